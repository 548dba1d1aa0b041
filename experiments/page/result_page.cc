#include "experiments/page/result_page.h"

#include <filesystem>
#include <fstream>

#include "experiments/page/study_page.h"
#include "experiments/page/trial_page.h"
#include "experiments/system/output_path.h"

namespace turbidock::page {

namespace fs = std::filesystem;

bool IsFileOfTrials(const std::string& path) {
  if (fs::path(path).extension() == ".db") return true;
  if (!system::WhyUnreadable(path).empty()) return false;  // opening a pipe would wait
  std::ifstream stream(path, std::ios::binary);
  std::string begin(6, '\0');
  stream.read(begin.data(), std::ssize(begin));
  return begin == "SQLite";
}

Page ResultPage(const std::string& path, const trial::Plugins& plugins) try {
  std::error_code none;
  if (!fs::is_directory(path, none))
    return StudyPage(report::ParseJson(system::ReadWhole(path), path), path);
  return IsStudyFolder(path) ? StudyFolderPage(path, plugins) : TrialPage(path, plugins);
} catch (const report::Json::exception&) {  // text where a number should be, or the like
  throw ConfigError(path + ": is no result of this program, or a damaged one");
}

}  // namespace turbidock::page
