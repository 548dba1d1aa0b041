#include "experiments/studies/recognition/near_truth.h"

#include <algorithm>
#include <cmath>

#include "experiments/config/yaml_fields.h"
#include "sim/base/random.h"
#include "sim/camera/exposure.h"
#include "sim/camera/image_sensor.h"
#include "sim/camera/lens.h"
#include "sim/light/water.h"
#include "vision/fitness.h"
#include "vision/hue_labels.h"

namespace turbidock::recognition {
namespace {

// Beyond the balls' outer rings, what is looked at of the images.
constexpr double kReach = 1.5, kMargin_px = 25;

StereoRegion RegionOf(const trial::FixedView& view, const vision::MarkerParams& marker) {
  return view.rig.Each([&](const MountedCamera& camera) {
    PixelRegion region{camera.width_px, camera.height_px, 0, 0};
    for (const vision::BallParams& ball : marker.balls) {
      const vision::BallCircle circle = vision::ProjectBall(
          camera, camera.X_HC.Inverse() * (view.X_HM * ball.p_MQ_m), ball.radius_m);
      const double reach = kReach * circle.radius_px + kMargin_px;
      region.column_begin = std::min(region.column_begin, static_cast<int>(circle.u_px - reach));
      region.column_end = std::max(region.column_end, static_cast<int>(circle.u_px + reach));
      region.row_begin = std::min(region.row_begin, static_cast<int>(circle.v_px - reach));
      region.row_end = std::max(region.row_end, static_cast<int>(circle.v_px + reach));
    }
    region.column_begin = std::max(region.column_begin, 0);
    region.row_begin = std::max(region.row_begin, 0);
    region.column_end = std::min(region.column_end, camera.width_px);
    region.row_end = std::min(region.row_end, camera.height_px);
    return region;
  });
}

// The true pose, some within a few pixels of it, and many within the size of the marker.
std::vector<Pose> PosesAbout(const Pose& X_HM, double focal_px, Rng rng) {
  const double distance_m = X_HM.p.x(), px_m = distance_m / focal_px;
  const struct {
    int count;
    double across_m, along_m, eps;
  } clouds[] = {{150, px_m, 0.004, 0.01},
                {120, 2 * px_m, 0.01, 0.03},
                {300, 20 * px_m, 0.08 * distance_m, 0.06}};
  std::vector<Pose> poses = {X_HM};
  for (const auto& cloud : clouds)
    for (int i = 0; i < cloud.count; ++i) {
      const auto draw = [&](double deviation) { return deviation * rng.Normal(); };
      // in braces, for the order of arguments in parentheses is the compiler's
      const Eigen::Vector3d offset{draw(cloud.along_m), draw(cloud.across_m), draw(cloud.across_m)};
      const Eigen::Vector3d eps{draw(cloud.eps), draw(cloud.eps), draw(cloud.eps)};
      const Eigen::Quaterniond turn(std::sqrt(std::max(0.0, 1 - eps.squaredNorm())), eps.x(),
                                    eps.y(), eps.z());
      poses.push_back({X_HM.q * turn.normalized(), X_HM.p + offset});
    }
  return poses;
}

light::OpticsParams WithStrengths(light::OpticsParams params, double lamps, double rim,
                                  double core) {
  params.lamps.intensity_w_sr.setConstant(lamps);
  params.ball_lights.rim_radiance_w_m2_sr = rim;
  params.ball_lights.core_radiance_w_m2_sr = core;
  return params;
}

}  // namespace

NearTruth::NearTruth(const Recognition& recognition, int frames)
    : recognition_(recognition), frames_(frames), lights_(recognition.cells().size()) {
  for (const RecognitionCell& cell : recognition.cells()) {
    const trial::FixedView& view = recognition.view(cell);
    X_HM_.push_back(
        PosesAbout(view.X_HM, view.rig.left.fx_px, recognition.SeedsOf(cell).Stream("near_truth")));
  }
}

NearTruth::Source NearTruth::Shine(const trial::FixedView& view, const light::OpticsParams& params,
                                   const StereoRegion& region) {
  light::Water water(params, view.rig, view.surfaces, view.X_HE);
  light::RadianceStereo radiance;
  water.Apply(view.rendered, &radiance);
  Source source;
  source.mean = water.MeanRadiance(view.rendered);
  for (const Side side : kSides)
    source.rows[side] =
        Eigen::Map<const Eigen::ArrayXf>(radiance[side].row(region[side].row_begin),
                                         static_cast<ptrdiff_t>(3 * radiance[side].width()) *
                                             (region[side].row_end - region[side].row_begin));
  return source;
}

void NearTruth::Light() {
  for (size_t i = 0; i < lights_.size(); ++i) {
    const RecognitionCell& cell = recognition_.cells()[i];
    const trial::Scenario& scenario = recognition_.scenario(cell.marker);
    if (scenario.snow.flakes_per_m3 > 0) throw ConfigError("snow", "a calibration knows none");
    if (camera::StereoLens(scenario.lens, recognition_.view(cell).rig).on())
      throw ConfigError("lens", "a calibration knows ideal ones only");
    light::OpticsParams params = scenario.light;
    params.water.milk_ml_m3 = cell.milk_ml_m3;
    const std::string of = config::SaveYaml(WithStrengths(params, 0, 0, 0));
    CellLight& light = lights_[i];
    if (light.of == of) continue;
    const trial::FixedView& view = recognition_.view(cell);
    light = {};
    light.of = of;
    light.region = RegionOf(view, scenario.marker);
    if (params.lamps.enabled)
      light.lamps = Shine(view, WithStrengths(params, 1, 0, 0), light.region);
    if (params.ball_lights.enabled) {
      light.rim = Shine(view, WithStrengths(params, 0, 1, 0), light.region);
      light.core = Shine(view, WithStrengths(params, 0, 0, 1), light.region);
    }
  }
}

CellResult NearTruth::RunCell(size_t index) const {
  const RecognitionCell& cell = recognition_.cells()[index];
  const trial::Scenario& scenario = recognition_.scenario(cell.marker);
  const trial::FixedView& view = recognition_.view(cell);
  const CellLight& light = lights_[index];
  const SeedTree seeds = recognition_.SeedsOf(cell);
  camera::ImageSensor sensor(scenario.sensor, seeds.Stream("camera.left").NextU64(),
                             seeds.Stream("camera.right").NextU64(), view.rig.left.width_px);

  Stereo<Eigen::ArrayXf> radiance;
  Eigen::Array3d mean = Eigen::Array3d::Zero();
  const auto add = [&](const Source& source, const Eigen::Array3d& strength) {
    mean += strength * source.mean;
    for (const Side side : kSides) {
      const Eigen::ArrayXf& rows = source.rows[side];
      if (rows.size() == 0) continue;
      const Eigen::ArrayXf factors = strength.cast<float>().replicate(rows.size() / 3, 1);
      if (radiance[side].size() == 0) radiance[side].setZero(rows.size());
      radiance[side] += factors * rows;
    }
  };
  const light::BallLightParams& balls = scenario.light.ball_lights;
  add(light.lamps, scenario.light.lamps.intensity_w_sr.array());
  add(light.rim, Eigen::Array3d::Constant(balls.rim_radiance_w_m2_sr));
  add(light.core, Eigen::Array3d::Constant(balls.core_radiance_w_m2_sr));
  camera::AutoExposure exposure(scenario.sensor, scenario.image_clock().frame_s());
  if (exposure.on()) sensor.Amplify(exposure.For(mean));

  Stereo<Image1u8> labels;
  StereoImage seen;
  for (const Side side : kSides)
    seen[side].Resize(view.rig[side].width_px, view.rig[side].height_px);
  vision::HueLabeller labeller(scenario.hue, scenario.marker);
  std::vector<double> fitness(X_HM_[index].size());
  CellResult result{.cell = cell};
  std::vector<float> best_of_frames;
  for (int frame = 0; frame < frames_; ++frame) {
    for (const Side side : kSides) {
      sensor.DigitiseRegion(side, frame, light.region[side], radiance[side].data(), &seen[side]);
      labeller.Label(seen[side], light.region[side], &labels[side]);
    }
    vision::Fitness evaluation(scenario.marker, view.rig, labels);
    evaluation.Confine(light.region);
    evaluation.EvaluateAll(X_HM_[index], fitness);
    const auto best = std::max_element(fitness.begin(), fitness.end());
    best_of_frames.push_back(static_cast<float>(*best));
    result.last_X_HM = X_HM_[index][static_cast<size_t>(best - fitness.begin())];
    result.position_error_mean_m += (result.last_X_HM.p - view.X_HM.p).norm() / frames_;
  }
  SetFitness(std::move(best_of_frames), &result);
  return result;
}

}  // namespace turbidock::recognition
