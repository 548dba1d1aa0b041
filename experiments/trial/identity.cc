#include "experiments/trial/identity.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <tuple>
#include <vector>

#include "experiments/config/yaml_fields.h"
#include "sim/base/digest.h"

namespace turbidock::trial {
namespace {

namespace fs = std::filesystem;

// The folder that all own files are in: below it their places count, it itself may be anywhere.
fs::path CommonFolder(const std::vector<ModelFile>& files) {
  fs::path common;
  for (const ModelFile& file : files) {
    if (!fs::path(file.file).is_absolute()) continue;
    if (common.empty()) common = fs::path(file.file).parent_path();
    while (!file.file.starts_with((common / "").string()) && common != common.root_path())
      common = common.parent_path();
  }
  return common;
}

}  // namespace

std::string IdentityOf(const Scenario& scenario, const std::string& program,
                       const std::string& renderer) {
  Scenario anywhere = scenario;
  anywhere.description.clear();
  const fs::path folder = CommonFolder(anywhere.model_files);
  std::map<std::string, std::string> contents;
  for (ModelFile& file : anywhere.model_files) {
    contents[file.file] = file.content;
    if (const fs::path path = file.file; path.is_absolute())
      file.file = path.lexically_relative(folder);
  }
  std::ranges::sort(anywhere.model_files, {},
                    [](const ModelFile& file) { return std::tie(file.file, file.content); });
  config::ForEachFileIn(&anywhere, [&contents](InputFile* file) {
    if (const auto known = contents.find(file->path); known != contents.end())
      file->path = known->second;
  });
  Digest digest;
  for (const std::string& part :
       {SaveScenario(anywhere), program, scenario.plugins.CodeInUse(), renderer})
    digest.Add(part);
  return digest.Hex();
}

void RequireSameFiles(const Scenario& scenario) {
  if (scenario.model_files.empty()) return;
  const std::vector<ModelFile> now = ModelFilesOf(scenario);
  if (const std::string changed = ChangedModels(scenario, now); !changed.empty())
    throw ConfigError(changed);
  // One that has appeared takes the place of another.
  for (const ModelFile& file : now)
    if (std::ranges::count(scenario.model_files, file.file, &ModelFile::file) == 0)
      throw ConfigError(file.file + " was not there when the trials were begun");
}

}  // namespace turbidock::trial
