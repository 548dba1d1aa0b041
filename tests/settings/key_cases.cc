#include "tests/settings/key_cases.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <stdexcept>

#include "experiments/config/data_files.h"
#include "experiments/config/yaml_fields.h"
#include "experiments/system/output_path.h"

namespace turbidock::testing {
namespace {

namespace fs = std::filesystem;
using Texts = std::vector<std::string>;

// What the keys' types and ranges do not say: of a key, or of each that ends so. In `before` "@"
// is the group or the list that the key is in.
struct Special {
  const char* key;
  Texts values;          // in place of made up ones
  Texts before{};        // has to be given too
  bool has_one = false;  // no second value is allowed
};
const std::vector<Special> kSpecial = {
    {"schema_version", {"1"}, {}, /*has_one=*/true},
    // three or four numbers or none; and without a place there is no attitude
    {"start.position_m", {"[-1, 0, -0.5]", "[-1.2, 0.1, -0.6]"}},
    {"start.quaternion_wxyz", {"[1, 0, 0, 0]", "[0, 0, 0, 1]"}, {"start.position_m=[-1, 0, -0.5]"}},
    {"start.velocity_mps", {"[0.1, 0, 0]", "[0, 0.1, 0]"}},
    {"start.turn_rate_rad_s", {"[0.1, 0, 0]", "[0, 0.1, 0]"}},
    // a measured current is in its place
    {"sea.current.file", {}, {"sea.current.surface_velocity_mps=[0, 0, 0]"}},
    {"station.mooring.natural_period_s", {"5", "6.5"}},  // 0, or 0.5 at least
    // as many volts as newtons, and none at 2.5 V
    {"table_volts", {"[0, 2.5, 5]", "[0, 2.5, 4.9]"}, {"@.table_thrust_newton=[-4, 0, 5]"}},
    {"table_thrust_newton", {"[-4, 0, 5]", "[-4, 0, 6]"}, {"@.table_volts=[0, 2.5, 5]"}},
    {"thrusters.effectiveness", {"[0.6, 1, 1, 1]", "[1, 1, 1, 0.9]"}},
    // added mass is symmetric
    {"added_mass_coupling",
     {"[{row: surge, column: sway, value: 0.1}, {row: sway, column: surge, value: 0.1}]",
      "[{row: surge, column: yaw, value: 0.1}, {row: yaw, column: surge, value: 0.1}]"}},
    {"added_mass_coupling[].value",
     {"0.2", "0.1"},
     {"@=[{row: surge, column: sway, value: 0.1}, {row: sway, column: surge, value: 0.2}]"},
     /*has_one=*/true},
    {"estimator.fiducial.tags[].q_MT_wxyz", {"[0, 1, 0, 0]", "[0, 0, 1, 0]"}},  // of length 1
    {"faults.lights[].light", {"red", "blue"}},
    {"faults.fish[].shines_as", {"red", "blue"}},
};

// Two elements of a list of groups, where two of defaults are not allowed or have too little.
const std::map<std::string, std::pair<std::string, std::string>> kElements = {
    {"lights.marker.balls", {"{name: red}", "{name: green}"}},  // before those of `marker`
    {"marker.balls", {"{name: one, hue_rad: 0}", "{name: other, hue_rad: 3}"}},
    {"added_mass_coupling", {"{row: surge, column: sway}", "{row: sway, column: surge}"}},
    {"linear_damping_coupling", {"{row: surge, column: sway}", "{row: sway, column: surge}"}},
    {"quadratic_damping_coupling", {"{row: surge, column: sway}", "{row: sway, column: surge}"}},
    {"thrusters.individual", {"{thruster: surge}", "{thruster: sway}"}},
    {"estimator.fiducial.tags", {"{id: 0}", "{id: 1}"}},
};

// What a trial's file has of it, and no trial follows from.
constexpr const char* kDecidesNothing = "trial.model_files";

bool IsOf(const std::string& key, const std::string& ending) {
  return key == ending || key.ends_with("." + ending);
}

const Special* SpecialOf(const std::string& key) {
  const auto found =
      std::ranges::find_if(kSpecial, [&key](const Special& each) { return IsOf(key, each.key); });
  return found == kSpecial.end() ? nullptr : &*found;
}

struct Bounds {
  double low = -1e9, high = 1e9;
};

// Of a range as the list of keys writes it: "in [0, 1]", "> 0", ">= 0".
Bounds BoundsOf(const std::string& range) {
  Bounds bounds;
  if (range.starts_with("in "))
    std::sscanf(range.c_str() + 4, "%lf, %lf", &bounds.low, &bounds.high);
  else if (range.starts_with(">"))
    bounds.low = std::stod(range.substr(range.find(' ')));
  else if (range.starts_with("<"))
    bounds.high = std::stod(range.substr(range.find(' ')));
  return bounds;
}

// Other numbers near this one.
std::vector<double> NumbersNear(double x, const std::string& range) {
  const auto [low, high] = BoundsOf(range);
  std::vector<double> numbers;
  const double step = x == 0 ? std::min({1.0, high - x, std::max(high - low, 0.0)}) : std::abs(x);
  for (const double share : {0.1, -0.1, 0.05, -0.05})
    if (const double y = x + share * step; y > low && y < high) numbers.push_back(y);
  return numbers;
}

Texts WholeNumbersNear(const std::string& now, const std::string& range) {
  const auto [low, high] = BoundsOf(range);
  Texts texts;
  const int64_t x = std::stoll(now);
  for (const int64_t y : {x + 1, x + 2, x - 1, x * 2, x * 3, x * 4, x / 2, x})
    if (static_cast<double>(y) >= low && static_cast<double>(y) <= high)
      texts.push_back(std::to_string(y));
  return texts;
}

// A list of numbers, or of rows of them, each moved a little.
Texts ListsNear(const config::YamlNode& now, const std::string& range) {
  Texts texts;
  for (size_t i = 0; i < 4; ++i) {
    std::string text;
    for (const config::YamlNode& element : now.Elements()) {
      std::string moved;
      if (element.IsList()) {
        const Texts inner = ListsNear(element, range);
        if (i < inner.size()) moved = inner[i];
      } else {
        const std::vector<double> near = NumbersNear(std::stod(*element.Text()), range);
        if (!near.empty()) moved = FormatNumber(near[i % near.size()]);
      }
      text += (text.empty() ? "" : ", ") + moved;
    }
    texts.push_back("[" + text + "]");
  }
  return texts;
}

Texts NamesIn(const std::string& type, const std::string& now) {
  Texts names;
  std::string rest = type.substr(std::string("one of ").size());
  while (!rest.empty()) {
    const size_t comma = rest.find(", ");
    if (const std::string name = rest.substr(0, comma); name != now) names.push_back(name);
    rest = comma == std::string::npos ? "" : rest.substr(comma + 2);
  }
  return names;
}

std::pair<std::string, std::string> ElementsOf(const std::string& list) {
  for (const auto& [ending, elements] : kElements)
    if (IsOf(list, ending)) return elements;
  return {"{}", "{}"};
}

// Of this process, and gone with it.
std::string ScratchFolder() {
  static const struct Folder {
    fs::path path = fs::path(::testing::TempDir()) / fmt::format("key_cases_{}", getpid());
    Folder() { fs::create_directories(path); }
    ~Folder() {
      std::error_code ignored;
      fs::remove_all(path, ignored);
    }
  } folder;
  return folder.path;
}

// What a key may be set to, where it is `now`.
Texts Candidates(const config::KeyDoc& doc, const std::string& now) {
  if (doc.type == "true or false") return {now == "true" ? "false" : "true", now};
  if (doc.type == "whole number") return WholeNumbersNear(now, doc.range);
  if (doc.type == "number") {
    Texts texts;
    for (const double x : NumbersNear(std::stod(now), doc.range)) texts.push_back(FormatNumber(x));
    return texts;
  }
  if (doc.type == "text") return {"some words", "\"other: #words\""};
  if (doc.type == "file") {
    Texts files;
    for (const int variant : {1, 2})
      files.push_back(
          MakeFileFor(doc.key, ScratchFolder(), fmt::format("{}{}", doc.key, variant), variant));
    return files;
  }
  if (doc.type.starts_with("one of ")) {
    Texts names = NamesIn(doc.type, now);
    names.push_back(now);
    return names;
  }
  if (doc.type == "list of groups") {
    const auto [one, other] = ElementsOf(doc.key);
    return {"[" + one + "]", "[" + one + ", " + other + "]", "[" + other + "]"};
  }
  if (doc.type.starts_with("list of "))
    return ListsNear(config::ParseYamlValue(now, {nullptr, "now", doc.key}), doc.range);
  throw std::logic_error(doc.key + ": no values for the type " + doc.type);
}

// The key of an element, "a[].b" as "a[0].b" or "a.1.b", and what has to be given before it.
void FillIn(const trial::Scenario& base, const Special* special, KeyCase* of) {
  static int filled = 0;
  std::string in;  // the list, or the group
  for (size_t at = of->key.find("[]"); at != std::string::npos; at = of->key.find("[]")) {
    in = of->key.substr(0, at);
    const auto [one, other] = ElementsOf(in);
    if (config::TextOf(base, in) == "[]")
      of->before.push_back(fmt::format("{}=[{}, {}]", in, one, other));
    of->key = (++filled % 2 == 0 ? in + "[0]" : in + ".1") + of->key.substr(at + 2);
  }
  if (!special) return;
  for (std::string given : special->before) {
    if (given.starts_with("@=")) of->before.clear(), given = in + given.substr(1);
    if (given.starts_with("@")) given = of->key.substr(0, of->key.rfind('.')) + given.substr(1);
    of->before.push_back(given);
  }
}

// The first two values that are allowed and make scenarios that differ.
void ChooseValues(const std::string& base, const Texts& candidates, KeyCase* of) {
  std::string why;
  for (const std::string& candidate : candidates) {
    of->values.push_back(candidate);
    try {
      const trial::Scenario made =
          trial::LoadScenario(base, of->Assignments(of->values.size() - 1));
      if (of->scenarios.empty() || of->IsIn(kDecidesNothing) ||
          !DifferenceOf(of->scenarios[0], made).empty()) {
        of->scenarios.push_back(made);
        if (of->values.size() == 2) return;
        continue;
      }
      why = "both values make the same scenario";
    } catch (const ConfigError& error) {
      why = error.what();
    }
    of->values.pop_back();
  }
  const Special* special = SpecialOf(of->listed);
  if (!special || !special->has_one || of->values.size() != 1)
    throw std::runtime_error("no two values: " + why);
}

// A group as a whole: the first of its keys that need nothing else, and one beside it; no seed,
// which a plan does not take.
std::optional<KeyCase> CaseOfGroup(const std::string& group, const std::vector<KeyCase>& cases) {
  std::vector<const KeyCase*> parts;
  std::string around;
  for (const KeyCase& each : cases) {
    const std::string in = each.key.substr(0, each.key.rfind('.') + 1);
    if (each.key.starts_with(group + ".") && each.before.empty() && each.values.size() == 2 &&
        each.key.find('[') == std::string::npos && each.key != "trial.seed" &&
        each.type != "group of keys" && (parts.empty() || (parts.size() == 1 && in == around))) {
      parts.push_back(&each);
      around = in;
    }
  }
  if (parts.empty()) return std::nullopt;
  KeyCase of{.key = group,
             .type = "group of keys",
             .before = {},
             .values = {},
             .listed = group,
             .scenarios = {}};
  for (size_t value = 0; value < 2; ++value) {
    std::string text = "{", closing = "}";
    for (size_t at = group.size() + 1; at < around.size(); at = around.find('.', at) + 1) {
      text += around.substr(at, around.find('.', at) - at) + ": {";
      closing += "}";
    }
    for (const KeyCase* part : parts)
      text += (part == parts[0] ? "" : ", ") + part->key.substr(around.size()) + ": " +
              part->values[value];
    of.values.push_back(text + closing);
  }
  return of;
}

std::vector<KeyCase> FindCases(const std::string& base) {
  const trial::Scenario scenario = trial::LoadScenario(base, {});
  std::vector<KeyCase> cases;
  std::vector<std::string> groups;
  std::string wrong;
  for (const config::KeyDoc& doc : trial::ScenarioKeys()) {
    if (doc.type == "group of keys") {
      groups.push_back(doc.key);
      continue;
    }
    KeyCase of{.key = doc.key,
               .type = doc.type,
               .before = {},
               .values = {},
               .listed = doc.key,
               .scenarios = {}};
    const Special* special = SpecialOf(doc.key);
    FillIn(scenario, special, &of);
    try {
      Texts candidates = special ? special->values : Texts();
      if (candidates.empty())
        candidates = Candidates(doc, config::TextOf(trial::LoadScenario(base, of.before), of.key));
      ChooseValues(base, candidates, &of);
      cases.push_back(of);
    } catch (const std::exception& error) {
      wrong += doc.key + ": " + error.what() + "\n";
    }
  }
  if (!wrong.empty()) throw std::runtime_error("say in key_cases.cc what they need:\n" + wrong);
  for (const std::string& group : groups)
    if (auto of = CaseOfGroup(group, cases)) {
      for (size_t value = 0; value < of->values.size(); ++value)
        of->scenarios.push_back(trial::LoadScenario(base, of->Assignments(value)));
      cases.push_back(*of);
    }
  return cases;
}

}  // namespace

std::vector<std::string> KeyCase::Assignments(size_t value) const {
  Texts all = before;
  all.push_back(key + "=" + values.at(value));
  return all;
}

const std::vector<KeyCase>& KeyCasesOf(const std::string& base) {
  static std::map<std::string, std::vector<KeyCase>> known;
  const auto [there, is_new] = known.try_emplace(base);
  if (is_new) there->second = FindCases(base);
  return there->second;
}

std::string MakeFileFor(const std::string& key, const std::string& folder,
                        const std::string& name_without_suffix, int variant) {
  const std::string base = (fs::path(folder) / name_without_suffix).string();
  const auto write = [](const std::string& file, const std::string& text) {
    std::ofstream(file) << text;
    return file;
  };
  const auto model = [](const std::string& name) {
    return system::ReadWhole(config::ModelPath(name));
  };
  const std::string comment = fmt::format("\n<!-- {} -->\n", variant);
  if (key == "trial.scene") return write(base + ".xml", model("pool_active.xml") + comment);
  if (key == "station.model") return write(base + ".xml", model("station.xml") + comment);
  if (key == "vehicle.model") {
    write(base + ".yaml", model("vehicle.yaml"));
    return write(base + ".xml", model("vehicle.xml") + comment);
  }
  if (key == "sea.current.file")
    return write(base + ".csv",
                 fmt::format("time_s,water_x_mps,water_y_mps\n0,0,0\n100,0,0.0{}\n", variant));
  if (key == "control.playback.file")
    return write(base + ".csv",
                 fmt::format("time_s,surge_newton,sway_newton,heave_newton,yaw_newton_m\n"
                             "0,0,0,0,0\n100,{},0,0,0\n",
                             variant));
  throw std::logic_error(key + " is a new key of the type file: make one for it here");
}

namespace {

std::string DifferenceIn(const config::Field& a, const config::Field& b, const std::string& path) {
  using config::internal::Overloaded;
  return std::visit(
      Overloaded{
          [&](const config::GroupRef& group) -> std::string {
            const auto& other = std::get<config::GroupRef>(b.value);
            for (size_t i = 0; i < group.fields.size(); ++i)
              if (const std::string found = DifferenceIn(group.fields[i], other.fields[i],
                                                         JoinKey(path, group.fields[i].key));
                  !found.empty())
                return found;
            return "";
          },
          [&](const config::ListRef& list) -> std::string {
            const auto& other = std::get<config::ListRef>(b.value);
            if (list.size() != other.size())
              return fmt::format("{} has {} and {} elements", path, list.size(), other.size());
            for (size_t i = 0; i < list.size(); ++i)
              if (const std::string found =
                      DifferenceIn(list.element(i), other.element(i), config::ElementPath(path, i));
                  !found.empty())
                return found;
            return "";
          },
          [&](const config::EnumRef& choice) -> std::string {
            const auto& other = std::get<config::EnumRef>(b.value);
            return choice.get() == other.get()
                       ? ""
                       : fmt::format("{}: {} and {}", path, choice.names[choice.get()],
                                     other.names[other.get()]);
          },
          [&](const InputFile* file) -> std::string {
            const auto* other = std::get<InputFile*>(b.value);
            return *file == *other ? ""
                                   : fmt::format("{}: {} and {}", path, file->path, other->path);
          },
          [&](const auto* value) -> std::string {
            const auto* other = std::get<std::remove_cvref_t<decltype(*value)>*>(b.value);
            return *value == *other ? "" : fmt::format("{}: {} and {}", path, *value, *other);
          }},
      a.value);
}

}  // namespace

std::string DifferenceOf(const trial::Scenario& a, const trial::Scenario& b) {
  trial::Scenario one = a, other = b;
  for (trial::Scenario* each : {&one, &other}) {
    each->model_files.clear();
  }
  return DifferenceIn({.value = config::GroupOf(&one)}, {.value = config::GroupOf(&other)}, "");
}

std::string YamlBlock(const std::string& indent, const std::string& name,
                      const std::vector<std::string>& assignments) {
  std::string text = assignments.empty() ? "" : indent + name + ":\n";
  for (const std::string& each : assignments) {
    const size_t equals = each.find('=');
    text +=
        fmt::format("{}  \"{}\": {}\n", indent, each.substr(0, equals), each.substr(equals + 1));
  }
  return text;
}

}  // namespace turbidock::testing
