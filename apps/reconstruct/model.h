// What one photo shows of its scene once the pose is known (proposition 6 of the paper): the
// world's plane, discs on it and on planes parallel to it, and upright faces, each with its part of
// the photo as a texture.
#ifndef CIRCLINE_APPS_RECONSTRUCT_MODEL_H_
#define CIRCLINE_APPS_RECONSTRUCT_MODEL_H_

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "apps/common/solids.h"
#include "apps/reconstruct/fit_box.h"
#include "apps/reconstruct/patch.h"
#include "circline/estimators/camera.h"
#include "circline/estimators/observations.h"
#include "circline/estimators/pose.h"
#include "circline/estimators/status.h"

namespace circline::apps {

// An edge that stands upright on the plane.
struct UprightEdge {
  std::string name;
  Eigen::Vector2d foot_px, top_px;
  Eigen::Vector3d foot;  // World; its Z is 0.
  double height = 0.0;   // Negative where it hangs below the plane.
};

// Of a round box.
struct SolidHeight {
  std::string id;
  double height = 0.0;  // Of its upper rim; negative below the plane.
  double sigma = 0.0;
  double truth = 0.0;  // 0 = not known.
};

struct Model {
  std::vector<Patch> patches;
  std::vector<UprightEdge> edges;
  std::vector<SolidHeight> heights;
  double size = 0.0;  // Diagonal of the plane's part, or of the box.
};

struct ModelOptions {
  int texture_px = 0;   // Longer side of the plane's texture; 16 to 8192; 0: as the photo has it.
  double margin = 0.1;  // Of the plane's part about the evidence, share of its longer side.
};

// What one photo shows of its plane; the plane comes first. `observations` as fitted. The part of
// the plane is that of the evidence, with the margin. Pencils along z give upright edges, where one
// end of a segment is that of a segment in the plane; two such at both ends of a segment in the
// plane bound a face. Empty where no evidence lies in the plane. No textures yet.
Model PlaneModel(const cv::Mat& photo, const Observations& observations,
                 const PoseHypothesis& hypothesis, const ModelOptions& options);

// Adds round boxes and pieces of the plane that are marked; `point_sigma_px` is the standard
// deviation of each coordinate of a marked point, and of a contour's points where it states none.
// Refused, in words, where a rim is not seen above its base or a corner lies beyond the horizon;
// invalid where a face lies in another plane.
Status AddSolids(const Solids& solids, const Observations& observations,
                 const PoseHypothesis& hypothesis, double point_sigma_px, Model* model);

// Standard deviation of each coordinate of an ellipse's centre, by that of its points all around.
double CenterSigmaPx(double sigma_px, std::size_t num_points);

// The visible faces of the box, in its own frame: "box_x0" is the one at the origin across x,
// "box_x1" the one at the far end. Edges are shared to the bit. Empty where the camera is inside.
Model BoxModel(const BoxFit& fit);

// Turns patches so that their outside is where the camera is.
void FaceTheCamera(const CameraPose& pose, Model* model);

// Textures for all patches, without what other patches hide.
void TextureModel(const cv::Mat& photo, const Camera& camera, const CameraPose& pose,
                  const ModelOptions& options, Model* model);

// Gives all patches names of files, letters, digits, "_", "-" and "." only, no two of which are the
// same; most stay what they are.
void NamePatches(Model* model);

// ---- As files of 3-D programs ----

// Wavefront OBJ, which every 3-D program reads: model.obj, model.mtl and a texture for each patch
// (texture.png for the plane, texture_<name>.png for the others). Z is up, the unit is the pose's.
// The camera is a pyramid of lines. `camera` states its size.
Status WriteObj(const Model& model, const Camera& camera, const CameraPose& pose,
                const std::string& folder);

// Binary glTF 2.0, which browsers and Blender open: one mesh for each patch, with its texture
// inside the file, and the camera. Y is up, as glTF has it. Textures are shown as they are, without
// light; what is transparent in them is cut out. `camera` states its size.
Status WriteGlb(const Model& model, const Camera& camera, const CameraPose& pose,
                const std::string& path);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_RECONSTRUCT_MODEL_H_
