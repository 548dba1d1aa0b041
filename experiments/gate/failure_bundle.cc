#include "experiments/gate/failure_bundle.h"

#include <fmt/format.h>

#include <cctype>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "experiments/output_path.h"
#include "experiments/subprocess.h"
#include "sim/base/check.h"

namespace turbidock::experiments {
namespace {

// A name that is a good file name everywhere.
std::string FileName(const std::string& name) {
  std::string out;
  for (const char c : name)
    out += std::isalnum(static_cast<unsigned char>(c)) || c == '-' ? c : '_';
  return out;
}

}  // namespace

std::string WriteFailureBundle(const std::string& folder, const GateCondition& condition,
                               const std::vector<std::string>& assignments,
                               const GateTrial& trial) {
  const std::filesystem::path bundle =
      std::filesystem::path(folder) / fmt::format("{}_{}", FileName(condition.name), trial.seed);
  std::vector<std::string> command = {std::filesystem::read_symlink("/proc/self/exe").string(),
                                      "run", condition.scenario_file};
  for (const auto* list : {&condition.assignments, &assignments})
    for (const std::string& assignment : *list)
      command.insert(command.end(), {"--set", assignment});
  command.insert(command.end(), {"--seed", std::to_string(trial.seed), "--out", bundle.string(),
                                 "--video", "--quiet"});
  Subprocess(command, "turbidock").Finish();

  std::ifstream file(bundle / "result.json");
  const auto result = nlohmann::json::parse(file);
  if (result["digest"] != trial.digest)
    throw SimulatorFault(fmt::format("{}: the trial does not repeat: digest {}, in the gate {}",
                                     bundle.string(), result["digest"].get<std::string>(),
                                     trial.digest));
  WriteWhole(bundle / "replay.txt",
             fmt::format("condition: {}\nseed: {}\noutcome: {}\ndigest: {}\n\n"
                         "turbidock run resolved.yaml --out replay --video\n",
                         condition.name, trial.seed, trial.outcome, trial.digest));
  return bundle.string();
}

}  // namespace turbidock::experiments
