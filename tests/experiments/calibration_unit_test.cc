#include "experiments/recognition/calibration.h"

#include <gtest/gtest.h>

#include "experiments/data_files.h"
#include "experiments/yaml_fields.h"
#include "sim/base/random.h"

namespace turbidock::experiments {
namespace {

FreeParameter Parameter(double low, double high, bool logarithmic) {
  FreeParameter p;
  p.key = "water.milk_ml_m3";
  p.low = p.start = low;
  p.high = high;
  p.logarithmic = logarithmic;
  return p;
}

TEST(FreeParameter, PlacesAndValuesAreInverse) {
  for (const bool logarithmic : {false, true}) {
    const FreeParameter p = Parameter(0.5, 32, logarithmic);
    EXPECT_DOUBLE_EQ(p.ValueAt(0), 0.5);
    EXPECT_DOUBLE_EQ(p.ValueAt(1), 32);
    for (const double place : {0.1, 0.5, 0.77})
      EXPECT_NEAR(p.PlaceOf(p.ValueAt(place)), place, 1e-12);
  }
  EXPECT_DOUBLE_EQ(Parameter(0.5, 32, true).ValueAt(0.5), 4);
}

TEST(FreeParameter, RefusesAnEmptyRange) {
  EXPECT_THROW(CheckFields(Parameter(2, 1, false), "p"), ConfigError);
  EXPECT_THROW(CheckFields(Parameter(0, 1, true), "p"), ConfigError);
  FreeParameter outside = Parameter(0, 1, false);
  outside.start = 2;
  EXPECT_THROW(CheckFields(outside, "p"), ConfigError);
}

// The bundled plan's keys are a scenario's, and what calibrate writes is read back as it was.
TEST(CalibrationPlan, WritesKeysThatAScenarioReads) {
  const CalibrationPlan plan = LoadCalibrationPlan(AssetPath("calibration.yaml"));
  std::vector<double> values;
  std::vector<std::string> assignments;
  for (const FreeParameter& p : plan.parameters) {
    values.push_back(p.ValueAt(0.3));
    assignments.push_back(p.Assignment(values.back()));
    EXPECT_FALSE(p.source.empty()) << p.key;
  }
  Scenario read = RecognitionScenario(MarkerKind::kPassive, {});
  ReadFields(ParseYaml(CalibratedYaml(plan, values), "optics.yaml"), &read, nullptr);
  EXPECT_EQ(SaveYaml(read), SaveYaml(RecognitionScenario(MarkerKind::kPassive, assignments)));
}

// Light on the cropped cameras is the same part of the light on the whole ones.
TEST(CropToMarker, ShowsTheSame) {
  const Scenario scenario = RecognitionScenario(MarkerKind::kPassive, {"water.milk_ml_m3=20"});
  const FixedView whole = DrawFixedViews(scenario, {Pose::Translation(0.8, 0, 0)}).front();
  const FixedView crop = CropToMarker(whole);
  const SeedTree seeds(1);
  const FixedCameras all(whole, scenario, seeds), part(crop, scenario, seeds);
  const Image3f &a = all.radiance().right, &b = part.radiance().right;
  const int u0 = static_cast<int>(whole.rig.right.cx_px - crop.rig.right.cx_px);
  const int v0 = static_cast<int>(whole.rig.right.cy_px - crop.rig.right.cy_px);
  ASSERT_GT(u0, 0);
  ASSERT_LT(b.width(), a.width() / 2);
  double most = 0;
  for (int v = 0; v < b.height(); ++v)
    for (int u = 0; u < b.width(); ++u)
      for (int k = 0; k < 3; ++k) {
        const float x = a.at(u0 + u, v0 + v)[k], y = b.at(u, v)[k];
        // light is interpolated in tiles, which lie elsewhere in a smaller image
        EXPECT_NEAR(x, y, 0.1f * x + 1e-4f) << u << " " << v;
        most = std::max(most, static_cast<double>(x));
      }
  EXPECT_GT(most, 1e-3);
}

}  // namespace
}  // namespace turbidock::experiments
