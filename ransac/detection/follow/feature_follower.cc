#include "circline/ransac/detection/feature_follower.h"

#include <algorithm>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "circline/ransac/detection/follow/follow_observations.h"

namespace circline {
namespace {

// After so many frames in a row that show little, and that of another scene, it is another scene.
constexpr int kFramesOfCut = 3;

template <typename Feature, typename Find>
void KeepKnown(const Observations& known, Find find, std::vector<Feature>* features) {
  features->erase(std::remove_if(features->begin(), features->end(),
                                 [&](const Feature& f) { return find(known, f.id) < 0; }),
                  features->end());
}

// Of what was found cold, only what goes on from the features that were given.
void KeepGiven(const Observations& given, Observations* found) {
  KeepKnown(given, FindCircle, &found->circles);
  KeepKnown(given, FindPencil, &found->pencils);
  found->frame.origin_is_center = given.frame.origin_is_center;
  if (FindCircle(*found, found->frame.origin_is_center) < 0) found->frame.origin_is_center.clear();
}

}  // namespace

Status FollowOptions::Validate() const {
  if (!(search_px >= 3.0 && search_px <= 200.0)) {
    return Status::Invalid("search_px must be in [3, 200]");
  }
  if (!(min_found_share >= 0.0 && min_found_share <= 1.0)) {
    return Status::Invalid("min_found_share must be in [0, 1]");
  }
  if (cold_every < 0) return Status::Invalid("cold_every must not be negative");
  return detection.Validate();
}

FeatureFollower::FeatureFollower(const Camera& camera, const FollowOptions& options)
    : options_(options) {
  nothing_.camera = camera;
  held_ = nothing_;
}

Status FeatureFollower::Next(const cv::Mat& image, Observations* observations) {
  const Status valid = options_.Validate();
  if (!valid.ok()) return valid;
  Observations found, expect;
  bool look = !is_given_ && IsTimeForCold();
  if (!look) {
    const Status status =
        FollowObservations(image, held_, SearchPx(), options_.detection, &found, &expect);
    if (!status.ok()) return status;
    look = CountFeatures(found) == 0 || !HasEnough(found);
  }
  if (look) {
    const Status status = Cold(image, &found, &expect);
    if (!status.ok()) return status;
  } else {
    was_cold_ = was_cut_ = false;
    ++frames_since_cold_;
  }
  frames_lost_ = CountFeatures(found) > 0 && HasEnough(found) ? 0 : frames_lost_ + 1;
  held_ = std::move(expect);
  *observations = std::move(found);
  return Status::Ok();
}

Status FeatureFollower::Cold(const cv::Mat& image, Observations* found, Observations* expect) {
  DetectionOptions detection = options_.detection;
  // One camera took all frames: the first one with something in it says which.
  if (is_settled_) {
    constexpr double kSettled = 0.01;  // Of log f: nothing is looked for any more.
    CameraSigma& sigma = detection.noise_model.camera;
    sigma.log_focal = std::min(sigma.log_focal, kSettled);
    sigma.doubtful_log_focal = 0.0;
  }
  const Status status = DetectObservations(image, nothing_.camera, detection, found);
  if (!status.ok()) return status;
  if (!is_settled_ && CountFeatures(*found) > 0) {
    nothing_.camera = found->camera;
    nothing_.stated_focal_px = found->stated_focal_px;
    nothing_.found_k1 = found->found_k1;
    is_settled_ = true;
  }
  found->stated_focal_px = nothing_.stated_focal_px;
  found->found_k1 = nothing_.found_k1;
  const NextNames before = next_;
  const int kept = KeepNames(held_, SearchPx(), &next_, found);
  was_cold_ = true;
  was_cut_ = false;
  frames_since_cold_ = 0;
  if (is_given_) {
    KeepGiven(held_, found);
    *expect = CountFeatures(*found) > 0 ? *found : held_;
    return status;
  }
  if (kept == 0 &&
      !(CountFeatures(*found) > 0 && (HasEnough(*found) || frames_lost_ + 1 >= kFramesOfCut))) {
    // A blurred frame, or something before the lens: it passes.
    next_ = before;
    *found = nothing_;
    found->message = "nothing of the frames before was found in this one";
    *expect = held_;
    return status;
  }
  was_cut_ = kept == 0;
  num_at_look_ = CountFeatures(*found);
  num_circles_at_look_ = static_cast<int>(found->circles.size());
  *expect = *found;
  return status;
}

double FeatureFollower::SearchPx() const {
  constexpr double kMostPx = 200.0;  // As Validate.
  return std::min(kMostPx, options_.search_px * (1 + frames_lost_));
}

bool FeatureFollower::HasEnough(const Observations& found) const {
  const double share = options_.min_found_share;
  return static_cast<double>(found.circles.size()) >= share * num_circles_at_look_ &&
         CountFeatures(found) >= share * num_at_look_;
}

bool FeatureFollower::IsTimeForCold() const {
  const bool has_pose = !held_.circles.empty() || held_.pencils.size() >= 2;
  return !has_pose || (options_.cold_every > 0 && frames_since_cold_ + 1 >= options_.cold_every);
}

void FeatureFollower::Start(const Observations& given) {
  held_ = given;
  for (PencilObservation& pencil : held_.pencils) {  // Lines without ends have no place.
    std::vector<LineObservation>& lines = pencil.lines;
    lines.erase(std::remove_if(lines.begin(), lines.end(),
                               [](const LineObservation& line) { return line.points.size() < 2; }),
                lines.end());
  }
  is_given_ = true;
  frames_lost_ = 0;
  num_at_look_ = CountFeatures(given);
  num_circles_at_look_ = static_cast<int>(given.circles.size());
}

void FeatureFollower::Move(const PoseHypothesis& last, const CameraPose& next) {
  held_ = MoveObservations(held_, last, next);
}

void FeatureFollower::Reset() {
  held_ = nothing_;
  is_given_ = false;
  num_at_look_ = num_circles_at_look_ = frames_lost_ = 0;
}

}  // namespace circline
