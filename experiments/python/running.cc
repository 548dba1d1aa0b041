// A trial under way, stepped from Python.

// first: it declares what yaml_fields.h defines
#include "experiments/trial/scenario.h"

#include <unistd.h>

#include <optional>
#include <thread>
#include <utility>

#include "experiments/config/yaml_fields.h"
#include "experiments/python/bindings.h"
#include "experiments/trial/plugin_of.h"
#include "experiments/trial/running_trial.h"
#include "experiments/trial/series.h"
#include "experiments/trial/trial_files.h"

namespace turbidock::python {
namespace {

using trial::FrameRecord;

constexpr const char* kSteered = "steered";

// Between whoever steers a trial by hand and the controller that stands in for them.
struct Hand {
  control::Axes demand = control::Axes::Zero();
  control::Axes authority = control::Axes::Zero();
  control::Observation seen;
  control::Reference wanted;
  control::Axes given = control::Axes::Zero();
  bool in_control = false;  // in the last frame
};

// The controller of a trial that is steered from outside.
class SteeredController final : public control::Controller {
 public:
  explicit SteeredController(std::shared_ptr<Hand> hand) : hand_(std::move(hand)) {}
  void Observe(const control::Observation& seen) override { hand_->seen = seen; }
  control::Axes Demand(const control::Reference& wanted) override {
    hand_->wanted = wanted;
    demanded_ = true;
    return hand_->demand;
  }
  void OnCommandApplied(int64_t, const control::Axes& given) override {
    hand_->given = given;
    hand_->in_control = demanded_;
    demanded_ = false;
  }

 private:
  std::shared_ptr<Hand> hand_;
  bool demanded_ = false;
};

struct SteeredParams {
  control::PoseFilterParams pose_filter{.enabled = true};

  static void Fields(auto& self, auto&& field) {
    field("pose_filter", self.pose_filter, Finite(), "between estimate and hand");
  }
};

class Trial {
 public:
  // `steered`: what is asked for by hand, forces or volts; empty: the scenario's controller steers.
  Trial(trial::Scenario scenario, bool images, const std::string& steered)
      : images_(images), hand_(steered.empty() ? nullptr : std::make_shared<Hand>()) {
    if (hand_) {
      const AnyAllocation allocation = AllocationFor(steered);
      const auto make = [hand = hand_, allocation](const SteeredParams& params) {
        control::CustomController controller;
        controller.pose_filter = params.pose_filter;
        controller.allocation = allocation;
        controller.make = [=](const control::VehicleModel& vehicle, const ClockParams&) {
          hand->authority = AuthorityOf(allocation, vehicle);
          return std::make_unique<SteeredController>(hand);
        };
        return controller;
      };
      scenario.plugins.AddController(kSteered, SteeredParams(), make);
      if (steered == "volts") most_ = kNeutralVolts;
      config::ApplySet(std::string("controller=") + kSteered, &scenario, nullptr);
    }
    if (images && scenario.pose_source == trial::PoseSource::kTruePose)
      throw ConfigError("images", "with pose_source = true_pose nothing is drawn");
    saved_ = trial::SaveScenario(scenario);
    trial::TrialOptions options;
    options.whole_images = images;
    running_.emplace(scenario, options);
  }

  void Step(const py::object& demand) {
    RequireUnfinished();
    if (running_->ended()) throw py::value_error("this trial has ended: ask for its result()");
    if (hand_)
      hand_->demand = DemandOf(demand, "step()", most_);
    else if (!demand.is_none())
      throw py::value_error("step() takes a demand of a steered trial only");
    const py::gil_scoped_release free;
    kept_ = nullptr;
    running_->Step();
  }

  bool ended() const { return running_->ended(); }

  FrameRecord Now() const { return last_ ? *last_ : Last(); }

  // Left and right; the memory is theirs from now on.
  py::tuple Images() {
    if (!images_) throw py::value_error("images are made with images=True only");
    RequireHere();
    if (!kept_) {
      kept_ = std::make_shared<StereoImage>();
      running_->CopyLatestImages(kept_.get());
    }
    if (kept_->left.empty()) throw py::value_error("no image yet: call step()");
    const py::capsule owner(new std::shared_ptr<StereoImage>(kept_), [](void* memory) {
      delete static_cast<std::shared_ptr<StereoImage>*>(memory);
    });
    return py::make_tuple(View(kept_->left, owner), View(kept_->right, owner));
  }

  void Set(const std::string& assignment) {
    RequireUnfinished();
    running_->Set(assignment);
  }
  void Push(const py::object& given) {
    RequireUnfinished();
    const std::string rule = "push() takes three finite forces in N";
    const Eigen::Vector3d newton = NumbersOf(given, 3, rule);
    if (!newton.allFinite()) throw py::value_error(rule);
    running_->Push(newton);
  }

  const Hand& hand() const {
    if (!hand_) throw py::value_error("of a steered trial only");
    return *hand_;
  }

  // Result as JSON, log and scenario. Its last frame and images remain.
  py::tuple Finish() {
    RequireHere();
    if (result_.empty()) {
      last_ = Last();
      const trial::TrialResult result = running_->Finish();
      series_ = trial::Series::Of(result.log);
      result_ = trial::ResultJson(result);
    }
    return py::make_tuple(result_, series_, saved_);
  }

