// A gate's files: baselines, reports in every form, and what is refused.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "experiments/config/yaml_fields.h"
#include "experiments/report/report.h"
#include "experiments/studies/gate/real_trials.h"
#include "experiments/system/subprocess.h"
#include "sim/base/check.h"
#include "tests/studies/gate/synthetic_gate.h"
#include "tests/support/message_of.h"

namespace turbidock::gate {
namespace {

using statistics::Verdict;
using ::testing::HasSubstr;
using testing::MessageOf;
using ::testing::Not;

using GateFiles = SyntheticGate;

// -------------------------------------------------------------------------------------- baselines

TEST_F(GateFiles, ABaselineReadsBackAsItWasWritten) {
  const Gate gate = Load();
  const Baseline baseline = Measure(gate, DocksAt(0.9));
  const std::string text = BaselineText(baseline);
  const Baseline read = LoadBaseline(File("gate.baseline.yaml", text));
  EXPECT_EQ(BaselineText(read), text);
  EXPECT_EQ(read.conditions.at(0).outcomes.size(), 200u);
  // a line a trial
  EXPECT_LT(std::count(text.begin(), text.end(), '\n'), 200 + 20);
  EXPECT_EQ(JsonOf(Judge(gate, read, DocksAt(0.85))), JsonOf(Judge(gate, baseline, DocksAt(0.85))));
}

// As of one measured before there was the measure.
TEST_F(GateFiles, AMeasureThatTheBaselineLacksIsNotJudged) {
  const Gate gate = Load();
  std::string text = BaselineText(Measure(
      gate, DocksAt(0.9, [](trial::TrialRecord* record) { record->effort_v = std::nan(""); })));
  EXPECT_THAT(text, Not(HasSubstr("effort_v")));
  const Baseline baseline = LoadBaseline(File("old.yaml", text));
  EXPECT_EQ(Judge(gate, baseline, DocksAt(0.9)).verdict, Verdict::kPass);
  const Gate judged = Load("", "  conditions: {calm: {margins: {effort_v: 0.3}}}\n");
  EXPECT_THAT(MessageOf([&] { Judge(judged, baseline, DocksAt(0.9)); }),
              HasSubstr("the baseline has no effort_v"));
}

TEST_F(GateFiles, AnyEditOfABaselineIsNoticed) {
  const Gate gate = Load();
  const std::string text = BaselineText(Measure(gate, DocksAt(0.9)));
  std::string crlf = text;
  for (size_t at = 0; (at = crlf.find('\n', at)) != std::string::npos; at += 2)
    crlf.insert(at, "\r");
  EXPECT_EQ(BaselineText(LoadBaseline(File("crlf.yaml", "\xEF\xBB\xBF" + crlf))), text);
  const auto refused = [&](const std::string& edited) {
    return MessageOf([&] { LoadBaseline(File("edited.yaml", edited)); });
  };
  std::string turned = text;
  turned.replace(turned.find("timeout"), 7, "success");
  EXPECT_THAT(refused(turned), HasSubstr("was edited"));
  EXPECT_THAT(refused("# a remark\n" + text), HasSubstr("was edited"));
  EXPECT_THAT(refused(text + "\n"), HasSubstr("was edited"));
  EXPECT_THAT(refused(text.substr(0, text.rfind("checksum"))), HasSubstr("was edited"));
  std::string schema = text;
  schema.replace(schema.find("schema_version: 3"), 17, "schema_version: 2");
  EXPECT_THAT(refused(schema),
              HasSubstr("schema_version = 2, must be in [3, 3]; measure it anew with --update"));
  EXPECT_THAT(MessageOf([&] { LoadBaseline((folder_ / "none.yaml").string()); }),
              HasSubstr("there is no baseline"));
}

TEST_F(GateFiles, ABaselineOfAnotherPlanIsRefusedWithTheReason) {
  const Gate gate = Load();
  const Baseline baseline = Measure(gate, DocksAt(0.9));
  const auto refused = [&](const Gate& other) {
    return MessageOf([&] { ConditionsOf(other, baseline); });
  };
  EXPECT_EQ(refused(gate), "no error");
  // Values count, not how they are written.
  const auto given = [&](const std::string& milk) {
    return Load("  other: {water.milk_ml_m3: " + milk + ", start: {lateral_m: 0.10}}\n")
        .conditions[1];
  };
  EXPECT_EQ(given("25").digest, given("25.0").digest);
  EXPECT_NE(given("25").digest, given("25.5").digest);
  const Gate nested = Load("  other: {water: {milk_ml_m3: 25}, start.lateral_m: 0.1}\n");
  EXPECT_EQ(nested.conditions[1].digest, given("25").digest);
  EXPECT_THAT(refused(Load(kRough)), HasSubstr("it has no condition 'rough'"));
  Gate other = gate;
  other.conditions[0].given = "pool_active water.milk_ml_m3=30";
  EXPECT_THAT(refused(other),
              HasSubstr("measured with 'pool_active water.milk_ml_m3=20 sea.state=calm', the "
                        "gate gives 'pool_active water.milk_ml_m3=30'"));
  other = gate;
  other.conditions[0].digest = "0";
  EXPECT_THAT(refused(other), HasSubstr("file of condition 'calm' has changed"));
  other = gate;
  other.conditions[0].name = "still";
  EXPECT_THAT(refused(other), HasSubstr("no condition 'still'"));
  other = gate;
  other.plan = gate.plan.WithSeeds(77, 200);
  EXPECT_THAT(refused(other), HasSubstr("those of master_seed 1, the gate's is 77; measure it"));
  // how it is judged may change, and what the command line gives is judged
  EXPECT_EQ(refused(Load("", "  alpha: 0.01\n  never: [collision]\n",
                         {"water.milk_ml_m3=99", "control.use=pid"})),
            "no error");
}

TEST_F(GateFiles, WhatTheCommandLineGivesCountsInEveryCondition) {
  const Gate gate = Load(kRough, "", {"water.milk_ml_m3=33"});
  for (const int64_t cell : {0, 1})
    EXPECT_EQ(config::ValueOf(gate.plan.ScenarioOf(gate.plan.FirstOf(cell)), "water.milk_ml_m3"),
              "33");
  EXPECT_EQ(gate.assignments, std::vector<std::string>{"water.milk_ml_m3=33"});
}

TEST_F(GateFiles, ABaselineThatCannotFallIsRefused) {
  const Gate gate = Load();
  const Baseline baseline = Measure(gate, DocksAt(0));
  EXPECT_THAT(MessageOf([&] { Judge(gate, baseline, DocksAt(0)); }),
              HasSubstr("cannot fall by 0.1"));
}

// ---------------------------------------------------------------------------------------- reports

GateReport AwkwardReport() {
  GateReport report;
  report.description = "a <gate> & \"quotes\" | \x01";
  report.build = "0.1.0 & more";
  for (const Verdict verdict : {Verdict::kPass, Verdict::kFail, Verdict::kInconclusive}) {
    ConditionReport condition;
    condition.condition = "50 % <milk> & | " + std::string(NameOf(verdict));
    condition.verdict = verdict;
    condition.trials = 2;
    condition.successes = 1;
    condition.flips = {{.seed = 9223372036854775807,
                        .change = batch::FlipKind::kLost,
                        .group = condition.condition,
                        .why = "timeout",
                        .link = "x"}};
    batch::Change change;
    change.measure = batch::kSuccessRate;
    change.margin = 0.1;
    change.verdict = verdict;
    change.a = 1;
    change.b = 0.5;
    condition.changes.push_back(change);
    report.conditions.push_back(condition);
  }
  report.verdict = Verdict::kFail;
  return report;
}

TEST_F(GateFiles, TheJunitFileIsValid) {
  const std::string schema = std::string(TURBIDOCK_TEST_DATA) + "/junit/jenkins-junit.xsd";
  const std::string file = File("junit.xml", Junit(AwkwardReport()));
  system::Subprocess({"xmllint", "--noout", "--schema", schema, file}, "libxml2-utils").Finish();
  // the schema does say no
  const std::string broken =
      File("broken.xml", "<testsuites><testsuite tests=\"1\"/></testsuites>");
  EXPECT_THROW(
      system::Subprocess({"xmllint", "--noout", "--schema", schema, broken}, "libxml2-utils")
          .Finish(),
      SimulatorFault);

  const auto xpath = [&](const std::string& expression) {
    return system::Subprocess({"xmllint", "--xpath", expression, file}, "libxml2-utils").Finish();
  };
  EXPECT_EQ(xpath("count(//testcase)"), "3\n");
  EXPECT_EQ(xpath("count(//failure)"), "1\n");
  EXPECT_EQ(xpath("count(//error)"), "1\n");
  EXPECT_EQ(xpath("string(//failure/@message)"),
            "success 100 % -> 50 %, worse in 0 of 0 pairs, better in 0\n");
  EXPECT_EQ(xpath("string(//testsuite[2]/@name)"), "50 % <milk> & | fail\n");
}

TEST_F(GateFiles, TheOtherRenderersSayTheSame) {
  const GateReport gate = AwkwardReport();
  const report::Report report = ReportOf(gate);
  const auto json = nlohmann::json::parse(JsonOf(gate));
  EXPECT_EQ(json["kind"], "gate");
  EXPECT_EQ(json["schema_version"], 1);
  EXPECT_EQ(json["verdict"], "fail");
  EXPECT_EQ(json["conditions"].size(), 3u);
  EXPECT_EQ(json["conditions"][1]["flips"][0]["seed"], 9223372036854775807);
  EXPECT_EQ(json["conditions"][2]["changes"][0]["b"], 0.5);
  EXPECT_EQ(json["report"]["verdict"]["tone"], "bad");
  const std::string markdown = report::Markdown(report), text = report::Text(report);
  for (const auto& [rendered, tag] : {std::pair(markdown, "\\<"), {text, "<"}}) {
    EXPECT_THAT(rendered, HasSubstr(fmt::format("fail: a {}gate>", tag)));
    EXPECT_THAT(rendered, HasSubstr(fmt::format("At least one measure got worse. 50 % {}milk> & | "
                                                "fail: success 100 % -> 50 %",
                                                tag)));
    EXPECT_THAT(rendered, HasSubstr("inconclusive"));
    EXPECT_THAT(rendered, HasSubstr("9223372036854775807"));
  }
  EXPECT_THAT(markdown, HasSubstr("\\|"));
}

// -------------------------------------------------------------------------------------- bad input

TEST_F(GateFiles, BadGates) {
  const std::string head = "schema_version: 1\nscenario: pool_active\n";
  const auto refused = [&](const std::string& text) {
    return MessageOf([&] { LoadGate(File("bad.yaml", text)); });
  };
  EXPECT_EQ(refused(head + "gate: {baseline: b.yaml}\n"), "no error") << "one condition";
  EXPECT_THAT(refused(head), HasSubstr("bad.yaml: gate: this key is required"));
  EXPECT_THAT(refused(head + "gate: {alpha: 0.1}\n"),
              HasSubstr(":3: gate: needs the key baseline"));
  const auto refused_key = [&](const std::string& keys) {
    return refused(head + "seeds: 20\ncases: {a: {}, b: {sea.state: calm}}\n" +
                   "gate:\n  baseline: b.yaml\n  " + keys + "\n");
  };
  EXPECT_EQ(refused_key("conditions: {a: {max_trials: 3}}"), "no error");
  EXPECT_THAT(refused_key("alpha: 0"),
              HasSubstr(":7: gate.alpha = 0, must be in [1e-06, 0.999999]"));
  EXPECT_THAT(refused_key("margins: {success_rate: 1e-300}"),
              HasSubstr("margins.success_rate = 1e-300, must be in [1e-06, 0.999999]"));
  EXPECT_THAT(refused_key("aplha: 0.1"), HasSubstr("did you mean alpha?"));
  EXPECT_THAT(refused_key("never: [colision]"), HasSubstr("collision"));
  EXPECT_THAT(refused_key("never: collision"), HasSubstr("must be a list of outcomes"));
  EXPECT_THAT(refused_key("never: [success]"), HasSubstr("'success' is what a gate is for"));
  for (const char* outcome : {"hung", "crashed"})
    EXPECT_THAT(refused_key(fmt::format("never: [{}]", outcome)), HasSubstr("ends with 4"));
  EXPECT_THAT(refused_key("max_trials: 21"), HasSubstr("more than the plan's 20 seeds"));
  EXPECT_THAT(refused_key("alpha: 0.6\n  beta: 0.4"),
              HasSubstr("alpha 0.6 and beta 0.4 must be below 1 together"));
  EXPECT_THAT(refused_key("conditions: {aa: {}}"), HasSubstr("no condition 'aa'"));
  EXPECT_THAT(refused_key("conditions: {a: {alpha: 2}}"), HasSubstr("alpha = 2"));
  EXPECT_THAT(refused(head + "precision: 0.1\ngate: {baseline: b.yaml}\n"),
              HasSubstr("a gate runs until its own tests know"));
  EXPECT_THAT(refused("schema_version: 1\nbaseline: b.yaml\nconditions: []\n"),
              HasSubstr("`cases`"));
  EXPECT_THAT(
      MessageOf([&] { LoadGate("docking", {}, config::ParseAssignments({"trial.seed=77"})); }),
      HasSubstr("seed"));
  EXPECT_THAT(MessageOf([] { LoadGate("dockin"); }), HasSubstr("did you mean docking?"));
}

TEST_F(GateFiles, RealTrialsStandBesideTheSimulatedOnes) {
  const Gate gate = Load(kRough);
  const auto refused = [&](const std::string& text) {
    return MessageOf([&] { LoadRealTrials(File("real.csv", text), gate); });
  };
  EXPECT_THAT(refused("name,docked\n"), HasSubstr("real.csv:1: must begin with the columns"));
  EXPECT_THAT(refused("condition,success\n"), HasSubstr("has no trial"));
  EXPECT_THAT(refused("condition,success\ncalm,1\nroug,1\n"),
              HasSubstr("real.csv:3: 'roug' is no condition of the gate; did you mean rough?"));
  EXPECT_THAT(refused("condition,success\ncalm,yes\n"), HasSubstr(":2: success is 'yes', must be"));
  const auto real = LoadRealTrials(
      File("real.csv", "condition,success\r\ncalm,1\r\n\"calm\",1\r\nrough,0\r\n"), gate);
  EXPECT_EQ(real[0].trials, 2);
  EXPECT_EQ(real[0].successes, 2);
  EXPECT_EQ(real[1].trials, 1);
  EXPECT_EQ(real[1].successes, 0);
  const GateReport report = Judge(gate, Measure(gate, DocksAt(0.9)), DocksAt(0.9));
  const report::Section section = RealTrialSection(WithReal(real, report), report);
  EXPECT_THAT(section.note, HasSubstr("Real success rate over these conditions: 66.7 % ["));
  EXPECT_EQ(section.table->rows()[0][1].text, "2 of 2");
}

// Which of what a condition draws goes with its failures.
TEST_F(GateFiles, WhatVariesWithinAConditionIsHeldAgainstItsFailures) {
  const Gate gate = LoadGate(File("drawn.yaml",
                                  "schema_version: 1\nscenario: pool_active\nseeds: 200\n"
                                  "random: {start.heading_rad: {uniform: [0, 0.3]},\n"
                                  "         start.lateral_m: {uniform: [0, 0.2]}}\n"
                                  "gate: {baseline: b.yaml, margins: {success_rate: 0.1}}\n"));
  const auto heading_fails = [&](const batch::TrialSpec& spec) {
    return Noise(spec.seed, "docks").Uniform() < std::stod(spec.parameters[0].value) / 0.3;
  };
  GateRun measured(gate);
  while (const auto trial = measured.Next()) {
    const batch::TrialSpec spec = gate.plan.Trial(*trial);
    measured.Add({.trial = spec.trial,
                  .cell = spec.cell,
                  .sample = spec.sample,
                  .parameters = spec.parameters,
                  .record = Ended(spec.seed, !heading_fails(spec))});
  }
  const auto effects = batch::FailureEffects(measured.TrialsOf(0));
  ASSERT_GE(effects.size(), 2u);
  EXPECT_THAT(effects[0].name, HasSubstr("heading"));
  EXPECT_TRUE(effects[0].significant);
  EXPECT_GT(effects[0].odds_low, 1);
  EXPECT_FALSE(effects[1].significant);
}

}  // namespace
}  // namespace turbidock::gate
