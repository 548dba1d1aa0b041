// Result files and the pages that show them, on awkward input.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "experiments/studies/measured/measured_page.h"
#include "sim/base/check.h"
#include "tests/support/program.h"

namespace turbidock::measured {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

const std::string kOrigin =
    "# title: Docking\n"
    "# command: turbidock batch sweep\n"
    "# build: 207453d\n"
    "# machine: not recorded\n"
    "# date: 2026-11-21\n";
const std::string kOriginShown =
    "Docking. `turbidock batch sweep`. Build: 207453d; machine: not recorded; date: 2026-11-21.";
const std::string kBlock = "<!-- measured docking -->\n<!-- end measured -->\n";

Table Parse(const std::string& rows) { return ParseTable(kOrigin + rows, "docking.csv"); }

Tables OneTable() { return {{"docking", Parse("milk,docked\n0,30\n")}}; }

// What ConfigError says.
template <typename Function>
std::string ErrorOf(const Function& function) {
  try {
    function();
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "no error";
}

std::string ParseError(const std::string& text) {
  return ErrorOf([&] { ParseTable(text, "docking.csv"); });
}

std::string DrawError(const std::string& text) {
  return ErrorOf([&] { DrawPage(text, "a.md", OneTable()); });
}

TEST(ResultFile, SaysWhereItsNumbersComeFrom) {
  const Table table = ParseTable("# command: make\n" + kOrigin + "a\n1\n", "docking.csv");
  EXPECT_EQ(table.title, "Docking");
  EXPECT_THAT(table.commands, ElementsAre("make", "turbidock batch sweep"));
  EXPECT_EQ(table.build, "207453d");
  EXPECT_EQ(table.machine, "not recorded");
  EXPECT_EQ(table.date, "2026-11-21");
}

TEST(ResultFile, HasCellsWithCommasQuotesAndNothing) {
  const Table table = Parse("a,\"b, c\",d\n\"say \"\"F\"\"\",,\n1,\"\",#3\n");
  EXPECT_THAT(table.columns, ElementsAre("a", "b, c", "d"));
  EXPECT_THAT(table.rows,
              ElementsAre(ElementsAre("say \"F\"", "", ""), ElementsAre("1", "", "#3")));
}

TEST(ResultFile, MayEndLinesAsWindowsDoesAndItsLastNotAtAll) {
  const Table unix_table = Parse("a,b\n1,2");
  std::string text = kOrigin + "a,b\n1,2";
  for (size_t at = 0; (at = text.find('\n', at)) != std::string::npos; at += 2)
    text.replace(at, 1, "\r\n");
  EXPECT_EQ(MarkdownLines(ParseTable(text, "docking.csv")), MarkdownLines(unix_table));
}

TEST(ResultFile, IsRefusedWithFileAndLineWhenItIsMalformed) {
  EXPECT_EQ(ParseError(kOrigin + "a,b\n1,2\n1\n"), "docking.csv:8: 1 cells under 2 columns");
  EXPECT_EQ(ParseError(kOrigin + "a,b\n1,2,3\n"), "docking.csv:7: 3 cells under 2 columns");
  EXPECT_EQ(ParseError(kOrigin + "a,b\n1,\"2\n"),
            "docking.csv:7: a quote is not closed on its line");
  EXPECT_EQ(ParseError(kOrigin + "a,b\n1,\"2\"3\n"), "docking.csv:7: text after a closing quote");
  EXPECT_EQ(ParseError(kOrigin + "a,b\n1,2\"3\"\n"),
            "docking.csv:7: a quote inside a cell that does not begin with one");
  EXPECT_EQ(ParseError(kOrigin + "a,b\n\n1,2\n"), "docking.csv:7: an empty line");
  EXPECT_EQ(ParseError(kOrigin + "a,b\n"), "docking.csv:7: no rows under the columns' names");
  EXPECT_EQ(ParseError(kOrigin), "docking.csv:6: no row that names the columns");
}

TEST(ResultFile, IsRefusedWhenItsOriginIsMissingMisspeltOrDouble) {
  EXPECT_THAT(ParseError("a\n1\n"), HasSubstr("docking.csv:1: no \"# title: ...\""));
  EXPECT_THAT(ParseError("# title: a\n# command: b\n# machine: c\n# date: d\na\n1\n"),
              HasSubstr("docking.csv:5: no \"# build: ...\""));
  EXPECT_EQ(ParseError("# titel: Docking\n" + kOrigin),
            "docking.csv:1: unknown key titel; did you mean title?");
  EXPECT_EQ(ParseError(kOrigin + "# build: 1\n"), "docking.csv:6: build is given twice");
  EXPECT_EQ(ParseError("#title: a\n"), "docking.csv:1: must be \"# key: value\"");
  EXPECT_EQ(ParseError("# title: \n"), "docking.csv:1: must be \"# key: value\"");
}

TEST(Markdown, IsATableWithItsOriginBelow) {
  EXPECT_THAT(
      MarkdownLines(Parse("milk,docked\n0,30\n5,\n")),
      ElementsAre("| milk | docked |", "|---|---|", "| 0 | 30 |", "| 5 | |", "", kOriginShown));
}

TEST(Markdown, EscapesBarsInCells) {
  EXPECT_EQ(MarkdownLines(Parse("|y|,b\n1,2\n"))[0], "| \\|y\\| | b |");
}

TEST(Markdown, ShowsACommandWithBackticksAndOneThatIsNotRecorded) {
  Table table = OneTable().at("docking");
  table.commands = {"a `b`", "not recorded"};
  EXPECT_THAT(MarkdownLines(table).back(),
              HasSubstr("Docking. `` a `b` ``. Command: not recorded. Build"));
}

TEST(Page, KeepsEverythingButItsTables) {
  const std::string before = "# Title\r\n\ttext  \n", after = "\n\nno newline at the end";
  EXPECT_EQ(DrawPage(before + kBlock + after, "a.md", OneTable()),
            before + "<!-- measured docking -->\n| milk | docked |\n|---|---|\n| 0 | 30 |\n\n" +
                kOriginShown + "\n<!-- end measured -->\n" + after);
  EXPECT_EQ(DrawPage(before + after, "a.md", OneTable()), before + after);
  EXPECT_EQ(DrawPage("", "a.md", OneTable()), "");
}

TEST(Page, DrawnTwiceIsTheSameAndDoesNotDiffer) {
  const std::string drawn = DrawPage(kBlock + "text\n" + kBlock, "a.md", OneTable());
  EXPECT_EQ(DrawPage(drawn, "a.md", OneTable()), drawn);
  EXPECT_THAT(Differences(drawn, "a.md", OneTable()), IsEmpty());
  EXPECT_THAT(TablesShown(drawn, "a.md"), ElementsAre("docking", "docking"));
}

TEST(Page, WithWindowsLinesGetsTablesWithThem) {
  const std::string drawn =
      DrawPage("<!-- measured docking -->\r\n<!-- end measured -->\r\n", "a.md", OneTable());
  EXPECT_THAT(drawn, HasSubstr("| 0 | 30 |\r\n"));
  EXPECT_THAT(Differences(drawn, "a.md", OneTable()), IsEmpty());
}

TEST(Page, SaysWhereATableDiffersFirst) {
  std::string page = "one\n" + DrawPage(kBlock, "a.md", OneTable());
  page.replace(page.find("| 30 |"), 6, "| 29 |");
  EXPECT_THAT(
      Differences(page, "a.md", OneTable()),
      ElementsAre(
          "a.md:5: table docking differs from its file\n  page: | 0 | 29 |\n  file: | 0 | 30 |"));
  EXPECT_THAT(Differences(kBlock, "a.md", OneTable()),
              ElementsAre("a.md:2: table docking differs from its file\n  page: (nothing)\n"
                          "  file: | milk | docked |"));
  std::string longer = DrawPage(kBlock, "a.md", OneTable());
  longer.insert(longer.find("<!-- end"), "more\n");
  EXPECT_THAT(
      Differences(longer, "a.md", OneTable()),
      ElementsAre("a.md:7: table docking differs from its file\n  page: more\n  file: (nothing)"));
}

TEST(Page, LeavesFencedMarkersAlone) {
  const std::string page = "```\n<!-- measured nothing -->\n```\n";
  EXPECT_EQ(DrawPage(page, "a.md", OneTable()), page);
}

TEST(Page, IsRefusedWithItsLine) {
  EXPECT_EQ(DrawError("one\n<!-- measured dokcing -->\n<!-- end measured -->\n"),
            "a.md:2: no result file dokcing.csv; did you mean docking?");
  EXPECT_EQ(DrawError("<!-- measured x -->\n<!-- end measured -->\n"),
            "a.md:1: no result file x.csv");
  const std::string endless = "table docking has no <!-- end measured --> of its own";
  EXPECT_EQ(DrawError("one\n<!-- measured docking -->\n"), "a.md:2: " + endless);
  EXPECT_EQ(DrawError("<!-- measured docking -->\n" + kBlock), "a.md:1: " + endless);
  EXPECT_EQ(DrawError(kBlock + "<!-- end measured -->\n"),
            "a.md:3: <!-- end measured --> without a beginning");
}

class PageCommand : public ::testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::create_directories(dir_);
    Write("docking.csv", kOrigin + "milk,docked\n0,30\n");
    Write("a.md", "# A\n" + kBlock);
  }
  void TearDown() override { std::filesystem::remove_all(dir_); }

