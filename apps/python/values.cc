// Camera, its uncertainty, the noise model, poses, priors and fits.
#include <algorithm>
#include <array>
#include <limits>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "apps/common/camera_file.h"
#include "apps/python/bindings.h"
#include "apps/python/pickled.h"
#include "circline/estimators/noise_model.h"
#include "circline/estimators/pose.h"
#include "circline/refine/estimate_pose.h"
#include "circline/refine/joint/known_pose.h"

namespace circline::python {
namespace {

namespace py = pybind11;

CameraModel ModelOf(const std::string& name) {
  CameraModel model = CameraModel::kPinhole;
  if (!apps::ModelFromName(name, &model))
    throw py::value_error("model: " + apps::NoSuchModel(name));
  return model;
}

// The values that a class's objects hold, by name.
template <typename T>
py::dict PropertiesOf() {
  const py::object property = py::module_::import("builtins").attr("property");
  py::dict properties;
  for (const auto& [name, attribute] : py::dict(py::type::of<T>().attr("__dict__")))
    if (py::isinstance(attribute, property)) properties[name] = attribute;
  return properties;
}

// A value with the attributes given by name; an unknown one is a TypeError, as of a Python class.
template <typename T>
T FromKeywords(const py::kwargs& keywords) {
  T value;
  const py::object object = py::cast(&value, py::return_value_policy::reference);
  const py::dict properties = PropertiesOf<T>();
  for (const auto& [name, given] : keywords) {
    if (!properties.contains(name)) {
      throw py::type_error("got an unexpected keyword argument '" + std::string(py::str(name)) +
                           "'");
    }
    object.attr(name) = given;
  }
  return value;
}

// For copy and pickle: as the keywords that make it.
template <typename T>
auto PickledAsKeywords() {
  return py::pickle(
      [](const T& value) {
        const py::object object = py::cast(value);
        py::dict state;
        for (const auto& [name, property] : PropertiesOf<T>()) state[name] = object.attr(name);
        return state;
      },
      [](const py::dict& state) {
        return FromKeywords<T>(py::reinterpret_borrow<py::kwargs>(state));
      });
}

// Of N x 3 points, camera frame: N x 2 pixels, NaN where the camera does not see them.
Eigen::Matrix<double, Eigen::Dynamic, 2, Eigen::RowMajor> Project(
    const Camera& camera,
    const Eigen::Ref<const Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>>& points) {
  ThrowUnlessOk(camera.Validate());
  Eigen::Matrix<double, Eigen::Dynamic, 2, Eigen::RowMajor> pixels(points.rows(), 2);
  pixels.setConstant(std::numeric_limits<double>::quiet_NaN());
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    Eigen::Vector2d pixel;
    if (CameraToPixel(camera, points.row(i).transpose(), &pixel)) pixels.row(i) = pixel;
  }
  return pixels;
}

// Of N x 2 pixels: N x 2 calibrated coordinates, NaN where the camera cannot undistort them.
py::array Calibrate(const Camera& camera, const py::handle& pixels) {
  ThrowUnlessOk(camera.Validate());
  std::vector<Eigen::Vector2d> points = PointsFromPython(pixels, "pixels");
  for (Eigen::Vector2d& point : points) {
    CalibratedPoint calibrated;
    const bool usable = PixelToCalibrated(camera, point, &calibrated);
    point =
        usable ? calibrated.x : Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
  }
  return ArrayOfPoints(std::move(points));
}

void SetDistortion(Camera* camera, const std::vector<double>& distortion) {
  if (distortion.size() > camera->distortion.size())
    throw py::value_error("distortion has at most 8 coefficients");
  camera->distortion = {};
  std::copy(distortion.begin(), distortion.end(), camera->distortion.begin());
}

void BindCamera(py::module_* module) {
  py::class_<Camera>(
      *module, "Camera",
      "A calibrated camera. Pixel centres lie at integer coordinates.\n\n"
      "Camera(model='opencv', width=640, height=480, fx=500, fy=500, cx=320, cy=240,\n"
      "       distortion=[k1, k2, p1, p2])")
      .def(py::init(&FromKeywords<Camera>))
      .def(PickledAsKeywords<Camera>())
      .def_readwrite("id", &Camera::id, "Photos with the same id share a camera.")
      .def_property(
          "model", [](const Camera& camera) { return apps::ModelName(camera.model); },
          [](Camera& camera, const std::string& name) { camera.model = ModelOf(name); },
          "pinhole, opencv (k1 k2 p1 p2 [k3 [k4 k5 k6]]) or fisheye (k1 k2 k3 k4).")
      .def_readwrite("width", &Camera::width, "Of the photo, pixels; 0: unknown.")
      .def_readwrite("height", &Camera::height, "Of the photo, pixels; 0: unknown.")
      .def_readwrite("fx", &Camera::fx, "Focal length, pixels.")
      .def_readwrite("fy", &Camera::fy, "Focal length, pixels.")
      .def_readwrite("cx", &Camera::cx, "Principal point, pixels.")
      .def_readwrite("cy", &Camera::cy, "Principal point, pixels.")
      .def_property(
          "distortion", [](const Camera& camera) { return py::tuple(py::cast(camera.distortion)); },
          &SetDistortion, "Up to 8 coefficients, as the model orders them; unused ones are 0.")
      .def("project", &Project, py::arg("points"),
           "Pixels (N, 2) of points (N, 3) in the camera frame; NaN for those out of view.")
      .def("calibrate", &Calibrate, py::arg("pixels"),
           "Calibrated coordinates X/Z, Y/Z (N, 2) of pixels (N, 2); NaN where there are none.")
      .def("__repr__", [](const Camera& camera) {
        std::ostringstream text;
        text << "Camera(model='" << apps::ModelName(camera.model) << "', width=" << camera.width
             << ", height=" << camera.height << ", fx=" << camera.fx << ", fy=" << camera.fy
             << ", cx=" << camera.cx << ", cy=" << camera.cy << ")";
        return text.str();
      });
}

void BindNoise(py::module_* module) {
  py::class_<CameraSigma>(*module, "CameraSigma",
                          "How well a camera is known: standard deviations; 0: exact. The defaults "
                          "are those of a good calibration.")
      .def(py::init(&FromKeywords<CameraSigma>))
      .def(PickledAsKeywords<CameraSigma>())
      .def_static("exact", &CameraSigma::Exact, "All zero.")
      .def_readwrite("log_focal", &CameraSigma::log_focal, "Of the focal length's logarithm.")
      .def_readwrite("log_aspect", &CameraSigma::log_aspect, "Of log (fy / fx).")
      .def_readwrite("principal_point_px", &CameraSigma::principal_point_px,
                     "Of each coordinate, pixels.")
      .def_readwrite("k1", &CameraSigma::k1, "Of the first distortion coefficient.")
      .def_readwrite("doubtful_log_focal", &CameraSigma::doubtful_log_focal,
                     "Of log f where the figure given is a placeholder; 0: it is none.");
  py::class_<NoiseModel>(*module, "NoiseModel",
                         "What is not exact beside the noise of points: standard deviations; 0: "
                         "exact. The defaults are those of photographs.")
      .def(py::init(&FromKeywords<NoiseModel>))
      .def(PickledAsKeywords<NoiseModel>())
      .def_static("exact", &NoiseModel::Exact,
                  "Nothing but the noise of points: for simulated evidence.")
      .def_readwrite("contour_px", &NoiseModel::contour_px,
                     "Error that neighbouring points of a contour share, pixels.")
      .def_readwrite("line_px", &NoiseModel::line_px, "The same of a line, pixels.")
      .def_readwrite("correlation_px", &NoiseModel::correlation_px,
                     "Over which length that stays the same, pixels.")
      .def_readwrite("contour_offset_px", &NoiseModel::contour_offset_px,
                     "Offset that all contours of one contrast share, pixels.")
      .def_readwrite("circle_tilt_rad", &NoiseModel::circle_tilt_rad,
                     "A circle's plane against the world's, about each of two axes, radians.")
      .def_readwrite("circle_height", &NoiseModel::circle_height,
                     "A circle over the world's plane, a share of its radius.")
      .def_readwrite("circle_shape", &NoiseModel::circle_shape,
                     "How far a circle is out of round, a share of its radius.")
      .def_readwrite("line_direction_rad", &NoiseModel::line_direction_rad,
                     "A line against its pencil's direction, radians.")
      .def_readwrite("pencil_axis_rad", &NoiseModel::pencil_axis_rad,
                     "A pencil's direction against its axis, radians.")
      .def_readwrite("grid_line", &NoiseModel::grid_line,
                     "A line of a grid of equal squares from its place, a share of its width.")
      .def_readwrite("radius", &NoiseModel::radius, "A known radius without a sigma, relative.")
      .def_readwrite("length", &NoiseModel::length, "A known length without a sigma, relative.")
      .def_readwrite("camera", &NoiseModel::camera, "How well the camera is known.")
      .def_readwrite("spread", &NoiseModel::spread,
                     "Of the figures' logarithms from photo to photo; 0: believed as they are.");
}

void BindPose(py::module_* module) {
  py::class_<CameraPose>(*module, "CameraPose", "X_cam = rotation @ X_world + translation.")
      .def(py::init([](const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation) {
             if (!IsRotation(rotation) || !translation.allFinite()) {
               throw py::value_error(
                   "CameraPose: rotation must be a rotation (R @ R.T = 1, det R = 1) and "
                   "translation finite");
             }
             return CameraPose{rotation, translation};
           }),
           py::arg("rotation"), py::arg("translation"))
      .def(Pickled(&CameraPose::rotation, &CameraPose::translation))
      .def_readonly("rotation", &CameraPose::rotation, "(3, 3), read-only.")
      .def_readonly("translation", &CameraPose::translation, "(3,), read-only.");
}

void BindPriors(py::module_* module) {
  py::class_<PosePrior>(*module, "PosePrior", "A pose known from elsewhere, with its covariance.")
      .def(Pickled(&PosePrior::mean, &PosePrior::covariance))
      .def(py::init([](const CameraPose& mean, const Eigen::Matrix<double, 6, 6>& covariance) {
             PosePrior prior;
             prior.mean = mean;
             Eigen::Map<Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>(prior.covariance.data()) =
                 covariance;
             return prior;
           }),
           py::arg("mean"), py::arg("covariance"), "covariance: (6, 6), of [delta, delta_t].");
  py::class_<GravityPrior>(*module, "GravityPrior",
                           "A world direction that is known in the camera.")
      .def(Pickled(&GravityPrior::in_world, &GravityPrior::in_camera, &GravityPrior::sigma_rad))
      .def(py::init([](const Eigen::Vector3d& in_world, const Eigen::Vector3d& in_camera,
                       double sigma_rad) {
             GravityPrior prior;
             prior.in_world = in_world;
             prior.in_camera = in_camera;
             prior.sigma_rad = sigma_rad;
             return prior;
           }),
           py::arg("in_world"), py::arg("in_camera"),
           py::arg("sigma_rad") = GravityPrior().sigma_rad,
           "Unit vectors (3,); sigma of each of two components, radians.");
}

void BindFits(py::module_* module) {
  py::class_<ConicFit>(*module, "ConicFit", "An ellipse in calibrated coordinates.")
      .def(Pickled(&ConicFit::conic, &ConicFit::covariance, &ConicFit::rms_px,
                   &ConicFit::irregularity))
      .def_readonly("conic", &ConicFit::conic, "(3, 3), unit Frobenius norm, negative inside.")
      .def_property_readonly("covariance", &ConicFit::Covariance,
                             "(6, 6), of (C00, C11, C22, sqrt2 C01, sqrt2 C02, sqrt2 C12).")
      .def_readonly("rms_px", &ConicFit::rms_px, "Of the distances, pixels of the photo.")
      .def_readonly("irregularity", &ConicFit::irregularity, "Scales NoiseModel.circle_shape.");
  py::class_<ConicReading>(*module, "ConicReading", "An ellipse and the points that speak for it.")
      .def(Pickled(&ConicReading::fit, &ConicReading::inliers))
      .def_readonly("fit", &ConicReading::fit)
      .def_readonly("inliers", &ConicReading::inliers, "One per point of the contour, 1: inlier.");
  py::class_<DirectionReading>(*module, "DirectionReading", "A direction that a pencil may have.")
      .def(Pickled(&DirectionReading::direction, &DirectionReading::probability))
      .def_readonly("direction", &DirectionReading::direction, "(3,), unit, without sense.")
      .def_readonly("probability", &DirectionReading::probability);
  py::class_<LineFit>(*module, "LineFit", "A line in calibrated coordinates.")
      .def(Pickled(&LineFit::line, &LineFit::covariance, &LineFit::rms_px))
      .def_readonly("line", &LineFit::line, "(3,), unit, without sense.")
      .def_readonly("covariance", &LineFit::covariance, "(3, 3), of the line.")
      .def_readonly("rms_px", &LineFit::rms_px, "Of the points about it, pixels of the photo.");
  py::class_<VanishingPointFit>(*module, "VanishingPointFit", "The direction of a pencil.")
      .def(Pickled(&VanishingPointFit::direction, &VanishingPointFit::covariance))
      .def_readonly("direction", &VanishingPointFit::direction,
                    "(3,), unit, camera frame, without sense.")
      .def_readonly("covariance", &VanishingPointFit::covariance, "(3, 3), of it, rad^2.");
}

}  // namespace

void BindValues(py::module_* module) {
  BindCamera(module);
  BindNoise(module);
  BindPose(module);
  BindPriors(module);
  BindFits(module);
}

}  // namespace circline::python
