#include "experiments/farm/varied_keys.h"

#include "experiments/config/yaml_node.h"
#include "sim/base/fields.h"

namespace turbidock::farm {
namespace {

// "a[1].b" as "a.1.b".
std::string Dotted(const std::string& key) {
  std::string dotted;
  for (const char c : key)
    if (c != ']') dotted += c == '[' ? '.' : c;
  return dotted;
}

template <class Do>
void ForEachLeaf(const std::string& key, const config::YamlNode& value, const Do& act) {
  if (!value.IsMap()) return act(Dotted(key), value);
  for (const auto& [name, part] : value.Entries()) ForEachLeaf(JoinKey(key, name), part, act);
}

[[noreturn]] void FailTwice(const config::YamlNode& at) {
  at.Fail(at.file == config::kFromSet ? "the plan gives each trial its own"
                                      : "this key is given twice");
}

}  // namespace

void VariedKeys::Add(const std::string& key, const config::YamlNode& value) {
  ForEachLeaf(key, value, [this](const std::string& leaf, const auto&) { leaves_.insert(leaf); });
}

std::optional<config::YamlNode> VariedKeys::FirstThere(const std::string& key,
                                                       const config::YamlNode& value) const {
  std::optional<config::YamlNode> first;
  ForEachLeaf(key, value, [&](const std::string& leaf, const config::YamlNode& at) {
    const auto part = leaves_.lower_bound(leaf + ".");
    const bool has_part = part != leaves_.end() && part->starts_with(leaf + ".");
    if (!first && (has_part || leaves_.contains(leaf))) first = at;
  });
  return first;
}

void VariedKeys::RequireNew(const std::string& key, const config::YamlNode& value) const {
  if (const auto at = FirstThere(key, value)) FailTwice(*at);
}

void VariedKeys::RequireKept(const std::string& key, const config::YamlNode& value) const {
  ForEachLeaf(key, value, [this](const std::string& leaf, const config::YamlNode& at) {
    for (size_t dot = leaf.find('.'); dot != std::string::npos; dot = leaf.find('.', dot + 1))
      if (leaves_.contains(leaf.substr(0, dot))) FailTwice(at);
    if (leaves_.contains(leaf)) FailTwice(at);
  });
}

}  // namespace turbidock::farm
