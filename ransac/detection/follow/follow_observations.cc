#include "circline/ransac/detection/follow/follow_observations.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "circline/ransac/detection/ellipses/contour_support.h"
#include "circline/ransac/detection/ellipses/ellipse_evidence.h"
#include "circline/ransac/detection/lines/edge_shift.h"
#include "circline/ransac/detection/structure/circle_grid.h"
#include "circline/ransac/detection/structure/observe_evidence.h"

namespace circline {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

// Smoothing reaches so far beyond the band that its outermost edges are found, pixels.
constexpr double kBandMarginPx = 2.0;

// Where edges are looked for about predicted features: tiles of the photo. Smaller tiles fit a band
// more closely, larger ones are filtered with less overhead: of 16, 32 and 64 pixels 16 was the
// fastest on the frames mire-2.
class SearchBands {
 public:
  // All that lies within `reach_px` of what is added.
  SearchBands(const cv::Size& photo, double reach_px)
      : photo_(photo),
        reach_px_(reach_px),
        tiles_(cv::Mat1b::zeros((photo.height + kTilePx - 1) / kTilePx,
                                (photo.width + kTilePx - 1) / kTilePx)) {}

  // What is not on the photo, or not finite, adds nothing.
  void Add(const Vector2d& pixel) {
    const Vector2d size(photo_.width, photo_.height);
    const Vector2d low = pixel.array() - reach_px_, high = pixel.array() + reach_px_;
    if (!pixel.allFinite() || (low.array() >= size.array()).any() || (high.array() < 0.0).any())
      return;
    const auto tile = [](double position) {
      return static_cast<int>(std::floor(position / kTilePx));
    };
    const cv::Point first(tile(low.x()), tile(low.y())), last(tile(high.x()), tile(high.y()));
    tiles_(cv::Rect(first, last + cv::Point(1, 1)) & cv::Rect({}, tiles_.size())) = 1;
  }

  void AddSegment(const Segment& segment) {
    const double length = (segment[1] - segment[0]).norm();
    // A line that is predicted beyond the photo by more than this is no line of the photo.
    if (!(length <= 4.0 * std::hypot(photo_.width, photo_.height))) return;
    const int steps = 1 + static_cast<int>(length / std::max(1.0, reach_px_));
    for (int k = 0; k <= steps; ++k) {
      const double t = static_cast<double>(k) / steps;
      Add((1.0 - t) * segment[0] + t * segment[1]);
    }
  }

  // Rectangles of tiles, which do not overlap.
  std::vector<cv::Rect> Rectangles() const {
    std::vector<cv::Rect> rectangles;
    for (int y = 0; y < tiles_.rows; ++y) {
      const auto row = tiles_.ptr(y), row_end = row + tiles_.cols;
      for (auto begin = std::find(row, row_end, 1); begin != row_end;) {
        const auto end = std::find(begin, row_end, 0);
        rectangles.push_back(cv::Rect({}, photo_) &
                             cv::Rect(static_cast<int>(begin - row) * kTilePx, y * kTilePx,
                                      static_cast<int>(end - begin) * kTilePx, kTilePx));
        begin = std::find(end, row_end, 1);
      }
    }
    return rectangles;
  }

 private:
  static constexpr int kTilePx = 16;

