#include <fmt/format.h>

#include <vector>

#include "experiments/app/commands.h"
#include "experiments/config/data_files.h"
#include "experiments/studies/measured/measured_page.h"
#include "experiments/system/output_path.h"

namespace turbidock::measured {
namespace {

struct PageArguments {
  std::vector<std::string> pages;
  std::string tables;
  bool check = false;
};

int Page(const PageArguments& arguments) {
  const Tables tables =
      LoadTables(arguments.tables.empty() ? config::AssetPath("measured") : arguments.tables);
  int code = app::kExitDone;
  for (const std::string& page : arguments.pages) {
    const std::string text = system::ReadWhole(page);
    if (arguments.check) {
      for (const std::string& difference : Differences(text, page, tables)) {
        fmt::print("{}\n", difference);
        code = app::kExitCheckFailed;
      }
    } else if (const std::string drawn = DrawPage(text, page, tables); drawn != text) {
      system::WriteWhole(page, drawn);
      fmt::print("{}: drawn anew\n", page);
    }
  }
  return code;
}

}  // namespace

void AddPage(app::CommandLine& line) {
  auto [page, arguments] = line.Add(
      "page", "Draw the tables of measured results in Markdown pages from their files", &Page);
  page.Add("page FILE.md", arguments.pages, "Markdown files").Required();
  page.Flag("--check", arguments.check,
            "Change nothing: name the tables that differ from their files, exit code 1");
  page.Add("--tables DIR", arguments.tables,
           "Folder of the result files (default: the program's assets/measured)");
}

}  // namespace turbidock::measured
