// The Python module circline._circline: C++ values and calls for apps/python/circline. Arrays come
// in as whatever numpy can see as float64; they go out without a copy, read-only where they belong
// to a result.
#ifndef CIRCLINE_APPS_PYTHON_BINDINGS_H_
#define CIRCLINE_APPS_PYTHON_BINDINGS_H_

#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "circline/estimators/observations.h"
#include "circline/estimators/status.h"

namespace circline::python {

// circline.Refused: the evidence does not determine the answer, or the numerics did not get there.
struct Refused : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// Raises circline.Refused or ValueError with the status' sentence.
inline void ThrowUnlessOk(const Status& status) {
  if (status.ok()) return;
  if (status.code == StatusCode::kInvalidArgument) throw pybind11::value_error(status.message);
  throw Refused(status.message);
}

// An N x 2 array; `name` says what it is if it is not. ValueError.
std::vector<Eigen::Vector2d> PointsFromPython(const pybind11::handle& array, const char* name);
// An N x 2 x 2 array: N segments of two points.
std::vector<Segment> SegmentsFromPython(const pybind11::handle& array, const char* name);

// The array takes the vector's memory over.
template <typename Scalar, typename Element>
pybind11::array ArrayOf(std::vector<Element>&& values, std::vector<pybind11::ssize_t> shape) {
  auto* owned = new std::vector<Element>(std::move(values));
  const pybind11::capsule owner(
      owned, [](void* memory) { delete static_cast<std::vector<Element>*>(memory); });
  return pybind11::array_t<Scalar>(std::move(shape), reinterpret_cast<const Scalar*>(owned->data()),
                                   owner);
}
pybind11::array ArrayOfPoints(std::vector<Eigen::Vector2d>&& points);

// Between the dataclasses of circline/observations.py and the library's structs.
Observations ObservationsFromPython(const pybind11::handle& observations);
pybind11::object ObservationsToPython(Observations&& observations);
CircleObservation CircleFromPython(const pybind11::handle& circle);
pybind11::object CircleToPython(CircleObservation&& circle);

// Parts of the module, in the order in which they need each other.
void BindValues(pybind11::module_* module);       // Camera, NoiseModel, Pose, priors, fits.
void BindResults(pybind11::module_* module);      // What estimate and adjust return.
void BindClosedForms(pybind11::module_* module);  // circle_poses, rotation_from_...
void BindCalls(pybind11::module_* module);        // detect, fit, estimate, adjust.
void BindFiles(pybind11::module_* module);        // load_scene, load_cameras, simulate.

}  // namespace circline::python

#endif  // CIRCLINE_APPS_PYTHON_BINDINGS_H_
