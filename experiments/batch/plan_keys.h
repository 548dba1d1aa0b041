#pragma once
// The keys of a plan besides its settings, and those of the scenario that it gives values.

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sim/base/fields.h"

namespace turbidock::config {
struct YamlNode;
}
namespace turbidock::trial {
struct Scenario;
}

namespace turbidock::batch {

struct PlanKey {
  std::string key, what;
};

// Groups of a plan that its uses read themselves.
inline const std::vector<PlanKey> kUseGroups = {
    {"gate", "settings of `turbidock gate` (list gate-keys)"},
    {"tuning", "settings of `turbidock tune` (list study-keys)"}};
// What uses other than a batch refuse (PlanOverrides::refused).
inline const PlanKey kNoRanges = {"ranges",
                                  "only `turbidock batch` looks for a boundary; give `grid`"};
// Of a resolved plan: where the files are that it names.
inline constexpr const char* kFolderKey = "folder";
// All keys but those of PlanSettings; and keys of older files with what has taken their place.
std::vector<PlanKey> PlanGroups();
std::vector<PlanKey> ReplacedPlanKeys();

// A random key and how a number in (0, 1) becomes its value.
struct RandomKey {
  enum class Kind { kUniform, kNormal, kLogUniform, kChoice };

  std::string key;
  Kind kind = Kind::kUniform;
  std::array<double, 2> numbers{};              // low, high; mean, standard deviation
  std::optional<std::array<double, 2>> within;  // of a normal distribution: cut off there
  std::vector<std::string> choices;

  // Of a distribution as a plan's `random` has it: {normal: [15, 0.5], within: [13, 17]}.
  // ConfigError that names its line for any other.
  static RandomKey Read(const std::string& key, const config::YamlNode& distribution);
  // The value, as YAML, at u in (0, 1): the distribution's quantile, or one of the choices.
  std::string ValueAt(double u) const;
  // ConfigError that names the distribution's line where an end of it is beyond what the key may
  // be, also where no trial comes near that end.
  void RequireAllowed(const trial::Scenario& scenario, const config::YamlNode& distribution) const;
  // A sentence where the scenario's own value, of its vehicle, is one that is never drawn.
  std::string RemarkOn(const trial::Scenario& scenario) const;
};

constexpr auto Names(RandomKey::Kind) {
  using enum RandomKey::Kind;
  return EnumList<RandomKey::Kind>({{kUniform, "uniform"},
                                    {kNormal, "normal"},
                                    {kLogUniform, "log_uniform"},
                                    {kChoice, "choice"}});
}

// Which keys of the scenario are given values, so that none is given them twice: by a plan's `set`,
// its cases, grid, strata and draws.
//
// A group of keys counts as each of its keys, an element of a list as a part of it: `start:
// {heading_rad: 0}` is `start.heading_rad`, `a[1]` is `a.1` and part of `a`. A part may be given
// after the whole, not the whole after the part, which would be lost.
class VariedKeys {
 public:
  void Add(const std::string& key, const config::YamlNode& value);
  // ConfigError about the first key of the value that is there already, or of which a part is.
  void RequireNew(const std::string& key, const config::YamlNode& value) const;
  // ConfigError where a list is given of which the key is an element: that value would be lost.
  void RequireNoWhole(const std::string& key, const config::YamlNode& value) const;
  // Where a key in dots, or its first part, is given, alone or in a group; null where it is not.
  const std::string* Find(const std::string& key) const;

 private:
  std::map<std::string, std::string> leaves_;  // by the key in dots, where it is given
};

}  // namespace turbidock::batch
