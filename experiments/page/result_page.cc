#include "experiments/page/result_page.h"

#include <filesystem>
#include <fstream>

#include "experiments/page/report_page.h"
#include "experiments/page/trial_page.h"
#include "experiments/system/output_path.h"

namespace turbidock::page {
namespace {

namespace fs = std::filesystem;

bool IsFile(const fs::path& path) {
  std::error_code none;
  return fs::is_regular_file(path, none);
}

// The document that a study saved in its folder; empty where there is none.
fs::path DocumentIn(const std::string& folder) {
  for (const char* name : {"summary.json", "report.json"})
    if (IsFile(fs::path(folder) / name)) return fs::path(folder) / name;
  return {};
}

Page DocumentPage(const std::string& file) {
  const report::Json document = report::ParseJson(system::ReadWhole(file), file);
  if (document.is_object() && document.contains("outcome") && !document.contains("report"))
    throw ConfigError(file + ": is one trial's result; give the folder that it is in");
  return ReportPage(document, file);
}

}  // namespace

bool IsFileOfTrials(const std::string& path) {
  if (fs::path(path).extension() == ".db") return true;
  if (!system::WhyUnreadable(path).empty()) return false;  // opening a pipe would wait
  std::ifstream stream(path, std::ios::binary);
  std::string begin(6, '\0');
  stream.read(begin.data(), std::ssize(begin));
  return begin == "SQLite";
}

Page ResultPage(const std::string& path, const trial::Plugins& plugins) {
  std::error_code none;
  if (!fs::is_directory(path, none)) return DocumentPage(path);
  const fs::path document = DocumentIn(path);
  if (document.empty()) return TrialPage(path, plugins);
  Page page = DocumentPage(document.string());
  AddTrialsIn((fs::path(path) / "failures").string(), plugins, &page);
  return page;
}

std::optional<std::string> TrialsOfStudy(const std::string& folder) {
  const fs::path trials = fs::path(folder) / "evaluations.sqlite";
  return IsFile(trials) ? std::optional(trials.string()) : std::nullopt;
}

}  // namespace turbidock::page
