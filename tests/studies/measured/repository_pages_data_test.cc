// The pages of this repository: their tables are those of the result files, and their links lead to
// something.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <set>

#include "experiments/studies/measured/measured_page.h"

namespace turbidock::measured {
namespace {

namespace fs = std::filesystem;

const fs::path kRoot = fs::path(TURBIDOCK_TEST_DATA).parent_path().parent_path();

std::vector<fs::path> Pages() {
  std::vector<fs::path> pages = {kRoot / "README.md"};
  for (const char* room : {"assets", "control", "experiments", "models", "sim", "tests", "vision"})
    for (const auto& entry : fs::recursive_directory_iterator(kRoot / room))
      if (entry.path().extension() == ".md") pages.push_back(entry.path());
  return pages;
}

std::string Read(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  EXPECT_TRUE(file) << path;
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(RepositoryPages, ShowWhatTheResultFilesHold) {
  const Tables tables = LoadTables((kRoot / "assets/measured").string());
  std::set<std::string> shown;
  for (const fs::path& page : Pages()) {
    const std::string name = fs::relative(page, kRoot).string(), text = Read(page);
    for (const std::string& difference : Differences(text, name, tables))
      ADD_FAILURE() << difference << "\n(turbidock page " << name << " draws it anew)";
    for (const std::string& table : TablesShown(text, name)) shown.insert(table);
  }
  std::set<std::string> known;
  for (const auto& [name, table] : tables) known.insert(name);
  EXPECT_EQ(shown, known) << "every result file is shown on some page";
  EXPECT_GE(known.size(), 20u);
}

TEST(RepositoryPages, LinkToFilesThatAreThere) {
  const std::regex link(R"(\]\(([^)#:]+)(#[^)]*)?\))");
  int checked = 0;
  for (const fs::path& page : Pages()) {
    const std::string text = Read(page);
    for (auto at = std::sregex_iterator(text.begin(), text.end(), link);
         at != std::sregex_iterator(); ++at, ++checked)
      EXPECT_TRUE(fs::exists(page.parent_path() / (*at)[1].str()))
          << fs::relative(page, kRoot) << " links to " << (*at)[1];
  }
  EXPECT_GE(checked, 40);
}

}  // namespace
}  // namespace turbidock::measured
