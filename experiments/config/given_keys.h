#pragma once

#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace turbidock::config {

// Where each value was last set: dotted key (and that of each group) -> "FILE:LINE: " or "--set ".
// A key that is absent has its default.
using Origins = std::map<std::string, std::string, std::less<>>;

// Where all that an object was given so far stands, those keys of it that were named one by one and
// not in a file, and a sentence for each time that a preset undid some of it.
struct GivenKeys {
  Origins origins;
  std::set<std::string> named;
  std::vector<std::string> remarks;
};

}  // namespace turbidock::config
