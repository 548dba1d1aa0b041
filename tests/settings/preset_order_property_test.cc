// A key that stands for others sets them where it is given: what is given later counts. Each preset
// with each key that it changes, in both orders, by --set and over the places of a plan.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>
#include <vector>

#include "experiments/batch/plan.h"
#include "experiments/config/yaml_fields.h"
#include "tests/settings/key_cases.h"
#include "tests/support/message_of.h"

namespace turbidock {
namespace {

using ::testing::AllOf;
using ::testing::AnyOf;
using testing::DifferenceOf;
using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using testing::KeyCase;
using testing::KeyCasesOf;
using ::testing::Not;

// But for those on keys that are switched off.
std::vector<std::string> PresetRemarks(const batch::Plan& plan) {
  std::vector<std::string> remarks = plan.remarks();
  std::erase_if(remarks,
                [](const auto& said) { return said.find(" changes no trial") != said.npos; });
  return remarks;
}

struct Order {
  std::string base, preset, key;  // assignments

  void PresetLast(const trial::Scenario& with_preset) const {
    const trial::Scenario made = trial::LoadScenario(base, {key, preset});
    EXPECT_EQ(DifferenceOf(made, with_preset), "") << key << " then " << preset;
    const std::string name = key.substr(0, key.find('='));
    const auto one_remark = ElementsAre(AllOf(HasSubstr(preset.substr(0, preset.find('=')) + " = "),
                                              HasSubstr("also sets what was given before: "),
                                              AnyOf(HasSubstr(name), EndsWith("more"))));
    EXPECT_THAT(made.given.remarks, one_remark);
    const batch::Plan plan = PlanOf(key, preset);
    trial::Scenario split = plan.ScenarioOf(plan.Trial(0));
    split.seed = made.seed;
    EXPECT_EQ(DifferenceOf(split, with_preset), "") << key << " then " << preset << " in a grid";
    EXPECT_THAT(PresetRemarks(plan), one_remark);
  }

  void KeyLast(const KeyCase& of, size_t value) const {
    const trial::Scenario made = trial::LoadScenario(base, {preset, key});
    EXPECT_EQ(config::TextOf(made, of.key), config::TextOf(of.scenarios[value], of.key))
        << preset << " then " << key;
    // at most what the preset undoes of the base
    const auto remarks = trial::LoadScenario(base, {preset}).given.remarks;
    EXPECT_THAT(made.given.remarks,
                Each(Not(HasSubstr(" " + key.substr(0, key.find('=')) + " ("))));
    const batch::Plan plan = PlanOf(preset, key);
    trial::Scenario split = plan.ScenarioOf(plan.Trial(0));
    split.seed = made.seed;
    EXPECT_EQ(DifferenceOf(split, made), "") << preset << " then " << key << " in a grid";
    EXPECT_EQ(PresetRemarks(plan), remarks);
  }

  // Whatever names a trial is what it has: presets come first among the values of a plan's trials.
  void TogetherInATrial(const trial::Scenario& key_last) const {
    const auto split = [](const std::string& assignment) {
      const size_t equals = assignment.find('=');
      return assignment.substr(0, equals) + "=[" + assignment.substr(equals + 1) + "]";
    };
    const std::string begin = "schema_version: 1\nscenario: " + base + "\n";
    for (const auto& [first, second] : {std::pair{key, preset}, {preset, key}})
      for (const std::string& values :
           {testing::YamlBlock("", "grid", {split(first), split(second)}),
            "cases:\n" + testing::YamlBlock("  ", "one", {first, second}),
            "cases:\n" + testing::YamlBlock("  ", "one", {first}) +
                testing::YamlBlock("", "grid", {split(second)})}) {
        const batch::Plan plan(begin + values, "plan.yaml");
        trial::Scenario made = plan.ScenarioOf(plan.Trial(0));
        made.seed = key_last.seed;
        EXPECT_EQ(DifferenceOf(made, key_last), "") << values;
      }
  }

