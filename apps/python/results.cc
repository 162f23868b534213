// What estimate and adjust return. All of it is read-only; arrays are views of it.
#include <sstream>
#include <string>
#include <vector>

#include "apps/python/bindings.h"
#include "apps/python/pickled.h"
#include "circline/estimators/pose.h"
#include "circline/refine/adjust_photos.h"

namespace circline::python {
namespace {

namespace py = pybind11;

template <int kSize>
Eigen::Map<const Eigen::Matrix<double, kSize, kSize, Eigen::RowMajor>> Square(
    const std::array<double, kSize * kSize>& entries) {
  return Eigen::Map<const Eigen::Matrix<double, kSize, kSize, Eigen::RowMajor>>(entries.data());
}

Eigen::Matrix<double, Eigen::Dynamic, 6, Eigen::RowMajor> FreeDirections(
    const PoseHypothesis& hypothesis) {
  Eigen::Matrix<double, Eigen::Dynamic, 6, Eigen::RowMajor> rows(
      static_cast<Eigen::Index>(hypothesis.free_directions.size()), 6);
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    rows.row(i) = Eigen::Map<const Eigen::Matrix<double, 1, 6>>(
        hypothesis.free_directions[static_cast<std::size_t>(i)].data());
  }
  return rows;
}

std::string Describe(const PoseHypothesis& hypothesis) {
  std::ostringstream text;
  const Eigen::Vector3d& t = hypothesis.cam_from_world.translation;
  text << "PoseHypothesis(probability=" << hypothesis.probability << ", translation=[" << t.x()
       << ", " << t.y() << ", " << t.z() << "], metric=" << (hypothesis.metric ? "True" : "False")
       << ", rms_px=" << hypothesis.rms_px << ")";
  return text.str();
}

void BindHypothesis(py::module_* module) {
  using H = PoseHypothesis;
  py::class_<H>(*module, "PoseHypothesis", "One pose that the evidence admits.")
      .def(Pickled(&H::cam_from_world, &H::metric, &H::probability, &H::cost, &H::log_det,
                   &H::covariance, &H::rank, &H::free_directions, &H::focal_scale, &H::focal_sigma,
                   &H::focal_covariance, &H::camera, &H::left_out, &H::structure, &H::rms_px,
                   &H::num_inliers, &H::num_observations, &H::origin_observed, &H::circles,
                   &H::pencils))
      .def_readonly("cam_from_world", &H::cam_from_world)
      .def_readonly("metric", &H::metric, "Else the translation has unit norm.")
      .def_readonly("probability", &H::probability, "Among the hypotheses of the estimate.")
      .def_readonly("cost", &H::cost, "1/2 sum rho(r^2), residuals in standard deviations.")
      .def_readonly("log_det", &H::log_det, "Of the covariance of all parameters.")
      .def_property_readonly(
          "covariance", [](const H& h) { return Square<6>(h.covariance); },
          py::return_value_policy::reference_internal,
          "(6, 6), of [delta, delta_t]: rotation = exp([delta]x) @ estimate, camera frame, "
          "radians.")
      .def_readonly("rank", &H::rank, "Of that covariance.")
      .def_property_readonly("free_directions", &FreeDirections,
                             "(N, 6), directions of [delta, delta_t] of which nothing is known.")
      .def_readonly("focal_scale", &H::focal_scale, "What fx and fy are to be multiplied by.")
      .def_readonly("focal_sigma", &H::focal_sigma, "Of focal_scale; 0 where it was not refined.")
      .def_property_readonly(
          "focal_covariance",
          [](const H& h) { return Eigen::Map<const Vector6d>(h.focal_covariance.data()); },
          py::return_value_policy::reference_internal,
          "(6,), of focal_scale with [delta, delta_t].")
      // A copy, as in AdjustedCamera: a Camera can be changed, a result cannot.
      .def_property_readonly(
          "camera", [](const H& h) { return h.camera; },
          "The one it sees through, where that was refined; a copy.")
      .def_readonly("left_out", &H::left_out, "Features that contradict the rest.")
      .def_readonly("structure", &H::structure, "Which plane and reading of the evidence.")
      .def_readonly("rms_px", &H::rms_px, "Of the inlier residuals, pixels of the photo.")
      .def_readonly("num_inliers", &H::num_inliers, "Scalar residuals.")
      .def_readonly("num_observations", &H::num_observations, "Scalar residuals.")
      .def_readonly("origin_observed", &H::origin_observed, "Whether evidence fixes the origin.")
      .def_readonly("circles", &H::circles)
      .def_readonly("pencils", &H::pencils)
      .def_property_readonly("rotation_is_free", &H::RotationIsFree, "Whether some rotation is.")
      .def_property_readonly("sigma_rotation", &H::SigmaRotation,
                             "(3,), of delta, radians; infinite where unbounded.")
      .def("__repr__", &Describe);
}

void BindEstimate(py::module_* module) {
  py::class_<CircleEstimate>(*module, "CircleEstimate", "A circle as a hypothesis places it.")
      .def(Pickled(&CircleEstimate::id, &CircleEstimate::normal, &CircleEstimate::center,
                   &CircleEstimate::center_px, &CircleEstimate::radius))
      .def_readonly("id", &CircleEstimate::id)
      .def_readonly("normal", &CircleEstimate::normal, "(3,), unit, camera frame, facing it.")
      .def_readonly("center", &CircleEstimate::center, "(3,), camera frame.")
      .def_readonly("center_px", &CircleEstimate::center_px, "(2,), its image, pixels.")
      .def_readonly("radius", &CircleEstimate::radius, "In the unit of the translation.");
  py::class_<PencilEstimate>(*module, "PencilEstimate", "A pencil as a hypothesis sees it.")
      .def(Pickled(&PencilEstimate::id, &PencilEstimate::direction, &PencilEstimate::sigma_deg))
      .def_readonly("id", &PencilEstimate::id)
      .def_readonly("direction", &PencilEstimate::direction, "(3,), unit, camera frame.")
      .def_readonly("sigma_deg", &PencilEstimate::sigma_deg, "Of the direction, degrees.");
  BindHypothesis(module);
  py::class_<PoseEstimate>(*module, "PoseEstimate", "Every pose that the evidence admits.")
      .def(Pickled(&PoseEstimate::status, &PoseEstimate::solver, &PoseEstimate::hypotheses,
                   &PoseEstimate::decided_by, &PoseEstimate::notes))
      .def_readonly("solver", &PoseEstimate::solver)
      .def_readonly("hypotheses", &PoseEstimate::hypotheses, "Best first; one or more.")
      .def_readonly("decided_by", &PoseEstimate::decided_by,
                    "Which evidence tells the first hypothesis from the others.")
      .def_readonly("notes", &PoseEstimate::notes, "Evidence left out, and why.");
}

py::array_t<double> Residuals(const AdjustedPhoto& photo) {
  py::array_t<double> rows({static_cast<py::ssize_t>(photo.residuals.size()), py::ssize_t{4}});
  double* out = rows.mutable_data();
  for (const AdjustedResidual& r : photo.residuals) {
    for (const double value : {r.pixel.x(), r.pixel.y(), r.offset.x(), r.offset.y()})
      *out++ = value;
  }
  return rows;
}

void BindAdjusted(py::module_* module) {
  using C = AdjustedCamera;
  py::class_<C>(*module, "AdjustedCamera", "A camera as many photos tell it.")
      .def(Pickled(&C::camera, &C::covariance, &C::at_prior, &C::num_photos, &C::rms_px,
                   &C::sigma_by_photos))
      .def_property_readonly(
          "camera", [](const C& c) { return c.camera; }, "A copy.")
      .def_property_readonly(
          "covariance", [](const C& c) { return Square<kCameraSize>(c.covariance); },
          py::return_value_policy::reference_internal,
          "(12, 12), of log f, log (fy / fx), principal point (2, pixels), distortion (8).")
      .def_readonly("at_prior", &C::at_prior, "What the photos say next to nothing of.")
      .def_readonly("num_photos", &C::num_photos)
      .def_readonly("rms_px", &C::rms_px, "Of the inlier residuals, pixels.")
      .def_readonly("sigma_by_photos", &C::sigma_by_photos,
                    "Of log f from the first photos alone: how many, and that.")
      .def_property_readonly("sigma_focal_px", &C::SigmaFocalPx, "Of fx, pixels.");
  using P = AdjustedPhoto;
  py::class_<P>(*module, "AdjustedPhoto", "One photo's part.")
      .def(Pickled(&P::status, &P::same_as, &P::camera, &P::cam_from_world, &P::covariance,
                   &P::rms_px, &P::misfit, &P::num_grid_lines, &P::left_out, &P::residuals))
      .def_property_readonly(
          "ok", [](const P& p) { return p.status.ok(); },
          "Whether it takes part; else `message` says why not.")
      .def_property_readonly("message", [](const P& p) { return p.status.message; })
      .def_readonly("same_as", &P::same_as, "The photo that shows nearly the same, or -1.")
      .def_readonly("camera", &P::camera, "Index of its camera.")
      .def_readonly("cam_from_world", &P::cam_from_world)
      .def_property_readonly(
          "covariance", [](const P& p) { return Square<6>(p.covariance); },
          py::return_value_policy::reference_internal, "(6, 6), as of PoseHypothesis.")
      .def_readonly("rms_px", &P::rms_px, "Of the inlier residuals, pixels.")
      .def_readonly("misfit", &P::misfit, "Median chi^2 of its features by residual.")
      .def_readonly("num_grid_lines", &P::num_grid_lines,
                    "Lines on a grid of equal squares, its world where there are any.")
      .def_readonly("left_out", &P::left_out, "Features that contradict the rest.")
      .def_property_readonly("residuals", &Residuals,
                             "(N, 4), of the points that count: where each lies and how far it is "
                             "from where it should be, pixels.");
  using A = AdjustedCircle;
  py::class_<A>(*module, "AdjustedCircle", "A circle of a world.")
      .def(Pickled(&A::id, &A::photo, &A::center, &A::normal, &A::radius))
      .def_readonly("id", &A::id)
      .def_readonly("photo", &A::photo, "Of whose world; -1: that of all photos.")
      .def_readonly("center", &A::center, "(3,), world frame.")
      .def_readonly("normal", &A::normal, "(3,), world frame.")
      .def_readonly("radius", &A::radius);
  using D = AdjustedDirection;
  py::class_<D>(*module, "AdjustedDirection", "A pencil's direction in a world, without sense.")
      .def(Pickled(&D::id, &D::photo, &D::direction))
      .def_readonly("id", &D::id)
      .def_readonly("photo", &D::photo, "Of whose world; -1: that of all photos.")
      .def_readonly("direction", &D::direction, "(3,), unit, world frame.");
  using G = GivenFrame;
  py::class_<G>(*module, "GivenFrame",
                "Of given poses: X_given = scale * rotation @ X_world + translation.")
      .def(Pickled(&G::scale, &G::rotation, &G::translation, &G::log_scale_sigma))
      .def_readonly("scale", &G::scale)
      .def_readonly("rotation", &G::rotation, "(3, 3).")
      .def_readonly("translation", &G::translation, "(3,), in the unit of the given poses.")
      .def_readonly("log_scale_sigma", &G::log_scale_sigma,
                    "Meaningful where the world is metric.");
  py::class_<AdjustedPhotos>(*module, "AdjustedPhotos",
                             "Cameras, poses, circles and directions of many photos.")
      .def(Pickled(&AdjustedPhotos::status, &AdjustedPhotos::cameras, &AdjustedPhotos::photos,
                   &AdjustedPhotos::circles, &AdjustedPhotos::directions, &AdjustedPhotos::given,
                   &AdjustedPhotos::rigid, &AdjustedPhotos::metric, &AdjustedPhotos::notes))
      .def_readonly("cameras", &AdjustedPhotos::cameras)
      .def_readonly("photos", &AdjustedPhotos::photos, "One for each of the input.")
      .def_readonly("circles", &AdjustedPhotos::circles)
      .def_readonly("directions", &AdjustedPhotos::directions)
      .def_readonly("given", &AdjustedPhotos::given, "Where poses were given: a GivenFrame.")
      .def_readonly("rigid", &AdjustedPhotos::rigid, "Whether all photos show one world.")
      .def_readonly("metric", &AdjustedPhotos::metric)
      .def_readonly("notes", &AdjustedPhotos::notes);
}

}  // namespace

void BindResults(py::module_* module) {
  BindEstimate(module);
  BindAdjusted(module);
}

}  // namespace circline::python
