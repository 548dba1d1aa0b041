// A trial under way, stepped from Python.

// first: it declares what yaml_fields.h defines
#include "experiments/trial/scenario.h"

#include <unistd.h>

#include <array>
#include <optional>
#include <thread>
#include <utility>

#include "experiments/config/yaml_fields.h"
#include "experiments/python/bindings.h"
#include "experiments/trial/plugins.h"
#include "experiments/trial/running_trial.h"
#include "experiments/trial/series.h"
#include "experiments/trial/trial_files.h"

namespace turbidock::python {
namespace {

constexpr const char* kSteered = "steered";

// Between whoever steers a trial by hand and the law that stands in for them.
struct Hand {
  control::Axes demand = control::Axes::Zero();
  control::Axes authority = control::Axes::Zero();
  control::Observation seen;
  control::Reference wanted;
  control::Axes given = control::Axes::Zero();
  bool in_control = false;  // in the last frame
};

// The law of a trial that is steered from outside.
class SteeredLaw final : public control::Controller {
 public:
  explicit SteeredLaw(std::shared_ptr<Hand> hand) : hand_(std::move(hand)) {}
  void Observe(const control::Observation& seen) override { hand_->seen = seen; }
  control::Axes Demand(const control::Reference& wanted) override {
    hand_->wanted = wanted;
    demanded_ = true;
    return hand_->demand;
  }
  void Given(int64_t, const control::Axes& given) override {
    hand_->given = given;
    hand_->in_control = demanded_;
    demanded_ = false;
  }

 private:
  std::shared_ptr<Hand> hand_;
  bool demanded_ = false;
};

class SteeredPlugin final : public trial::LawPlugin {
 public:
  SteeredPlugin(std::shared_ptr<Hand> hand, const AnyAllocation& allocation)
      : hand_(std::move(hand)), allocation_(allocation) {
    Reset();
  }
  config::GroupRef Group() override {
    config::GroupRef group;
    group.fields.push_back(
        {"pose_filter", Finite(), "between estimate and hand", config::GroupOf(&filter_)});
    return group;
  }
  void Check(const std::string& path) const override {
    CheckFields(filter_, JoinKey(path, "pose_filter"));
  }
  void Reset() override {
    filter_ = {};
    filter_.enabled = true;
  }
  std::unique_ptr<trial::LawPlugin> Copy() const override {
    return std::make_unique<SteeredPlugin>(*this);
  }
  control::OwnLaw Law() const override {
    control::OwnLaw law;
    law.make = [hand = hand_, allocation = allocation_](const control::VehicleModel& vehicle,
                                                        const ClockParams&) {
      hand->authority = AuthorityOf(allocation, vehicle);
      return std::make_unique<SteeredLaw>(hand);
    };
    law.pose_filter = filter_;
    law.allocation = allocation_;
    return law;
  }

 private:
  std::shared_ptr<Hand> hand_;
  AnyAllocation allocation_;
  control::PoseFilterParams filter_;
};

// What is known of one frame, in arrays that point into it.
struct Frame {
  trial::FrameRecord record;
  std::array<double, 4> est_q{}, true_q{}, world_q{}, desired{}, demand{};

