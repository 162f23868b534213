// Makes the blocks and terms of a JointProblem, one feature of the observations after the other.
// Internal: not installed.
#ifndef CIRCLINE_REFINE_JOINT_JOINT_BUILDER_H_
#define CIRCLINE_REFINE_JOINT_JOINT_BUILDER_H_

#include <ceres/manifold.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "circline/refine/joint/joint_problem.h"

namespace circline {

class JointProblemBuilder {
 public:
  explicit JointProblemBuilder(JointProblem* problem)
      : p_(*problem), obs_(p_.observations_), model_(p_.options_.noise_model) {}

  void Build();

 private:
  int AddConstant(const std::vector<double>& value) {
    return p_.AddBlock(static_cast<int>(value.size()), value, {}, true);
  }
  int AddFeature(Feature feature);

  bool Points(const std::vector<Eigen::Vector2d>& pixels, const std::vector<std::uint8_t>& inliers,
              double sigma_px, bool is_circle, ImagePoints* points) const;

  void AddOrigin();
  void AddCircle(std::size_t index);
  int CenterBlock(const CircleObservation& circle);
  int RadiusBlock(const CircleObservation& circle, int feature);
  int OffsetBlock(const CircleObservation& circle);
  void AddDiameter(const CircleObservation& circle, std::size_t index, int center, int feature);
  void AddMark(const CircleObservation& circle, double sigma_px, int center, int feature);
  void AddPencil(std::size_t index);
  void AddLine(ImagePoints points, const Eigen::Vector3d& fit, int direction,
               double direction_sigma, Feature feature);
  void AddPlaneLine(ImagePoints points, int point, int angle, int feature);
  int DirectionBlock(std::size_t pencil);
  int AxisOfLine(std::size_t pencil, std::size_t line) const;
  void AddAxisLine(ImagePoints points, const LineFit& fit, int axis, const std::string& id,
                   const std::string& name);
  void AddDrawnAxis(const std::optional<Segment>& axis, int which);
  void AddCameraPrior(std::vector<double> sigmas);
  void AddAngle(std::size_t index);
  void AddLength(std::size_t index);
  void AddPoint(const Eigen::Vector2d& pixel, double sigma_px, int block, int feature);
  void AddTranslation();
  void AddPosePrior(const PosePrior& prior);
  void AddGravityPrior(const GravityPrior& prior);
  void AddPrior(ceres::CostFunction* cost, std::vector<int> blocks, bool tells_spin,
                Feature feature);
  void NoteWhatIsOutside();

  // Whether it takes part.
  bool InPlane(const CircleObservation& circle) const {
    const auto inliers = std::count(circle.inliers.begin(), circle.inliers.end(), 1);
    const bool has_points = circle.inliers.empty() || inliers >= 5;
    return circle.fit && circle.plane == obs_.frame.plane && has_points;
  }
  static std::size_t ContrastOf(const CircleObservation& circle) {
    return static_cast<std::size_t>(std::clamp(circle.contrast, -1, 1) + 1);
  }
  // Of points drawn by hand: axes, the origin, lengths' ends.
  double DrawnSigma() const {
    constexpr double kDrawnSigmaPx = 0.5;
    return p_.options_.line_loss.scale_px > 0.0 ? p_.options_.line_loss.scale_px : kDrawnSigmaPx;
  }

  JointProblem& p_;
  const Observations& obs_;
  const NoiseModel& model_;
  int camera_ = -1;  // Block: kCamera, or -1 where it is exact.
  bool is_metric_ = false;
  int origin_point_ = -1;                             // Constant block (0, 0).
  const CircleObservation* origin_circle_ = nullptr;  // Whose centre is there.
  // Of one contrast, by ContrastOf: circles in the plane, the block of their offset.
  std::array<int, 3> num_circles_ = {0, 0, 0}, offsets_ = {-1, -1, -1};
  std::map<std::string, int> concentric_, radius_groups_;
};

}  // namespace circline

#endif  // CIRCLINE_REFINE_JOINT_JOINT_BUILDER_H_
