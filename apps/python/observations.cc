// The dataclasses of circline/observations.py, to and from Observations.
#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/python/bindings.h"

namespace circline::python {
namespace {

namespace py = pybind11;
using py::literals::operator""_a;
using DoubleArray = py::array_t<double, py::array::c_style | py::array::forcecast>;

DoubleArray Doubles(const py::handle& object, const char* name) {
  auto array = DoubleArray::ensure(object);
  if (!array) {
    PyErr_Clear();
    throw py::value_error(std::string(name) + " is not an array of numbers");
  }
  return array;
}

std::optional<Eigen::Vector2d> PointFromPython(const py::handle& object, const char* name) {
  if (object.is_none()) return std::nullopt;
  const DoubleArray array = Doubles(object, name);
  if (array.ndim() != 1 || array.shape(0) != 2)
    throw py::value_error(std::string(name) + " must be a pixel, of shape (2,)");
  return Eigen::Vector2d(array.data()[0], array.data()[1]);
}

std::optional<Segment> SegmentFromPython(const py::handle& object, const char* name) {
  if (object.is_none()) return std::nullopt;
  const std::vector<Eigen::Vector2d> points = PointsFromPython(object, name);
  if (points.size() != 2)
    throw py::value_error(std::string(name) + " must be two pixels, of shape (2, 2)");
  return Segment{points[0], points[1]};
}

std::vector<std::uint8_t> MaskFromPython(const py::handle& object, const char* name) {
  const auto array = py::array_t<bool, py::array::c_style | py::array::forcecast>::ensure(object);
  if (!array || array.ndim() != 1)
    throw py::value_error(std::string(name) + " must be of shape (N,), true: inlier");
  return {array.data(), array.data() + array.size()};
}

template <typename T>
T Get(const py::handle& object, const char* name) {
  const py::object value = object.attr(name);
  try {
    return value.cast<T>();
  } catch (const py::builtin_exception&) {  // None is no cast_error where a struct is expected.
    throw py::value_error(std::string(name) + " cannot be " + py::repr(value).cast<std::string>());
  }
}

py::object ToPython(const std::optional<Eigen::Vector2d>& point) {
  return point ? py::cast(*point) : py::none();
}

py::object ToPython(const std::optional<Segment>& segment) {
  if (!segment) return py::none();
  return ArrayOfPoints({(*segment)[0], (*segment)[1]});
}

py::array MaskToPython(std::vector<std::uint8_t>&& mask) {
  const auto size = static_cast<py::ssize_t>(mask.size());
  return ArrayOf<std::uint8_t>(std::move(mask), {size});
}

py::object Class(const char* name) {
  return py::module_::import("circline.observations").attr(name);
}

LineObservation LineFromPython(const py::handle& object) {
  LineObservation line;
  line.points = PointsFromPython(object.attr("points"), "points of a line");
  line.fit = Get<std::optional<LineFit>>(object, "fit");
  line.inliers = MaskFromPython(object.attr("inliers"), "inliers");
  line.is_parallel = Get<bool>(object, "is_parallel");
  line.sigma_px = Get<double>(object, "sigma_px");
  return line;
}

py::object LineToPython(LineObservation&& line) {
  return Class("LineObservation")("points"_a = ArrayOfPoints(std::move(line.points)),
                                  "fit"_a = line.fit,
                                  "inliers"_a = MaskToPython(std::move(line.inliers)),
                                  "is_parallel"_a = line.is_parallel, "sigma_px"_a = line.sigma_px);
}

PencilDirection DirectionFromName(const std::string& name) {
  for (const auto direction :
       {PencilDirection::kX, PencilDirection::kY, PencilDirection::kZ, PencilDirection::kFree}) {
    if (name == PencilDirectionName(direction)) return direction;
  }
  throw py::value_error("direction must be x, y, z or free, not " + name);
}

PencilObservation PencilFromPython(const py::handle& object) {
  PencilObservation pencil;
  pencil.id = Get<std::string>(object, "id");
  for (const py::handle line : object.attr("lines")) pencil.lines.push_back(LineFromPython(line));
  pencil.direction = DirectionFromName(Get<std::string>(object, "direction"));
  pencil.plane = Get<std::string>(object, "plane");
  pencil.sigma_px = Get<double>(object, "sigma_px");
  pencil.fit = Get<std::optional<VanishingPointFit>>(object, "fit");
  pencil.readings = Get<std::vector<DirectionReading>>(object, "readings");
  pencil.axis_probability = Get<double>(object, "axis_probability");
  return pencil;
}

py::object PencilToPython(PencilObservation&& pencil) {
  py::list lines;
  for (LineObservation& line : pencil.lines) lines.append(LineToPython(std::move(line)));
  return Class("PencilObservation")(
      "id"_a = pencil.id, "lines"_a = lines, "direction"_a = PencilDirectionName(pencil.direction),
      "plane"_a = pencil.plane, "sigma_px"_a = pencil.sigma_px, "fit"_a = pencil.fit,
      "readings"_a = pencil.readings, "axis_probability"_a = pencil.axis_probability);
}

FrameObservation FrameFromPython(const py::handle& object) {
  FrameObservation frame;
  frame.plane = Get<std::string>(object, "plane");
  frame.origin = PointFromPython(object.attr("origin"), "origin");
  frame.x_axis = SegmentFromPython(object.attr("x_axis"), "x_axis");
  frame.y_axis = SegmentFromPython(object.attr("y_axis"), "y_axis");
  frame.origin_is_center = Get<std::string>(object, "origin_is_center");
  return frame;
}

py::object FrameToPython(const FrameObservation& frame) {
  return Class("FrameObservation")("plane"_a = frame.plane, "origin"_a = ToPython(frame.origin),
                                   "x_axis"_a = ToPython(frame.x_axis),
                                   "y_axis"_a = ToPython(frame.y_axis),
                                   "origin_is_center"_a = frame.origin_is_center);
}

}  // namespace

std::vector<Eigen::Vector2d> PointsFromPython(const py::handle& object, const char* name) {
  const DoubleArray array = Doubles(object, name);
  if (array.size() == 0) return {};
  if (array.ndim() != 2 || array.shape(1) != 2)
    throw py::value_error(std::string(name) + " must be pixels, of shape (N, 2)");
  std::vector<Eigen::Vector2d> points(static_cast<std::size_t>(array.shape(0)));
  std::copy_n(array.data(), array.size(), points.front().data());
  return points;
}

std::vector<Segment> SegmentsFromPython(const py::handle& object, const char* name) {
  const DoubleArray array = Doubles(object, name);
  if (array.size() == 0) return {};
  if (array.ndim() != 3 || array.shape(1) != 2 || array.shape(2) != 2)
    throw py::value_error(std::string(name) + " must be segments, of shape (N, 2, 2)");
  std::vector<Segment> segments(static_cast<std::size_t>(array.shape(0)));
  std::copy_n(array.data(), array.size(), segments.front().front().data());
  return segments;
}

py::array ArrayOfPoints(std::vector<Eigen::Vector2d>&& points) {
  const auto size = static_cast<py::ssize_t>(points.size());
  return ArrayOf<double>(std::move(points), {size, 2});
}

CircleObservation CircleFromPython(const py::handle& object) {
  CircleObservation circle;
  circle.id = Get<std::string>(object, "id");
  circle.points = PointsFromPython(object.attr("points"), "points of a circle");
  circle.normals = PointsFromPython(object.attr("normals"), "normals");
  circle.sigma_px = Get<double>(object, "sigma_px");
  circle.center = PointFromPython(object.attr("center"), "center");
  circle.radius = Get<double>(object, "radius");
  circle.radius_sigma = Get<double>(object, "radius_sigma");
  circle.plane = Get<std::string>(object, "plane");
  circle.concentric = Get<std::string>(object, "concentric");
  circle.contrast = Get<int>(object, "contrast");
  circle.radius_group = Get<std::string>(object, "radius_group");
  circle.diameters = SegmentsFromPython(object.attr("diameters"), "diameters");
  circle.fit = Get<std::optional<ConicFit>>(object, "fit");
  circle.inliers = MaskFromPython(object.attr("inliers"), "inliers");
  circle.second = Get<std::optional<ConicReading>>(object, "second");
  return circle;
}

py::object CircleToPython(CircleObservation&& circle) {
  const auto num_diameters = static_cast<py::ssize_t>(circle.diameters.size());
  return Class("CircleObservation")(
      "id"_a = circle.id, "points"_a = ArrayOfPoints(std::move(circle.points)),
      "normals"_a = ArrayOfPoints(std::move(circle.normals)), "sigma_px"_a = circle.sigma_px,
      "center"_a = ToPython(circle.center), "radius"_a = circle.radius,
      "radius_sigma"_a = circle.radius_sigma, "plane"_a = circle.plane,
      "concentric"_a = circle.concentric, "contrast"_a = circle.contrast,
      "radius_group"_a = circle.radius_group,
      "diameters"_a = ArrayOf<double>(std::move(circle.diameters), {num_diameters, 2, 2}),
      "fit"_a = circle.fit, "inliers"_a = MaskToPython(std::move(circle.inliers)),
      "second"_a = circle.second);
}

Observations ObservationsFromPython(const py::handle& object) {
  Observations observations;
  observations.camera = Get<Camera>(object, "camera");
  observations.stated_focal_px = Get<double>(object, "stated_focal_px");
  observations.found_k1 = Get<double>(object, "found_k1");
  for (const py::handle circle : object.attr("circles"))
    observations.circles.push_back(CircleFromPython(circle));
  for (const py::handle pencil : object.attr("pencils"))
    observations.pencils.push_back(PencilFromPython(pencil));
  observations.frame = FrameFromPython(object.attr("frame"));
  for (const py::handle known : object.attr("known_angles")) {
    observations.known_angles.push_back({Get<std::array<std::string, 2>>(known, "pencils"),
                                         Get<double>(known, "value"), Get<double>(known, "sigma")});
  }
  for (const py::handle known : object.attr("known_lengths")) {
    const auto points = SegmentFromPython(known.attr("points"), "points of a known length");
    if (!points) throw py::value_error("a known length has no points");
    observations.known_lengths.push_back({*points, Get<std::string>(known, "plane"),
                                          Get<double>(known, "value"),
                                          Get<double>(known, "sigma")});
  }
  observations.num_dropped_points = Get<int>(object, "num_dropped_points");
  observations.message = Get<std::string>(object, "message");
  return observations;
}

py::object ObservationsToPython(Observations&& observations) {
  py::list circles, pencils, angles, lengths;
  for (CircleObservation& circle : observations.circles)
    circles.append(CircleToPython(std::move(circle)));
  for (PencilObservation& pencil : observations.pencils)
    pencils.append(PencilToPython(std::move(pencil)));
  for (const KnownAngle& known : observations.known_angles) {
    angles.append(
        Class("KnownAngle")("pencils"_a = py::make_tuple(known.pencils[0], known.pencils[1]),
                            "value"_a = known.value, "sigma"_a = known.sigma));
  }
  for (const KnownLength& known : observations.known_lengths) {
    lengths.append(Class("KnownLength")(
        "points"_a = ArrayOfPoints({known.points[0], known.points[1]}), "plane"_a = known.plane,
        "value"_a = known.value, "sigma"_a = known.sigma));
  }
  return Class("Observations")(
      "camera"_a = observations.camera, "stated_focal_px"_a = observations.stated_focal_px,
      "found_k1"_a = observations.found_k1, "circles"_a = circles, "pencils"_a = pencils,
      "frame"_a = FrameToPython(observations.frame), "known_angles"_a = angles,
      "known_lengths"_a = lengths, "num_dropped_points"_a = observations.num_dropped_points,
      "message"_a = observations.message);
}

}  // namespace circline::python
