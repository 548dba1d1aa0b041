#include "experiments/trial/record_columns.h"

#include <fmt/format.h>

#include <cmath>
#include <type_traits>

namespace turbidock::trial {
namespace {

// A field and the groups around it.
struct Path {
  const Path* group = nullptr;
  const char* key = "";
  FieldPolicy policy;  // of the outermost group, but for the column's name
  const char* doc = "";

  std::string Key() const { return group ? group->Key() + "." + key : key; }
  std::string Column() const {
    std::string own = policy.column[0] ? policy.column : key;
    if (!group) return own;
    std::string name = group->Column();
    return name.replace(name.find("{}"), 2, own);
  }
  std::string Doc() const {
    return group ? std::string(group->doc) + (doc[0] ? ", " : "") + doc : doc;
  }
  Path Inner(const char* inner_key, const char* inner_doc) const {
    return {this, inner_key, {policy.storage, "", policy.json}, inner_doc};
  }
};

template <class V>
struct IsMap : std::false_type {};
template <class E, class V>
struct IsMap<std::map<E, V>> : std::true_type {};

// Calls leaf(path, value) for a member or, of a group, for each of its members; what leaf assigns
// to value becomes the member's.
template <class V, class Leaf>
void VisitMember(const Path& path, V& value, const Leaf& leaf) {
  using Plain = std::remove_const_t<V>;
  if constexpr (HasFields<Plain>) {
    Plain::Fields(value, [&](const char* key, auto&& inner, const auto&, const char* doc) {
      VisitMember(path.Inner(key, doc), inner, leaf);
    });
  } else if constexpr (std::is_same_v<Plain, std::optional<Contact>>) {
    Contact contact = value.value_or(Contact());
    bool has_any = false;
    Contact::Fields(contact, [&](const char* key, double& inner, const auto&, const char* doc) {
      std::optional<double> number = value ? std::optional(inner) : std::nullopt;
      leaf(path.Inner(key, doc), number);
      inner = number.value_or(inner);
      has_any |= number.has_value();
    });
    if constexpr (!std::is_const_v<V>) value = has_any ? std::optional(contact) : std::nullopt;
  } else if constexpr (IsMap<Plain>::value) {
    for (const auto& [key, name] : EnumNames<typename Plain::key_type>::kNames) {
      const auto found = value.find(key);
      double number = found == value.end() ? 0 : found->second;
      leaf(path.Inner(name, ""), number);
      if constexpr (!std::is_const_v<V>)
        if (number > 0) value[key] = number;
    }
  } else {
    leaf(path, value);
  }
}

template <class Record, class Leaf>
void VisitFields(Record& record, const Leaf& leaf) {
  TrialRecord::Fields(
      record, [&](const char* key, auto&& member, const FieldPolicy& policy, const char* doc) {
        VisitMember(Path{nullptr, key, policy, doc}, member, leaf);
      });
}

// The members that have a column.
template <class Record, class Leaf>
void VisitColumns(Record& record, const Leaf& leaf) {
  VisitFields(record, [&](const Path& path, auto& value) {
    if constexpr (!IsVectorOfStructs<std::remove_cvref_t<decltype(value)>>::value)
      if (path.policy.storage != Storage::kNowhere) leaf(path, value);
  });
}

template <class V>
constexpr const char* SqlType(Storage storage) {
  if (storage == Storage::kMetric || std::is_same_v<V, double>) return "REAL";
  return std::is_integral_v<V> ? "INTEGER NOT NULL" : "TEXT NOT NULL";
}

template <class V>
Cell CellAt(const TrialRecord& record, Storage storage, const V& value) {
  if (storage == Storage::kMetric && !record.ended()) return {};
  if constexpr (std::is_integral_v<V>)  // metrics are real numbers, whatever they count in
    if (storage == Storage::kMetric) return static_cast<double>(value);
  return CellOf(value);
}

}  // namespace

const std::vector<Column>& Columns() {
  static const std::vector<Column> columns = [] {
    std::vector<Column> list;
    const TrialRecord record;
    VisitColumns(record, [&](const Path& path, const auto& value) {
      using V = std::remove_cvref_t<decltype(value)>;
      list.push_back({path.Column(), path.policy.storage, SqlType<V>(path.policy.storage)});
    });
    return list;
  }();
  return columns;
}

std::vector<Cell> CellsOf(const TrialRecord& record) {
  std::vector<Cell> cells;
  cells.reserve(Columns().size());
  VisitColumns(record, [&](const Path& path, const auto& value) {
    cells.push_back(CellAt(record, path.policy.storage, value));
  });
  return cells;
}

TrialRecord RecordOf(const std::vector<Cell>& cells) {
  TD_CHECK(cells.size() == Columns().size(), "a cell for each column");
  TrialRecord record;
  size_t at = 0;
  // The outcome is the first field: whether it ended is known before the numbers are read.
  VisitColumns(record, [&](const Path& path, auto& value) {
    const Cell& cell = cells[at++];
    if (cell.is_null() && !record.ended()) return;
    try {
      ReadCell(cell, &value);
    } catch (const ConfigError& error) {
      throw ConfigError(path.Column(), error.what());
    }
  });
  return record;
}

const std::vector<Metric>& Metrics() {
  static const std::vector<Metric> metrics = [] {
    std::vector<Metric> list;
    for (size_t i = 0; i < Columns().size(); ++i) {
      if (Columns()[i].storage == Storage::kMetric)
        list.push_back({Columns()[i].name, [i](const TrialRecord& record) {
                          const Cell cell = CellsOf(record)[i];
                          return cell.is_null() ? std::nullopt : std::optional(cell.get<double>());
                        }});
    }
    return list;
  }();
  return metrics;
}

std::string ResultKeyTable() {
  std::string table = "| `result.json` | batch's table `trials` | Meaning |\n|---|---|---|\n";
  const auto code = [](const std::string& name) { return name.empty() ? "" : "`" + name + "`"; };
  const TrialRecord record;
  VisitFields(record, [&](const Path& path, const auto&) {
    const bool has_column = path.policy.storage != Storage::kNowhere;
    table += fmt::format("| {} | {} | {} |\n", code(path.policy.json ? path.Key() : ""),
                         code(has_column ? path.Column() : ""), path.Doc());
  });
  return table;
}

}  // namespace turbidock::trial
