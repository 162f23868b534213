// The scene of the paper's simulation: a circle in a square of two orthogonal pairs of parallel
// lines, all on the plane Z = 0. Noisy observations of it, and the bound on what they can tell.
#ifndef CIRCLINE_APPS_SIMULATE_SCENE_H_
#define CIRCLINE_APPS_SIMULATE_SCENE_H_

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "circline/estimators/observations.h"
#include "circline/estimators/pose.h"
#include "circline/estimators/random.h"
#include "circline/estimators/status.h"

namespace circline::apps {

enum class OutlierKind {
  kBand,     // Uniform within 40 px of the feature.
  kCluster,  // In one disc of 15 px radius whose centre lies 40 px off the feature.
};

// What a trial adds to the true image.
struct Disturbance {
  double noise_px = 0.0;       // Standard deviation of each coordinate of each point.
  double outlier_ratio = 0.0;  // Share of each feature's points that is replaced.
  OutlierKind outlier_kind = OutlierKind::kBand;
};

// Evidence that a method may use. All of it knows that the axes, and the pencils along them, are
// orthogonal.
enum class Evidence {
  kCircleFrame,  // The circle, and the lines that are the axes.
  kLinePairs,    // The four lines.
  kJoint,        // All.
};
inline constexpr std::size_t kNumEvidences = 3;

inline constexpr std::size_t kNumFeatures = 5;  // The circle, L11, L12, L21, L22.
using InlierMasks = std::array<std::vector<std::uint8_t>, kNumFeatures>;

class PaperScene {
 public:
  PaperScene(double focal_px, const Eigen::Vector3d& translation);

  // Not ok where some point of the scene is not in front of the camera.
  Status Validate() const;

  // One trial's image. A noise of zero is stated to the library as sigma_px = 0.001. `masks`: which
  // points are not outliers.
  Observations Observe(const Disturbance& disturbance, Random* random, InlierMasks* masks) const;

  // Cramer-Rao bound on the covariance of the rotation (of delta, camera frame) from the points
  // that the masks keep, for a noise of 1 px; it grows with the square of the noise.
  Eigen::Matrix3d BoundCovariance(Evidence evidence, const InlierMasks& masks) const;

  const CameraPose& pose() const { return pose_; }

 private:
  static constexpr int kNumParameters = 10;
  using Gradient = Eigen::Matrix<double, kNumParameters, 1>;
  struct Sample {
    Eigen::Vector2d pixel;   // True image.
    Eigen::Vector2d normal;  // Unit, across the curve's image.
    // Of the distance from the curve's image, by [rotation, t_x, t_y, circle's centre and radius,
    // offset of L12, offset of L22].
    Gradient gradient;
  };

  Eigen::Vector3d ToCamera(const Eigen::Vector2d& X) const;
  Sample MakeSample(const Eigen::Vector2d& X, const Eigen::Vector2d& tangent,
                    std::size_t feature) const;
  std::vector<Eigen::Vector2d> Disturb(const std::vector<Sample>& samples,
                                       const Disturbance& disturbance, Random* random,
                                       std::vector<std::uint8_t>* mask) const;

  Camera camera_;
  CameraPose pose_;
  std::array<std::vector<Sample>, kNumFeatures> features_;
};

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_SIMULATE_SCENE_H_
