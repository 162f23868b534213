// What one photo shows of its scene once the pose is known (proposition 6 of the paper): the
// world's plane, discs on it and on planes parallel to it, and upright faces, each with its part of
// the photo as a texture.
#ifndef CIRCLINE_APPS_RECONSTRUCT_MODEL_H_
#define CIRCLINE_APPS_RECONSTRUCT_MODEL_H_

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "circline/estimators/observations.h"
#include "circline/estimators/pose.h"

namespace circline::apps {

// A parallelogram in the world: corner + s u + t v, s and t from 0 to 1. The texture has s to the
// right and t upwards.
struct Patch {
  std::string name;  // Of files and materials, too: letters, digits, "_", "-", "." only.
  Eigen::Vector3d corner, u, v;
  bool is_disc = false;  // Only the disc that touches all sides.
  cv::Mat texture;
};

// An edge that stands upright on the plane.
struct UprightEdge {
  std::string name;
  Eigen::Vector2d foot_px, top_px;
  Eigen::Vector3d foot;  // World; its Z is 0.
  double height = 0.0;   // Negative where it hangs below the plane.
};

struct Model {
  std::vector<Patch> patches;  // The plane first.
  std::vector<UprightEdge> edges;
  double size = 0.0;  // Diagonal of the plane's part.
};

struct ModelOptions {
  int texture_px = 1024;  // Longer side of the plane's texture; 16 to 8192. Others in its scale.
  double margin = 0.1;    // Of the plane's part about the evidence, share of its longer side.
};

// `observations` as fitted. The part of the plane is that of the evidence, with the margin. Pencils
// along z give upright edges, where one end of a segment is that of a segment in the plane; two
// such at both ends of a segment in the plane bound a face. Empty where no evidence lies in the
// plane.
Model BuildModel(const cv::Mat& photo, const Observations& observations,
                 const PoseHypothesis& hypothesis, const ModelOptions& options);

// A name that can be part of a file name.
std::string FileSafe(const std::string& name);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_RECONSTRUCT_MODEL_H_
