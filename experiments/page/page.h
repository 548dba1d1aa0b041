#pragma once
// A page: one HTML file that shows a result, opened by double click. It needs no network and no
// file beside it. What a model consists of stands in README.md of this folder.

#include <map>
#include <string>
#include <string_view>

#include "experiments/report/json.h"
#include "experiments/system/output_path.h"

namespace turbidock::page {

// A page is replaced by one that nobody asked for by name.
inline constexpr system::FileKind kPageFile = {
    "page of this program", R"(<meta name="generator" content="turbidock">)", ".html"};

struct Page {
  // What is shown. model["kind"] names the module of web/ that shows it, model["title"] is the
  // document's title.
  report::Json model;
  // What is opened when it is asked for, by name: JSON.
  std::map<std::string, std::string> parts = {};
  // Bytes that are compressed already, by name: a video.
  std::map<std::string, std::string> files = {};
  bool has_3d = false;  // brings three.js along
};

// The page as a document. Whatever text is in it shows as text.
std::string Html(const Page& page);

// Writes it, complete or not at all. ConfigError when it cannot be written.
void WritePage(const std::string& path, const Page& page);

// RFC 1952, the smallest that zlib makes: what a browser's DecompressionStream("gzip") reads. The
// same bytes for the same text.
std::string Gzip(std::string_view text);

}  // namespace turbidock::page
