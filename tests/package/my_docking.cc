// turbidock with a controller and a pose estimator of one's own: every subcommand knows them.
//
//   my_docking run sea_night_active --set control.use=damped_p
//   my_docking list keys | grep damped_p

#include <algorithm>
#include <optional>

#include "experiments/app/main.h"
#include "experiments/trial/plugin_of.h"
#include "vision/rm_ga.h"

namespace {

using namespace turbidock;

// A proportional controller with damping.
class DampedP final : public control::Controller {
 public:
  struct Params {
    double gain_newton_per_m = 60, damping_newton_s_per_m = 50, yaw_newton_m_per_rad = 0.4;
    control::PoseFilterParams pose_filter{.enabled = true};  // whose rate the damping needs

    static void Fields(auto& self, auto&& field) {
      field("gain_newton_per_m", self.gain_newton_per_m, InRange(0, 1e3), "force per error");
      field("damping_newton_s_per_m", self.damping_newton_s_per_m, InRange(0, 1e3),
            "force per speed");
      field("yaw_newton_m_per_rad", self.yaw_newton_m_per_rad, InRange(0, 50),
            "moment per error of the heading");
      field("pose_filter", self.pose_filter, Finite(), "filter between estimate and controller");
    }
  };
  DampedP(const Params& params, const ClockParams&) : params_(params) {}

  void Observe(const control::Observation& seen) override { seen_ = seen; }
  control::Axes Demand(const control::Reference& wanted) override {
    const control::Axes error = seen_.position - wanted.position;
    const control::Axes rate = seen_.rate.value_or(control::Axes::Zero());
    control::Axes force = params_.gain_newton_per_m * error + params_.damping_newton_s_per_m * rate;
    force[control::kSurge] = std::clamp(force[control::kSurge], -2.0, 2.0);
    force[control::kYaw] = params_.yaw_newton_m_per_rad * error[control::kYaw];
    return force;
  }
  void OnCommandApplied(int64_t, const control::Axes&) override {}

 private:
  Params params_;
  control::Observation seen_;
};

// RM-GA that does not believe an estimate far from the last one, once.
class Cautious final : public vision::PoseEstimator {
 public:
  struct Params {
    double largest_jump_m = 0.3;
    static void Fields(auto& self, auto&& field) {
      field("largest_jump_m", self.largest_jump_m, Above(0),
            "largest jump of the pose from one frame to the next");
    }
  };
  Cautious(const Params& params, const trial::EstimatorSetup& setup)
      : params_(params), search_({}, setup.marker, setup.hue, setup.rig, setup.rng) {}

  const PoseEstimate& Update(const StereoImage& seen) override {
    const PoseEstimate& now = search_.Update(seen);
    const bool jumped = last_ && (now.X_HM.p - last_->p).norm() > params_.largest_jump_m;
    last_ = now.X_HM;
    estimate_ = now;
    if (jumped) estimate_.fitness = std::min(estimate_.fitness, 0.0);
    return estimate_;
  }
  void Reset() override {
    search_.Reset();
    last_.reset();
  }
  std::optional<StereoRegion> RegionOfInterest() const override {
    return search_.RegionOfInterest();
  }
  std::string_view name() const override { return "cautious"; }

 private:
  Params params_;
  vision::RmGa search_;
  PoseEstimate estimate_;
  std::optional<Pose> last_;
};

}  // namespace

int main(int argc, char** argv) {
  turbidock::trial::Plugins plugins;
  plugins.AddController<DampedP>("damped_p");
  plugins.AddEstimator<Cautious>("cautious");
  return turbidock::Main(argc, argv, plugins);
}
