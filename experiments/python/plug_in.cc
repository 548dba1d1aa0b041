// Laws and estimators written in Python, as plug-ins of a scenario.

#include <optional>
#include <tuple>
#include <variant>
#include <vector>

#include "experiments/config/yaml_fields.h"
#include "experiments/python/bindings.h"
#include "experiments/trial/plugin_of.h"

namespace turbidock::python {
namespace {

using trial::Plugins;

// A key that a Python class declares.
struct Key {
  std::string name;
  std::variant<bool, int64_t, double, std::string> value;
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
        if constexpr (std::is_same_v<V, double> || std::is_same_v<V, int64_t>)
          if (const auto number = static_cast<double>(value); !key.range.Contains(number))
            throw ConfigError(JoinKey(path, key.name),
                              FormatNumber(number) + ", " + key.range.Sentence());
      };
      std::visit(check, key.value);
    }
  }
  // An instance of the class with its keys set.
  py::object Instance(const Held& cls) const {
    py::object object = (*cls)();
    for (const Key& key : keys)
      std::visit([&](const auto& value) { object.attr(key.name.c_str()) = value; }, key.value);
    return object;
  }
};

Keys KeysOf(const py::list& declared) {
  Keys keys;
  for (const py::handle& each : declared) {
    const auto [name, value, low, high, doc] =
        each.cast<std::tuple<std::string, py::object, std::optional<double>, std::optional<double>,
                             std::string>>();
    Key& key = keys.keys.emplace_back(Key{.name = name, .value = {}, .range = {}, .doc = doc});
    if (py::isinstance<py::bool_>(value))
      key.value = value.cast<bool>();
    else if (py::isinstance<py::int_>(value))
      key.value = value.cast<int64_t>();
    else if (py::isinstance<py::float_>(value))
      key.value = value.cast<double>();
    else if (py::isinstance<py::str>(value))
      key.value = value.cast<std::string>();
    else
      throw py::type_error("key " + name + ": its default must be a bool, a number or text");
    if (low) key.range.low = *low;
    if (high) key.range.high = *high;
  }
  return keys;
}

// Calls Python from C++ code that runs without the lock. What Python raises is a C++ error of the
// same text.
template <class Do>
auto Call(const Do& act) {
  const py::gil_scoped_acquire lock;
  std::string problem;
  try {
    return act();
  } catch (const py::error_already_set& error) {
    problem = error.what();
  } catch (const py::cast_error& error) {
    problem = error.what();
  }
  throw std::runtime_error(problem);
}

bool Overrides(const py::object& cls, const char* base, const char* method) {
  const py::object ours = py::module_::import("turbidock").attr(base).attr(method);
  return !py::object(cls.attr(method)).is(ours);
}

// ----------------------------------------------------------------------------------------
// controllers

class PythonController final : public control::Controller {
 public:
  PythonController(const Held& cls, const Keys& keys, const control::VehicleModel& vehicle,
                   const control::Axes& authority, double frame_s, bool observes, bool hears)
      : observes_(observes), hears_(hears) {
    Call([&] {
      py::object self = keys.Instance(cls);
      self.attr("frame_s") = frame_s;
      self.attr("authority") = python::Copy(authority);
      self.attr("vehicle") =
          py::dict(py::arg("inertia") = python::Copy(vehicle.inertia),
                   py::arg("linear_damping") = python::Copy(vehicle.linear_damping),
                   py::arg("quadratic_damping") = python::Copy(vehicle.quadratic_damping),
                   py::arg("thruster_lag_s") = vehicle.thruster_lag_s,
                   py::arg("head_ahead_m") = vehicle.head_ahead_m);
      self.attr("start")();
      self_ = Hold(std::move(self));
    });
  }

  void Observe(const control::Observation& seen) override {
    seen_ = seen;
    if (observes_) Call([&] { self_->attr("observe")(seen); });
  }
  control::Axes Demand(const control::Reference& wanted) override {
    return Call([&] {
      constexpr double kMost = 1e6;  // the allocation limits it
      return DemandOf(self_->attr("demand")(seen_, wanted), "demand()", kMost);
    });
  }
  void OnCommandApplied(int64_t frame, const control::Axes& given) override {
    if (hears_) Call([&] { self_->attr("given")(frame, Copy(given)); });
  }

 private:
  Held self_;
  control::Observation seen_;
  bool observes_, hears_;
};

// What a scenario says of a controller in Python, besides its own keys.
struct LawParams : Keys {
  control::PoseFilterParams pose_filter;
  control::SetpointParams setpoint;
  AnyAllocation allocation;

