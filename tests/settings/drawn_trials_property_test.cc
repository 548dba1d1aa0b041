// A trial that a worker runs of a plan is the one that `run --set` makes: keys drawn from the list,
// trials of a moment, their digests.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>
#include <vector>

#include "experiments/batch/runner.h"
#include "experiments/report/json.h"
#include "experiments/trial/record_columns.h"
#include "experiments/trial/switched_off.h"
#include "experiments/trial/trial.h"
#include "sim/base/random.h"
#include "tests/settings/key_cases.h"
#include "tests/support/message_of.h"

namespace turbidock {
namespace {

using testing::KeyCase;
using testing::KeyCasesOf;
using testing::YamlBlock;

constexpr const char* kBase = "sea_night_passive";
const std::vector<std::string> kBrief = {"estimator.pose_source=true_pose", "trial.duration_s=2",
                                         "marker.may_differ=true"};

std::vector<std::string> With(const std::string& assignment) {
  std::vector<std::string> all = kBrief;
  all.push_back(assignment);
  return all;
}

// So many assignments, each allowed in a brief trial.
std::vector<std::string> Drawn(size_t count) {
  const std::vector<KeyCase>& cases = KeyCasesOf("pool_active");
  // what such a trial follows from
  const std::set<std::string> groups = {"trial.clock",
                                        "start",
                                        "sea",
                                        "vehicle",
                                        "control.lqg",
                                        "estimator.true_pose",
                                        "cameras.delay_frames",
                                        "cameras.period_frames"};
  const trial::Scenario brief = trial::LoadScenario(kBase, kBrief);
  Rng rng = SeedTree(20260728).Stream("keys");
  std::vector<std::string> drawn;
  std::set<std::string> keys;
  while (drawn.size() < count) {
    const KeyCase& of = cases[rng.NextU64() % cases.size()];
    if (!of.before.empty() || !trial::SwitchedOffBy(brief, of.key).empty() ||
        std::ranges::none_of(groups, [&](const auto& group) { return of.IsIn(group); }) ||
        !keys.insert(of.key).second)
      continue;
    const std::string assignment = of.Assignments(rng.NextU64() % of.values.size()).back();
    if (testing::MessageOf([&] { trial::LoadScenario(kBase, With(assignment)); }) == "no error")
      drawn.push_back(assignment);
  }
  return drawn;
}

TEST(DrawnTrials, AreThoseOfSet) {
  const std::vector<std::string> drawn = Drawn(12);
  std::string text = fmt::format("schema_version: 1\nscenario: {}\n", kBase) +
                     YamlBlock("", "set", kBrief) + "cases:\n";
  for (size_t i = 0; i < drawn.size(); ++i)
    text += YamlBlock("  ", fmt::format("\"{}\"", i), {drawn[i]});
  const batch::Plan plan(text, "plan.yaml");
  ASSERT_EQ(plan.trials(), 12);
  std::set<std::string> digests;
  for (int64_t trial = 0; trial < plan.trials(); ++trial) {
    const std::string& assignment = drawn[static_cast<size_t>(trial)];
    const batch::TrialSpec spec = plan.Trial(trial);
    const std::string output =
        batch::TrialWork().run(batch::TrialJob(trial, plan.ScenarioOf(spec)).input);
    const trial::TrialRecord record = trial::RecordOf(
        report::ParseJson(output, "output")["cells"].get<std::vector<trial::Cell>>());
    std::vector<std::string> given = With(assignment);
    given.push_back(fmt::format("trial.seed={}", spec.seed));
    EXPECT_EQ(record.digest, trial::RunTrial(trial::LoadScenario(kBase, given)).digest)
        << assignment;
    digests.insert(record.digest);
  }
  EXPECT_GE(digests.size(), 9u);  // of twelve
}

}  // namespace
}  // namespace turbidock
