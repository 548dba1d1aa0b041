#include "experiments/batch/varied_keys.h"

#include "experiments/config/yaml_node.h"
#include "sim/base/fields.h"

namespace turbidock::batch {
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

}  // namespace

void VariedKeys::Add(const std::string& key, const config::YamlNode& value) {
  ForEachLeaf(key, value, [this](const std::string& leaf, const config::YamlNode& at) {
    leaves_.emplace(leaf, at.Where() + at.path);
  });
}

const std::string* VariedKeys::Find(const std::string& leaf) const {
  auto there = leaves_.find(leaf);
  if (there == leaves_.end()) there = leaves_.lower_bound(leaf + ".");
  const bool is_there =
      there != leaves_.end() && (there->first == leaf || there->first.starts_with(leaf + "."));
  return is_there ? &there->second : nullptr;
}

std::optional<config::YamlNode> VariedKeys::FirstThere(const std::string& key,
                                                       const config::YamlNode& value) const {
  std::optional<config::YamlNode> first;
  ForEachLeaf(key, value, [&](const std::string& leaf, const config::YamlNode& at) {
    if (!first && Find(leaf)) first = at;
  });
  return first;
}

void VariedKeys::RequireNew(const std::string& key, const config::YamlNode& value) const {
  ForEachLeaf(key, value, [this](const std::string& leaf, const config::YamlNode& at) {
    if (const std::string* before = Find(leaf))
      at.Fail("this key is given twice, also by " + *before);
  });
}

}  // namespace turbidock::batch
