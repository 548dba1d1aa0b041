#include "experiments/batch/store_header.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <sstream>

#include "experiments/config/yaml_fields.h"
#include "experiments/system/build_info.h"

namespace turbidock::batch {
namespace {

// The first line in which two texts differ, without its comment; empty where they do not.
std::string FirstDifference(const std::string& before, const std::string& now) {
  std::istringstream left(before), right(now);
  const auto next = [](std::istringstream* lines) -> std::string {
    std::string line;
    if (!std::getline(*lines, line)) return "nothing";
    line.resize(std::min(line.size(), line.find("  # ")));
    return "'" + line.erase(0, line.find_first_not_of(' ')) + "'";
  };
  std::string x, y;
  do {
    x = next(&left);
    y = next(&right);
  } while (x == y && left);
  return x == y ? "" : x + " then, " + y + " now";
}

// Of a file as a resolved plan names it.
std::string PathIn(const config::YamlNode& plan, const std::string& name) {
  const auto folder = plan.Find(kFolderKey);
  if (!folder || !name.starts_with(".")) return name;
  return (std::filesystem::path(folder->Text().value_or("")) / name).lexically_normal();
}

// What the values of the same name in two groups differ in; empty where they do not.
std::string CommonDifference(const config::YamlNode& before, const config::YamlNode& now,
                             const std::string& key) {
  const auto was = before.Find(key), is = now.Find(key);
  if (!was || !is || !was->IsMap() || !is->IsMap()) return "";
  for (const auto& [name, value] : was->Entries())
    if (const auto other = is->Find(name); other && other->Canonical() != value.Canonical()) {
      const bool is_text = value.Text() && other->Text();
      const std::string difference = FirstDifference(is_text ? *value.Text() : value.OneLine(),
                                                     is_text ? *other->Text() : other->OneLine());
      if (!difference.empty())
        return key == "model_files" ? fmt::format("the file {} has changed", PathIn(now, name))
                                    : fmt::format("{}: {}", name, difference);
    }
  return "";
}

// Lines of a name and a digest.
std::string CodeDifference(const std::string& before, const std::string& now) {
  std::istringstream lines(before);
  for (std::string line; std::getline(lines, line);) {
    const std::string name = line.substr(0, line.rfind(' ') + 1);
    if (now.find(name) != std::string::npos && now.find(line + "\n") == std::string::npos)
      return "the code of " + name +
             (line.find(trial::kUnknownCode) == std::string::npos
                  ? "has changed"
                  : "cannot be told, and may have changed");
  }
  return before == now ? "" : "the plug-ins differ: " + FirstDifference(before, now);
}

// A resolved plan may be anywhere, with the files beside it.
std::string WithFolder(const std::string& plan, const std::string& line) {
  const size_t begin = plan.find(fmt::format("\n{}: ", kFolderKey));
  if (begin == std::string::npos) return plan;
  return plan.substr(0, begin) + line +
         plan.substr(std::min(plan.size(), plan.find('\n', begin + 1)));
}

// What decides no trial is left out.
std::string Deciding(const std::string& plan) {
  try {
    std::string text;
    const config::YamlNode node = config::ParseYaml(plan, "plan");
    for (const auto& [key, value] : node.Entries())
      if (key != kFolderKey && key != "description") text += key + ": " + value.Canonical() + "\n";
    return text;
  } catch (const ConfigError&) {  // no plan
    return plan;
  }
}

}  // namespace

StoreHeader HeaderOf(const Plan& plan, const Shard& shard) {
  return {.kind = "batch",
          .plan = plan.resolved(),
          .build = system::BuildId(),
          .code = plan.code(),
          .shard = shard,
          .trials = plan.trials(),
          .keys = plan.keys()};
}

std::string ChangeOf(const StoreHeader& before, const StoreHeader& now) {
  if (before.build != now.build) return "the builds differ: " + before.build + " and " + now.build;
  if (std::string code = CodeDifference(before.code, now.code); !code.empty()) return code;
  try {
    const config::YamlNode was = config::ParseYaml(before.plan, "plan"),
                           is = config::ParseYaml(now.plan, "plan");
    for (const char* key : {"master_seed", "common_seeds"})
      if (was.Find(key) && is.Find(key))
        if (const std::string difference =
                FirstDifference(was.Find(key)->OneLine(), is.Find(key)->OneLine());
            !difference.empty())
          return std::string(key) + ": " + difference;
    for (const char* key :
         {"model_files", "resolved_scenarios", "conditions", "cases", "strata", "random"})
      if (std::string difference = CommonDifference(was, is, key); !difference.empty())
        return difference;
  } catch (const ConfigError&) {  // of an older program: the texts still differ
  }
  return "";
}

std::vector<std::string> Differences(const StoreHeader& a, const StoreHeader& b) {
  std::vector<std::string> differences;
  if (a.kind != b.kind)
    differences.push_back("one was written by " + a.kind + ", the other by " + b.kind);
  if (const std::string change = ChangeOf(a, b); !change.empty())
    differences.push_back(change);
  else if (Deciding(a.plan) != Deciding(b.plan))
    differences.push_back("the plans differ: " + FirstDifference(a.plan, b.plan));
  else if (a.trials != b.trials)
    differences.push_back(fmt::format("{} trials then, {} now", a.trials, b.trials));
  return differences;
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
