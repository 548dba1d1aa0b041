#include "experiments/batch/plan_keys.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <iterator>

#include "experiments/config/yaml_fields.h"
#include "experiments/statistics/sampling.h"
#include "experiments/trial/scenario.h"

namespace turbidock::batch {
namespace {

std::array<double, 2> Bounds(const config::YamlNode& at) {
  std::array<double, 2> bounds{};
  config::ReadValue(at, &bounds);
  if (bounds[0] >= bounds[1]) at.Fail("low must be below high");
  return bounds;
}

// "a[1].b" as "a.1.b".
std::string Dotted(const std::string& key) {
  std::string dotted;
  for (const char c : key)
    if (c != ']') dotted += c == '[' ? '.' : c;
  return dotted;
}

template <class Do>
void ForEachLeaf(const std::string& key, const config::YamlNode& value, const Do& act) {
  if (!value.IsMap()) return act(Dotted(key), value);
  for (const auto& [name, part] : value.Entries()) ForEachLeaf(JoinKey(key, name), part, act);
}

}  // namespace

std::vector<PlanKey> PlanGroups() {
  std::vector<PlanKey> groups = {
      {"set", "keys of the scenario and their values in every trial"},
      {"cases",
       "cases by name, each with keys of the scenario and perhaps a `scenario` of its own, in "
       "every cell of the grid"},
      {"grid", "keys of the scenario and a list of values of each; every combination is a cell"},
      {"ranges",
       "one to three keys of the scenario, each {from: VALUE, to: VALUE, scale: linear or "
       "logarithmic, success: falls, rises or unknown}, over which `find` looks for a boundary; "
       "one for each combination of cases and grid"},
      {"find",
       "boundary in the `ranges` at which success crosses `rate` (0.9), until no more than the "
       "share `width` "
       "(0.1) of the ranges is undecided with 95 %, or `trials` (5000; at least 100) are run"},
      {"strata",
       "strata: equally likely parts of the draws by name, each with keys of the scenario; a "
       "cell's trials "
       "are of each in turn"},
      {"random",
       "keys of the scenario and how each trial draws their values: {uniform: [LOW, HIGH]}, "
       "{log_uniform: [LOW, HIGH]}, {normal: [MEAN, DEVIATION], within: [LOW, HIGH]}, "
       "{choice: [VALUE, ...]}"}};
  std::ranges::copy(kUseGroups, std::back_inserter(groups));
  const std::string by_program = ", of a resolved plan, which the program writes";
  groups.push_back({"resolved_scenarios", "scenarios with all their values" + by_program});
  groups.push_back({"model_files", "model files and their digests" + by_program});
  groups.push_back({kFolderKey, "folder in which named files are looked for" + by_program});
  return groups;
}

std::vector<PlanKey> ReplacedPlanKeys() {
  return {{"conditions",
           "is now `cases`, by name, with scenario and keys together; alpha, beta, margins and "
           "baseline "
           "are in the group `gate`"},
          {"trials",
           "its keys now stand at the top of the file; gains, objective, optimiser, racing and "
           "proof are "
           "in the group `tuning`"}};
}

RandomKey RandomKey::Read(const std::string& key, const config::YamlNode& distribution) {
  constexpr auto& kKinds = EnumNames<Kind>::kNames;
  RandomKey random;
  random.key = key;
  int kinds = 0;
  for (const auto& [word, value] : distribution.Entries()) {
    if (word == "within") {
      random.within = Bounds(value);
      continue;
    }
    const auto kind = std::ranges::find(
        kKinds, word, [](const auto& known) -> std::string { return known.second; });
    if (kind == kKinds.end() || ++kinds > 1)
      value.Fail("must be one of uniform, normal, log_uniform, choice");
    random.kind = kind->first;
    if (random.kind == Kind::kChoice) {
      for (const config::YamlNode& choice : value.Elements())
        random.choices.push_back(choice.OneLine());
      if (random.choices.empty()) value.Fail("must be a list of values");
    } else if (random.kind == Kind::kNormal) {
      config::ReadValue(value, &random.numbers);
      if (random.numbers[1] <= 0) value.Fail("the standard deviation must be > 0");
    } else {
      random.numbers = Bounds(value);
      if (random.kind == Kind::kLogUniform && random.numbers[0] <= 0) value.Fail("low must be > 0");
    }
  }
  if (kinds == 0) distribution.Fail("must be one of uniform, normal, log_uniform, choice");
  if (!random.within) return random;
  if (random.kind != Kind::kNormal) distribution.Fail("only a normal distribution has `within`");
  // beyond that next to nothing is left to draw from
  constexpr double kFarthest = 5;  // standard deviations
  const auto [mean, deviation] = random.numbers;
  if ((*random.within)[0] > mean + kFarthest * deviation ||
      (*random.within)[1] < mean - kFarthest * deviation)
    distribution.Fail("`within` is more than 5 standard deviations from the mean");
  return random;
}

std::string RandomKey::ValueAt(double u) const {
  const auto [a, b] = numbers;
  if (kind == Kind::kUniform) return FormatNumber(statistics::UniformAt(u, a, b));
  if (kind == Kind::kLogUniform) return FormatNumber(statistics::LogUniformAt(u, a, b));
  if (kind == Kind::kNormal)
    return FormatNumber(within ? statistics::NormalAt(u, a, b, (*within)[0], (*within)[1])
                               : statistics::NormalAt(u, a, b));
  return choices[static_cast<size_t>(u * static_cast<double>(choices.size()))];
}

void RandomKey::RequireAllowed(const trial::Scenario& scenario,
                               const config::YamlNode& distribution) const {
  if (kind == Kind::kChoice || (kind == Kind::kNormal && !within)) return;
  const Range allowed = config::RangeOf(scenario, key);
  for (const double end : within.value_or(numbers))
    if (!allowed.Contains(end))
      distribution.Fail(FormatNumber(end) + " cannot be drawn: " + allowed.Sentence());
}

std::string RandomKey::RemarkOn(const trial::Scenario& scenario) const {
  if (!key.starts_with("vehicle.") || kind == Kind::kChoice) return "";
  constexpr double kRare = 0.001;
  const double low = std::stod(ValueAt(kRare)), high = std::stod(ValueAt(1 - kRare)),
               own = std::stod(config::ValueOf(scenario, key));
  if (own >= low && own <= high) return "";
  return fmt::format("{} is drawn from {:.2g} to {:.2g} (`random`): its own {:.4g} is never tried",
                     key, low, high, own);
}

void VariedKeys::Add(const std::string& key, const config::YamlNode& value) {
  ForEachLeaf(key, value, [this](const std::string& leaf, const config::YamlNode& at) {
    leaves_.emplace(leaf, at.Where() + at.path);
  });
}

const std::string* VariedKeys::Find(const std::string& key) const {
  auto there = leaves_.find(key);
  if (there == leaves_.end()) there = leaves_.lower_bound(key + ".");
  const bool is_there =
      there != leaves_.end() && (there->first == key || there->first.starts_with(key + "."));
  return is_there ? &there->second : nullptr;
}

void VariedKeys::RequireNew(const std::string& key, const config::YamlNode& value) const {
  ForEachLeaf(key, value, [&](const std::string& leaf, const config::YamlNode& at) {
    if (const std::string* before = Find(leaf))
      at.Fail("this key is given twice, also by " + *before);
  });
}

void VariedKeys::RequireNoWhole(const std::string& key, const config::YamlNode& value) const {
  const std::string dotted = Dotted(key);
  for (size_t end = dotted.find('.'); end != std::string::npos; end = dotted.find('.', end + 1))
    if (const auto whole = leaves_.find(dotted.substr(0, end));
        whole != leaves_.end() && std::isdigit(dotted[end + 1]) != 0)
      value.Fail("this key is given twice, also in the list of " + whole->second +
                 ": give its other elements alone");
}

}  // namespace turbidock::batch
