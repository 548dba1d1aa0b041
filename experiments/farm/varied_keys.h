#pragma once
// Which keys of the scenario are given values, so that none is given them twice: by a plan's `set`,
// its cases, grid, strata and draws, or by a study's gains.

#include <map>
#include <optional>
#include <string>

#include "experiments/config/yaml_node.h"

namespace turbidock::farm {

// A group of keys counts as each of its keys, an element of a list as a part of it: `start:
// {heading_rad: 0}` is `start.heading_rad`, `a[1]` is `a.1` and part of `a`. A part may be given
// after the whole, not the whole after the part, which would be lost.
class VariedKeys {
 public:
  void Add(const std::string& key, const config::YamlNode& value);
  // The first key of the value that is there already, or of which a part is.
  std::optional<config::YamlNode> FirstThere(const std::string& key,
                                             const config::YamlNode& value) const;
  // ConfigError about that key, which names where it is given before.
  void RequireNew(const std::string& key, const config::YamlNode& value) const;

 private:
  // What is there of a key in dots: the key, or its first part.
  const config::YamlNode* Find(const std::string& leaf) const;

  std::map<std::string, config::YamlNode> leaves_;  // by the key in dots
};

}  // namespace turbidock::farm
