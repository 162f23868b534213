#include "circline/refine/many/adjust_layout.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <deque>
#include <optional>
#include <utility>

#include "circline/estimators/statistics.h"

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

void SharedLayout::Add(std::size_t photo, const CameraPose& pose, const Layout& own,
                       std::map<std::string, std::string> matched) {
  placed[photo] = true;
  poses[photo] = pose;
  names[photo] = std::move(matched);
  for (const auto& [id, circle] : own) {
    if (names[photo].count(id) > 0) continue;
    const bool is_free = circles.count(id) == 0;
    const std::string name = is_free ? id : std::to_string(photo) + ":" + id;
    names[photo][id] = name;
    circles[name] = circle;
  }
}

bool SharedLayout::IsById() const {
  return std::all_of(names.begin(), names.end(), [](const auto& of_photo) {
    return std::all_of(of_photo.begin(), of_photo.end(),
                       [](const auto& name) { return name.first == name.second; });
  });
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
  Aligner(const std::vector<PoseEstimate>& estimates, bool by_id)
      : by_id_(by_id), out_(estimates.size()) {
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
    const auto first = std::max_element(
        candidates_.begin(), candidates_.end(),
        [](const Candidate& a, const Candidate& b) { return a.own.size() < b.own.size(); });
    if (first != candidates_.end() && !first->own.empty()) Place(*first);
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
  // Later there are more circles to match under the same similarity.
  const bool found = by_id_                 ? AlignById(candidate->own, shared_, &made)
                     : candidate->alignment ? AlignFrom(candidate->own, shared_,
                                                        candidate->alignment->to_shared, &made)
                                            : AlignByPattern(candidate->own, shared_, &made);
  candidate->seen = shared_.size();
  candidate->alignment.reset();
  if (found && made.misfit <= kFar) candidate->alignment = std::move(made);
}

// More circles, or of one photo as many that lie closer.
bool IsBetter(const Candidate& a, const Candidate& b) {
  const std::size_t more = a.alignment->pairs.size(), fewer = b.alignment->pairs.size();
  return more > fewer ||
         (more == fewer && a.photo == b.photo && a.alignment->misfit < b.alignment->misfit);
}

// The photo that shares most with what is placed. What shared too little is looked at again only
// when all others are placed: the layout may have grown towards it.
const Candidate* Aligner::Next() {
  for (const bool again : {false, true}) {
    const Candidate* best = nullptr;
    for (Candidate& candidate : candidates_) {
      if (out_.placed[candidate.photo]) continue;
      if (candidate.seen != shared_.size() &&
          (again || candidate.alignment || candidate.seen == 0)) {
        Align(&candidate);
      }
      if (candidate.alignment && (best == nullptr || IsBetter(candidate, *best))) best = &candidate;
    }
    if (best != nullptr) return best;
  }
  return nullptr;
}

void Aligner::Place(const Candidate& candidate) {
  const Alignment alignment = candidate.alignment.value_or(Alignment());
  if (candidate.alignment) misfits_.push_back(alignment.misfit);
  std::map<std::string, std::string> matched;
  for (const auto& [own, shared] : alignment.pairs)
    matched[*candidate.own[own].id] = *shared_[shared].id;
  Layout moved;
  for (const auto& [id, circle] : candidate.layout)
    moved[id] = {alignment.to_shared(circle.center), alignment.to_shared.scale * circle.radius};
  out_.Add(candidate.photo, MovedPose(candidate.hypothesis->cam_from_world, alignment.to_shared),
           moved, std::move(matched));
  if (out_.circles.size() > shared_.size()) shared_ = PlacesOf(out_.circles);
}

}  // namespace

SharedLayout AlignLayouts(const std::vector<PoseEstimate>& estimates, bool by_id) {
  return Aligner(estimates, by_id).Run();
}

}  // namespace circline
