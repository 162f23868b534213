#include "circline/refine/adjust_layout.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <deque>
#include <optional>
#include <utility>

#include "circline/refine/statistics.h"

namespace circline {

Layout LayoutOf(const PoseHypothesis& h) {
  Layout layout;
  for (const CircleEstimate& circle : h.circles) {
    const Eigen::Vector3d X =
        h.cam_from_world.rotation.transpose() * (circle.center - h.cam_from_world.translation);
    if (circle.radius > 0.0) layout[circle.id] = {X.head<2>(), circle.radius};
  }
  return layout;
}

CameraPose MovedPose(const CameraPose& own, const Similarity& to_shared) {
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  turn.topLeftCorner<2, 2>() = to_shared.turn / to_shared.scale;
  CameraPose pose;
  pose.rotation = own.rotation * turn.transpose();
  pose.translation = to_shared.scale * own.translation -
                     pose.rotation * Eigen::Vector3d(to_shared.shift.x(), to_shared.shift.y(), 0.0);
  return pose;
}

namespace {

// A hypothesis of a photo against the layout so far.
struct Candidate {
  std::size_t photo = 0;
  const PoseHypothesis* hypothesis = nullptr;
  Layout layout;
  Places own;  // Of the layout.
  std::optional<Alignment> alignment;
  std::size_t seen = 0;  // Circles in the shared layout when it was aligned.
};

// Candidates of layouts that are aligned one by one.
class Aligner {
 public:
  Aligner(const std::vector<PoseEstimate>& estimates, bool by_id) : by_id_(by_id) {
    out_.poses.resize(estimates.size());
    out_.names.resize(estimates.size());
    out_.placed.assign(estimates.size(), false);
    for (std::size_t i = 0; i < estimates.size(); ++i) {
      for (const PoseHypothesis& h : estimates[i].hypotheses) {
        Candidate& made = candidates_.emplace_back();
        made.photo = i;
        made.hypothesis = &h;
        made.layout = LayoutOf(h);
        made.own = PlacesOf(made.layout);
      }
    }
  }

  SharedLayout Run() {
    while (const Candidate* next = Next()) Place(*next);
    out_.misfit = Median(std::move(misfits_));
    return std::move(out_);
  }

 private:
  void Align(Candidate* candidate) const;
  const Candidate* Next();
  void Place(const Candidate& candidate);

  bool by_id_;
  std::deque<Candidate> candidates_;  // Their places point into their layouts.
  Places shared_;
  std::vector<double> misfits_;
  SharedLayout out_;
};

void Aligner::Align(Candidate* candidate) const {
  constexpr double kFar = 0.5;  // Units of Place: another circle, or another pose of the photo.
  Alignment made;
  bool found = false;
  if (by_id_ || !candidate->alignment) {
    found = by_id_ ? AlignById(candidate->own, shared_, &made)
                   : AlignByPattern(candidate->own, shared_, &made);
  } else {  // More circles to match under the same similarity.
    found = AlignFrom(candidate->own, shared_, candidate->alignment->to_shared, &made);
  }
  candidate->seen = shared_.size();
  candidate->alignment.reset();
  if (found && made.misfit <= kFar) candidate->alignment = std::move(made);
}

// The photo that shares most with what is placed. What shared too little is looked at again only
// when all others are placed: the layout may have grown towards it.
const Candidate* Aligner::Next() {
  const bool is_first = shared_.empty();
  for (const bool again : {false, true}) {
    const Candidate* best = nullptr;
    std::size_t most = 0;
    for (Candidate& candidate : candidates_) {
      if (out_.placed[candidate.photo]) continue;
      if (!is_first && candidate.seen != shared_.size() &&
          (again || candidate.alignment || candidate.seen == 0)) {
        Align(&candidate);
      }
      if (!is_first && !candidate.alignment) continue;
      const std::size_t count = is_first ? candidate.own.size() : candidate.alignment->pairs.size();
      const bool is_better =
          count > most ||
          (count == most && best != nullptr && !is_first && best->photo == candidate.photo &&
           candidate.alignment->misfit < best->alignment->misfit);
      if (!is_better) continue;
      most = count;
      best = &candidate;
    }
    if (best != nullptr || is_first) return best;
  }
  return nullptr;
}

// Circles that nobody else has seen join the layout, under a name of their own.
void Aligner::Place(const Candidate& candidate) {
  const Alignment alignment = candidate.alignment.value_or(Alignment());
  const std::size_t i = candidate.photo;
  if (candidate.alignment) misfits_.push_back(alignment.misfit);
  out_.placed[i] = true;
  out_.poses[i] = MovedPose(candidate.hypothesis->cam_from_world, alignment.to_shared);
  std::map<std::string, std::string>& names = out_.names[i];
  for (const auto& [own, shared] : alignment.pairs)
    names[*candidate.own[own].id] = *shared_[shared].id;
  const std::size_t before = out_.circles.size();
  for (const auto& [id, circle] : candidate.layout) {
    if (names.count(id) > 0) continue;
    const std::string name = by_id_ ? id : std::to_string(i) + ":" + id;
    names[id] = name;
    out_.circles[name] = {alignment.to_shared(circle.center),
                          alignment.to_shared.scale * circle.radius};
  }
  if (out_.circles.size() > before) shared_ = PlacesOf(out_.circles);
}

}  // namespace

SharedLayout AlignLayouts(const std::vector<PoseEstimate>& estimates, bool by_id) {
  return Aligner(estimates, by_id).Run();
}

}  // namespace circline