  void Write(const std::string& name, const std::string& text) {
    std::ofstream(dir_ / name, std::ios::binary) << text;
  }
  std::string Read(const std::string& name) {
    std::ifstream file(dir_ / name, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  turbidock::testing::ProgramEnd Run(const std::vector<std::string>& options = {}) {
    std::vector<std::string> arguments = {"page", (dir_ / "a.md").string(), "--tables",
                                          dir_.string()};
    arguments.insert(arguments.end(), options.begin(), options.end());
    return turbidock::testing::RunProgram(arguments);
  }

  const std::filesystem::path dir_ = std::filesystem::temp_directory_path() / "turbidock_page";
};

TEST_F(PageCommand, DrawsAPageThatThenPassesTheCheck) {
  const auto stale = Run({"--check"});
  EXPECT_EQ(stale.exit_code, 1);
  EXPECT_THAT(stale.out, HasSubstr("a.md:3: table docking differs"));
  EXPECT_EQ(Read("a.md"), "# A\n" + kBlock);

  const auto drawn = Run();
  EXPECT_EQ(drawn.exit_code, 0) << drawn.err;
  EXPECT_THAT(drawn.out, HasSubstr("a.md: drawn anew"));
  EXPECT_THAT(Read("a.md"), HasSubstr("| 0 | 30 |"));

  const auto checked = Run({"--check"});
  EXPECT_EQ(checked.exit_code, 0);
  EXPECT_EQ(checked.out, "");
  EXPECT_EQ(Run().out, "");
}

TEST_F(PageCommand, RefusesBadFilesWithCodeTwo) {
  Write("other.csv", "a\n1\n");
  const auto end = Run();
  EXPECT_EQ(end.exit_code, 2);
  EXPECT_THAT(end.err, HasSubstr("other.csv:1: no \"# title"));
  EXPECT_THAT(Read("a.md"), Not(HasSubstr("30")));

  const auto refusal = [](const std::string& page, const std::string& tables) {
    const auto refused = turbidock::testing::RunProgram({"page", page, "--tables", tables});
    EXPECT_EQ(refused.exit_code, 2);
    return refused.err;
  };
  EXPECT_THAT(refusal((dir_ / "a.md").string(), "/nowhere"), HasSubstr("/nowhere: No such file"));
  std::filesystem::remove(dir_ / "other.csv");
  EXPECT_THAT(refusal("/nowhere.md", dir_.string()), HasSubstr("/nowhere.md: cannot be read"));
}

}  // namespace
}  // namespace turbidock::measured
