#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "experiments/report/report.h"
#include "experiments/report/report_json.h"

namespace turbidock::report {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

Report Example() {
  Table table({"<condition", "docked"});
  table.Row({"calm", Cell("12", Tone::kGood, "seed-3")});
  return {.kind = "gate",
          .title = "night",
          .build = "0.1.0 abc",
          .verdict = {"fail", Tone::kBad, "It docks less."},
          .facts = {{"trials", "40", "of both"}, {"build", "0.1.0"}},
          .missing = {"No traces: none were stored."},
          .sections = {
              {.title = "Measures", .note = "With 95 % intervals.", .table = table},
              {.title = "Seeds", .lines = {"3 no longer docks"}},
              {.title = "Path",
               .panels = {{.series = {{.points = {{1, 2}, {kOpen, 3}}, .links = {"seed-3"}}}}}},
              {.title = "Again", .commands = {{"One trial", "turbidock replay a.db 3"}}}}};
}

TEST(Text, SaysVerdictFactsAndTablesAndLeavesPlotsOut) {
  EXPECT_EQ(Text(Example()),
            "fail: night\n"
            "It docks less.\n"
            "\n"
            "trials  40     of both\n"
            "build   0.1.0\n"
            "No traces: none were stored.\n"
            "\n"
            "Measures\n"
            "With 95 % intervals.\n"
            "condition  docked\n"
            "calm           12\n"
            "\n"
            "Seeds\n"
            "3 no longer docks\n"
            "\n"
            "Again\n"
            "One trial:\n"
            "  turbidock replay a.db 3\n");
}

TEST(Markdown, HasHeadingsListsAndTables) {
  const std::string text = Markdown(Example());
  EXPECT_THAT(text, StartsWith("# fail: night\n\nIt docks less.\n\n- trials: **40**, of both\n"));
  EXPECT_THAT(text, HasSubstr("\n## Measures\n\nWith 95 % intervals.\n\n| condition | docked |\n"));
  EXPECT_THAT(text, HasSubstr("\n## Seeds\n\n- 3 no longer docks\n"));
  EXPECT_THAT(text, HasSubstr("- One trial: `turbidock replay a.db 3`\n"));
  EXPECT_THAT(text, Not(HasSubstr("Path")));
}

TEST(Markdown, ANameIsNoElement) {
  const std::string text =
      Markdown({.kind = "gate",
                .title = "<b>calm</b>, <!-- or",
                .facts = {{"F < 0.5", "3<4", "`<p>`"}},
                .sections = {{.title = "Again", .commands = {{"All of <i>", "cat <in"}}}}});
  EXPECT_THAT(text, StartsWith("# \\<b>calm\\</b>, \\<!-- or\n\n- F < 0.5: **3<4**, `<p>`\n"));
  EXPECT_THAT(text, HasSubstr("- All of \\<i>: `cat <in`\n"));
  EXPECT_THAT(Markdown({.kind = "gate", .title = "a ` in a name", .missing = {"<b>"}}),
              HasSubstr("\n\\<b>"));
}

TEST(Table, CountsLettersNotBytes) {
  Table table({"<what", "n"});
  table.Row({"µ", "1"});
  table.Row({"ab", "2"});
  EXPECT_EQ(table.Text(), "what  n\nµ     1\nab    2\n");
}

TEST(Document, HasKindSchemaTheStudysOwnKeysAndTheReport) {
  const Json document = Document(Example(), {{"verdict", "fail"}, {"trials", 40}});
  EXPECT_EQ(document["kind"], "gate");
  EXPECT_EQ(document["schema_version"], 1);
  EXPECT_EQ(document["verdict"], "fail");
  EXPECT_EQ(document["trials"], 40);
  const Json& report = document["report"];
  EXPECT_EQ(report["verdict"]["tone"], "bad");
  const Json& cells = report["sections"][0]["table"]["rows"][0];
  EXPECT_EQ(cells[0], "calm");
  EXPECT_EQ(cells[1], (Json{{"text", "12"}, {"tone", "good"}, {"link", "seed-3"}}));
  const Json& series = report["sections"][2]["panels"][0]["series"][0];
  EXPECT_EQ(series["x"], (Json{1.0, nullptr}));
  EXPECT_EQ(series["y"], (Json{2.0, 3.0}));
  EXPECT_EQ(series["links"], (Json{"seed-3"}));
  EXPECT_FALSE(series.contains("low"));
}

TEST(Document, OpenEndsOfAnAxisAreNothing) {
  const Json axis = ParseJson(JsonText(Axis{.label = "trials", .high = 5}), "axis");
  EXPECT_EQ(axis["low"], nullptr);
  EXPECT_EQ(axis["high"], 5);
}

TEST(ReportIn, IsTheReportOfADocumentThatWasWrittenAndRead) {
  const Json document = ParseJson(JsonText(Document(Example(), Json::object())), "gate.json");
  const Json report = ReportIn(document, "gate.json");
  EXPECT_EQ(report["kind"], "gate");
  EXPECT_EQ(report["title"], "night");
}

TEST(Quantity, HasAPersonsUnit) {
  EXPECT_EQ(QuantityOf("time_s").Text("5"), "5 s");
  EXPECT_EQ(QuantityOf("yaw_rad").Text("5"), "5°");
  EXPECT_EQ(QuantityOf("yaw_rad_s").Text("5"), "5°/s");
  EXPECT_EQ(QuantityOf("attempts").Text("5"), "5");
  EXPECT_EQ(QuantityOf("peak_memory_mib").Title(), "peak memory, MiB");
  EXPECT_EQ(QuantityOf("rss_bytes").Title(), "rss, MB");
  EXPECT_EQ(QuantityOf("drift_mps2").Title(), "drift, m/s²");
  EXPECT_EQ(QuantityOf("moment_newton_m").Title(), "moment, N m");
  EXPECT_EQ(QuantityOf("moment_newton_m").factor, 1);
  EXPECT_EQ(QuantityOf("kp_v_per_m").Title(), "kp v per m");
  EXPECT_EQ(QuantityOf("kp_v_per_m").factor, 1);
}

TEST(Spoken, NamesNoShapeAndNoKey) {
  EXPECT_EQ(Spoken("hull_box touched station_wall_2 in visual_servoing"),
            "hull touched station in visual servoing");
}

std::string ProblemOf(const Json& document) {
  try {
    ReportIn(document, "x.json");
    return "";
  } catch (const ConfigError& error) {
    return error.what();
  }
}

TEST(ReportIn, RefusesWhatAPageCouldNotDraw) {
  const Json sound = Document(Example(), Json::object());
  EXPECT_EQ(ProblemOf(sound), "");
  EXPECT_THAT(ProblemOf({{"outcome", "success"}}), StartsWith("x.json: is no result"));
  EXPECT_THAT(ProblemOf(Json::array({1})), StartsWith("x.json: is no result"));
  EXPECT_THAT(ProblemOf(5), StartsWith("x.json: is no result"));
  Json newer = sound;
  newer["schema_version"] = 2;
  EXPECT_THAT(ProblemOf(newer), HasSubstr("a newer program wrote it"));
  newer["schema_version"] = "1";
  EXPECT_THAT(ProblemOf(newer), HasSubstr("schema_version"));
  for (const char* key : {"title", "facts", "sections"}) {
    Json damaged = sound;
    damaged["report"][key] = 3;
    EXPECT_THAT(ProblemOf(damaged), HasSubstr("damaged")) << key;
    damaged["report"].erase(key);
    EXPECT_THAT(ProblemOf(damaged), HasSubstr("damaged")) << key;
  }
  Json untitled = sound;
  untitled["report"]["sections"][0].erase("title");
  EXPECT_THAT(ProblemOf(untitled),
              HasSubstr("damaged: [json.exception.out_of_range.403] key 'title'"));
  untitled["report"] = "text";
  EXPECT_THAT(ProblemOf(untitled), HasSubstr("damaged"));
}

}  // namespace
}  // namespace turbidock::report
