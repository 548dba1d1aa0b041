// A trial under way, stepped from Python.

#include <fmt/format.h>
#include <unistd.h>

#include <optional>
#include <thread>

#include "control/axes.h"
#include "experiments/python/bindings.h"
#include "experiments/report/json.h"
#include "experiments/trial/running_trial.h"
#include "experiments/trial/series.h"

namespace turbidock::python {

py::object RigOf(const StereoRig& rig) {
  const MountedCamera& left = rig.left;
  return py::module_::import("turbidock.frames")
      .attr("Rig")(left.width_px, left.height_px, left.fx_px, left.fy_px, left.cx_px, left.cy_px,
                   (rig.right.X_HC.p - left.X_HC.p).norm());
}

py::list BallsOf(const vision::MarkerParams& marker) {
  py::list balls;
  for (const vision::BallParams& ball : marker.balls)
    balls.append(py::dict(py::arg("name") = ball.name,
                          py::arg("position_m") = python::Copy(ball.p_MQ_m),
                          py::arg("radius_m") = ball.radius_m));
  return balls;
}

py::tuple TupleOf(const trial::TrialResult& result, const trial::Scenario& scenario) {
  return py::make_tuple(report::JsonText(result), trial::Series::Of(result.log),
                        trial::SaveResolved(scenario, result.model_files));
}

namespace {

using trial::FrameRecord;

class Trial {
 public:
  Trial(const trial::Scenario& scenario, bool images) : images_(images), scenario_(scenario) {
    trial::TrialOptions options;
    options.whole_images = images;
    running_.emplace(scenario, options);
  }

  void Step() {
    RequireUnfinished();
    if (running_->ended()) throw py::value_error("this trial has ended: ask for its result()");
    const py::gil_scoped_release free;
    kept_ = nullptr;
    running_->Step();
  }

  bool ended() const { return !running_ || running_->ended(); }
  void Close() {
    RequireHere();
    running_.reset();
  }

  FrameRecord Now() const { return last_ ? *last_ : Last(); }

  // Left and right; the memory is theirs from now on.
  py::tuple Images() {
    if (!images_) throw py::value_error("images are made with images=True only");
    RequireHere();
    if (!kept_ && running_) {
      kept_ = std::make_shared<StereoImage>();
      *kept_ = running_->latest_images();
    }
    if (!kept_ || kept_->left.empty()) throw py::value_error("no image yet: call step()");
    const py::capsule owner(new std::shared_ptr<StereoImage>(kept_), [](void* memory) {
      delete static_cast<std::shared_ptr<StereoImage>*>(memory);
    });
    return py::make_tuple(View(kept_->left, owner), View(kept_->right, owner));
  }

  py::object Rig() const { return RigOf(scenario_.rig.MakeRig()); }
  py::list Balls() const { return BallsOf(scenario_.marker); }

  void Set(const std::string& assignment) {
    RequireUnfinished();
    running_->Set(assignment);
  }
  void Push(const py::object& given) {
    RequireUnfinished();
    running_->Push(NumbersOf(given, 3, "push() takes three forces in N, up to 1e6"));
  }

  // Once. Its last frame and images remain.
  py::tuple Finish() {
    RequireUnfinished();
    last_ = Last();
    return TupleOf(running_->Finish(), scenario_);
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
    if (!running_) throw py::value_error("this trial is closed");
  }
  const FrameRecord& Last() const {
    if (!running_ || running_->log().frames.empty())
      throw py::value_error("no frame yet: call step()");
    return running_->log().frames.back();
  }

  bool images_;
  trial::Scenario scenario_;  // as it began
  std::optional<trial::RunningTrial> running_;
  std::shared_ptr<StereoImage> kept_;
  std::optional<FrameRecord> last_;  // once it is finished
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
      .def("__repr__",
           [](const R& f) {
             return fmt::format("<Frame {} at {:.2f} s: {}, F {:.2f}>", f.frame, f.time_s,
                                NameOf(f.stage), f.fitness);
           })
      .def_readonly("frame", &R::frame, "Its number, from 0.")
      .def_readonly("time_s", &R::time_s, "Simulated, at its beginning.")
      .def_property_readonly(
          "stage", [](const R& f) { return NameOf(f.stage); }, "Of the procedure.")
      .def_readonly("fitness", &R::fitness, "F of the estimate, in [-1, 1].")
      .def_readonly("controlled", &R::controlled, "Whether a controller steered.")
      .def_readonly("insertion_depth_m", &R::insertion_depth_m,
                    "Of the pole's tip past the dock's mouth.")
      .def_readonly("dock_force_newton", &R::dock_force_newton, "Between pole and dock.")
      .def_property_readonly("estimated_position", Array([](const R& f) { return f.est_X_HM.p; }),
                             "Of the marker in the camera head [m].")
      .def_property_readonly("estimated_quaternion_wxyz",
                             Array([](const R& f) { return Wxyz(f.est_X_HM); }))
      .def_property_readonly("true_position", Array([](const R& f) { return f.true_X_HM.p; }),
                             "Of the marker in the camera head at time_s [m].")
      .def_property_readonly("true_quaternion_wxyz",
                             Array([](const R& f) { return Wxyz(f.true_X_HM); }))
      .def_readonly("image_time_s", &R::image_time_s,
                    "When the image of the estimate was exposed: cameras.delay_frames ago.")
      .def_property_readonly("true_position_at_image",
                             Array([](const R& f) { return f.true_at_image_X_HM.p; }),
                             "Of the marker in the camera head then: what the image shows.")
      .def_property_readonly("true_quaternion_at_image_wxyz",
                             Array([](const R& f) { return Wxyz(f.true_at_image_X_HM); }))
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
      .def(py::init<const trial::Scenario&, bool>(), py::arg("scenario"), py::arg("images"))
      .def("advance", &Trial::Step)
      .def_property_readonly("ended", &Trial::ended)
      .def_property_readonly("frame", &Trial::Now, "The last frame: truth, estimate, commands.")
      .def_property_readonly("images", &Trial::Images,
                             "What the estimator saw last, left and right, (height, width, 3), "
                             "RGB, without a copy.")
      .def_property_readonly("rig", &Trial::Rig, "Its cameras, as the estimator knows them.")
      .def_property_readonly("balls", &Trial::Balls,
                             "Of the marker: name, position_m in its frame, radius_m.")
      .def("assign", &Trial::Set)
      .def("push", &Trial::Push,
           "A steady force on the vehicle, in the world's axes, until another.")
      .def("close", &Trial::Close,
           "Frees its memory; its result remains, if it has been asked for.")
      .def("finish", &Trial::Finish);
}

}  // namespace turbidock::python