  static void Fields(auto& self, auto&& field) {
    field("pose_filter", self.pose_filter, Finite(), "between estimate and controller");
    field("setpoint", self.setpoint, Finite(), "how the desired pose moves");
    std::visit([&](auto& of) { field("allocation", of, Finite(), "from axes to thrusters"); },
               self.allocation);
  }
};

// ---------------------------------------------------------------------------------- estimators

class PythonEstimator final : public vision::PoseEstimator {
 public:
  PythonEstimator(const Held& cls, const Keys& keys, trial::EstimatorSetup setup) {
    Call([&] {
      py::object self = keys.Instance(cls);
      const MountedCamera& left = setup.rig.left;
      self.attr("rig") =
          py::dict(py::arg("width_px") = left.width_px, py::arg("height_px") = left.height_px,
                   py::arg("fx_px") = left.fx_px, py::arg("fy_px") = left.fy_px,
                   py::arg("cx_px") = left.cx_px, py::arg("cy_px") = left.cy_px,
                   py::arg("baseline_m") = (setup.rig.right.X_HC.p - left.X_HC.p).norm());
      py::list balls;
      for (const vision::BallParams& ball : setup.marker.balls)
        balls.append(py::dict(py::arg("name") = ball.name,
                              py::arg("position_m") = python::Copy(ball.p_MQ_m),
                              py::arg("radius_m") = ball.radius_m));
      self.attr("balls") = balls;
      self.attr("seed") = setup.rng.NextU64();
      self.attr("start")();
      self_ = Hold(std::move(self));
    });
  }

  const PoseEstimate& Update(const StereoImage& seen) override {
    Call([&] {
      // Copies: what a Python object keeps of a frame is its own.
      const py::object result =
          self_->attr("update")(View(seen.left, py::handle()), View(seen.right, py::handle()));
      const auto parts = result.cast<py::sequence>();
      if (parts.size() != 3)
        throw py::value_error("update() must return (position, quaternion_wxyz, fitness)");
      estimate_.X_HM.p = NumbersOf(parts[0], 3, "position must be 3 numbers");
      const Eigen::Vector4d q = NumbersOf(parts[1], 4, "quaternion_wxyz must be 4 numbers");
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

}  // namespace

void AddPlugins(py::module_* module) {
  py::class_<control::Observation>(*module, "Observation",
                                   "Where the marker is in the camera head, as far as it is known.")
      .def_readonly("frame", &control::Observation::frame, "Of the image.")
      .def_property_readonly(
          "position", [](const control::Observation& seen) { return Copy(seen.position); },
          "x, y, z [m] and heading [rad] of the marker in the camera head.")
      .def_property_readonly(
          "rate",
          [](const control::Observation& seen) -> py::object {
            return seen.rate ? py::object(Copy(*seen.rate)) : py::none();
          },
          "The same per second; None without a pose filter.");
  py::class_<control::Reference>(*module, "Reference", "Where the marker shall be.")
      .def_property_readonly("position",
                             [](const control::Reference& wanted) { return Copy(wanted.position); })
      .def_property_readonly("rate",
                             [](const control::Reference& wanted) { return Copy(wanted.rate); })
      .def_property_readonly("acceleration", [](const control::Reference& wanted) {
        return Copy(wanted.acceleration);
      });
  py::class_<Plugins>(*module, "Plugins", "Laws and estimators besides turbidock's own.")
      .def(py::init<>())
      .def("add_controller",
           [](Plugins* plugins, const std::string& name, py::object cls, const py::list& keys,
              const std::string& asks_for, bool pose_filter, bool setpoint) {
             LawParams defaults{KeysOf(keys), {}, {}, AllocationFor(asks_for)};
             defaults.pose_filter.enabled = pose_filter;
             defaults.setpoint.enabled = setpoint;
             const bool observes = Overrides(cls, "Controller", "observe");
             const bool hears = Overrides(cls, "Controller", "given");
             plugins->AddController(
                 name, defaults, [=, held = Hold(std::move(cls))](const LawParams& params) {
                   return control::CustomController{
                       .make =
                           [=](const control::VehicleModel& vehicle, const ClockParams& clock) {
                             return std::make_unique<PythonController>(
                                 held, params, vehicle, AuthorityOf(params.allocation, vehicle),
                                 clock.frame_s(), observes, hears);
                           },
                       .pose_filter = params.pose_filter,
                       .setpoint = params.setpoint,
                       .allocation = params.allocation};
                 });
           })
      .def("add_estimator",
           [](Plugins* plugins, const std::string& name, py::object cls, const py::list& keys) {
             plugins->AddEstimator(name, KeysOf(keys),
                                   [held = Hold(std::move(cls))](
                                       const Keys& params, const trial::EstimatorSetup& setup) {
                                     return std::make_unique<PythonEstimator>(held, params, setup);
                                   });
           });
}

}  // namespace turbidock::python
