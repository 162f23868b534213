// Scene files, camera files and the paper's simulation, as the programs have them.
#include <pybind11/stl/filesystem.h>

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "apps/common/camera_file.h"
#include "apps/common/scene.h"
#include "apps/python/bindings.h"
#include "apps/simulate/simulate.h"

namespace circline::python {
namespace {

namespace py = pybind11;
using py::literals::operator""_a;

// As os.fsdecode has it: a path need not be UTF-8.
py::str PathText(const std::string& text) {
  PyObject* decoded =
      PyUnicode_DecodeFSDefaultAndSize(text.data(), static_cast<Py_ssize_t>(text.size()));
  if (decoded == nullptr) throw py::error_already_set();
  return py::reinterpret_steal<py::str>(decoded);
}

// What is wrong with a file is the caller's to mend.
void ThrowUnlessRead(const Status& status) {
  if (status.ok()) return;
  PyErr_SetObject(PyExc_ValueError, PathText(status.message).ptr());
  throw py::error_already_set();
}

py::list LoadScene(const std::filesystem::path& path) {
  std::vector<apps::SceneImage> images;
  ThrowUnlessRead(apps::ReadScene(path.string(), {}, &images));
  const py::object scene_image = py::module_::import("circline.scene").attr("SceneImage");
  py::list loaded;
  for (apps::SceneImage& image : images) {
    py::dict rois;
    for (const apps::CircleRoi& roi : image.rois)
      rois[py::int_(roi.circle)] = py::cast(roi.rectangle);
    py::object camera_sigma = py::none(), rotation = py::none(), translation = py::none();
    if (image.camera_sigma.IsAny())
      camera_sigma = py::cast(
          image.camera_sigma.OverCalibrated(NoiseModel().SigmaOf(image.observations.camera)));
    if (image.truth && image.truth->rotation) rotation = py::cast(*image.truth->rotation);
    if (image.truth && image.truth->translation) translation = py::cast(*image.truth->translation);
    const apps::Symmetry symmetry = image.truth ? image.truth->symmetry : apps::Symmetry::kNone;
    loaded.append(scene_image(
        "name"_a = image.name, "path"_a = PathText(image.path),
        "observations"_a = ObservationsToPython(std::move(image.observations)),
        "camera_sigma"_a = camera_sigma, "detect_everything"_a = image.detect_everything,
        "rois"_a = rois, "true_rotation"_a = rotation, "true_translation"_a = translation,
        "symmetry"_a = apps::SymmetryName(symmetry)));
  }
  return loaded;
}

std::vector<Camera> LoadCameras(const std::filesystem::path& path) {
  std::vector<Camera> cameras;
  ThrowUnlessRead(apps::ReadCameraFile(path.string(), &cameras));
  return cameras;
}

py::list RunSimulation(const apps::SimulationOptions& options) {
  ThrowUnlessOk(options.Validate());
  std::vector<apps::SimulationRow> rows;
  {
    const py::gil_scoped_release unlocked;
    rows = apps::Simulate(options);
  }
  py::list table;
  for (const apps::SimulationRow& row : rows) {
    table.append(
        py::dict("noise_px"_a = row.noise_px, "outlier_ratio"_a = row.outlier_ratio,
                 "method"_a = row.method->name, "trials"_a = row.trials,
                 "failures"_a = row.failures, "axis_mean_rad"_a = row.axis_mean_rad,
                 "axis_std_rad"_a = row.axis_std_rad, "angle_mean_rad"_a = row.angle_mean_rad,
                 "angle_std_rad"_a = row.angle_std_rad, "rotation_rms_rad"_a = row.rotation_rms_rad,
                 "bound_rms_rad"_a = row.bound_rms_rad, "nees_mean"_a = row.nees_mean));
  }
  return table;
}

}  // namespace

void BindFiles(py::module_* module) {
  module->def("load_scene", &LoadScene, py::arg("path"),
              "The images of a scene file (docs/scene_files.md) and what is known of each: a list\n"
              "of SceneImage. ValueError: which place of the file is wrong.");
  module->def(
      "load_cameras", &LoadCameras, py::arg("path"),
      "The cameras of an OpenCV calibration file or a COLMAP cameras.txt. ValueError: what\n"
      "is wrong with it.");
  const apps::SimulationOptions d;
  module->def(
      "simulate",
      [](int trials, std::vector<double> noise_px, std::vector<double> outlier_ratio,
         const std::string& outlier_kind, double focal, const Eigen::Vector3d& translation,
         std::uint64_t seed, int threads) {
        apps::SimulationOptions options;
        options.trials = trials;
        options.noise_px = std::move(noise_px);
        options.outlier_ratios = std::move(outlier_ratio);
        if (outlier_kind != "band" && outlier_kind != "cluster")
          throw py::value_error("outlier_kind must be band or cluster");
        options.outlier_kind =
            outlier_kind == "band" ? apps::OutlierKind::kBand : apps::OutlierKind::kCluster;
        options.focal_px = focal;
        options.translation = translation;
        options.seed = seed;
        options.threads = threads;
        return RunSimulation(options);
      },
      py::kw_only(), py::arg("trials") = d.trials, py::arg("noise_px") = d.noise_px,
      py::arg("outlier_ratio") = d.outlier_ratios, py::arg("outlier_kind") = "band",
      py::arg("focal") = d.focal_px, py::arg("translation") = d.translation,
      py::arg("seed") = d.seed, py::arg("threads") = d.threads,
      "The paper's simulation, as circline_simulate has it: a list of dicts, the rows and columns\n"
      "of its simulation.csv (nees_mean is nan without noise). noise_px, focal: pixels.");
}

}  // namespace circline::python
