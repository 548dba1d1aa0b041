#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

namespace turbidock::config {

// Where each value was last set: dotted key (and that of each group) -> "FILE:LINE: " or "--set ".
// A key that is absent has its default.
using Origins = std::map<std::string, std::string, std::less<>>;

// What an object was given key by key so far, a sentence for each value that a preset after it
// undid, and where all of it stands.
struct GivenKeys {
  std::vector<std::string> keys, remarks;
  Origins origins;
};

}  // namespace turbidock::config
