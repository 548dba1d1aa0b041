#pragma once
// The files that a page consists of: the modules of web/ as one script, the style, and three.js.
// They are part of the program, so that it can write a page wherever it runs.

#include <array>
#include <span>
#include <string_view>

namespace turbidock::page {

struct WebFile {
  std::string_view name;  // "plot.js"
  std::string_view text;
};

// page.js and the style sheets (.css), by name.
std::span<const WebFile> WebFiles();

// Libraries from Debian's packages: classic scripts that make one global each.
std::span<const WebFile> Libraries();

}  // namespace turbidock::page
