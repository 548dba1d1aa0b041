#pragma once
// A field's type and value in words, for messages, saved files and the table of keys.

#include <optional>
#include <string>
#include <vector>

#include "experiments/config/yaml_fields.h"

namespace turbidock::config::internal {

// Functions of a variant's kinds as one visitor.
template <class... Fs>
struct Overloaded : Fs... {
  using Fs::operator()...;
};
template <class... Fs>
Overloaded(Fs...) -> Overloaded<Fs...>;

std::string Commas(const std::vector<std::string>& parts);

// " in V s/m" of a key called kd_v_s_per_m; empty where a key names no unit.
std::string InUnit(const std::string& key);

// What a value of the field is: "number in m", "one of active, passive".
std::string TypeName(const Field& field);
std::string WithArticle(const std::string& type);

// A value that fits on its key's line; nothing for a group or a list of groups that has elements.
std::optional<std::string> ValueAsYaml(const Field& field);

}  // namespace turbidock::config::internal
