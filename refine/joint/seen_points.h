// The origin and the centres of circles as ceres solves for them where the camera is an unknown: by
// where they are seen. A focal length or a principal point that changes moves every one of them, by
// more than the straight line of a step follows, so that steps along such a valley are short and
// there are hundreds of them. Their images hardly move. Internal: not installed.
#ifndef CIRCLINE_REFINE_JOINT_SEEN_POINTS_H_
#define CIRCLINE_REFINE_JOINT_SEEN_POINTS_H_

#include <ceres/manifold.h>
#include <ceres/problem.h>

#include <memory>
#include <vector>

#include "circline/refine/joint/joint_problem.h"

namespace circline {

class SeenPoints {
 public:
  // Of a problem with an estimated camera; `state` outlives this. From here on the blocks that are
  // free and lie in front of the camera are images: pixels without distortion from the principal
  // point of the camera as given, over its focal length. Of a translation, its image and length.
  SeenPoints(const JointProblem& problem, State* state);
  // Puts the blocks where their images are by now.
  ~SeenPoints();
  SeenPoints(const SeenPoints&) = delete;
  SeenPoints& operator=(const SeenPoints&) = delete;

  // As Graph::Fill, with the active terms, those on such a block taking its image.
  int Fill(ceres::Problem* problem);

 private:
  const JointProblem& problem_;
  State* state_;
  bool origin_is_seen_ = false;
  std::vector<int> centers_;  // Blocks.
  std::vector<Term> seen_;    // What stands for terms of the problem.
  std::unique_ptr<ceres::Manifold> of_given_length_;
};

}  // namespace circline

#endif  // CIRCLINE_REFINE_JOINT_SEEN_POINTS_H_
