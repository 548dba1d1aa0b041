// Any text as a plan of few trials: refused, or a plan whose resolved text is the same plan.

#include "experiments/batch/plan.h"
#include "experiments/config/yaml_fields.h"
#include "sim/base/check.h"

using namespace turbidock;  // NOLINT(google-build-using-namespace)

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  try {
    // One trial a cell, or the checking of a million trials is what is timed.
    const batch::PlanOverrides few{.assignments = {}, .master_seed = {}, .seeds = 6};
    const batch::Plan plan(text, "input.yaml", few);
    const batch::Plan again(plan.resolved(), "resolved.yaml");
    TD_CHECK(again.hash() == plan.hash(), "the same plan");
    TD_CHECK(again.trials() == plan.trials(), "of as many trials");
  } catch (const ConfigError&) {
  }
  return 0;
}
