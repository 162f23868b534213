// Visual odometry with circles and directions as landmarks, over a recorded sequence: a camera is
// moved about a box with a disc on it, dots around the disc, clutter behind.
//
//     visual_odometry apps/demo/disc.yaml /usr/share/visp-images-data/ViSP-images/mire-2
//
// (frames of the Debian package visp-images-data). The scene file gives the camera, the disc's
// radius and, of twelve frames, the pose by other means. examples/ceres_graph.cc is the simpler
// introduction.
//
// Each frame is detected, its circles and lines are matched to the landmarks under the pose of the
// frame before (landmarks.h), and its pose is solved for. Every seventh is a keyframe; now and
// then, and at the end, all keyframes and landmarks are adjusted together. Landmarks are those of
// the first frame that has three circles; none is added later. The package test builds and runs
// this program; its exit code says whether the poses are as good as their covariances claim.
#include <ceres/ceres.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <deque>
#include <filesystem>
#include <map>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "circline/ransac/detection/detect_observations.h"
#include "circline/refine/estimate_pose.h"
#include "landmarks.h"

using namespace circline;
using Eigen::Matrix3d;
using Eigen::Vector3d;

// A keyframe every so many frames (and where the pose is known otherwise), an adjustment of all
// every so many keyframes.
constexpr int kKeyframeEvery = 7, kAdjustEvery = 10;
constexpr double kDegrees = 180.0 / 3.14159265358979;
constexpr int kNoFrames = 77;  // Exit code; what tests take for skipped.

struct Recording {
  Camera camera;
  double disc_radius = 0.0;  // Millimetres.
  std::map<std::string, CameraPose> truth;
};

Recording ReadRecording(const std::string& path) {
  const cv::FileStorage file(path, cv::FileStorage::READ);
  const cv::FileNode node = file["cameras"][0];
  std::vector<double> K, distortion, R, t;
  node["camera_matrix"] >> K, node["distortion"] >> distortion;
  Recording recording;
  Camera& camera = recording.camera;
  camera.model = CameraModel::kOpenCV;
  camera.width = node["width"], camera.height = node["height"];
  camera.fx = K.at(0), camera.cx = K.at(2), camera.fy = K.at(4), camera.cy = K.at(5);
  std::copy(distortion.begin(), distortion.end(), camera.distortion.begin());
  recording.disc_radius = file["images"][0]["circles"][0]["radius"];
  for (const cv::FileNode& image : file["images"]) {
    image["truth"]["rotation"] >> R, image["truth"]["translation"] >> t;
    recording.truth[image["file"]] = {Matrix3d(R.data()).transpose(), Vector3d(t.data())};
  }
  return recording;
}

// A ceres::Problem of one frame, or of all keyframes.
class Graph {
 public:
  Graph(const std::vector<Frame*>& frames, Map* map) {
    for (Frame* frame : frames) {
      for (const Feature& feature : frame->features)
        problem_.AddResidualBlock(feature.cost.get(), nullptr, feature.blocks);
      if (problem_.HasParameterBlock(frame->q()))
        problem_.SetManifold(frame->q(), new ceres::EigenQuaternionManifold);
    }
    for (Circle& circle : map->circles) MoveOnSphere(&circle.normal);
    for (Vector3d& direction : map->directions) MoveOnSphere(&direction);
  }
  void Hold(double* block) {
    if (problem_.HasParameterBlock(block)) problem_.SetParameterBlockConstant(block);
  }
  bool Solve() {
    ceres::Solver::Summary summary;
    ceres::Solve(ceres::Solver::Options(), &problem_, &summary);
    return summary.IsSolutionUsable();
  }
  // Of [delta, delta_t], as PoseHypothesis::covariance.
  bool Covariance(Frame* frame, Matrix6d* covariance) {
    const std::vector<const double*> pose = {frame->q(), frame->t()};
    ceres::Covariance sigma{ceres::Covariance::Options()};
    Eigen::Matrix<double, 6, 6, Eigen::RowMajor> C;
    if (!sigma.Compute(pose, &problem_) || !sigma.GetCovarianceMatrixInTangentSpace(pose, C.data()))
      return false;
    Vector6d unit = Vector6d::Ones();
    unit.head<3>().setConstant(2.0);  // The quaternion's tangent is half a rotation vector.
    *covariance = unit.asDiagonal() * C * unit.asDiagonal();
    return true;
  }

 private:
  void MoveOnSphere(Vector3d* unit) {
    if (problem_.HasParameterBlock(unit->data()))
      problem_.SetManifold(unit->data(), new ceres::SphereManifold<3>);
  }
  static ceres::Problem::Options FramesOwnCosts() {
    ceres::Problem::Options options;
    options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    return options;
  }
  ceres::Problem problem_{FramesOwnCosts()};
};

// The pose of a frame, the landmarks as they are.
bool Track(Frame* frame, Map* map) {
  if (frame->features.size() < 3) return false;
  Graph graph({frame}, map);
  for (Circle& circle : map->circles) {
    for (double* block : {circle.center.data(), circle.normal.data(), &circle.radius})
      graph.Hold(block);
  }
  for (Vector3d& direction : map->directions) graph.Hold(direction.data());
  return graph.Solve();
}

// Everything. One pose says where the world is, the disc how large.
Graph MakeGraph(const std::vector<Frame*>& keyframes, Frame* held, Map* map) {
  Graph graph(keyframes, map);
  graph.Hold(held->q());
  graph.Hold(held->t());
  graph.Hold(&map->circles[0].radius);
  return graph;
}

