// The mathematics by itself: free functions on calibrated coordinates.
#include <Eigen/Geometry>
#include <array>
#include <sstream>
#include <utility>
#include <vector>

#include "apps/python/bindings.h"
#include "apps/python/pickled.h"
#include "circline/estimators/circle_pose.h"
#include "circline/estimators/circular_points.h"
#include "circline/estimators/line_pose.h"

namespace circline::python {
namespace {

namespace py = pybind11;

std::vector<CirclePose> PosesOf(const Eigen::Matrix3d& conic) {
  std::array<CirclePose, 2> poses;
  const int count = CirclePoses(conic, &poses);
  if (count == 0) throw Refused("the conic is no proper ellipse");
  return {poses.begin(), poses.begin() + count};
}

Eigen::Matrix3d ImageOf(const CirclePose& pose) {
  if (IsInView(pose)) return ProjectCircle(pose);
  const Eigen::IOFormat row(6, Eigen::DontAlignCols, ", ", ", ", "", "", "(", ")");
  std::ostringstream said;
  said << "the circle about " << pose.center.format(row) << " with normal "
       << pose.normal.format(row)
       << " has no ellipse as image: it must be finite, all in front of the camera and not edge-on";
  throw py::value_error(said.str());
}

std::vector<std::pair<Eigen::Matrix3d, double>> FrameRotations(const Eigen::Matrix3d& conic,
                                                               const Eigen::Vector3d& x_line,
                                                               const Eigen::Vector3d& y_line) {
  std::array<FrameRotation, 2> rotations;
  const int count = RotationsFromCircleAndFrame(conic, x_line, y_line, &rotations);
  if (count == 0) throw Refused("the conic is no proper ellipse, or the axes span no plane");
  std::vector<std::pair<Eigen::Matrix3d, double>> found;
  for (int i = 0; i < count; ++i) {
    const FrameRotation& rotation = rotations[static_cast<std::size_t>(i)];
    found.emplace_back(rotation.rotation, rotation.deviation);
  }
  return found;
}

using LinePair = Eigen::Matrix<double, Eigen::Dynamic, 3>;  // Two rows.

Eigen::Matrix3d PairRotation(const LinePair& x_lines, const LinePair& y_lines) {
  const auto direction = [](const LinePair& lines) -> Eigen::Vector3d {
    if (lines.rows() != 2) throw py::value_error("a pair of lines must be of shape (2, 3)");
    const Eigen::Vector3d first = lines.row(0).transpose(), second = lines.row(1).transpose();
    return first.normalized().cross(second.normalized());
  };
  Eigen::Matrix3d rotation;
  if (!RotationFromDirections(direction(x_lines), direction(y_lines), &rotation))
    throw Refused("the lines of a pair coincide, or both pairs have one direction");
  return rotation;
}

}  // namespace

void BindClosedForms(py::module_* module) {
  py::class_<CirclePose>(*module, "CirclePose", "A circle, camera frame, in units of its radius.")
      .def(py::init([](const Eigen::Vector3d& normal, const Eigen::Vector3d& center) {
             return CirclePose{normal, center};
           }),
           py::arg("normal"), py::arg("center"))
      .def(Pickled(&CirclePose::normal, &CirclePose::center))
      .def_readonly("normal", &CirclePose::normal, "(3,), unit, facing the camera.")
      .def_readonly("center", &CirclePose::center, "(3,), in radii.");
  module->def("circle_poses", &PosesOf, py::arg("conic"),
              "The one or two circles whose image is the ellipse `conic` (3, 3), calibrated\n"
              "coordinates, any scale. Their order has no meaning. Refused: no proper ellipse.");
  module->def("project_circle", &ImageOf, py::arg("pose"),
              "Image of a circle of radius 1: a conic (3, 3), calibrated, unit norm, negative\n"
              "inside. ValueError: there is none, some of the circle is behind the camera.");
  module->def("rotation_from_circle_and_frame", &FrameRotations, py::arg("conic"),
              py::arg("x_line"), py::arg("y_line"),
              "Rotations (3, 3) of the world frame, each with the cosine by which its axes miss a\n"
              "right angle, best first: proposition 4. `conic` (3, 3); `x_line`, `y_line` (3,):\n"
              "images of the axes or of lines along them, calibrated. Signs as they come.");
  module->def("rotation_from_line_pairs", &PairRotation, py::arg("x_lines"), py::arg("y_lines"),
              "Rotation (3, 3) of the frame whose X axis runs along the first pair of parallel\n"
              "lines and whose XY plane holds the second's direction, at any angle: proposition\n"
              "5. `x_lines`, `y_lines` (2, 3): images of the lines, calibrated. Signs as they "
              "come.");
}

}  // namespace circline::python