  explicit Frame(const trial::FrameRecord& of) : record(of) {
    const auto wxyz = [](const Pose& X) { return std::array{X.q.w(), X.q.x(), X.q.y(), X.q.z()}; };
    est_q = wxyz(of.est_X_HM);
    true_q = wxyz(of.true_X_HM);
    world_q = wxyz(of.true_X_WB);
    desired = {of.desired.x_m, of.desired.y_m, of.desired.z_m, of.desired.yaw_rad};
    std::copy(of.demand.begin(), of.demand.end(), demand.begin());
  }
};

class Trial {
 public:
  // `steered`: what is asked for by hand, forces or volts; empty: the scenario's law steers.
  Trial(trial::Scenario scenario, bool images, const std::string& steered)
      : images_(images), hand_(steered.empty() ? nullptr : std::make_shared<Hand>()) {
    if (hand_) {
      scenario.plugins.Add(kSteered,
                           std::make_unique<SteeredPlugin>(hand_, AllocationFor(steered)));
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
    const std::shared_ptr<StereoImage> before = std::exchange(kept_, nullptr);
    running_->Step();
    const bool arrived = !running_->seen().left.empty();
    if (before && !arrived) kept_ = before;
  }

  bool ended() const { return running_->ended(); }

  Frame Now() const { return Frame(last_ ? *last_ : Last()); }

  // Left and right; the memory is theirs from now on.
  py::tuple Images() {
    if (!images_) throw py::value_error("images are made with images=True only");
    RequireHere();
    if (!kept_) {
      kept_ = std::make_shared<StereoImage>();
      running_->CopySeen(kept_.get());
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
  void Push(const Eigen::Vector3d& newton) {
    RequireUnfinished();
    if (!newton.allFinite()) throw py::value_error("push() takes three finite forces in N");
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
  const trial::FrameRecord& Last() const {
    if (running_->log().frames.empty()) throw py::value_error("no frame yet: call step()");
    return running_->log().frames.back();
  }

  bool images_;
  std::shared_ptr<Hand> hand_;
  double most_ = 1e6;  // of a demand; the allocation limits it
  std::optional<trial::RunningTrial> running_;
  std::shared_ptr<StereoImage> kept_;
  std::optional<trial::FrameRecord> last_;  // once it is finished
  std::string saved_, result_;
  trial::Series series_;
  pid_t process_ = getpid();
  std::thread::id thread_ = std::this_thread::get_id();
};

template <class Get>
auto Part(const std::vector<py::ssize_t>& shape, const Get& get) {
  return [=](const py::object& self) { return View(shape, get(*self.cast<Frame*>()), self); };
}

}  // namespace

void AddRunning(py::module_* module) {
  py::class_<Frame>(*module, "Frame", "What is known of one camera frame.")
      .def_property_readonly("frame", [](const Frame& f) { return f.record.frame; })
      .def_property_readonly("time_s", [](const Frame& f) { return f.record.time_s; })
      .def_property_readonly("stage", [](const Frame& f) { return NameOf(f.record.stage); })
      .def_property_readonly("fitness", [](const Frame& f) { return f.record.fitness; })
      .def_property_readonly("controlled", [](const Frame& f) { return f.record.controlled; })
      .def_property_readonly("insertion_depth_m",
                             [](const Frame& f) { return f.record.insertion_depth_m; })
      .def_property_readonly("dock_force_newton",
                             [](const Frame& f) { return f.record.dock_force_newton; })
      .def_property_readonly("estimated_position",
                             Part({3}, [](const Frame& f) { return f.record.est_X_HM.p.data(); }),
                             "Of the marker in the camera head [m].")
      .def_property_readonly("estimated_quaternion_wxyz",
                             Part({4}, [](const Frame& f) { return f.est_q.data(); }))
      .def_property_readonly("true_position",
                             Part({3}, [](const Frame& f) { return f.record.true_X_HM.p.data(); }))
      .def_property_readonly("true_quaternion_wxyz",
                             Part({4}, [](const Frame& f) { return f.true_q.data(); }))
      .def_property_readonly("vehicle_position",
                             Part({3}, [](const Frame& f) { return f.record.true_X_WB.p.data(); }),
                             "Of the vehicle in the world [m].")
      .def_property_readonly("vehicle_quaternion_wxyz",
                             Part({4}, [](const Frame& f) { return f.world_q.data(); }))
      .def_property_readonly(
          "velocity_mps", Part({3}, [](const Frame& f) { return f.record.true_V_WB_B.v.data(); }),
          "Of the vehicle, in its own axes.")
      .def_property_readonly(
          "turn_rate_radps",
          Part({3}, [](const Frame& f) { return f.record.true_V_WB_B.w.data(); }))
      .def_property_readonly("desired", Part({4}, [](const Frame& f) { return f.desired.data(); }),
                             "x, y, z [m], yaw [rad] that the procedure wants.")
      .def_property_readonly("demand", Part({4}, [](const Frame& f) { return f.demand.data(); }),
                             "Of the law, in its unit: surge, sway, heave, yaw.")
      .def_property_readonly("command_v", [](const py::object& self) {
        const auto& volts = self.cast<Frame*>()->record.command.volts;
        return View({static_cast<py::ssize_t>(volts.size())}, volts.data(), self);
      });
  py::class_<Trial>(*module, "Trial")
      .def(py::init<trial::Scenario, bool, std::string>(), py::arg("scenario"), py::arg("images"),
           py::arg("steered"))
      .def("step", &Trial::Step, py::arg("demand") = py::none())
      .def_property_readonly("ended", &Trial::ended)
      .def_property_readonly("frame", &Trial::Now)
      .def_property_readonly("images", &Trial::Images)
      .def("set", &Trial::Set)
      .def("push",
           [](Trial* trial, const std::array<double, 3>& newton) {
             trial->Push({newton[0], newton[1], newton[2]});
           })
      .def_property_readonly("seen", [](const Trial& t) { return t.hand().seen; })
      .def_property_readonly("wanted", [](const Trial& t) { return t.hand().wanted; })
      .def_property_readonly("given", [](const Trial& t) { return Copy(t.hand().given); })
      .def_property_readonly("authority", [](const Trial& t) { return Copy(t.hand().authority); })
      .def_property_readonly("in_control", [](const Trial& t) { return t.hand().in_control; })
      .def("finish", &Trial::Finish);
}

}  // namespace turbidock::python
