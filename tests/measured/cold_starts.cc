// Cold starts of the estimator: rendered pairs anywhere in the search range, one after the other.
//
//   cold_starts MARKER OPTICS MILK STARTS SEED     such as: cold_starts passive published 2.5 100 7
//
// A start has all balls in both images and F of at least 0.3 at the true pose. Its three exposures
// are seen in turn until the marker is detected for 8 frames, 30 at most. Prints a row a start,
// then how many were right (within 10 mm and 3 degrees), wrong and detected, and not detected, by F
// at the true pose: the rows of assets/measured/estimator_cold_starts.csv.

#include <fmt/format.h>

#include <array>
#include <cstdlib>
#include <exception>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "experiments/studies/recognition/recognition.h"
#include "experiments/trial/fixed_view.h"
#include "sim/base/units.h"
#include "vision/fitness.h"
#include "vision/gene.h"
#include "vision/hue_labels.h"
#include "vision/normalised_error.h"
#include "vision/rm_ga.h"

namespace turbidock::cold_starts {
namespace {

constexpr int kExposures = 3, kHeldFrames = 8, kMostFrames = 30;
constexpr double kLeastFitness = 0.3;

using Exposures = std::array<StereoImage, kExposures>;

bool AllInSight(const Pose& X_HM, const vision::MarkerParams& marker, const StereoRig& rig) {
  for (const vision::BallParams& ball : marker.balls)
    for (const Side side : kSides) {
      const MountedCamera& camera = rig[side];
      const Eigen::Vector3d p_CQ = camera.X_HC.Inverse() * (X_HM * ball.p_MQ_m);
      const vision::BallCircle circle = vision::ProjectBall(camera, p_CQ, ball.radius_m);
      if (circle.u_px < circle.radius_px || circle.u_px > camera.width_px - circle.radius_px ||
          circle.v_px < circle.radius_px || circle.v_px > camera.height_px - circle.radius_px)
        return false;
    }
  return true;
}

Pose DrawPose(const trial::Scenario& scenario, const StereoRig& rig, Rng* rng) {
  const vision::GeneMap map(scenario.plugins.ParamsOf<vision::RmGaOptions>().range);
  for (;;) {
    vision::GeneMap::Values values;
    for (size_t i = 0; i < values.size(); ++i)
      values[i] = rng->Uniform(map.low()[i], map.high()[i]);
    const Pose X_HM = vision::GeneMap::PoseOf(values);
    if (AllInSight(X_HM, scenario.marker, rig)) return X_HM;
  }
}

double FitnessAt(const Pose& X_HM, const trial::Scenario& scenario, const StereoRig& rig,
                 const StereoImage& seen) {
  vision::HueLabeller labeller(scenario.hue, scenario.marker);
  Stereo<Image1u8> labels;
  for (const Side side : kSides) labeller.Label(seen[side], &labels[side]);
  return vision::Fitness(scenario.marker, rig, labels).Evaluate(X_HM);
}

struct Counts {
  int starts = 0, right = 0, wrong = 0, roughly_right = 0, roughly_wrong = 0;
};

// Prints the start's row and counts it.
void Judge(int64_t start, const Pose& true_X_HM, double true_fitness, const Exposures& seen,
           vision::RmGa* search, Counts* counts) {
  PoseEstimate estimate;
  int frames = 0;
  for (int held = 0; frames < kMostFrames && held < kHeldFrames; ++frames) {
    estimate = search->Update(seen[static_cast<size_t>(frames % kExposures)]);
    held = estimate.detected ? held + 1 : 0;
  }
  const Eigen::Vector3d error_m = estimate.X_HM.p - true_X_HM.p;
  const double error_mm = units::MmFromM(error_m.norm());
  const double depth_error_mm = units::MmFromM(error_m.dot(true_X_HM.p.normalized()));
  const double error_deg = units::DegFromRad(AngleBetween(estimate.X_HM.q, true_X_HM.q));
  const auto sigma = [&](int first) {
    return estimate.covariance ? std::sqrt(estimate.covariance->diagonal().segment<3>(first).sum())
                               : NAN;
  };
  fmt::print("{},{:.3f},{:.3f},{:.3f},{},{},{:.2f},{:.2f},{:.2f},{:.2f},{:.2f},{:.2f}", start,
             true_X_HM.p.x(), true_fitness, estimate.fitness, frames, estimate.detected ? 1 : 0,
             error_mm, depth_error_mm, error_deg, units::MmFromM(sigma(0)),
             units::DegFromRad(sigma(3)),
             vision::NormalisedError2(estimate, true_X_HM).value_or(NAN));
  for (const double support : estimate.ball_support) fmt::print(",{:.2f}", support);
  fmt::print("\n");
  ++counts->starts;
  if (!estimate.detected) return;
  ++(error_mm <= 10 && error_deg <= 3 ? counts->right : counts->wrong);
  ++(error_mm <= 20 && error_deg <= 5 ? counts->roughly_right : counts->roughly_wrong);
}

void Run(recognition::MarkerKind marker, const std::string& optics, const std::string& milk,
         int starts, const std::string& seed) {
  const trial::Scenario scenario = recognition::RecognitionScenario(
      marker, {"cameras.optics=" + optics, "water.milk_ml_m3=" + milk, "trial.seed=" + seed});
  const StereoRig rig = scenario.rig.MakeRig();
  const SeedTree root(static_cast<uint64_t>(scenario.seed));
  Rng poses = root.Stream("cold starts");
  std::map<bool, Counts> by_fitness;  // whether at least 0.6
  fmt::print(
      "start,x_m,fitness_at_truth,fitness,frames,detected,error_mm,depth_error_mm,error_deg,"
      "claimed_mm,claimed_deg,normalised_error2,support_1,support_2,support_3\n");
  constexpr int kAtOnce = 8;
  std::optional<light::Water> water;  // the same for all
  for (int drawn = 0, used = 0; used < starts; drawn += kAtOnce) {
    std::vector<Pose> X_HM(kAtOnce);
    for (Pose& pose : X_HM) pose = DrawPose(scenario, rig, &poses);
    const std::vector<trial::FixedView> views = trial::DrawFixedViews(scenario, X_HM);
    if (!water) water = trial::WaterOf(views[0], scenario);
    for (int i = 0; i < kAtOnce && used < starts; ++i) {
      const trial::FixedView& view = views[static_cast<size_t>(i)];
      const SeedTree seeds(root.Stream(fmt::format("start {}", drawn + i)).NextU64());
      camera::StereoCamera cameras = trial::HoldView(view, *water, scenario, seeds);
      Exposures seen;
      for (int k = 0; k < kExposures; ++k) cameras.ExposeHeld(k, &seen[static_cast<size_t>(k)]);
      const double fitness = FitnessAt(view.X_HM, scenario, rig, seen[0]);
      if (fitness < kLeastFitness) continue;
      ++used;
      vision::RmGa search(scenario.plugins.ParamsOf<vision::RmGaOptions>(), scenario.marker,
                          scenario.hue, rig, seeds.Stream("search"));
      Judge(drawn + i, view.X_HM, fitness, seen, &search, &by_fitness[fitness >= 0.6]);
    }
  }
  for (const auto& [high, counts] : by_fitness)
    fmt::print("# {},{},{},{},{},{} ({}),{} ({}),{}\n", NameOf(marker), optics, milk,
               high ? "0.6 or more" : "0.3 to 0.6", counts.starts, counts.right,
               counts.roughly_right, counts.wrong, counts.roughly_wrong,
               counts.starts - counts.right - counts.wrong);
}

int Main(const std::vector<std::string>& arguments) {
  if (arguments.size() != 5) {
    fmt::print(stderr, "cold_starts active|passive published|modern_digital MILK STARTS SEED\n");
    return 2;
  }
  try {
    Run(arguments[0] == "active" ? recognition::MarkerKind::kActive
                                 : recognition::MarkerKind::kPassive,
        arguments[1], arguments[2], std::stoi(arguments[3]), arguments[4]);
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
  return 0;
}

}  // namespace
}  // namespace turbidock::cold_starts

int main(int argc, char** argv) { return turbidock::cold_starts::Main({argv + 1, argv + argc}); }
