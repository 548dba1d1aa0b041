// Laws and estimators written in Python, as plug-ins of a scenario.

#include <variant>
#include <vector>

#include "experiments/config/yaml_fields.h"
#include "experiments/python/bindings.h"
#include "experiments/trial/plugins.h"

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

struct Keys {
  std::vector<Key> initial, now;

  void AddTo(config::GroupRef* group) {
    for (Key& key : now)
      std::visit(
          [&](auto& value) {
            group->fields.push_back({key.name, key.range, key.doc, &value});
          },
          key.value);
  }
  void Check(const std::string& path) const {
    for (const Key& key : now)
      std::visit(
          [&](const auto& value) {
            using V = std::remove_cvref_t<decltype(value)>;
            if constexpr (std::is_same_v<V, double> || std::is_same_v<V, int64_t>)
              if (!key.range.Contains(static_cast<double>(value)))
                throw ConfigError(
                    JoinKey(path, key.name),
                    FormatNumber(static_cast<double>(value)) + ", " + key.range.Sentence());
          },
          key.value);
  }
  void SetOn(py::object* object) const {
    for (const Key& key : now)
      std::visit([&](const auto& value) { object->attr(key.name.c_str()) = value; }, key.value);
  }
};

Keys KeysOf(const py::list& declared) {
  Keys keys;
  for (const py::handle& each : declared) {
    const auto row = each.cast<py::tuple>();  // name, value, low, high, doc
    Key key{.name = row[0].cast<std::string>(), .value = {}, .range = {}, .doc = {}};
    const py::object value = row[1];
    if (py::isinstance<py::bool_>(value))
      key.value = value.cast<bool>();
    else if (py::isinstance<py::int_>(value))
      key.value = value.cast<int64_t>();
    else if (py::isinstance<py::float_>(value))
      key.value = value.cast<double>();
    else if (py::isinstance<py::str>(value))
      key.value = value.cast<std::string>();
    else
      throw py::type_error("key " + key.name + ": its default must be a bool, a number or text");
    if (!row[2].is_none()) key.range.low = row[2].cast<double>();
    if (!row[3].is_none()) key.range.high = row[3].cast<double>();
    key.doc = row[4].cast<std::string>();
    keys.initial.push_back(key);
  }
  keys.now = keys.initial;
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

// ---------------------------------------------------------------------------------------- laws

class PythonLaw final : public control::Controller {
 public:
  PythonLaw(const Held& cls, const Keys& keys, const control::VehicleModel& vehicle,
            const control::Axes& authority, double frame_s, bool observes, bool hears)
      : observes_(observes), hears_(hears) {
    Call([&] {
      py::object self = (*cls)();
      keys.SetOn(&self);
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
  void Given(int64_t frame, const control::Axes& given) override {
    if (hears_) Call([&] { self_->attr("given")(frame, Copy(given)); });
  }

 private:
  Held self_;
  control::Observation seen_;
  bool observes_, hears_;
};

class PythonLawPlugin final : public trial::LawPlugin {
 public:
  PythonLawPlugin(Held cls, Keys keys, const AnyAllocation& allocation, bool filter, bool setpoint,
                  bool observes, bool hears)
      : cls_(std::move(cls)),
        keys_(std::move(keys)),
        allocation_by_default_(allocation),
        filter_by_default_(filter),
        setpoint_by_default_(setpoint),
        observes_(observes),
        hears_(hears) {
    Reset();
  }

  config::GroupRef Group() override {
    config::GroupRef group;
    keys_.AddTo(&group);
    group.fields.push_back(
        {"pose_filter", Finite(), "between estimate and law", config::GroupOf(&filter_)});
    group.fields.push_back(
        {"setpoint", Finite(), "how the desired pose moves", config::GroupOf(&setpoint_)});
    std::visit(
        [&](auto& allocation) {
          group.fields.push_back(
              {"allocation", Finite(), "from axes to thrusters", config::GroupOf(&allocation)});
        },
        allocation_);
    return group;
  }
  void Check(const std::string& path) const override {
    keys_.Check(path);
    CheckFields(filter_, JoinKey(path, "pose_filter"));
    CheckFields(setpoint_, JoinKey(path, "setpoint"));
    std::visit(
        [&](const auto& allocation) { CheckFields(allocation, JoinKey(path, "allocation")); },
        allocation_);
  }
  void Reset() override {
    keys_.now = keys_.initial;
    filter_ = {};
    filter_.enabled = filter_by_default_;
    setpoint_ = {};
    setpoint_.enabled = setpoint_by_default_;
    allocation_ = allocation_by_default_;
  }
  std::unique_ptr<trial::LawPlugin> Copy() const override {
    return std::make_unique<PythonLawPlugin>(*this);
  }
  control::OwnLaw Law() const override {
    control::OwnLaw law;
    law.make = [cls = cls_, keys = keys_, allocation = allocation_, observes = observes_,
                hears = hears_](const control::VehicleModel& vehicle,
                                const ClockParams& clock) -> std::unique_ptr<control::Controller> {
      return std::make_unique<PythonLaw>(cls, keys, vehicle, AuthorityOf(allocation, vehicle),
                                         clock.frame_s(), observes, hears);
    };
    law.pose_filter = filter_;
    law.setpoint = setpoint_;
    law.allocation = allocation_;
    return law;
  }

 private:
  Held cls_;
  Keys keys_;
  AnyAllocation allocation_by_default_;
  bool filter_by_default_, setpoint_by_default_, observes_, hears_;
  control::PoseFilterParams filter_;
  control::SetpointParams setpoint_;
  AnyAllocation allocation_;
};

// ---------------------------------------------------------------------------------- estimators

class PythonEstimator final : public vision::PoseEstimator {
 public:
  PythonEstimator(const Held& cls, const Keys& keys, trial::EstimatorSetup setup) {
    Call([&] {
      py::object self = (*cls)();
      keys.SetOn(&self);
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
      estimate_.X_HM.p = Numbers<3>(parts[0], "position");
      const Eigen::Vector4d q = Numbers<4>(parts[1], "quaternion_wxyz");
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
  template <int kCount>
  static Eigen::Matrix<double, kCount, 1> Numbers(const py::object& given, const char* what) {
    const auto array =
        py::array_t<double, py::array::c_style | py::array::forcecast>::ensure(given);
    if (!array || array.ndim() != 1 || array.shape(0) != kCount) {
      PyErr_Clear();
      throw py::value_error(std::string(what) + " must be " + std::to_string(kCount) + " numbers");
    }
    return Eigen::Map<const Eigen::Matrix<double, kCount, 1>>(array.data());
  }

  Held self_;
  PoseEstimate estimate_;
};

class PythonEstimatorPlugin final : public trial::EstimatorPlugin {
 public:
  PythonEstimatorPlugin(Held cls, Keys keys) : cls_(std::move(cls)), keys_(std::move(keys)) {}

  config::GroupRef Group() override {
    config::GroupRef group;
    keys_.AddTo(&group);
    return group;
  }
  void Check(const std::string& path) const override { keys_.Check(path); }
  void Reset() override { keys_.now = keys_.initial; }
  std::unique_ptr<trial::EstimatorPlugin> Copy() const override {
    return std::make_unique<PythonEstimatorPlugin>(*this);
  }
  std::unique_ptr<vision::PoseEstimator> Make(const trial::EstimatorSetup& setup) const override {
    return std::make_unique<PythonEstimator>(cls_, keys_, setup);
  }

 private:
  Held cls_;
  Keys keys_;
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
             const bool observes = Overrides(cls, "Controller", "observe");
             const bool hears = Overrides(cls, "Controller", "given");
             plugins->Add(name, std::make_unique<PythonLawPlugin>(
                                    Hold(std::move(cls)), KeysOf(keys), AllocationFor(asks_for),
                                    pose_filter, setpoint, observes, hears));
           })
      .def("add_estimator",
           [](Plugins* plugins, const std::string& name, py::object cls, const py::list& keys) {
             plugins->Add(
                 name, std::make_unique<PythonEstimatorPlugin>(Hold(std::move(cls)), KeysOf(keys)));
           });
}

}  // namespace turbidock::python
