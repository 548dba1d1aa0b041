#pragma once
// The tags of an XML file, for what is to be known of a model before MuJoCo reads it.

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace turbidock::vehicle {

// An opening tag.
struct Tag {
  std::string name;
  std::vector<std::pair<std::string, std::string>> attributes;
  int line = 1;

  // Its value; empty without one.
  std::string attribute(std::string_view wanted) const;
};

// The tags of a well-formed file, in order; of any other whatever, for MuJoCo to refuse.
std::vector<Tag> TagsOf(std::string_view xml);

}  // namespace turbidock::vehicle
