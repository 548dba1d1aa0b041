// Every key of a scenario, set in each place of a plan and of a study in turn: `set`, `grid`,
// `random`, a gain. Nine keys at a time, three in each place; together they make the scenario that
// --set makes of them in the order of the places. Each key is in each place once, with one of the
// two base scenarios.

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "experiments/batch/plan.h"
#include "experiments/config/yaml_fields.h"
#include "experiments/studies/tuning/study.h"
#include "experiments/trial/switched_off.h"
#include "tests/settings/key_cases.h"
#include "tests/support/message_of.h"

namespace turbidock {
namespace {

using testing::DifferenceOf;
using testing::KeyCase;
using testing::KeyCasesOf;
using testing::MessageOf;
using testing::YamlBlock;

using Keys = std::vector<const KeyCase*>;
using Texts = std::vector<std::string>;

// The value of this number, or the only one.
size_t At(const KeyCase& of, size_t value) { return std::min(value, of.values.size() - 1); }

std::string OneLine(const std::string& value) {
  return config::ParseYamlValue(value, {nullptr, "a value", ""}).OneLine();
}

// Whether a key is the other one, or that a part of it.
bool Holds(const std::string& key, const std::string& other) {
  return other == key || other.starts_with(key + ".") || other.starts_with(key + "[");
}

// Whether what is given for one holds what is given for the other.
bool Meet(const KeyCase& a, const KeyCase& b) {
  for (const std::string& one : a.Assignments(0))
    for (const std::string& other : b.Assignments(0)) {
      const std::string x = one.substr(0, one.find('=')), y = other.substr(0, other.find('='));
      if (Holds(x, y) || Holds(y, x)) return true;
    }
  return false;
}

// Keys in the places of a plan.
struct Places {
  Keys set{}, grid{}, random{}, gains{};

  Keys All() const {
    Keys all;
    for (const Keys* keys : {&set, &grid, &random, &gains})
      all.insert(all.end(), keys->begin(), keys->end());
    return all;
  }
  // Takes out the keys that meet one before them.
  Places TakeMeeting() {
    Places meeting;
    Keys before;
    for (const auto& lists : {std::pair(&set, &meeting.set), std::pair(&grid, &meeting.grid),
                              std::pair(&random, &meeting.random)})
      std::erase_if(*lists.first, [&before, to = lists.second](const KeyCase* of) {
        const bool meets =
            std::ranges::any_of(before, [of](const KeyCase* each) { return Meet(*of, *each); });
        (meets ? *to : before).push_back(of);
        return meets;
      });
    return meeting;
  }
};

class KeyPlaces : public ::testing::TestWithParam<const char*> {
 protected:
  const std::string base_ = GetParam();
  const size_t first_ = base_ == "pool_active" ? 0 : 1;  // of the values that `set` has
  std::vector<KeyCase> cases_;
  // Values that were compared: by place of a plan, and of the same stored; in a study's trials; as
  // gains.
  size_t set_ = 0, grid_ = 0, random_ = 0, stored_ = 0, studies_ = 0, gains_ = 0;
  size_t unread_ = 0;  // numbers that are not tuned, for no trial reads them

  void SetUp() override {
    for (const KeyCase& of : KeyCasesOf(base_))
      if (of.key != "trial.seed") cases_.push_back(of);  // refused: see every_key_property_test.cc
  }

  // What a plan's `set` has.
  Texts Set(const Places& places) const {
    Texts set;
    for (const KeyCase* of : places.set)
      for (const std::string& each : of->Assignments(At(*of, first_))) set.push_back(each);
    return set;
  }

  // What has to be given before the others: the plan has it in its only case.
  static Texts Case(const Places& places) {
    Texts given;
    for (const Keys* keys : {&places.grid, &places.random, &places.gains})
      for (const KeyCase* of : *keys)
        given.insert(given.end(), of->before.begin(), of->before.end());
    return given;
  }

  // The scenario that follows from these of the values.
  trial::Scenario Expected(const Places& places, size_t value) const {
    Texts trial = Case(places);
    for (const Keys* keys : {&places.grid, &places.random, &places.gains})
      for (const KeyCase* of : *keys) trial.push_back(of->key + "=" + of->values[At(*of, value)]);
    // Presets come first among the values of a trial.
    static const Texts presets = config::PresetsOf(trial::Scenario());
    std::ranges::stable_sort(trial, {}, [](const std::string& each) {
      const auto is_it = [key = each.substr(0, each.find('='))](const std::string& preset) {
        return preset == key || preset.starts_with(key + ".");
      };
      return std::ranges::find_if(presets, is_it) - presets.begin();
    });
    Texts given = Set(places);
    given.insert(given.end(), trial.begin(), trial.end());
    return trial::LoadScenario(base_, given);
  }