  cv::Size photo_;
  double reach_px_;
  cv::Mat1b tiles_;
};

std::vector<cv::Rect> BandsOf(const Observations& predicted,
                              const std::vector<PencilObservation>& edge_pencils,
                              const cv::Size& photo, double search_px) {
  SearchBands bands(photo, search_px + kBandMarginPx);
  Contour contour(predicted.camera);
  std::vector<ContourSample> samples;
  const double largest = 2.0 * std::hypot(photo.width, photo.height);
  for (const CircleObservation& circle : predicted.circles) {
    if (!circle.fit || !contour.Project(circle.fit->conic, 1.0, largest)) continue;
    if (!contour.SampleEvery(search_px, &samples)) continue;
    for (const ContourSample& sample : samples) bands.Add(sample.pixel);
  }
  for (const PencilObservation& pencil : edge_pencils) {
    for (const LineObservation& line : pencil.lines) {
      for (std::size_t k = 1; k < line.points.size(); ++k)
        bands.AddSegment({line.points[k - 1], line.points[k]});
    }
  }
  return bands.Rectangles();
}

// The rows and columns of a sheet of circles, of those that were found: each goes on from the one
// of the two predicted pencils that it is nearer to.
void FollowGrid(const std::vector<PencilObservation>& predicted, Observations* found,
                Observations* expect) {
  // One direction does not tell where the centres are.
  if (predicted.size() < 2 || !predicted[0].fit || !predicted[1].fit) return;
  const Vector3d &x = predicted[0].fit->direction, &y = predicted[1].fit->direction;
  std::vector<Matrix3d> conics;
  for (const CircleObservation& circle : found->circles) conics.push_back(circle.fit->conic);
  std::vector<DetectedPencil> pencils =
      FindGridPencils(found->camera, conics, x.cross(y).stableNormalized());
  if (pencils.size() < 2) return;
  const auto along = [&](const DetectedPencil& pencil, const Vector3d& axis) {
    return std::abs(pencil.observation.fit->direction.dot(axis));
  };
  if (along(pencils[0], x) + along(pencils[1], y) < along(pencils[0], y) + along(pencils[1], x))
    std::swap(pencils[0], pencils[1]);
  for (std::size_t k = 0; k < 2; ++k) {
    PencilObservation& pencil = pencils[k].observation;
    Continue(predicted[k], &pencil);
    expect->pencils[static_cast<std::size_t>(FindPencil(*expect, pencil.id))] = pencil;
    found->pencils.push_back(std::move(pencil));
  }
}

// A pencil that was followed takes the place of its prediction, with the lines and the direction
// that were not found again.
void ExpectPencil(const PencilObservation& pencil, const std::vector<int>& matches,
                  Observations* expect) {
  PencilObservation& place =
      expect->pencils[static_cast<std::size_t>(FindPencil(*expect, pencil.id))];
  PencilObservation next = pencil;
  for (std::size_t k = 0; k < matches.size(); ++k) {
    if (matches[k] < 0) next.lines.push_back(std::move(place.lines[k]));
  }
  if (!next.fit) next.fit = place.fit;
  place = std::move(next);
}

void FollowEdgeLines(const std::vector<PencilObservation>& pencils, const EdgeMap& edges,
                     const std::vector<std::uint8_t>& on_ellipses, double search_px,
                     const DetectionOptions& options, Observations* found, Observations* expect) {
  if (pencils.empty()) return;
  std::vector<DetectedLine> lines =
      DetectLines(edges, found->camera, options.min_segment_length_px, &on_ellipses);
  UndoEdgeShift(edges, found->camera, &lines);
  const std::vector<std::vector<int>> matches = MatchLines(pencils, lines, search_px);
  for (std::size_t p = 0; p < pencils.size(); ++p) {
    PencilObservation pencil =
        FollowPencil(pencils[p], lines, matches[p], DiagonalPx(edges.width, edges.height));
    ExpectPencil(pencil, matches[p], expect);
    if (!pencil.lines.empty()) found->pencils.push_back(std::move(pencil));
  }
}

// Pencils in the order of the prediction; the frame and the angles that still have what they name.
void Settle(const Observations& predicted, Observations* found) {
  std::stable_sort(found->pencils.begin(), found->pencils.end(),
                   [&](const PencilObservation& a, const PencilObservation& b) {
                     return FindPencil(predicted, a.id) < FindPencil(predicted, b.id);
                   });
  // Of the frame only what names features: its pixels were those of another photo.
  const FrameObservation& frame = predicted.frame;
  if (FindCircle(*found, frame.origin_is_center) >= 0)
    found->frame.origin_is_center = frame.origin_is_center;
  if (HasPlane(*found, frame.plane)) found->frame.plane = frame.plane;
  for (const KnownAngle& angle : predicted.known_angles) {
    if (FindPencil(*found, angle.pencils[0]) >= 0 && FindPencil(*found, angle.pencils[1]) >= 0)
      found->known_angles.push_back(angle);
  }
}

}  // namespace

bool HasPlane(const Observations& observations, const std::string& plane) {
  const auto is_on = [&](const auto& feature) { return feature.plane == plane; };
  return std::any_of(observations.circles.begin(), observations.circles.end(), is_on) ||
         std::any_of(observations.pencils.begin(), observations.pencils.end(), is_on);
}

int CountFeatures(const Observations& observations) {
  std::size_t count = observations.circles.size();
  for (const PencilObservation& pencil : observations.pencils) count += pencil.lines.size();
  return static_cast<int>(count);
}

Status FollowObservations(const cv::Mat& image, const Observations& predicted, double search_px,
                          const DetectionOptions& options, Observations* found,
                          Observations* expect) {
  *expect = predicted;
  *found = Observations();
  found->camera = predicted.camera;
  found->stated_focal_px = predicted.stated_focal_px;
  found->found_k1 = predicted.found_k1;
  cv::Mat gray;
  Status status = CheckDetectionInput(image, predicted.camera, options);
  if (status.ok()) status = ToGray(image, &gray);
  if (!status.ok()) return status;
  std::vector<PencilObservation> of_centres, of_edges;
  for (const PencilObservation& pencil : predicted.pencils)
    (IsOfCentres(predicted, pencil) ? of_centres : of_edges).push_back(pencil);
  const std::vector<cv::Rect> bands = BandsOf(predicted, of_edges, gray.size(), search_px);
  const EdgeMap edges = DetectEdges(gray, kEdgeSmoothingPx, &bands);
  const std::vector<DetectedEllipse> ellipses =
      FollowCircles(edges, predicted.camera, predicted.circles,
                    {options.min_ellipse_axis_px, options.min_arc_deg}, search_px);
  for (std::size_t k = 0; k < ellipses.size(); ++k) {
    if (ellipses[k].points.empty()) continue;
    CircleObservation circle;
    FillCircle(edges, ellipses[k], predicted.camera, options.noise_model, &circle);
    Continue(predicted.circles[k], &circle);
    circle.concentric = predicted.circles[k].concentric;
    expect->circles[k] = circle;
    found->circles.push_back(std::move(circle));
  }
  FollowEdgeLines(of_edges, edges, EllipsePoints(edges, ellipses), search_px, options, found,
                  expect);
  FollowGrid(of_centres, found, expect);
  Settle(predicted, found);
  return status;
}

}  // namespace circline
