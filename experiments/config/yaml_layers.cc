// Values from several places over each other, and what presets among them undid.

#include <fmt/ranges.h>

#include <algorithm>
#include <functional>
#include <iterator>

#include "experiments/config/yaml_fields.h"
#include "experiments/system/plain_text.h"

namespace turbidock::config {
namespace {

// The values that were given by these keys, a list as one.
std::map<std::string, std::string> ValuesGiven(const GroupRef& group, const Origins& origins) {
  std::map<std::string, std::string> values;
  for (const auto& [key, where] : origins) {
    YamlNode at{nullptr, kFromSet, key.substr(0, key.find('['))};
    if (at.path.empty() || values.contains(at.path)) continue;
    if (!std::holds_alternative<GroupRef>(internal::FieldAt(group, &at).value))
      values[at.path] = internal::TextAt(group, at.path);
  }
  return values;
}

// What the presets of a layer undid of the values before it: "a.b (3)" by its key.
struct Undone {
  std::vector<std::string> presets;  // "preset = large"
  std::map<std::string, std::string> values;
};

Undone UndoneBy(const std::vector<std::string>& presets, const Origins& layer,
                const std::map<std::string, std::string>& before, const GroupRef& group) {
  Undone undone;
  for (const std::string& preset : presets)
    if (layer.contains(preset))
      undone.presets.push_back(preset + " = " + internal::TextAt(group, preset));
  for (const auto& [key, text] : before)
    if (!layer.contains(key) && internal::TextAt(group, key) != text)
      undone.values[key] = fmt::format("{} ({})", key, system::Shortened(text));
  return undone;
}

std::string RemarkOn(const Undone& undone) {
  constexpr size_t kMostSaid = 3;
  std::vector<std::string> said;
  for (const auto& [key, text] : undone.values)
    if (said.size() < kMostSaid) said.push_back(text);
  const size_t rest = undone.values.size() - said.size();
  return fmt::format("{} also {} what was given before: {}{}", fmt::join(undone.presets, ", "),
                     undone.presets.size() == 1 ? "sets" : "set", fmt::join(said, ", "),
                     rest > 0 ? fmt::format(" and {} more", rest) : "");
}

}  // namespace

namespace internal {

// A list that is set as a whole has no elements of before.
void AddOrigins(const Origins& layer, Origins* all) {
  for (const auto& [key, where] : layer) {
    std::erase_if(*all,
                  [&, &key = key](const auto& old) { return old.first.starts_with(key + "["); });
    (*all)[key] = where;
  }
}

Origins ReadLayersOf(const std::vector<Assignment>& layers, const GroupRef& group,
                     GivenKeys* given) {
  const std::vector<std::string> presets = given ? PresetsIn(group) : std::vector<std::string>();
  Origins origins;
  std::vector<Undone> undone;
  for (const Assignment& layer : layers) {
    const bool may_undo =
        given && std::ranges::any_of(presets, [&layer](const std::string& preset) {
          return layer.key.empty() || preset == layer.key || preset.starts_with(layer.key + ".");
        });
    std::map<std::string, std::string> before;
    if (may_undo) before = ValuesGiven(group, given->origins);
    Origins set;
    ReadLayer(layer, group, &set);
    AddOrigins(set, &origins);
    if (!given) continue;
    for (Undone& earlier : undone)  // what is given again is as somebody wants it
      std::erase_if(earlier.values,
                    [&set](const auto& value) { return set.contains(value.first); });
    if (may_undo) undone.push_back(UndoneBy(presets, set, before, group));
    AddOrigins(set, &given->origins);
    if (layer.key.empty()) continue;
    for (const Assignment& leaf : LeavesOf({layer})) given->named.insert(leaf.key);
  }
  for (const Undone& each : undone)
    if (!each.values.empty()) given->remarks.push_back(RemarkOn(each));
  return origins;
}

Range RangeIn(const GroupRef& group, const std::string& key) {
  YamlNode at{nullptr, kFromSet, key};
  return FieldAt(group, &at).range;
}

}  // namespace internal

Assignment ParseAssignment(const std::string& text) {
  const size_t equals = text.find('=');
  const YamlNode at{nullptr, kFromSet, text.substr(0, equals)};
  if (equals == std::string::npos) at.Fail("must be KEY=VALUE");
  if (at.path.empty()) at.Fail("is no key; write group.key=value");
  return {at.path, ParseYamlValue(text.substr(equals + 1), at)};
}

std::vector<Assignment> ParseAssignments(const std::vector<std::string>& texts) {
  std::vector<Assignment> assignments;
  assignments.reserve(texts.size());
  for (const std::string& text : texts) assignments.push_back(ParseAssignment(text));
  return assignments;
}

std::vector<Assignment> LeavesOf(const std::vector<Assignment>& assignments) {
  std::vector<Assignment> leaves;
  for (const Assignment& each : assignments) {
    std::vector<Assignment> parts;
    if (each.value.IsMap())
      for (const auto& [name, part] : each.value.Entries())
        parts.push_back({JoinKey(each.key, name), part});
    if (parts.empty())
      leaves.push_back(each);
    else
      std::ranges::copy(LeavesOf(parts), std::back_inserter(leaves));
  }
  return leaves;
}

}  // namespace turbidock::config
