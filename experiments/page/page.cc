#include "experiments/page/page.h"

#include <fmt/format.h>
#include <zlib.h>

#include "experiments/page/plain.h"
#include "experiments/page/web_files.h"
#include "experiments/report/plot.h"
#include "experiments/system/base64.h"
#include "sim/base/check.h"

namespace turbidock::page {
namespace {

// The files of a kind, one after the other.
std::string FilesThatEndWith(std::string_view ending) {
  std::string text;
  for (const WebFile& file : WebFiles())
    if (file.name.ends_with(ending)) text += file.text;
  return text;
}

// An element that the browser does not read until a module asks for it.
std::string Data(const std::string& name, const std::string& type, std::string_view bytes) {
  return fmt::format("<script type=\"{}\" data-name=\"{}\">{}</script>\n", type, EscapeHtml(name),
                     system::Base64(bytes));
}

std::string Packed(const std::string& name, std::string_view text) {
  return Data(name, "application/gzip", Gzip(text));
}

std::string Head(const report::Json& model) {
  return fmt::format(
      "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "{}\n"
      // no favicon is asked for
      "<link rel=\"icon\" "
      "href=\"data:,\">\n<title>{}</title>\n<style>\n{}</style>\n</head>\n<body>\n{}",
      kPageFile.mark, EscapeHtml(model.value("title", "turbidock")), FilesThatEndWith(".css"),
      Plain(model));
}

}  // namespace

std::string Gzip(std::string_view text) {
  z_stream stream{};
  constexpr int kGzipFormat = 16 + MAX_WBITS, kMemory = 9;
  if (deflateInit2(&stream, Z_BEST_COMPRESSION, Z_DEFLATED, kGzipFormat, kMemory,
                   Z_DEFAULT_STRATEGY) != Z_OK)
    throw SimulatorFault("zlib cannot compress");
  std::string out(deflateBound(&stream, text.size()), '\0');
  // zlib's interface has no const
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(text.data()));  // NOLINT
  stream.avail_in = static_cast<uInt>(text.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  const int end = deflate(&stream, Z_FINISH);
  out.resize(stream.total_out);
  deflateEnd(&stream);
  TD_CHECK(end == Z_STREAM_END, "deflateBound is enough");
  return out;
}

std::string Html(const Page& page) {
  std::string html = Head(page.model);
  report::Json model = page.model;
  model["curves"] = report::kCurveColors;
  html += Packed("model", report::JsonLine(model));
  for (const auto& [name, text] : page.parts) html += Packed(name, text);
  for (const auto& [name, bytes] : page.files)
    html += Data(name, "application/octet-stream", bytes);
  if (page.has_3d)
    for (const WebFile& library : Libraries())
      html += Packed(std::string(library.name), library.text);
  return html + "<script>" + FilesThatEndWith(".js") + "</script>\n</body>\n</html>\n";
}

void WritePage(const std::string& path, const Page& page) { system::WriteWhole(path, Html(page)); }

}  // namespace turbidock::page
