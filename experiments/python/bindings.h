#pragma once
// What the files of the Python module share.

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <Eigen/Core>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "experiments/config/number_table.h"
#include "experiments/trial/trial.h"
#include "sim/base/image.h"

namespace turbidock::python {

namespace py = pybind11;

// A Python object held by C++ code that runs without the interpreter's lock.
using Held = std::shared_ptr<py::object>;
Held Hold(py::object object);

// Numbers that Python may read and not write: a view into `owner`, or without one a copy.
template <class T>
py::array View(std::vector<py::ssize_t> shape, const T* data, py::handle owner) {
  py::array_t<T> array(std::move(shape), data, owner);
  array.attr("flags").attr("writeable") = false;
  return array;
}
py::array View(const Image3u8& image, py::handle owner);
py::array Copy(const Eigen::Ref<const Eigen::VectorXd>& values);

// So many numbers up to 1e6 from whatever Python gave; ValueError "RULE, not ..." for anything
// else.
Eigen::VectorXd NumbersOf(const py::object& given, int count, const std::string& rule);

// turbidock.frames.Rig of a rig; name, position_m and radius_m of each ball.
py::object RigOf(const StereoRig& rig);
py::list BallsOf(const vision::MarkerParams& marker);

// A table as a dict of arrays, and one of a dict of arrays of one length.
py::dict ArraysOf(const config::NumberTable& table);
config::NumberTable TableOf(const py::dict& columns);

// A result as JSON, its log and the scenario that it began with.
py::tuple TupleOf(const trial::TrialResult& result, const trial::Scenario& scenario);

void AddScenario(py::module_* module);  // Scenario, keys
void AddPredict(py::module_* module);   // predict, commands, thrusters, authority
void AddPlugins(py::module_* module);   // Plugins, Observation, Reference
void AddRunning(py::module_* module);   // Trial, Frame

}  // namespace turbidock::python
