#include "experiments/trial/identity.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <tuple>

#include "experiments/config/yaml_fields.h"
#include "sim/base/digest.h"

namespace turbidock::trial {

std::string IdentityOf(const Scenario& scenario, const std::string& program,
                       const std::string& renderer) {
  Scenario anywhere = scenario;
  anywhere.description.clear();
  std::map<std::string, std::string> contents;
  for (ModelFile& file : anywhere.model_files) {
    contents[file.file] = file.content;
    file.file = std::filesystem::path(file.file).filename();
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
  if (const std::string changed = ChangedModels(scenario); !changed.empty())
    throw ConfigError(changed);
}

}  // namespace turbidock::trial
