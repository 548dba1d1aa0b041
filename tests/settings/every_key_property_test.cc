// Every key of a scenario, set in every way in which one can be, makes the scenario that --set
// makes; or the way refuses the key by its name.
//
// Here each key is set alone; key_places_property_test.cc has those ways of which each takes a
// plan or a study of its own.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "experiments/batch/plan.h"
#include "experiments/config/yaml_fields.h"
#include "experiments/studies/gate/gate_plan.h"
#include "experiments/studies/tuning/study.h"
#include "experiments/trial/running_trial.h"
#include "tests/settings/key_cases.h"
#include "tests/support/message_of.h"

namespace turbidock {
namespace {

using ::testing::AllOf;
using testing::DifferenceOf;
using ::testing::HasSubstr;
using testing::KeyCase;
using testing::KeyCasesOf;
using testing::MessageOf;
using ::testing::TestParamInfo;
using ::testing::TestWithParam;
using ::testing::Values;
using testing::YamlBlock;

// ---------------------------------------------------------------------------- what is refused
// where

// A batch and a gate give each trial its seed.
bool MayBeGivenToTrials(const KeyCase& of) { return of.key != "trial.seed"; }

// What a running trial can follow; no snow, of the sea not the file of a measured current, and no
// commands from a file in the controller's place.
bool MayChange(const KeyCase& of) {
  static const std::set<std::string> may_change = [] {
    std::set<std::string> groups = {"water", "lights.lamps",      "lights.marker",
                                    "sea",   "control.levelling", "control.use"};
    const trial::Plugins plugins;
    for (const std::string& name : plugins.controllers())
      if (!plugins.Spec(name).commands) groups.insert("control." + name);
    return groups;
  }();
  return std::ranges::any_of(may_change, [&](const auto& group) { return of.IsIn(group); }) &&
         of.key != "sea.current.file" && !of.IsIn("water.snow");
}

// ------------------------------------------------------------------------------------------- ways

class EveryKey : public TestWithParam<const char*> {
 protected:
  const std::string base_ = GetParam();
  const size_t first_ = base_ == "pool_active" ? 0 : 1;  // where a base has every other key
  const std::vector<KeyCase>& cases_ = KeyCasesOf(base_);
  size_t compared_ = 0;

  void Compare(const KeyCase& of, size_t value, const trial::Scenario& made) {
    trial::Scenario expected = of.scenarios.at(value);
    if (MayBeGivenToTrials(of)) expected.seed = made.seed;
    EXPECT_EQ(DifferenceOf(expected, made), "")
        << fmt::format("of {} with {}", base_, fmt::join(of.Assignments(value), ", "));
    ++compared_;
  }

  // That so many values were compared as these keys have.
  template <class Which>
  void ExpectCompared(const Which& which, size_t ways) const {
    size_t values = 0;
    for (const KeyCase& of : cases_)
      if (which(of)) values += of.values.size();
    EXPECT_EQ(compared_, values * ways);
  }

