// Controllers and estimators written in Python, as plug-ins of a scenario.

#include <fmt/ranges.h>

#include <exception>
#include <optional>
#include <random>
#include <tuple>
#include <utility>
#include <variant>
#include <vector>

#include "control/autopilot.h"
#include "experiments/config/yaml_fields.h"
#include "experiments/python/bindings.h"
#include "experiments/trial/plugin_of.h"
#include "experiments/trial/world.h"

namespace turbidock::python {
namespace {

using trial::Plugins;

// A key that a Python class declares.
using Value = std::variant<bool, int64_t, double, std::string>;
struct Key {
  std::string name;
  Value value;
  Range range;
  std::string doc;
};

// The keys of a Python class, as a scenario sets them.
struct Keys {
  std::vector<Key> keys;

  static void Fields(auto&, auto&&) {}
  void MoreFields(config::GroupRef* group) {
    for (Key& key : keys)
      std::visit(
          [&](auto& value) {
            group->fields.push_back({key.name, key.range, key.doc, &value});
          },
          key.value);
  }
  void Check(const std::string& path) const {
    for (const Key& key : keys) {
      const auto check = [&](const auto& value) {
        using V = std::decay_t<decltype(value)>;
        if constexpr (std::is_same_v<V, double> || std::is_same_v<V, int64_t>) {
          const auto number = static_cast<double>(value);
          internal::CheckNumbers(&number, 1, key.range, path, key.name.c_str());
        }
      };
      std::visit(check, key.value);
    }
  }
  // What a class, or a function, makes, with its keys set.
  py::object Instance(const Held& make) const {
    py::object object = (*make)();
    for (const Key& key : keys) object.attr(key.name.c_str()) = key.value;
    return object;
  }
};

Keys KeysOf(const py::list& declared) {
  using Row =
      std::tuple<std::string, Value, std::optional<double>, std::optional<double>, std::string>;
  Keys keys;
  for (const py::handle& each : declared) {
    const auto [name, value, low, high, doc] = each.cast<Row>();
    Range range;
    range.low = low.value_or(range.low);
    range.high = high.value_or(range.high);
    keys.keys.push_back({name, value, range, doc});
  }
  return keys;
}

// What Python raised in the last call of a plug-in; nothing where it returned. Not destroyed with
// its thread, when there may be no interpreter any more.
thread_local PyObject* raised = nullptr;

// Calls Python from C++ code that runs without the lock. What Python raises is a C++ error of the
// same text; with the traceback, but where the plug-in itself says what is wrong by a PluginError.
template <class Do>
auto Call(const Do& act) {
  const py::gil_scoped_acquire lock;
  Py_CLEAR(raised);
  std::string problem;
  try {
    return act();
  } catch (const py::error_already_set& error) {
    if (error.matches(py::module_::import("turbidock").attr("NoAnswer")))
      throw trial::NoAnswer(py::str(error.value()));
    const bool is_said = error.matches(py::module_::import("turbidock").attr("PluginError"));
    problem = is_said ? std::string(py::str(error.value())) : error.what();
    raised = error.value().inc_ref().ptr();
    PyException_SetTraceback(raised, error.trace() ? error.trace().ptr() : Py_None);
  } catch (const py::cast_error& error) {
    problem = error.what();
  }
  throw std::runtime_error(problem);
}

void SetDelay(const ImageTimes& images, py::object* self) {
  self->attr("delay_frames") = images.delay_images;
  self->attr("delay_s") = images.delay_s;
}

// A PluginError caused by what Python raised; what is no Exception (KeyboardInterrupt, SystemExit)
// goes on as it is.
void Translate(std::exception_ptr thrown) {
  try {
    std::rethrow_exception(std::move(thrown));
  } catch (const trial::NoAnswer& error) {
    PyErr_SetString(py::module_::import("turbidock").attr("NoAnswer").ptr(), error.what());
  } catch (const trial::PluginError& error) {
    const auto cause = py::reinterpret_steal<py::object>(std::exchange(raised, nullptr));
    py::object made = py::module_::import("turbidock").attr("PluginError")(error.what());
    if (cause && !py::isinstance(cause, PyExc_Exception))
      made = cause;
    else
      PyException_SetCause(made.ptr(), py::object(cause).release().ptr());
    PyErr_SetObject(py::type::handle_of(made).ptr(), made.ptr());
  }
}

// ------------------------------------------------------------------------------------ controllers

// The type of a controller's allocation, by what it asks for. ConfigError for what is nothing.
using AnyAllocation = decltype(control::ControllerSpec::allocation);
AnyAllocation AllocationFor(const std::string& asks_for) {
  if (asks_for == "volts") return control::VoltsAllocationParams();
  for (const char* each : {"forces", "thrusts", "thruster_volts"})
    if (asks_for == each) return control::ForceAllocationParams();
  throw ConfigError("asks_for", asks_for + ", must be forces, volts, thrusts or thruster_volts");
}

// The most of it by axis, the mean of both ways: N and N m, or volts. None on a vehicle that cannot
// follow such a controller: the autopilot says so, as of every controller.
control::Axes AuthorityOf(const AnyAllocation& allocation,
                          const control::VehicleModel& vehicle) try {
  if (const auto* forces = std::get_if<control::ForceAllocationParams>(&allocation))
    return control::ForceAllocation(*forces, vehicle).authority();
  return control::VoltsAllocation(std::get<control::VoltsAllocationParams>(allocation), vehicle)
      .authority();
} catch (const ConfigError&) {
  return control::Axes::Zero();
}

// What a scenario says of a controller in Python, besides its own keys.
struct ControllerParams : Keys {
  control::PoseFilterParams pose_filter;
  control::SetpointParams setpoint;
  AnyAllocation allocation;

