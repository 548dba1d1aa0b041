#include "experiments/studies/measured/page_command.h"

#include <fmt/format.h>

#include <memory>
#include <vector>

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
  auto arguments = std::make_shared<PageArguments>();
  app::Subcommand page =
      line.Add("page", "Draw the tables of measured results in Markdown pages from their files");
  page.Add("page", arguments->pages, "Markdown files").Required().Type("FILE.md");
  page.Flag("--check", arguments->check,
            "Change nothing: name the tables that differ from their files, exit code 1");
  page.Add("--tables", arguments->tables,
           "Folder of the result files (default: the program's assets/measured)")
      .Type("DIR");
  page.Runs([arguments] { return Page(*arguments); });
}

}  // namespace turbidock::measured