Observations Detect(const cv::Mat& photo, const Recording& recording) {
  Observations seen;
  const Status status = DetectObservations(photo, recording.camera, DetectionOptions(), &seen);
  if (!status.ok()) std::fprintf(stderr, "%s\n", status.message.c_str());
  // The disc, whose radius is known, has the longest contour.
  const auto disc = std::max_element(
      seen.circles.begin(), seen.circles.end(),
      [](const auto& a, const auto& b) { return a.points.size() < b.points.size(); });
  if (disc != seen.circles.end()) disc->radius = recording.disc_radius;
  return seen;
}

// A frame whose pose is known otherwise.
struct Checked {
  Frame* frame;
  CameraPose truth;
  PoseEstimate alone;  // From this frame and nothing else.
};

// Angle between the disc's normal, camera frame, and the truth, degrees.
double NormalOff(const Vector3d& normal, const CameraPose& truth) {
  const double cosine = std::abs(normal.dot(truth.rotation.col(2)));
  return kDegrees * std::acos(std::min(cosine, 1.0));
}

// How far a keyframe has drifted since the first one, whose pose the graph holds: its pose against
// the true motion from there.
bool Check(const Checked& first, const Checked& now, const Map& map, Graph* graph) {
  const Matrix3d motion = now.truth.rotation * first.truth.rotation.transpose();
  const Matrix3d R = motion * first.frame->rotation;
  const Vector3d t =
      motion * (first.frame->translation - first.truth.translation) + now.truth.translation;
  Vector6d error;  // [delta, delta_t]
  error << LogRotation(R * now.frame->rotation.conjugate()), t - now.frame->translation;
  Matrix6d C;
  if (!graph->Covariance(now.frame, &C)) return false;
  const double sigmas = std::sqrt(error.dot(C.ldlt().solve(error)) / 6.0);
  const double sigma_degrees = kDegrees * std::sqrt(C.topLeftCorner<3, 3>().trace());
  std::printf("%s  drift %.2f +- %.2f degrees, %.1f +- %.1f mm: %.1f sigma; normal %.2f",
              now.frame->name.c_str(), kDegrees * error.head<3>().norm(), sigma_degrees,
              error.tail<3>().norm(), std::sqrt(C.bottomRightCorner<3, 3>().trace()), sigmas,
              NormalOff(now.frame->rotation * map.circles[0].normal, now.truth));
  if (now.alone.status.ok()) {
    const CameraPose& alone = now.alone.hypotheses[0].cam_from_world;
    std::printf(", from this frame alone %.2f", NormalOff(alone.rotation.col(2), now.truth));
  }
  std::printf("\n");
  // About 1 expected, above 2 once in 1500; and a sigma that is of use.
  return sigmas < 2.0 && sigma_degrees < 0.5;
}

// One run through the frames. References to elements of a deque stay valid as it grows.
struct Odometry {
  Map map;
  std::deque<Frame> frames;
  std::vector<Frame*> keyframes;
  std::vector<Checked> checked;
  int num_lost = 0;

  void Add(const std::string& name, const Observations& seen, const Recording& recording);
  bool Locate(const Observations& seen, Frame* frame);  // The newest frame.
};

bool Odometry::Locate(const Observations& seen, Frame* frame) {
  if (map.circles.empty()) {
    if (!StartMap(seen, frame, &map)) return false;
  } else {
    const Frame& before = frames[frames.size() - 2];
    frame->rotation = before.rotation;
    frame->translation = before.translation;
  }
  MatchFeatures(seen, &map, frame);
  return Track(frame, &map);
}

void Odometry::Add(const std::string& name, const Observations& seen, const Recording& recording) {
  Frame& frame = frames.emplace_back();
  frame.name = name;
  if (!Locate(seen, &frame)) {
    if (!map.circles.empty()) ++num_lost;
    frames.pop_back();
    return;
  }
  const auto truth = recording.truth.find(name);
  const bool is_checked = truth != recording.truth.end();
  if (is_checked) checked.push_back({&frame, truth->second, EstimatePose(seen)});
  if (!is_checked && frames.size() % kKeyframeEvery != 1) return;
  keyframes.push_back(&frame);
  if (keyframes.size() % kAdjustEvery == 0) MakeGraph(keyframes, keyframes[0], &map).Solve();
}

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: visual_odometry SCENE FRAMES\n");
    return 2;
  }
  std::vector<cv::String> files;  // In order of their names.
  if (std::filesystem::is_directory(argv[2])) cv::glob(std::string(argv[2]) + "/*.pgm", files);
  if (files.empty()) {
    std::fprintf(stderr, "no frames in %s; apt-get install visp-images-data\n", argv[2]);
    return kNoFrames;
  }
  const Recording recording = ReadRecording(argv[1]);
  Odometry odometry;
  for (const std::string& file : files) {
    odometry.Add(file.substr(file.rfind('/') + 1),
                 Detect(cv::imread(file, cv::IMREAD_GRAYSCALE), recording), recording);
  }
  if (odometry.checked.size() < 2) {
    std::fprintf(stderr, "no frames of known pose were tracked\n");
    return 1;
  }
  const Checked& first = odometry.checked[0];
  Graph graph = MakeGraph(odometry.keyframes, first.frame, &odometry.map);
  bool right = graph.Solve() && odometry.num_lost == 0;
  std::printf("%zu of %zu frames, %d lost on the way; %zu keyframes, %zu circles, %zu directions\n",
              odometry.frames.size(), files.size(), odometry.num_lost, odometry.keyframes.size(),
              odometry.map.circles.size(), odometry.map.directions.size());
  for (std::size_t i = 1; i < odometry.checked.size(); ++i)
    right = Check(first, odometry.checked[i], odometry.map, &graph) && right;
  return right ? 0 : 1;
}