  static void Fields(auto& self, auto&& field) {
    field("pose_filter", self.pose_filter, Finite(), "filter between estimate and controller");
    field("setpoint", self.setpoint, Finite(),
          "motion of the desired pose that the controller follows");
    std::visit(
        [&](auto& of) {
          field("allocation", of, Finite(), "allocation of the axes' demand to the thrusters");
        },
        self.allocation);
  }
};

class PythonController final : public control::Controller {
 public:
  PythonController(const Held& make, const ControllerParams& params,
                   const control::VehicleModel& vehicle, double frame_s,
                   const std::string& asks_for, bool observes, bool hears)
      : gives_volts_(asks_for == "thruster_volts"), observes_(observes), hears_(hears) {
    for (const control::ThrusterModel& thruster : vehicle.thrusters)
      names_.push_back(thruster.name);
    if (gives_volts_ || asks_for == "thrusts") {
      thrusters_.emplace(std::get<control::ForceAllocationParams>(params.allocation), vehicle,
                         /*may_lack_axes=*/true);
      rule_ = fmt::format("demand() must give {} numbers up to 1e6, {}", names_.size(),
                          fmt::join(names_, ", "));
      command_ = ThrusterCommand::Neutral(names_.size());
    }
    Call([&] {
      py::object self = params.Instance(make);
      self.attr("frame_s") = frame_s;
      SetDelay(vehicle.images, &self);
      self.attr("authority") = python::Copy(AuthorityOf(params.allocation, vehicle));
      self.attr("vehicle") =
          py::dict(py::arg("inertia") = python::Copy(vehicle.inertia),
                   py::arg("linear_damping") = python::Copy(vehicle.linear_damping),
                   py::arg("quadratic_damping") = python::Copy(vehicle.quadratic_damping),
                   py::arg("thruster_lag_s") = vehicle.thruster_lag_s,
                   py::arg("thrusters") = names_, py::arg("head_ahead_m") = vehicle.head_ahead_m);
      self.attr("start")();
      self_ = Hold(std::move(self));
    });
  }

  void Observe(const control::Observation& seen) override {
    seen_ = seen;
    if (observes_) Call([&] { self_->attr("observe")(seen); });
  }
  control::Axes Demand(const control::Reference& wanted) override {
    const auto count = thrusters_ ? std::ssize(command_.volts) : control::kAxisCount;
    const Eigen::VectorXd asked = Call([&] {
      return NumbersOf(self_->attr("demand")(seen_, wanted), static_cast<int>(count), rule_);
    });
    if (!thrusters_) return asked;
    PerThruster numbers(asked.begin(), asked.end());
    if (!gives_volts_) numbers = thrusters_->CommandOf(numbers).volts;
    for (size_t i = 0; i < numbers.size(); ++i)
      if (numbers[i] < 0 || numbers[i] > kMaxVolts)
        throw std::runtime_error(
            fmt::format("{}: thruster volts must be in 0 to {}, neutral {}, not {}", names_[i],
                        kMaxVolts, kNeutralVolts, numbers[i]));
    command_.volts = numbers;
    return thrusters_->GivenBy(command_);
  }
  const ThrusterCommand* Command() const override { return thrusters_ ? &command_ : nullptr; }
  std::optional<control::Axes> Predict(int64_t frame) override {
    return Call([&]() -> std::optional<control::Axes> {
      const py::object marker = self_->attr("predict")(frame);
      if (marker.is_none()) return std::nullopt;
      return NumbersOf(marker, control::kAxisCount,
                       "predict() must give four numbers up to 1e6, x, y, z, heading, or None");
    });
  }
  void OnCommandApplied(int64_t frame, const control::Axes& given) override {
    if (hears_) Call([&] { self_->attr("given")(frame, Copy(given)); });
  }

