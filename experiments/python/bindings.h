#pragma once
// What the files of the Python module share.

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <sys/types.h>

#include <Eigen/Core>
#include <memory>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "control/axes.h"
#include "control/thrust_allocation.h"
#include "control/vehicle_model.h"
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

// What a controller asks for: the type of its allocation.
using AnyAllocation = std::variant<control::ForceAllocationParams, control::VoltsAllocationParams>;
// "forces" or "volts". ConfigError for what is neither.
AnyAllocation AllocationFor(const std::string& asks_for);
// The most of it by axis, the mean of both ways: N and N m, or volts. None on a vehicle that cannot
// follow such a controller.
control::Axes AuthorityOf(const AnyAllocation& allocation, const control::VehicleModel& vehicle);

// So many numbers from whatever Python gave; ValueError "RULE, not ..." for anything else.
Eigen::VectorXd NumbersOf(const py::object& given, int count, const std::string& rule);

// A demand from whatever Python gave. ValueError that names `what` for another shape, for what is
// no number, is not finite or larger than `most`.
control::Axes DemandOf(const py::object& given, const std::string& what, double most);

// Forks with the interpreter told of it; the calling thread must not hold its lock.
pid_t ForkWithInterpreter();

void AddPlugins(py::module_* module);  // Plugins, Observation, Reference
void AddRunning(py::module_* module);  // Trial, Frame

}  // namespace turbidock::python
