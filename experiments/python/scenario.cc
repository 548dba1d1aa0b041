// Scenarios as objects: their keys with values as Python has them.

// first: it declares what yaml_fields.h defines
#include "experiments/trial/scenario.h"
#include "experiments/trial/switched_off.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "experiments/config/yaml_fields.h"
#include "experiments/python/bindings.h"
#include "experiments/trial/record_columns.h"
#include "experiments/trial/trial_record.h"

namespace turbidock::python {
namespace {

using trial::Scenario;

// The field of a key in words: "marker", "balls", "0". Refers into the scenario. ConfigError for a
// key that is not there.
config::Field FieldOf(Scenario* scenario, const std::vector<std::string>& words) {
  config::Field field{"", {}, "", config::GroupOf(scenario)};
  for (const std::string& word : words) {
    std::optional<config::Field> inner;
    if (const auto* group = std::get_if<config::GroupRef>(&field.value)) {
      const auto found = std::ranges::find(group->fields, word, &config::Field::key);
      if (found != group->fields.end()) inner = *found;
    } else if (const auto* list = std::get_if<config::ListRef>(&field.value)) {
      const bool is_index = word.find_first_not_of("0123456789") == std::string::npos;
      if (is_index && std::stoul(word) < list->size()) inner = list->element(std::stoul(word));
    }
    if (!inner) config::ValueOf(*scenario, fmt::format("{}", fmt::join(words, ".")));  // says why
    field = inner.value();
  }
  return field;
}

// A value; of a list a tuple; of a group its keys with their descriptions, of a list of groups
// these.
py::object ValueOf(const config::Field& field) {
  return std::visit(config::internal::Overloaded{
                        [](const config::EnumRef& choice) -> py::object {
                          return py::str(choice.names[choice.get()]);
                        },
                        [](const config::GroupRef& group) -> py::object {
                          py::dict docs;
                          for (const config::Field& each : group.fields)
                            docs[py::str(each.key)] = each.doc;
                          return docs;
                        },
                        [](const config::ListRef& list) -> py::object {
                          py::list values;
                          for (size_t i = 0; i < list.size(); ++i)
                            values.append(ValueOf(list.element(i)));
                          return list.of_groups ? py::object(values) : py::tuple(values);
                        },
                        [](const InputFile* file) -> py::object { return py::str(file->path); },
                        [](const auto* value) -> py::object { return py::cast(*value); }},
                    field.value);
}

// How Python's type checkers write a type of a result.
template <class T>
std::string TypeOf(const T&) {
  if constexpr (std::is_same_v<T, bool>) {
    return "bool";
  } else if constexpr (std::is_enum_v<T>) {
    std::string names;
    for (const auto& [value, name] : EnumNames<T>::kNames)
      names += (names.empty() ? "\"" : ", \"") + std::string(name) + "\"";
    return "Literal[" + names + "]";
  } else if constexpr (std::is_integral_v<T>) {
    return "int";
  } else if constexpr (std::is_floating_point_v<T>) {
    return "float";
  } else if constexpr (std::is_same_v<T, std::string>) {
    return "str";
  } else if constexpr (requires(T value) { value.has_value(); }) {
    return TypeOf(typename T::value_type()) + " | None";
  } else if constexpr (requires(T value) { value.push_back({}); }) {
    return "list[dict[str, Any]]";
  } else {
    return "dict[str, Any]";
  }
}

// Key, type and meaning of what a result has.
py::list ResultKeys() {
  py::list rows;
  trial::TrialRecord record;
  trial::TrialRecord::Fields(record, [&](const char* key, const auto& member,
                                         const trial::FieldPolicy& policy, const char* doc) {
    if (policy.json) rows.append(py::make_tuple(key, TypeOf(member), doc));
  });
  return rows;
}

// The columns of a batch's table that hold numbers with a fraction.
std::vector<std::string> RealColumns() {
  std::vector<std::string> names;
  for (const trial::Column& column : trial::Columns())
    if (std::string_view(column.sql_type) == "REAL") names.push_back(column.name);
  return names;
}

}  // namespace

void AddScenario(py::module_* module) {
  py::class_<Scenario>(*module, "Scenario")
      .def(py::init([](const std::string& name, const std::vector<std::string>& assignments,
                       const std::string& gains, const trial::Plugins& plugins) {
             return trial::LoadScenario(name, assignments, gains, plugins);
           }),
           py::arg("name"), py::arg("assignments"), py::arg("gains"), py::arg("plugins"))
      .def_static("parse", &trial::ParseScenario, py::arg("text"), py::arg("name"),
                  py::arg("plugins"))
      .def("set",
           [](Scenario* scenario, const std::vector<std::string>& assignments) {
             trial::Resolve(config::ParseAssignments(assignments), scenario);
           })
      // What presets undid since this was asked last, and what was named and is switched off.
      .def("remarks",
           [](Scenario* scenario) {
             std::vector<std::string> remarks = trial::RemarksOn(*scenario);
             scenario->given.remarks.clear();
             scenario->given.named.clear();
             return remarks;
           })
      .def("get",
           [](Scenario* scenario, const std::vector<std::string>& words) {
             return ValueOf(FieldOf(scenario, words));
           })
      .def_readwrite("plugins", &Scenario::plugins)
      .def("copy", [](const Scenario& scenario) { return scenario; })
      .def("yaml", &trial::SaveScenario);
  module->def("keys", [](const trial::Plugins& plugins) {
    py::list rows;
    for (const config::KeyDoc& key : trial::ScenarioKeys(plugins))
      rows.append(py::make_tuple(key.key, key.type, key.value, key.range, key.doc));
    return rows;
  });
  module->def("result_keys", &ResultKeys);
  module->def("real_columns", &RealColumns);
}

}  // namespace turbidock::python