 private:
  Held self_;
  control::Observation seen_;
  std::optional<control::ForceAllocation> thrusters_;  // of one that commands them itself
  ThrusterCommand command_;
  std::vector<std::string> names_;  // of the vehicle's thrusters
  std::string rule_ = "demand() must give four numbers up to 1e6, surge, sway, heave, yaw";
  bool gives_volts_, observes_, hears_;
};

// ---------------------------------------------------------------------------------- estimators

class PythonEstimator final : public vision::PoseEstimator {
 public:
  PythonEstimator(const Held& make, const Keys& keys, trial::EstimatorSetup setup) {
    Call([&] {
      py::object self = keys.Instance(make);
      self.attr("rig") = RigOf(setup.rig);
      self.attr("balls") = BallsOf(setup.marker);
      self.attr("seed") = setup.rng.NextU64();
      self.attr("frame_s") = setup.images.period_s;
      SetDelay(setup.images, &self);
      self.attr("start")();
      self_ = Hold(std::move(self));
    });
  }

  const PoseEstimate& Update(const StereoImage& seen) override {
    Call([&] {
      self_->attr("frame") = seen.frame;
      // Copies: what a Python object keeps of a frame is its own.
      const py::object result =
          self_->attr("update")(View(seen.left, py::handle()), View(seen.right, py::handle()));
      const auto parts = result.cast<py::sequence>();
      if (parts.size() != 3)
        throw py::value_error("update() must return (position, quaternion_wxyz, fitness)");
      estimate_.X_HM.p = NumbersOf(parts[0], 3, "position must be 3 numbers up to 1e6");
      const Eigen::Vector4d q =
          NumbersOf(parts[1], 4, "quaternion_wxyz must be 4 numbers up to 1e6");
      estimate_.X_HM.q = Eigen::Quaterniond(q[0], q[1], q[2], q[3]);
      estimate_.fitness = parts[2].cast<double>();
    });
    estimate_.frame = seen.frame;
    estimate_.evaluations = 1;
    return estimate_;
  }
  void Reset() override {
    Call([&] { self_->attr("start")(); });
  }
  std::string_view name() const override { return "python"; }

 private:
  Held self_;
  PoseEstimate estimate_;
};

// Code that cannot be told is nobody else's: what it flew is not gone on with by another call.
std::string CodeOr(const std::string& code) {
  std::random_device random;
  return code.empty() ? fmt::format("{}{:08x}{:08x}", trial::kUnknownCode, random(), random())
                      : code;
}

control::Axes AxesOf(const py::object& given) {
  return NumbersOf(given, control::kAxisCount, "must be four numbers up to 1e6");
}

// A scenario's controller by itself.
class ControllerAlone {
 public:
  explicit ControllerAlone(const trial::Scenario& scenario)
      : controller_(
            scenario.plugins.Spec().make(trial::ModelOf(scenario), scenario.image_clock())) {}

  void Observe(int64_t frame, const py::object& position, const py::object& rate) {
    RequireLater(frame, &seen_);
    controller_->Observe({.frame = frame,
                          .position = AxesOf(position),
                          .rate = rate.is_none() ? std::nullopt : std::optional(AxesOf(rate))});
  }
  py::array Demand(const py::object& position, const py::object& rate,
                   const py::object& acceleration) {
    if (!seen_) throw py::value_error("nothing has been observed");
    return Copy(controller_->Demand({AxesOf(position), AxesOf(rate), AxesOf(acceleration)}));
  }
  void Given(int64_t frame, const py::object& given) {
    RequireLater(frame, &given_);
    controller_->OnCommandApplied(frame, AxesOf(given));
  }

 private:
  static void RequireLater(int64_t frame, std::optional<int64_t>* last) {
    if (*last && frame <= *last)
      throw py::value_error(fmt::format("frame {} must be above {}", frame, **last));
    *last = frame;
  }

