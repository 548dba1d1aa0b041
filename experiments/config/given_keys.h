#pragma once

#include <string>
#include <vector>

namespace turbidock::config {

// What an object was given key by key so far, and a sentence for each value that a preset after it
// undid.
struct GivenKeys {
  std::vector<std::string> keys, remarks;
};

}  // namespace turbidock::config
