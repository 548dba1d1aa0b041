#include "experiments/page/page.h"

#include <fmt/format.h>

#include "experiments/page/compress.h"
#include "experiments/page/web_files.h"

namespace turbidock::page {
namespace {

// The sheets, by name.
std::string Style() {
  std::string style = "<style>\n";
  for (const WebFile& file : WebFiles())
    if (file.name.ends_with(".css")) style += file.text;
  return style + "</style>\n";
}

// An element that the browser does not read until a module asks for it.
std::string Data(const std::string& name, const std::string& type, std::string_view bytes) {
  return fmt::format("<script type=\"{}\" data-name=\"{}\">{}</script>\n", type, EscapeHtml(name),
                     Base64(bytes));
}

std::string Packed(const std::string& name, std::string_view text) {
  return Data(name, "application/gzip", Gzip(text));
}

// Modules know each other as "page/NAME.js", wherever they are.
std::string ImportMap() {
  report::Json imports = report::Json::object();
  for (const WebFile& file : WebFiles())
    if (file.name.ends_with(".js"))
      imports["page/" + std::string(file.name)] =
          "data:text/javascript;base64," + Base64(file.text);
  return "<script type=\"importmap\">" + report::Json{{"imports", imports}}.dump() + "</script>\n";
}

std::string Head(const report::Json& model, const std::string& style) {
  return fmt::format(
      "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "{}\n"
      // no favicon is asked for
      "<link rel=\"icon\" href=\"data:,\">\n<title>{}</title>\n{}</head>\n<body>\n"
      "<noscript>This page draws itself: it needs JavaScript.</noscript>\n",
      kPageFile.mark, EscapeHtml(model.value("title", "turbidock")), style);
}

constexpr const char* kStart =
    "<script type=\"module\">import {start} from 'page/main.js'; start();</script>\n"
    "</body>\n</html>\n";

}  // namespace

std::string Html(const Page& page) {
  std::string html = Head(page.model, Style() + ImportMap());
  html += Packed("model", report::JsonLine(page.model));
  for (const auto& [name, text] : page.parts) html += Packed(name, text);
  for (const auto& [name, bytes] : page.files)
    html += Data(name, "application/octet-stream", bytes);
  if (page.has_3d)
    for (const WebFile& library : Libraries())
      html += Packed(std::string(library.name), library.text);
  return html + kStart;
}

void WritePage(const std::string& path, const Page& page) { system::WriteWhole(path, Html(page)); }

}  // namespace turbidock::page
