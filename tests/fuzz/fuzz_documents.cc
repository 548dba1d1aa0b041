// Any bytes as one of the smaller files: refused, or read. The first byte says as which:
//
//   g gains over a scenario   s a tuning study   t a gate   b a gate's baseline
//   c a calibration's plan    p a published table   m a marker   v a vehicle's data

#include "experiments/config/yaml_fields.h"
#include "experiments/studies/estimate/estimate.h"
#include "experiments/studies/gate/baseline.h"
#include "experiments/studies/gate/gate_plan.h"
#include "experiments/studies/recognition/calibration.h"
#include "experiments/studies/recognition/table.h"
#include "experiments/studies/tuning/study.h"
#include "experiments/trial/scenario.h"
#include "sim/base/check.h"
#include "tests/fuzz/input_file.h"

using namespace turbidock;  // NOLINT(google-build-using-namespace)

namespace {

void Read(char kind, const std::string& file) {
  switch (kind) {
    case 'g':
      CheckFields(trial::LoadScenario("sea_night_active", {}, file), "");
      break;
    case 's':
      tuning::LoadStudy(file);
      break;
    case 't':
      gate::LoadGate(file);
      break;
    case 'b': {
      const gate::Baseline baseline = gate::LoadBaseline(file);
      TD_CHECK(!gate::BaselineText(baseline).empty(), "it can be written again");
      break;
    }
    case 'c':
      recognition::LoadCalibrationPlan(file);
      break;
    case 'p': {
      const auto rows = recognition::ReadRecognitionTable(file, recognition::MarkerKind::kActive);
      TD_CHECK(!rows.empty(), "a table has rows");
      for (const auto& row : rows) TD_CHECK(std::isfinite(row.fitness_mean), "numbers");
      break;
    }
    case 'm':
      CheckFields(estimate::LoadEstimateSettings(file, {}), "");
      break;
    case 'v': {
      trial::Scenario scenario;
      config::ReadLayers({{"", config::LoadYaml(file)}}, &scenario.vehicle);
      CheckFields(scenario.vehicle, "");
      break;
    }
    default:
      break;
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size == 0) return 0;
  const testing::InputFile file(data + 1, size - 1);
  try {
    Read(static_cast<char>(data[0]), file.path());
  } catch (const ConfigError&) {
  }
  return 0;
}
