// The free vehicle's dynamics against closed forms and an independent integration.

#include <gtest/gtest.h>

#include <limits>

#include "tests/check/physics_checks.h"

namespace turbidock::check {
namespace {

TEST(Physics, EveryCheckPasses) {
  const std::vector<PhysicsCheck> checks = RunPhysicsChecks();
  ASSERT_EQ(checks.size(), 46u);
  for (const PhysicsCheck& check : checks) {
    EXPECT_TRUE(check.pass()) << check.name << " (" << check.reference << "): " << check.measured
                              << ", expected " << check.expected << " +- " << check.tolerance;
    if (check.relation == Relation::kNear && check.expected != 0) {
      EXPECT_LT(check.tolerance, 0.3 * std::abs(check.expected)) << check.name << " says nothing";
    }
  }
}

TEST(Physics, ACheckPassesWithinItsLimitsOnly) {
  PhysicsCheck check{.name = "", .reference = "", .unit = "", .expected = 2, .tolerance = 0.5};
  const auto passes = [&check](Relation relation, double measured) {
    check.relation = relation;
    check.measured = measured;
    return check.pass();
  };
  EXPECT_TRUE(passes(Relation::kNear, 2.5));
  EXPECT_FALSE(passes(Relation::kNear, 2.51));
  EXPECT_FALSE(passes(Relation::kNear, 1.49));
  EXPECT_TRUE(passes(Relation::kAtMost, 1));
  EXPECT_FALSE(passes(Relation::kAtMost, 2.01));
  for (const Relation relation : {Relation::kNear, Relation::kAtMost})
    EXPECT_FALSE(passes(relation, std::numeric_limits<double>::quiet_NaN()));
}

}  // namespace
}  // namespace turbidock::check