  // The keys of a plan.
  std::string Text(const Places& places) const {
    std::string text = "scenario: " + base_ + "\n" + YamlBlock("", "set", Set(places));
    if (!Case(places).empty()) text += "cases:\n" + YamlBlock("  ", "the only one", Case(places));
    Texts grid, random;
    for (const KeyCase* of : places.grid)
      grid.push_back(fmt::format("{}=[{}]", of->key, fmt::join(of->values, ", ")));
    for (const KeyCase* of : places.random)
      random.push_back(fmt::format("{}={{choice: [{}]}}", of->key, fmt::join(of->values, ", ")));
    return text + YamlBlock("", "grid", grid) + YamlBlock("", "random", random);
  }

  void ExpectSame(const trial::Scenario& expected, trial::Scenario made, const Places& places) {
    made.seed = expected.seed;
    EXPECT_EQ(DifferenceOf(expected, made), "") << Text(places);
  }

  // A trial with these values in the grid that draws these, of a plan with other seeds.
  static std::pair<batch::Plan, int64_t> TrialWith(const batch::Plan& plan, const Places& places,
                                                   size_t value) {
    int64_t cell = 0;
    for (const KeyCase* of : places.grid)
      cell = cell * std::ssize(of->values) + static_cast<int64_t>(At(*of, value));
    for (int64_t seed = 1; seed < 1000; ++seed) {
      const batch::Plan other = plan.WithSeeds(seed, 1);
      const batch::TrialSpec spec = other.FirstOf(cell);
      if (std::ranges::all_of(places.random, [&](const KeyCase* of) {
            return std::ranges::find(spec.parameters, of->key, &batch::Parameter::key)->value ==
                   OneLine(of->values[At(*of, value)]);
          }))
        return {other, spec.trial};
    }
    throw std::runtime_error("some values are never drawn together");
  }

  void TryPlan(const Places& places, const std::vector<trial::Scenario>& expected) {
    const batch::Plan plan("schema_version: 1\n" + Text(places), "plan.yaml");
    const batch::Plan read(plan.resolved(), "plan");
    EXPECT_EQ(read.hash(), plan.hash()) << Text(places);
    for (size_t value = 0; value < expected.size(); ++value)
      for (const batch::Plan* of : {&plan, &read}) {
        const auto [other, trial] = TrialWith(*of, places, value);
        ExpectSame(expected[value], other.ScenarioOf(other.Trial(trial)), places);
      }
    set_ += places.set.size();
    for (const KeyCase* of : places.grid) grid_ += of->values.size();
    for (const KeyCase* of : places.random) random_ += of->values.size();
    stored_ += places.All().size();
  }

  // A study with these gains, a line of its file for each.
  tuning::Study StudyOf(const Places& places, const std::string& gains) const {
    return tuning::Study(
        config::ParseYaml("schema_version: 1\n" + Text(places) +
                              "tuning:\n  objective: [{metric: time_s}]\n  gains:\n" + gains,
                          "study.yaml"));
  }

  bool IsRead(Places places, const KeyCase* of) const {
    std::erase(places.random, of);
    const std::string said = MessageOf(
        [&] { StudyOf(places, "    - {key: " + of->key + ", low: -1.0e9, high: 1.0e9}\n"); });
    return said.find(of->key + " changes no trial: ") == std::string::npos;
  }

  // The same of a study, where numbers that a plan draws are tuned.
  void TryStudy(Places places, const std::vector<trial::Scenario>& expected) {
    for (const KeyCase* of : Keys(places.random)) {
      if (!of->is_plain_number()) continue;
      if (!IsRead(places, of)) {
        for (const trial::Scenario& scenario : expected)
          EXPECT_NE(trial::SwitchedOffBy(scenario, of->key), "") << of->key;
        ++unread_;
        continue;
      }
      std::erase(places.random, of);
      places.gains.push_back(of);
    }
    Places start = places;
    start.gains.clear();
    const trial::Scenario before = Expected(start, 0);
    const auto value_in = [](const trial::Scenario& scenario, const std::string& key) {
      return std::stod(config::ValueOf(scenario, key));
    };
    std::string text;
    std::vector<tuning::Gains> gains(expected.size());
    const auto tune = [&](const std::string& key) {
      std::vector<double> all = {value_in(before, key)};
      for (size_t value = 0; value < expected.size(); ++value)
        all.push_back(gains[value].emplace_back(value_in(expected[value], key)));
      const auto [low, high] = std::ranges::minmax(all);
      text += fmt::format("    - {{key: {}, low: {}, high: {}}}\n", key, FormatNumber(low),
                          FormatNumber(low == high ? high + 1 : high));
    };
    for (const KeyCase* of : places.gains) tune(of->key);
    const Keys all = places.All();
    for (const std::string any :
         {"trial.jam.time_s", "trial.after_docked_s", "procedure.give_up_s"}) {
      const auto has_it = [&any](const KeyCase* of) { return any.starts_with(of->key); };
      if (gains[0].empty() && std::ranges::none_of(all, has_it))
        tune(any);  // a study has one at least
    }
    const tuning::Study study = StudyOf(places, text);
    for (size_t value = 0; value < expected.size(); ++value) {
      const auto [plan, trial] = TrialWith(study.plan(), places, value);
      ExpectSame(expected[value], study.ScenarioOf(plan, trial, gains[value]), places);
      ++studies_;
    }
    gains_ += places.gains.size();
  }

