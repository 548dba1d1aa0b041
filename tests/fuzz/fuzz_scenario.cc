// Any text as a scenario: refused, or one that passes its own checks and comes back as it was
// saved.

#include "experiments/config/yaml_fields.h"
#include "experiments/trial/scenario.h"
#include "sim/base/check.h"

using namespace turbidock;  // NOLINT(google-build-using-namespace)

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  try {
    const trial::Scenario scenario = trial::ParseScenario(text, "input.yaml");
    CheckFields(scenario, "");
    const std::string saved = trial::SaveScenario(scenario);
    TD_CHECK(trial::SaveScenario(trial::ParseScenario(saved, "saved.yaml")) == saved,
             "what was saved is read as it was");
  } catch (const ConfigError&) {
  }
  return 0;
}
