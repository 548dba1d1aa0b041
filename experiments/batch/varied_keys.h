#pragma once
// Which keys of the scenario are given values, so that none is given them twice: by a plan's `set`,
// its cases, grid, strata and draws, or by a study's gains.

#include <map>
#include <optional>
#include <string>

namespace turbidock::config {
struct YamlNode;
}

namespace turbidock::batch {

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
  // Where a key in dots, or its first part, is given; null where it is not.
  const std::string* Find(const std::string& leaf) const;

  std::map<std::string, std::string> leaves_;  // by the key in dots, where it is given
};

}  // namespace turbidock::batch
