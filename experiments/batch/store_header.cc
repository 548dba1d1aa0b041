#include "experiments/batch/store_header.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <sstream>

#include "experiments/config/yaml_fields.h"
#include "experiments/system/build_info.h"
#include "experiments/system/plain_text.h"

namespace turbidock::batch {
namespace {

// Notes every value below a node of one of two plans by its dotted key; those of a text of several
// lines, which a scenario is, by their own.
void Note(const config::YamlNode& node, const std::string& key, size_t side,
          PlanDifferences* values) {
  if (node.IsMap()) {
    const auto entries = node.Entries();
    const bool is_scenario = key == "resolved_scenarios" && entries.size() == 1;
    for (const auto& [name, child] : entries)
      Note(child, is_scenario ? "scenario" : JoinKey(key, name), side, values);
    return;
  }
  const std::string text = node.Text().value_or("");
  if (text.find('\n') != std::string::npos) {
    try {
      return Note(config::ParseYaml(text, key), key, side, values);
    } catch (const ConfigError&) {
      // a text for people
    }
  }
  values->try_emplace(key, std::array<std::string, 2>{"-", "-"}).first->second[side] =
      node.Canonical();
}

PlanDifferences DifferencesOf(const config::YamlNode& a, const config::YamlNode& b,
                              const std::string& key) {
  PlanDifferences differences;
  Note(a, key, 0, &differences);
  Note(b, key, 1, &differences);
  std::erase_if(differences, [](const auto& of) { return of.second[0] == of.second[1]; });
  return differences;
}

// The first of them: "cameras.delay_frames: 1 then, 4 now".
std::string SentenceOf(const PlanDifferences& differences, const Sides& sides) {
  if (differences.empty()) return "";
  const auto& [key, values] = *differences.begin();
  return fmt::format("{}: {} {}, {} {}", key, system::Shortened(values[0]), sides.a,
                     system::Shortened(values[1]), sides.b);
}

// Of a file as a resolved plan names it.
std::string PathIn(const config::YamlNode& plan, const std::string& name) {
  const auto folder = plan.Find(kFolderKey);
  if (!folder || !name.starts_with(".")) return name;
  return (std::filesystem::path(folder->Text().value_or("")) / name).lexically_normal();
}

// What two plans differ in of a key that both have, of a group only under the same names.
std::string CommonDifference(const config::YamlNode& before, const config::YamlNode& now,
                             const std::string& key, const Sides& sides) {
  const auto was = before.Find(key), is = now.Find(key);
  if (!was || !is) return "";
  if (!was->IsMap() || !is->IsMap()) return SentenceOf(DifferencesOf(*was, *is, key), sides);
  for (const auto& [name, value] : was->Entries()) {
    const auto other = is->Find(name);
    if (!other) continue;
    const std::string difference =
        SentenceOf(DifferencesOf(value, *other, key == "resolved_scenarios" ? "" : name), sides);
    if (!difference.empty())
      return key == "model_files" ? fmt::format("the file {} has changed", PathIn(now, name))
                                  : difference;
  }
  return "";
}

// Lines of a name and a digest.
std::string CodeDifference(const std::string& before, const std::string& now, const Sides& sides) {
  std::istringstream lines(before);
  for (std::string line; std::getline(lines, line);) {
    const std::string name = line.substr(0, line.rfind(' ') + 1);
    if (now.find(name) != std::string::npos && now.find(line + "\n") == std::string::npos)
      return "the code of " + name +
             (line.find(trial::kUnknownCode) == std::string::npos
                  ? "has changed"
                  : "cannot be told, and may have changed");
  }
  if (before == now) return "";
  return fmt::format("the plug-ins differ: '{}' {}, '{}' {}", system::OneLineOf(before), sides.a,
                     system::OneLineOf(now), sides.b);
}

// A resolved plan may be anywhere, with the files beside it.
std::string WithFolder(const std::string& plan, const std::string& line) {
  const size_t begin = plan.find(fmt::format("\n{}: ", kFolderKey));
  if (begin == std::string::npos) return plan;
  return plan.substr(0, begin) + line +
         plan.substr(std::min(plan.size(), plan.find('\n', begin + 1)));
}

// A plan, or a text that is none.
config::YamlNode Parsed(const std::string& plan) {
  try {
    return config::ParseYaml(plan, "plan");
  } catch (const ConfigError&) {
    return config::TextNode(plan, {nullptr, "plan", ""});
  }
}

}  // namespace

StoreHeader HeaderOf(const Plan& plan, const Shard& shard, const std::string& kind) {
  return {.kind = kind,
          .plan = plan.resolved(),
          .build = system::BuildId(),
          .code = plan.code(),
          .shard = shard,
          .trials = plan.trials(),
          .keys = plan.keys()};
}

PlanDifferences DifferencesOf(const std::string& a, const std::string& b) {
  return DifferencesOf(Parsed(a), Parsed(b), "");
}

std::string ChangeOf(const StoreHeader& before, const StoreHeader& now, const Sides& sides) {
  if (before.build != now.build) return "the builds differ: " + before.build + " and " + now.build;
  if (std::string code = CodeDifference(before.code, now.code, sides); !code.empty()) return code;
  const config::YamlNode was = Parsed(before.plan), is = Parsed(now.plan);
  for (const char* key : {"master_seed", "common_seeds", "model_files", "resolved_scenarios",
                          "cases", "strata", "random"})
    if (std::string difference = CommonDifference(was, is, key, sides); !difference.empty())
      return difference;
  return "";
}

std::string DifferenceOf(const StoreHeader& a, const StoreHeader& b, const Sides& sides) {
  if (a.kind != b.kind) return "one was written by " + a.kind + ", the other by " + b.kind;
  if (std::string change = ChangeOf(a, b, sides); !change.empty()) return change;
  PlanDifferences plans = DifferencesOf(a.plan, b.plan);
  for (const char* key : {kFolderKey, "description"}) plans.erase(key);  // which decide no trial
  if (!plans.empty()) return "the plans differ: " + SentenceOf(plans, sides);
  if (a.trials != b.trials)
    return fmt::format("{} trials {}, {} {}", a.trials, sides.a, b.trials, sides.b);
  return "";
}

std::string PlanMoved(const std::string& plan, const std::string& from, const std::string& to) {
  namespace fs = std::filesystem;
  const auto folder = config::ParseYaml(plan, "plan").Find(kFolderKey);
  if (!folder || from.empty() || from == to) return plan;
  const fs::path there =
      (fs::path(to) / fs::path(folder->Text().value_or("")).lexically_relative(from))
          .lexically_normal();
  std::error_code ignored;
  if (!fs::is_directory(there, ignored)) return plan;
  return WithFolder(plan, fmt::format("\n{}: {}", kFolderKey, YamlText(there.string())));
}

std::string SettingOf(const StoreHeader& header, const std::string& key) {
  const auto value = config::ParseYaml(header.plan, "plan").Find(key);
  return value ? value->OneLine() : "";
}

std::string OtherFile(const StoreHeader& before, const StoreHeader& now) {
  const config::YamlNode was = config::ParseYaml(before.plan, "plan"),
                         is = config::ParseYaml(now.plan, "plan");
  const auto first_missing = [](const config::YamlNode& from, const config::YamlNode& in) {
    const auto files = from.Find("model_files"), others = in.Find("model_files");
    if (files && others)
      for (const auto& [name, content] : files->Entries())
        if (!others->Find(name)) return name;
    return std::string();
  };
  if (const std::string name = first_missing(is, was); !name.empty())
    return "it reads the file " + PathIn(is, name) + " now, and did not before";
  if (const std::string name = first_missing(was, is); !name.empty())
    return "it read the file " + PathIn(was, name) + " before, and does not now";
  return "";
}

}  // namespace turbidock::batch
