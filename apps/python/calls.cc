// detect, fit, estimate and adjust. The interpreter is let go while they compute.
#include <exception>
#include <map>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/python/bindings.h"
#include "circline/ransac/detection/detect_observations.h"
#include "circline/ransac/fit_observations.h"
#include "circline/refine/adjust_photos.h"
#include "circline/refine/estimate_pose.h"

namespace circline::python {
namespace {

namespace py = pybind11;

// The photo's own memory; rows may lie apart. `array` must outlive it.
cv::Mat MatOf(const py::array& array) {
  const py::ssize_t channels = array.ndim() == 3 ? array.shape(2) : 1;
  if (!py::isinstance<py::array_t<std::uint8_t>>(array) || array.ndim() < 2 || array.ndim() > 3 ||
      (channels != 1 && channels != 3 && channels != 4)) {
    throw py::value_error("an image must be of uint8, of shape (H, W), (H, W, 3) or (H, W, 4)");
  }
  if (array.size() == 0) throw py::value_error("the image is empty");
  return cv::Mat(static_cast<int>(array.shape(0)), static_cast<int>(array.shape(1)),
                 CV_8UC(static_cast<int>(channels)), const_cast<void*>(array.data()),
                 static_cast<std::size_t>(array.strides(0)));
}

// As it is where pixels of a row follow each other, else a copy in which they do.
py::array Rows(const py::array& image) {
  const py::ssize_t pixel = image.ndim() == 3 ? image.shape(2) : 1;
  const bool packed = image.ndim() >= 2 && image.itemsize() == 1 && image.strides(1) == pixel &&
                      image.strides(0) >= pixel * image.shape(1) &&
                      (image.ndim() == 2 || image.strides(2) == 1);
  return packed ? image : py::array(py::module_::import("numpy").attr("ascontiguousarray")(image));
}

// One named thread-safe step: `compute` without the interpreter's lock.
template <typename Compute>
auto Unlocked(const Compute& compute) {
  const py::gil_scoped_release unlocked;
  return compute();
}

LossOptions Loss(const std::string& name, double scale_px, const char* field) {
  LossOptions loss;
  if (!LossFromName(name, &loss.type))
    throw py::value_error(std::string(field) + ": there is no loss " + name);
  loss.scale_px = scale_px;
  return loss;
}

// Of cameras these keep a copy: Python may change its own while they compute.
py::object Detect(const py::array& image, const Camera& camera, const DetectionOptions& options) {
  const py::array rows = Rows(image);
  const cv::Mat mat = MatOf(rows);
  Observations observations;
  ThrowUnlessOk(
      Unlocked([&, camera] { return DetectObservations(mat, camera, options, &observations); }));
  return ObservationsToPython(std::move(observations));
}

py::object DetectCircle(const py::array& image, const Camera& camera, const std::array<int, 4>& roi,
                        const DetectionOptions& options) {
  const py::array rows = Rows(image);
  const cv::Mat mat = MatOf(rows);
  const cv::Rect box(roi[0], roi[1], roi[2], roi[3]);
  CircleObservation circle;
  ThrowUnlessOk(
      Unlocked([&, camera] { return DetectCircleInRoi(mat, camera, box, options, &circle); }));
  return CircleToPython(std::move(circle));
}

py::object Fit(const py::handle& given, const FitOptions& options,
               std::optional<py::list> problems) {
  Observations observations = ObservationsFromPython(given);
  std::vector<std::string> said;
  ThrowUnlessOk(Unlocked([&] { return FitObservations(options, &observations, &said); }));
  if (problems) {
    for (const std::string& problem : said) problems->append(problem);
  }
  return ObservationsToPython(std::move(observations));
}

PoseEstimate Estimate(const py::handle& given, const EstimationOptions& options) {
  const Observations observations = ObservationsFromPython(given);
  ThrowUnlessOk(options.Validate());
  PoseEstimate estimate = Unlocked([&] { return EstimatePose(observations, options); });
  ThrowUnlessOk(estimate.status);
  return estimate;
}

// `progress` is called as AdjustOptions::progress is, until it raises: what it raises first is
// raised here in the end.
AdjustedPhotos Adjust(const py::iterable& given, const std::optional<py::function>& progress,
                      AdjustOptions options) {
  std::vector<Observations> photos;
  for (const py::handle photo : given) photos.push_back(ObservationsFromPython(photo));
  ThrowUnlessOk(options.Validate());
  std::exception_ptr raised;
  if (progress) {
    options.progress = [&progress, &raised](const char* what, int done, int total) {
      if (raised) return;
      const py::gil_scoped_acquire locked;
      try {
        (*progress)(what, done, total);
      } catch (const py::error_already_set&) {
        raised = std::current_exception();
      }
    };
  }
  AdjustedPhotos adjusted = Unlocked([&] { return AdjustPhotos(photos, options); });
  if (raised) std::rethrow_exception(raised);
  ThrowUnlessOk(adjusted.status);
  return adjusted;
}

void BindDetect(py::module_* module) {
  const DetectionOptions d;
  module->def(
      "detect",
      [](const py::array& image, const Camera& camera, double min_ellipse_axis_px,
         double min_arc_deg, double min_segment_length_px, int max_circles, int max_pencils,
         double max_shared_plane_deg, std::uint64_t seed, const std::optional<NoiseModel>& noise) {
        DetectionOptions options;
        options.min_ellipse_axis_px = min_ellipse_axis_px;
        options.min_arc_deg = min_arc_deg;
        options.min_segment_length_px = min_segment_length_px;
        options.max_circles = max_circles;
        options.max_pencils = max_pencils;
        options.max_shared_plane_deg = max_shared_plane_deg;
        options.seed = seed;
        if (noise) options.noise_model = *noise;
        return Detect(image, camera, options);
      },
      py::arg("image"), py::arg("camera"), py::kw_only(),
      py::arg("min_ellipse_axis_px") = d.min_ellipse_axis_px,
      py::arg("min_arc_deg") = d.min_arc_deg,
      py::arg("min_segment_length_px") = d.min_segment_length_px,
      py::arg("max_circles") = d.max_circles, py::arg("max_pencils") = d.max_pencils,
      py::arg("max_shared_plane_deg") = d.max_shared_plane_deg, py::arg("seed") = d.seed,
      py::arg("noise_model") = py::none(),
      "Circles and pencils of parallel lines in a photo, fits included: Observations.\n\n"
      "image: uint8, (H, W), (H, W, 3) (blue first, as OpenCV) or (H, W, 4); not copied where its\n"
      "rows are packed. A photo in which nothing is found is no error: `message` says so. "
      "Options:\n"
      "ransac/detection/detect_observations.h. ValueError: wrong image, camera or option.");
  module->def(
      "detect_circle",
      [](const py::array& image, const Camera& camera, const std::array<int, 4>& roi,
         double min_ellipse_axis_px, double min_arc_deg, std::uint64_t seed,
         const std::optional<NoiseModel>& noise) {
        DetectionOptions options;
        options.min_ellipse_axis_px = min_ellipse_axis_px;
        options.min_arc_deg = min_arc_deg;
        options.seed = seed;
        if (noise) options.noise_model = *noise;
        return DetectCircle(image, camera, roi, options);
      },
      py::arg("image"), py::arg("camera"), py::arg("roi"), py::kw_only(),
      py::arg("min_ellipse_axis_px") = d.min_ellipse_axis_px,
      py::arg("min_arc_deg") = d.min_arc_deg, py::arg("seed") = d.seed,
      py::arg("noise_model") = py::none(),
      "The ellipse best supported inside a rectangle, roi = (x, y, width, height), pixels: a\n"
      "CircleObservation. Refused where there is none.");
}

void BindFit(py::module_* module) {
  const FitOptions d;
  module->def(
      "fit",
      [](const py::handle& observations, double inlier_threshold_px, double confidence,
         int max_iterations, std::uint64_t seed, double sigma_px, double direction_sigma_rad,
         const std::optional<NoiseModel>& noise, const std::optional<py::list>& problems) {
        FitOptions options;
        options.inlier_threshold_px = inlier_threshold_px;
        options.confidence = confidence;
        options.max_iterations = max_iterations;
        options.seed = seed;
        options.sigma_px = sigma_px;
        options.direction_sigma_rad = direction_sigma_rad;
        if (noise) options.noise_model = *noise;
        return Fit(observations, options, problems);
      },
      py::arg("observations"), py::kw_only(),
      py::arg("inlier_threshold_px") = d.inlier_threshold_px, py::arg("confidence") = d.confidence,
      py::arg("max_iterations") = d.max_iterations, py::arg("seed") = d.seed,
      py::arg("sigma_px") = d.sigma_px, py::arg("direction_sigma_rad") = d.direction_sigma_rad,
      py::arg("noise_model") = py::none(), py::arg("problems") = py::none(),
      "Robust fits of all circles, lines and pencils: the same Observations with fits and inlier\n"
      "masks. `problems`, a list, receives a sentence for each feature that could not be fitted.\n"
      "Options: ransac/fit_observations.h. ValueError: wrong observations or option.");
}

void BindEstimateCall(py::module_* module) {
  const EstimationOptions d;
  module->def(
      "estimate",
      [](const py::handle& observations, const std::string& conic_loss, double conic_scale,
         const std::string& line_loss, double line_scale, const std::string& conic_distance,
         const std::optional<NoiseModel>& noise, const std::optional<CameraSigma>& camera_sigma,
         const std::optional<PosePrior>& pose_prior,
         const std::optional<GravityPrior>& gravity_prior, const std::optional<CameraPose>& prior,
         int max_iterations, double max_cost_gap) {
        EstimationOptions options;
        options.conic_loss = Loss(conic_loss, conic_scale, "conic_loss");
        options.line_loss = Loss(line_loss, line_scale, "line_loss");
        if (!ConicDistanceFromName(conic_distance, &options.conic_distance))
          throw py::value_error("conic_distance must be auto, sampson or orthogonal");
        if (noise) options.noise_model = *noise;
        options.camera_sigma = camera_sigma;
        options.pose_prior = pose_prior;
        options.gravity_prior = gravity_prior;
        options.prior = prior;
        options.max_iterations = max_iterations;
        options.max_cost_gap = max_cost_gap;
        return Estimate(observations, options);
      },
      py::arg("observations"), py::kw_only(), py::arg("conic_loss") = LossName(d.conic_loss.type),
      py::arg("conic_loss_scale_px") = d.conic_loss.scale_px,
      py::arg("line_loss") = LossName(d.line_loss.type),
      py::arg("line_loss_scale_px") = d.line_loss.scale_px,
      py::arg("conic_distance") = ConicDistanceName(d.conic_distance),
      py::arg("noise_model") = py::none(), py::arg("camera_sigma") = py::none(),
      py::arg("pose_prior") = py::none(), py::arg("gravity_prior") = py::none(),
      py::arg("prior") = py::none(), py::arg("max_iterations") = d.max_iterations,
      py::arg("max_cost_gap") = d.max_cost_gap,
      "Every pose that the observations admit, ranked, with covariances: PoseEstimate.\n\n"
      "Losses: trivial, huber, soft_l_one, cauchy, arctan, tukey, geman_mcclure; scales in "
      "pixels,\n"
      "0: from the scatter of each feature. Options: refine/estimate_pose.h. Refused, with the\n"
      "reason: the evidence does not determine a pose. ValueError: wrong observations or option.");
}

void BindAdjustCall(py::module_* module) {
  const AdjustOptions d;
  module->def(
      "adjust",
      [](const py::iterable& photos, const std::string& conic_loss, double conic_scale,
         const std::string& line_loss, double line_scale, const std::optional<NoiseModel>& noise,
         const std::map<std::string, CameraSigma>& camera_sigma, int num_radial,
         double tangential_sigma, const std::string& rigid, bool square_grids, double nearly_equal,
         std::vector<std::optional<CameraPose>> given_poses, double given_rotation_sigma,
         double given_translation_sigma, int max_iterations, int num_threads,
         int num_solver_threads, const std::optional<py::function>& progress) {
        AdjustOptions options;
        options.conic_loss = Loss(conic_loss, conic_scale, "conic_loss");
        options.line_loss = Loss(line_loss, line_scale, "line_loss");
        if (noise) options.noise_model = *noise;
        options.camera_sigma = camera_sigma;
        options.num_radial = num_radial;
        options.tangential_sigma = tangential_sigma;
        if (!RigidWorldFromName(rigid, &options.rigid))
          throw py::value_error("rigid must be auto, yes or no");
        options.square_grids = square_grids;
        options.nearly_equal = nearly_equal;
        options.given_poses = std::move(given_poses);
        options.given_rotation_sigma = given_rotation_sigma;
        options.given_translation_sigma = given_translation_sigma;
        options.max_iterations = max_iterations;
        options.num_threads = num_threads;
        options.num_solver_threads = num_solver_threads;
        return Adjust(photos, progress, std::move(options));
      },
      py::arg("observations_list"), py::kw_only(),
      py::arg("conic_loss") = LossName(d.conic_loss.type),
      py::arg("conic_loss_scale_px") = d.conic_loss.scale_px,
      py::arg("line_loss") = LossName(d.line_loss.type),
      py::arg("line_loss_scale_px") = d.line_loss.scale_px, py::arg("noise_model") = py::none(),
      py::arg("camera_sigma") = std::map<std::string, CameraSigma>(),
      py::arg("num_radial") = d.num_radial, py::arg("tangential_sigma") = d.tangential_sigma,
      py::arg("rigid") = RigidWorldName(d.rigid), py::arg("square_grids") = d.square_grids,
      py::arg("nearly_equal") = d.nearly_equal,
      py::arg("given_poses") = std::vector<std::optional<CameraPose>>(),
      py::arg("given_rotation_sigma") = d.given_rotation_sigma,
      py::arg("given_translation_sigma") = d.given_translation_sigma,
      py::arg("max_iterations") = d.max_iterations, py::arg("num_threads") = d.num_threads,
      py::arg("num_solver_threads") = d.num_solver_threads, py::arg("progress") = py::none(),
      "The camera (or several), the pose of every photo and what is seen: AdjustedPhotos.\n\n"
      "observations_list: one Observations a photo. camera_sigma: by Camera.id; without, nothing\n"
      "is known of a camera. given_poses: none, or of each photo a CameraPose from elsewhere, or\n"
      "None. progress: called with a word and how many of how many are done. Options:\n"
      "refine/adjust_photos.h. Refused, with the reason.");
}

}  // namespace

void BindCalls(py::module_* module) {
  BindDetect(module);
  BindFit(module);
  BindEstimateCall(module);
  BindAdjustCall(module);
}

}  // namespace circline::python
