#pragma once
// Every key of a scenario with values that it may have, found from the list of keys.

#include <string>
#include <vector>

#include "experiments/trial/scenario.h"

namespace turbidock::testing {

// A key, two values of it in a base scenario, and what has to be given before it.
struct KeyCase {
  std::string key;                         // "water.milk_ml_m3", "sea.waves[0].height_m", "sea"
  std::string type;                        // as the list of keys has it
  std::vector<std::string> before;         // assignments: "sea.waves=[{}, {}]"
  std::vector<std::string> values;         // as YAML in one line; two of them, or the only one
  std::string listed;                      // as the list of keys has it: "sea.waves[].height_m"
  std::vector<trial::Scenario> scenarios;  // LoadScenario of the base with each

  bool IsIn(const std::string& group) const {
    return key == group || key.starts_with(group + ".") || key.starts_with(group + "[");
  }
  bool is_plain_number() const {
    return type == "number" && listed.find("[]") == std::string::npos;
  }
  std::vector<std::string> Assignments(size_t value) const;  // `before`, then the key itself
};

// Cases of all keys, in the order of the list. Values differ from those that the base has, are
// allowed there and make different scenarios; a key for which there are none throws with its name.
const std::vector<KeyCase>& KeyCasesOf(const std::string& base);

// A file that may stand for this key of the type "file", made in `folder`; with other content for
// another `variant`.
std::string MakeFileFor(const std::string& key, const std::string& folder,
                        const std::string& name_without_suffix, int variant);

// Where two scenarios differ: the first key, with both values; empty where they are equal.
// `model_files` are left out.
std::string DifferenceOf(const trial::Scenario& a, const trial::Scenario& b);

// Assignments as YAML, a line each, behind `indent`; `name` is the key that they are below, and
// nothing at all where there are none.
std::string YamlBlock(const std::string& indent, const std::string& name,
                      const std::vector<std::string>& assignments);

}  // namespace turbidock::testing