  std::unique_ptr<control::Controller> controller_;
  std::optional<int64_t> seen_, given_;
};

void AddController(py::module_* module) {
  py::class_<ControllerAlone>(
      *module, "ControllerAlone",
      "A scenario's controller without what a trial has around it: procedure, pose filter, "
      "setpoint, allocation. Frames must increase, else ValueError. Places are x, y, z [m] and "
      "heading [rad] of the marker in the camera head.")
      .def(py::init<const trial::Scenario&>())
      .def("observe", &ControllerAlone::Observe, py::arg("frame"), py::arg("position"),
           py::arg("rate") = py::none(),
           "A usable estimate, with its rate where the controller has a pose filter.")
      .def("demand", &ControllerAlone::Demand, py::arg("position"), py::arg("rate"),
           py::arg("acceleration"),
           "Surge, sway, heave, N, and yaw, N m, or volts, for where the marker shall be.")
      .def("given", &ControllerAlone::Given, py::arg("frame"), py::arg("given"),
           "What the vehicle could give of it; zeros while another steers.");
}

void AddSeen(py::module_* module) {
  py::class_<control::Observation>(*module, "Observation",
                                   "Where the marker is in the camera head, as far as it is known.")
      .def(py::init<>())
      .def_readonly("frame", &control::Observation::frame, "Of the image.")
      .def_property_readonly(
          "position", [](const control::Observation& seen) { return Copy(seen.position); },
          "x, y, z [m] and heading [rad] of the marker in the camera head.")
      .def_property_readonly(
          "rate",
          [](const control::Observation& seen) -> py::object {
            return seen.rate ? py::object(Copy(*seen.rate)) : py::none();
          },
          "The same per second; None without a pose filter.")
      .def_property_readonly(
          "variance",
          [](const control::Observation& seen) -> py::object {
            return seen.variance ? py::object(Copy(*seen.variance)) : py::none();
          },
          "Of the position, as its estimator claims; None where it claims nothing.")
      .def_readonly("fitness", &control::Observation::fitness, "F of the estimate.")
      .def_property_readonly(
          "roll_pitch",
          [](const control::Observation& seen) { return Copy(seen.attitude.roll_pitch_rad); },
          "Of the vehicle [rad], as its own sensor says.")
      .def_property_readonly(
          "roll_pitch_rate",
          [](const control::Observation& seen) { return Copy(seen.attitude.rate_rad_s); },
          "About its x and y axes [rad/s], likewise.")
      .def_property_readonly(
          "navigation",
          [](const control::Observation& seen) -> py::object {
            if (!seen.navigation) return py::none();
            const NavigationReading& n = *seen.navigation;
            using namespace py::literals;
            return py::dict("z_m"_a = n.z_m, "heading_rad"_a = n.heading_rad,
                            "fix_xy_m"_a = n.fix_xy_m ? py::object(Copy(*n.fix_xy_m)) : py::none(),
                            "z_std_m"_a = n.z_std_m, "heading_std_rad"_a = n.heading_std_rad,
                            "fix_std_m"_a = n.fix_std_m);
          },
          "z_m, heading_rad and fix_xy_m (None between fixes) of the camera head in the marker's "
          "frame, and the standard deviations of their noise; None without navigation.");
  py::class_<control::Reference>(*module, "Reference", "Where the marker shall be.")
      .def(py::init<>())
      .def_property_readonly("position",
                             [](const control::Reference& wanted) { return Copy(wanted.position); })
      .def_property_readonly("rate",
                             [](const control::Reference& wanted) { return Copy(wanted.rate); })
      .def_property_readonly("acceleration", [](const control::Reference& wanted) {
        return Copy(wanted.acceleration);
      });
}

}  // namespace

void AddPlugins(py::module_* module) {
  py::register_exception<trial::PluginError>(*module, "PluginError", PyExc_RuntimeError);
  py::register_exception<trial::NoAnswer>(*module, "NoAnswer", module->attr("PluginError"));
  py::register_exception_translator(&Translate);
  AddSeen(module);
  AddController(module);
  py::class_<Plugins>(*module, "Plugins", "Controllers and estimators, turbidock's own and others.")
      .def(py::init<>())
      .def("add_controller",
           [](Plugins* plugins, const std::string& name, py::object make, const py::list& keys,
              const std::string& asks_for, bool pose_filter, bool setpoint, bool observes,
              bool predicts, bool hears, const std::string& code) {
             ControllerParams defaults{KeysOf(keys), {}, {}, AllocationFor(asks_for)};
             defaults.pose_filter.enabled = pose_filter;
             defaults.setpoint.enabled = setpoint;
             plugins->AddController(
                 name, defaults, [=, held = Hold(std::move(make))](const ControllerParams& params) {
                   return control::ControllerSpec{
                       .make =
                           [=](const control::VehicleModel& vehicle, const ClockParams& clock) {
                             return std::make_unique<PythonController>(
                                 held, params, vehicle, clock.frame_s(), asks_for, observes, hears);
                           },
                       .predicts = predicts,
                       .pose_filter = params.pose_filter,
                       .setpoint = params.setpoint,
                       .allocation = params.allocation};
                 });
             plugins->SetCode(name, CodeOr(code));
           })
      .def("add_estimator", [](Plugins* plugins, const std::string& name, py::object make,
                               const py::list& keys, const std::string& code) {
        plugins->AddEstimator(
            name, KeysOf(keys),
            [held = Hold(std::move(make))](const Keys& params, const trial::EstimatorSetup& setup) {
              return std::make_unique<PythonEstimator>(held, params, setup);
            });
        plugins->SetCode(name, CodeOr(code));
      });
}

}  // namespace turbidock::python
