#pragma once
// Which keys of the scenario a plan gives each trial, so that none is given twice: by the grid, the
// strata, a draw.

#include <optional>
#include <set>
#include <string>

namespace turbidock::config {
struct YamlNode;
}

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
  // ConfigError about that key.
  void RequireNew(const std::string& key, const config::YamlNode& value) const;
  // Of a value that is given before these, in `set` or a case: ConfigError about the first key of
  // it that is there, or that is part of one.
  void RequireKept(const std::string& key, const config::YamlNode& value) const;

 private:
  std::set<std::string> leaves_;  // dotted
};

}  // namespace turbidock::farm
