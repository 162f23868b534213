// One candidate of an ellipse against the edges of a photo: from a first fit to arcs, over what
// edges there are along its contour, to the maximum-likelihood fit and the verdict on its shape.
#ifndef CIRCLINE_RANSAC_DETECTION_ELLIPSES_ELLIPSE_FITTER_H_
#define CIRCLINE_RANSAC_DETECTION_ELLIPSES_ELLIPSE_FITTER_H_

#include <Eigen/Core>
#include <array>
#include <initializer_list>
#include <opencv2/core.hpp>
#include <vector>

#include "circline/estimators/camera.h"
#include "circline/ransac/detection/calibrated_edges.h"
#include "circline/ransac/detection/edges.h"
#include "circline/ransac/detection/ellipses/arcs.h"
#include "circline/ransac/detection/ellipses/contour_support.h"
#include "circline/ransac/detection/ellipses/detect_ellipses.h"

namespace circline {

struct EllipseCandidate {
  Eigen::Matrix3d conic = Eigen::Matrix3d::Zero();
  BrightSide bright = BrightSide::kOutside;
  // Length of the support times its share of the contour, less for what strays.
  double score = 0.0;
};

// Keeps book of the points that accepted ellipses took.
class EllipseFitter {
 public:
  // All must outlive it.
  EllipseFitter(const EdgeMap& map, const Camera& camera, const EllipseOptions& options);

  // The ellipse through one arc or two; false if they are not on one ellipse.
  bool FitArcs(std::initializer_list<const Arc*> arcs, EllipseCandidate* candidate);

  // The candidate that edges along a contour support, with the bright side of most of them; false
  // where there is none.
  bool FindAlong(const Eigen::Matrix3d& conic, EllipseCandidate* candidate);

  // Refits a candidate to all edges along its contour; false if these are too few or too unlike an
  // ellipse.
  bool Improve(EllipseCandidate* candidate);

  // Whether edges which no ellipse took support enough of the contour.
  bool IsSupported(const EllipseCandidate& candidate);

  // The final fit; false if what the edges follow is no ellipse.
  bool Fit(EllipseCandidate candidate, DetectedEllipse* e);

  // Marks the ellipse's points, which then support no other, and undoes that.
  void Take(const DetectedEllipse& e) { collector_.Take(e.points); }
  void Release(const DetectedEllipse& e) { collector_.Release(e.points); }
  bool IsTaken(int i) const { return collector_.IsTaken(i); }

  // An edge point; false where the camera cannot undistort it.
  bool Calibrate(int i, CalibratedPoint* point) { return calibrated_.Get(i, point); }

  // Whether a conic passes within `reach_px` of the ellipse's points. (A dozen of them are looked
  // at.)
  bool LiesOn(const DetectedEllipse& e, const Eigen::Matrix3d& conic, double reach_px);

 private:
  // Edge points support a contour within this distance, pixels: at first, and after refits.
  static constexpr std::array<double, 3> kGatherPx = {2.5, 2.0, 1.5};
  // Largest root-mean-square distance of the supporting points, pixels. A contour that is an
  // ellipse stays below 0.3 px in a fair photo; a blob that resembles one does not.
  static constexpr double kMaxRmsPx = 0.6;

  void AppendPoints(const Arc& arc);
  bool FitTrimmed(const std::vector<CalibratedPoint>& start, int max_trims, Eigen::Matrix3d* conic);
  bool FitLikeliest(Eigen::Matrix3d* conic);
  double TruncatedCost(const Eigen::Matrix3d& conic, double sigma_px);
  void Trim(const Eigen::Matrix3d& conic);
  void MeasureDistances(const Eigen::Matrix3d& conic);
  double RobustSigma(const Eigen::Matrix3d& conic);
  bool ArcsAgree(const EllipseCandidate& candidate) const;
  static double Rms(const std::vector<CalibratedPoint>& points, const Eigen::Matrix3d& conic);
  bool Refit(EllipseCandidate* candidate);
  double MeasureShape(double rms_px, const Eigen::Matrix3d& conic, const std::vector<int>& points);
  bool Gather(const EllipseCandidate& candidate, double spacing, double reach,
              int max_samples = 20000);
  void CalibrateSupport(std::size_t limit);
  bool Plausible(BrightSide bright) const;
  bool SecondLook(EllipseCandidate* candidate, DetectedEllipse* e);
  cv::Rect Surroundings() const;
  double FinalFit(EllipseCandidate* candidate, DetectedEllipse* e);
  bool GatherUnbiased(const EllipseCandidate& candidate, double reach, DetectedEllipse* e);
  bool FitUnbiased(const Eigen::Matrix3d& initial, DetectedEllipse* e);
  bool DropOutliers(DetectedEllipse* e);

  const EdgeMap& map_;
  const Camera& camera_;
  const EllipseOptions& options_;
  CalibratedEdges calibrated_;
  Contour contour_;
  EdgeCollector collector_;
  const double max_axis_px_;
  // Scratch.
  std::vector<CalibratedPoint> fit_points_, trimmed_, stretch_;
  std::vector<int> fit_indices_;
  std::vector<ContourSample> samples_;
  Support support_;
  std::vector<double> distances_;
};

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DETECTION_ELLIPSES_ELLIPSE_FITTER_H_