  batch::Plan PlanOf(const std::string& set, const std::string& grid) const {
    const size_t equals = grid.find('=');
    return batch::Plan(
        "schema_version: 1\nscenario: " + base + "\n" + testing::YamlBlock("", "set", {set}) +
            testing::YamlBlock("", "grid",
                               {grid.substr(0, equals) + "=[" + grid.substr(equals + 1) + "]"}),
        "plan.yaml");
  }
};

// The cases of the keys that a preset changes, but for groups, elements of lists and presets.
std::vector<const KeyCase*> ChangedBy(const std::string& preset, const trial::Scenario& before,
                                      const trial::Scenario& after,
                                      const std::vector<KeyCase>& cases) {
  std::vector<const KeyCase*> changed;
  const std::vector<std::string> presets = config::PresetsOf(before);
  for (const KeyCase& of : cases)
    if (of.key != preset && std::ranges::count(presets, of.key) == 0 &&
        of.type != "group of keys" && of.before.empty() && of.key.find('[') == std::string::npos &&
        of.listed.find("[]") == std::string::npos &&
        config::TextOf(before, of.key) != config::TextOf(after, of.key))
      changed.push_back(&of);
  return changed;
}

class PresetOrder : public ::testing::TestWithParam<const char*> {};

std::string NameOf(const ::testing::TestParamInfo<const char*>& base) { return base.param; }
INSTANTIATE_TEST_SUITE_P(Of, PresetOrder, ::testing::Values("pool_active", "approach_5m"), NameOf);

TEST_P(PresetOrder, WhatIsGivenLaterCounts) {
  const std::string base = GetParam();
  const std::vector<KeyCase>& cases = KeyCasesOf(base);
  const trial::Scenario before = trial::LoadScenario(base, {});
  for (const std::string& preset : config::PresetsOf(before)) {
    std::vector<std::string> values = std::ranges::find(cases, preset, &KeyCase::key)->values;
    // another vehicle, not the same one in a file of another name
    if (preset == "vehicle.model") values = {"bluerov2_heavy.xml"};
    std::set<std::string> tried;
    for (const std::string& value : values) {
      const std::string assignment = preset + "=" + value;
      const trial::Scenario after = trial::LoadScenario(base, {assignment});
      for (const KeyCase* of : ChangedBy(preset, before, after, cases)) {
        // a value that the preset does not have
        const bool is_its =
            config::TextOf(of->scenarios[0], of->key) == config::TextOf(after, of->key);
        const size_t other = is_its ? 1 : 0;
        const Order order{base, assignment, of->key + "=" + of->values[other]};
        order.PresetLast(after);
        order.KeyLast(*of, other);
        order.TogetherInATrial(trial::LoadScenario(base, {assignment, order.key}));
        tried.insert(of->key);
      }
    }
    // so many keys at least does each of them change here
    const std::map<std::string, size_t> least = {{"vehicle.model", 20},
                                                 {"cameras.optics", 20},
                                                 {"marker.from_scene", 0},  // a bundled scene's
                                                 {"estimator.fiducial.tags_from_scene", 0},
                                                 {"procedure.approach.mode", 5},
                                                 {"navigation.preset", 8},
                                                 {"estimator.rm_ga.preset", 5}};
    EXPECT_GE(tried.size(), least.at(preset)) << preset;
  }
}

TEST(PresetOrder, TwoThatExcludeEachOtherAreRefused) {
  for (const std::string navigation : {"usbl", "dvl", "dead_reckoning"})
    EXPECT_THAT(testing::MessageOf([&] {
                  trial::LoadScenario("approach_5m", {"procedure.approach.mode=pilot",
                                                      "navigation.preset=" + navigation});
                }),
                HasSubstr("navigation.preset: " + navigation +
                          " and procedure.approach.mode = pilot exclude each other"));
  EXPECT_EQ(testing::MessageOf([] {
              trial::LoadScenario("approach_5m",
                                  {"navigation.preset=usbl", "procedure.approach.mode=pilot"});
            }),
            "no error");
}

}  // namespace
}  // namespace turbidock
