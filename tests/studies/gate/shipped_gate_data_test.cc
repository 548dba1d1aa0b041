// The plan that measures what a planted regression really does flies the gate's own conditions.

#include <gtest/gtest.h>

#include "experiments/batch/plan.h"
#include "experiments/config/data_files.h"
#include "experiments/config/yaml_fields.h"
#include "experiments/studies/gate/gate_plan.h"

namespace turbidock::gate {
namespace {

TEST(ShippedGate, ItsConditionsAreFlownOnOtherSeeds) {
  const GatePlan gate = LoadGatePlan(config::AssetPath("gates/docking.yaml"));
  const batch::Plan plan = batch::LoadPlan(config::AssetPath("gates/conditions.yaml"));
  ASSERT_EQ(plan.cells(), 4);  // without the pool, the few trials beside
  for (int64_t cell = 0; cell < plan.cells(); ++cell) {
    const GateCondition& condition = gate.conditions[static_cast<size_t>(cell)];
    const batch::TrialSpec spec = plan.FirstOf(cell);
    EXPECT_EQ(spec.parameters.front().value, condition.name);
    EXPECT_EQ(config::SaveYaml(plan.ScenarioOf(spec)),
              config::SaveYaml(ScenarioOf(condition, spec.seed)));
  }
}

}  // namespace
}  // namespace turbidock::gate