  // Together, but for keys that meet; alone where together they are not allowed.
  void Try(Places places) {
    if (const Places meeting = places.TakeMeeting(); !meeting.All().empty()) Try(meeting);
    std::vector<trial::Scenario> expected;
    const std::string refused = MessageOf([&] {
      for (size_t value = 0; value < 2; ++value) expected.push_back(Expected(places, value));
    });
    if (refused == "no error") {
      TryPlan(places, expected);
      TryStudy(places, expected);
      return;
    }
    ASSERT_GT(places.All().size(), 1u) << refused << "\n" << Text(places);
    for (const KeyCase* of : places.set) Try({.set = {of}});
    for (const KeyCase* of : places.grid) Try({.grid = {of}});
    for (const KeyCase* of : places.random) Try({.random = {of}});
  }
};

std::string NameOf(const ::testing::TestParamInfo<const char*>& base) { return base.param; }
INSTANTIATE_TEST_SUITE_P(Of, KeyPlaces, ::testing::Values("pool_active", "approach_5m"), NameOf);

TEST_P(KeyPlaces, MakeTheScenarioThatSetMakes) {
  constexpr size_t kOfEach = 3;
  // Neighbours in the list are far apart here.
  const size_t n = cases_.size();
  size_t stride = 5 * n / 13;
  while (std::gcd(stride, n) > 1) ++stride;
  const auto key = [&](size_t i) { return &cases_[i * stride % n]; };
  Places all;
  for (size_t begin = 0, turn = 0; begin < n; begin += kOfEach, ++turn) {
    if (turn % 2 != first_) continue;
    Places places;
    for (size_t i = begin; i < std::min(begin + kOfEach, n); ++i) {
      places.set.push_back(key(i));
      places.grid.push_back(key(i + n / 3));
      places.random.push_back(key(i + 2 * n / 3));
    }
    Try(places);
    all.set.insert(all.set.end(), places.set.begin(), places.set.end());
    all.grid.insert(all.grid.end(), places.grid.begin(), places.grid.end());
    all.random.insert(all.random.end(), places.random.begin(), places.random.end());
  }
  const auto values = [](const Keys& keys) {
    size_t count = 0;
    for (const KeyCase* of : keys) count += of->values.size();
    return count;
  };
  EXPECT_EQ(set_, all.set.size());
  EXPECT_EQ(grid_, values(all.grid));
  EXPECT_EQ(random_, values(all.random));
  EXPECT_EQ(stored_, all.All().size());
  EXPECT_EQ(gains_ + unread_, std::ranges::count_if(all.random, &KeyCase::is_plain_number));
  EXPECT_GT(gains_, unread_);
  EXPECT_GT(all.set.size(), n / 2 - kOfEach);
}

// All plain numbers at once, each drawn between its two values.
TEST_P(KeyPlaces, DrawNumbers) {
  Texts distributions;
  for (const KeyCase& of : cases_)
    if (of.is_plain_number()) {
      const auto [low, high] = std::minmax({std::stod(of.values[0]), std::stod(of.values[1])});
      distributions.push_back(
          fmt::format("{}={{uniform: [{}, {}]}}", of.key, FormatNumber(low), FormatNumber(high)));
    }
  const batch::Plan plan("schema_version: 1\nscenario: " + base_ + "\nseeds: 3\n" +
                             YamlBlock("", "random", distributions),
                         "plan.yaml");
  const batch::Plan read(plan.resolved(), "plan");
  std::set<std::string> drawn;
  for (int64_t trial = 0; trial < plan.trials(); ++trial) {
    const batch::TrialSpec spec = plan.Trial(trial);
    Texts given;
    for (const batch::Parameter& parameter : spec.parameters)
      given.push_back(parameter.Assignment());
    drawn.insert(given.begin(), given.end());
    const trial::Scenario expected = trial::LoadScenario(base_, given);
    ExpectSame(expected, plan.ScenarioOf(spec), {});
    ExpectSame(expected, read.ScenarioOf(read.Trial(trial)), {});
  }
  EXPECT_GT(distributions.size(), 200u);
  EXPECT_EQ(drawn.size(), 3 * distributions.size());
}

}  // namespace
}  // namespace turbidock