 private:
  // The OpenGL context is one thread's, and no fork takes its threads along.
  void RequireHere() const {
    if (getpid() != process_)
      throw std::runtime_error("this trial belongs to process " + std::to_string(process_) +
                               "; a forked process cannot go on with it");
    if (std::this_thread::get_id() != thread_)
      throw std::runtime_error("this trial belongs to another thread: step it where it was made");
  }
  void RequireUnfinished() const {
    RequireHere();
    if (last_) throw py::value_error("this trial is finished: its result has been asked for");
  }
  const FrameRecord& Last() const {
    if (running_->log().frames.empty()) throw py::value_error("no frame yet: call step()");
    return running_->log().frames.back();
  }

  bool images_;
  std::shared_ptr<Hand> hand_;
  double most_ = 1e6;  // of a demand; the allocation limits it
  std::optional<trial::RunningTrial> running_;
  std::shared_ptr<StereoImage> kept_;
  std::optional<FrameRecord> last_;  // once it is finished
  std::string saved_, result_;
  trial::Series series_;
  pid_t process_ = getpid();
  std::thread::id thread_ = std::this_thread::get_id();
};

Eigen::Vector4d Wxyz(const Pose& X) { return {X.q.w(), X.q.x(), X.q.y(), X.q.z()}; }

// An array that is the frame's own.
template <class Get>
auto Array(const Get& get) {
  return [get](const FrameRecord& frame) { return Copy(get(frame)); };
}

void AddFrame(py::module_* module) {
  using R = FrameRecord;
  py::class_<R>(*module, "Frame", "What is known of one camera frame.")
      .def_readonly("frame", &R::frame)
      .def_readonly("time_s", &R::time_s)
      .def_property_readonly("stage", [](const R& f) { return NameOf(f.stage); })
      .def_readonly("fitness", &R::fitness)
      .def_readonly("controlled", &R::controlled)
      .def_readonly("insertion_depth_m", &R::insertion_depth_m)
      .def_readonly("dock_force_newton", &R::dock_force_newton)
      .def_property_readonly("estimated_position", Array([](const R& f) { return f.est_X_HM.p; }),
                             "Of the marker in the camera head [m].")
      .def_property_readonly("estimated_quaternion_wxyz",
                             Array([](const R& f) { return Wxyz(f.est_X_HM); }))
      .def_property_readonly("true_position", Array([](const R& f) { return f.true_X_HM.p; }))
      .def_property_readonly("true_quaternion_wxyz",
                             Array([](const R& f) { return Wxyz(f.true_X_HM); }))
      .def_property_readonly("vehicle_position", Array([](const R& f) { return f.true_X_WB.p; }),
                             "Of the vehicle in the world [m].")
      .def_property_readonly("vehicle_quaternion_wxyz",
                             Array([](const R& f) { return Wxyz(f.true_X_WB); }))
      .def_property_readonly("velocity_mps", Array([](const R& f) { return f.true_V_WB_B.v; }),
                             "Of the vehicle, in its own axes.")
      .def_property_readonly("turn_rate_radps", Array([](const R& f) { return f.true_V_WB_B.w; }))
      .def_property_readonly("desired",
                             Array([](const R& f) { return control::ToAxes(f.desired); }),
                             "x, y, z [m], yaw [rad] that the procedure wants.")
      .def_property_readonly("demand", Array([](const R& f) { return f.demand; }),
                             "Of the controller, in its unit: surge, sway, heave, yaw.")
      .def_property_readonly("command_v", [](const R& f) {
        const auto& volts = f.command.volts;
        return View({static_cast<py::ssize_t>(volts.size())}, volts.data(), py::handle());
      });
}

}  // namespace

void AddRunning(py::module_* module) {
  AddFrame(module);
  py::class_<Trial>(*module, "Trial")
      .def(py::init<trial::Scenario, bool, std::string>(), py::arg("scenario"), py::arg("images"),
           py::arg("steered"))
      .def("step", &Trial::Step, py::arg("demand") = py::none(),
           "Lets the next frame's time pass. ValueError after the end.")
      .def_property_readonly("ended", &Trial::ended)
      .def_property_readonly("frame", &Trial::Now, "The last frame: truth, estimate, commands.")
      .def_property_readonly("images", &Trial::Images,
                             "What the estimator saw last, left and right, (height, width, 3), "
                             "RGB, without a copy.")
      .def("assign", &Trial::Set)
      .def("push", &Trial::Push,
           "A steady force on the vehicle, in the world's axes, until another.")
      .def_property_readonly(
          "seen", [](const Trial& t) { return t.hand().seen; },
          "Steered: the filtered pose that a controller would see.")
      .def_property_readonly(
          "wanted", [](const Trial& t) { return t.hand().wanted; },
          "Steered: where the procedure wants the marker.")
      .def_property_readonly(
          "given", [](const Trial& t) { return Copy(t.hand().given); },
          "Steered: what came of your demand in the last frame: less where "
          "thrusters saturate.")
      .def_property_readonly(
          "authority", [](const Trial& t) { return Copy(t.hand().authority); },
          "Steered: all that the vehicle has on each axis alone, in the "
          "demand's unit.")
      .def_property_readonly(
          "in_control", [](const Trial& t) { return t.hand().in_control; },
          "Steered: whether your demand counted in the last frame; not while "
          "the vehicle searches or drifts.")
      .def("finish", &Trial::Finish);
}

}  // namespace turbidock::python