  template <class Do>
  void ForEachValue(const Do& act) {
    for (const KeyCase& of : cases_)
      for (size_t value = 0; value < of.values.size(); ++value) act(of, value);
  }
};

std::string NameOf(const TestParamInfo<const char*>& info) { return info.param; }
INSTANTIATE_TEST_SUITE_P(Of, EveryKey, Values("pool_active", "approach_5m"), NameOf);

// All keys of the list are here: alone, in a list of groups as an element's, or as a group.
TEST_P(EveryKey, IsTried) {
  std::set<std::string> listed, tried;
  for (const config::KeyDoc& doc : trial::ScenarioKeys()) listed.insert(doc.key);
  for (const KeyCase& of : cases_) tried.insert(of.listed);
  EXPECT_EQ(tried, listed);
}

TEST_P(EveryKey, IsSetInAScenarioThatIsResolvedAlready) {
  const trial::Scenario loaded = trial::LoadScenario(base_, {});
  const trial::Scenario saved = trial::ParseScenario(trial::SaveScenario(loaded), "resolved.yaml");
  EXPECT_EQ(DifferenceOf(loaded, saved), "");
  ForEachValue([&](const KeyCase& of, size_t value) {
    for (trial::Scenario scenario : {loaded, saved}) {
      trial::Resolve(config::ParseAssignments(of.Assignments(value)), &scenario);
      Compare(of, value, scenario);
    }
  });
  ExpectCompared([](const KeyCase&) { return true; }, 2);
}

// What a scenario saves is what it is. Of each key one value, with every other base.
TEST_P(EveryKey, IsSavedAndReadAgain) {
  for (size_t i = first_; i < cases_.size(); i += 2) {
    const trial::Scenario& made = cases_[i].scenarios.back();
    Compare(cases_[i], cases_[i].values.size() - 1,
            trial::ParseScenario(trial::SaveScenario(made), "resolved.yaml"));
  }
  EXPECT_EQ(compared_, (cases_.size() + 1 - first_) / 2);
}

// All values at once, each as a case or a stratum of its own; cases with one base, strata with the
// other.
TEST_P(EveryKey, IsSetByCasesOrStrataOfAPlan) {
  const std::string part = first_ == 0 ? "cases" : "strata";
  std::string values;
  int64_t count = 0;
  ForEachValue([&](const KeyCase& of, size_t value) {
    if (MayBeGivenToTrials(of))
      values += YamlBlock("  ", fmt::format("\"{}\"", count++), of.Assignments(value));
  });
  const std::string text = fmt::format("schema_version: 1\nscenario: {}\nseeds: {}\n{}:\n{}", base_,
                                       first_ == 0 ? 1 : count, part, values);
  const batch::Plan plan(text, "plan.yaml"), stored(plan.resolved(), "plan");
  ASSERT_EQ(plan.trials(), count);
  EXPECT_EQ(stored.hash(), plan.hash());
  int64_t trial = 0;
  ForEachValue([&](const KeyCase& of, size_t value) {
    if (!MayBeGivenToTrials(of)) return;
    Compare(of, value, plan.ScenarioOf(plan.Trial(trial)));
    Compare(of, value, stored.ScenarioOf(stored.Trial(trial++)));
  });
  ExpectCompared(MayBeGivenToTrials, 2);
}

// Of each key one value with either base.
TEST_P(EveryKey, IsSetByConditionsOfAGate) {
  std::string text = fmt::format("schema_version: 1\nscenario: {}\ncases:\n", base_);
  const auto value_of = [this](const KeyCase& of) { return of.values.size() == 1 ? 0 : first_; };
  for (const KeyCase& of : cases_)
    if (MayBeGivenToTrials(of))
      text += YamlBlock("  ", fmt::format("\"{}\"", of.key), of.Assignments(value_of(of)));
  const std::string file = ::testing::TempDir() + base_ + "_gate.yaml";
  std::ofstream(file) << text << "gate: {baseline: baseline.yaml}\n";
  const gate::Gate gate = gate::LoadGate(file);
  for (const KeyCase& of : cases_)
    if (MayBeGivenToTrials(of))
      Compare(of, value_of(of),
              gate.plan.ScenarioOf(gate.plan.FirstOf(static_cast<int64_t>(compared_))));
  EXPECT_EQ(compared_ + 1, cases_.size());
}

TEST_P(EveryKey, IsChangedInARunningTrialOrRefused) {
  const trial::Scenario base = trial::LoadScenario(base_, {});
  size_t refused = 0;
  ForEachValue([&](const KeyCase& of, size_t value) {
    const std::string assignment = of.Assignments(value).back();
    trial::Scenario running = base;
    if (MayChange(of) || of.key == "sea.current.file")
      trial::Resolve(config::ParseAssignments(of.before), &running);
    if (MayChange(of)) {
      Compare(of, value, trial::Changed(running, assignment));
    } else {
      EXPECT_THAT(MessageOf([&] { trial::Changed(running, assignment); }),
                  AllOf(HasSubstr(of.key), HasSubstr("cannot change while")));
      ++refused;
    }
  });
  ExpectCompared(MayChange, 1);
  size_t values = 0;
  ForEachValue([&values](const KeyCase&, size_t) { ++values; });
  EXPECT_EQ(refused, values - compared_);
  EXPECT_GT(compared_, 300u);
}

// No gain but plain numbers; those are tuned in key_places_property_test.cc.
TEST_P(EveryKey, IsANumberOrIsNotTuned) {
  size_t refused = 0, numbers = 0;
  for (const KeyCase& of : cases_) {
    if (of.is_plain_number()) {
      ++numbers;
      continue;
    }
    const std::string text =
        "schema_version: 1\nscenario: pool_active\n"
        "tuning: {objective: [{metric: time_s}], gains: [{key: \"" +
        of.key + "\"}]}\n";
    EXPECT_THAT(MessageOf([&] { tuning::Study(config::ParseYaml(text, "study.yaml")); }),
                HasSubstr("'" + of.key + "' is no number of a scenario"));
    ++refused;
  }
  EXPECT_EQ(refused + numbers, cases_.size());
}

// What gives each trial its seed takes none.
TEST(TheSeed, IsRefusedByWhatGivesIt) {
  const std::string head = "schema_version: 1\nscenario: pool_active\n";
  for (const std::string text :
       {"set: {trial.seed: 3}", "set: {trial: {seed: 3}}", "grid: {trial.seed: [3, 4]}",
        "grid: {trial: [{seed: 3}]}", "cases: {one: {trial.seed: 3}}",
        "strata: {one: {trial: {seed: 3}}}", "random: {trial.seed: {choice: [3, 4]}}",
        "random: {trial: {choice: [{seed: 3}]}}"}) {
    EXPECT_THAT(MessageOf([&] { batch::Plan(head + text, "plan.yaml"); }),
                HasSubstr(": the plan gives each trial its seed; set master_seed"))
        << text;
  }
}

}  // namespace
}  // namespace turbidock
