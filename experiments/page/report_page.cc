#include "experiments/page/report_page.h"

#include <fmt/format.h>

#include <filesystem>
#include <fstream>
#include <map>

#include "experiments/media/jpeg.h"
#include "experiments/media/png.h"
#include "experiments/page/trial_page.h"
#include "experiments/report/report_json.h"
#include "experiments/system/base64.h"

namespace turbidock::page {
namespace {

namespace fs = std::filesystem;
using report::Json;

bool IsFile(const fs::path& path) {
  std::error_code none;
  return fs::is_regular_file(path, none);
}

// Images that a study drew beside its document: sheets, STEM_images_NAME.png, and its "overlay".
Json PicturesBeside(const fs::path& file, const Json& document) {
  const std::string begin = file.stem().string() + "_images_";
  std::map<std::string, std::string> sheets;  // by name
  const auto add = [&sheets](const std::string& name, const fs::path& png) {
    constexpr int kQuality = 80;
    sheets[name] = system::Base64(media::EncodeJpeg(media::ReadPng(png.string()), kQuality));
  };
  if (const Json overlay = document.value("overlay", Json()); overlay.is_string())
    if (const fs::path png = file.parent_path() / fs::path(overlay.get<std::string>()).filename();
        IsFile(png) && png.extension() == ".png")
      add("the last frame", png);
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(fs::absolute(file).parent_path(), none))
    if (const std::string name = entry.path().stem().string();
        name.starts_with(begin) && entry.path().extension() == ".png")
      add(name.substr(begin.size()), entry.path());
  return sheets;
}

Page DocumentPage(const std::string& file) {
  const Json document = report::ParseJson(system::ReadWhole(file), file);
  if (document.is_object() && document.contains("outcome") && !document.contains("report"))
    throw ConfigError(file + ": is one trial's result; give the folder that it is in");
  Page page = ReportPage(document, file);
  page.model["pictures"] = PicturesBeside(file, document);
  return page;
}

}  // namespace

Page ReportPage(const Json& document, const std::string& where) {
  Page page;
  Json& model = page.model;
  model = report::ReportIn(document, where);
  model["kind_title"] = model["kind"];
  model["kind"] = "report";  // the module that shows it
  try {
    model["links"] = document.value("links", Json::object()).get<std::map<std::string, Link>>();
  } catch (const Json::exception& error) {
    throw ConfigError(fmt::format("{}: links: {}", where, error.what()));
  }
  return page;
}

void AddTrialsIn(const std::string& folder, const trial::Plugins& plugins, Page* page) {
  std::map<std::string, Link> links = page->model["links"];
  for (auto& [name, link] : links) {
    const fs::path path = fs::path(folder) / name;
    if (path.filename() != name || !IsFile(path / "result.json")) continue;
    try {
      const Page trial = TrialPage(path.string(), plugins);
      const Json& verdict = trial.model["verdict"];
      const std::string part = "trial-" + name;
      LinkedTrial linked{.title = trial.model["title"],
                         .outcome = verdict["word"],
                         .reason = verdict["reason"],
                         .model = part};
      for (const Json& section : trial.model["sections"])
        for (const Json& command : section["commands"])
          linked.commands.push_back({command["what"], command["command"]});
      link = {.title = name, .trials = {linked}};
      AddPart(part, trial.model, trial.has_3d, page);
    } catch (const ConfigError& error) {
      page->model["missing"].push_back(error.what());
    }
  }
  page->model["links"] = links;
}

void AddPart(const std::string& name, const Json& part, bool has_3d, Page* page) {
  page->parts[name] = report::JsonLine(part);
  page->has_3d |= has_3d;
}

bool IsFileOfTrials(const std::string& path) {
  if (fs::path(path).extension() == ".db") return true;
  if (!system::WhyUnreadable(path).empty()) return false;  // opening a pipe would wait
  std::ifstream stream(path, std::ios::binary);
  std::string begin(6, '\0');
  stream.read(begin.data(), std::ssize(begin));
  return begin == "SQLite";
}

Page ResultPage(const std::string& path, const trial::Plugins& plugins) {
  if (std::error_code none; !fs::is_directory(path, none)) return DocumentPage(path);
  for (const char* name : {"summary.json", "report.json"})
    if (const fs::path document = fs::path(path) / name; IsFile(document)) {
      Page page = DocumentPage(document.string());
      AddTrialsIn((fs::path(path) / "failures").string(), plugins, &page);
      return page;
    }
  return TrialPage(path, plugins);
}

std::optional<std::string> TrialsOfStudy(const std::string& folder) {
  const fs::path trials = fs::path(folder) / "evaluations.sqlite";
  return IsFile(trials) ? std::optional(trials.string()) : std::nullopt;
}

}  // namespace turbidock::page
