// Where in a photo the edges of a box lie, of which only the directions are known.
//
// A box seen from outside has a nearest corner, at which its visible faces meet, and at most nine
// visible edges. The images of the corner and of the three far ends say where all nine are; lines
// of the photo along them speak for it, gaps and lines that run on beyond a corner against it.
#ifndef CIRCLINE_APPS_RECONSTRUCT_TRACE_BOX_H_
#define CIRCLINE_APPS_RECONSTRUCT_TRACE_BOX_H_

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <vector>

#include "apps/reconstruct/fit_box.h"
#include "circline/estimators/camera.h"
#include "circline/estimators/status.h"

namespace circline::apps {

// `axes`: candidates of the box's directions (columns, camera frame, without sense), as hypotheses
// of the photo's pose have them; right within two degrees. The box is traced, fitted, traced again
// by the fit and fitted again. Its z is upwards: the edge that falls most steeply on the photo from
// the nearest corner, downwards; x is the longer of the other two. `box`: id, known lengths and
// truth, along these axes; its edges are filled in. Refused where no box is found.
Status TraceBox(const cv::Mat& photo, const Camera& camera, const BoxOptions& options,
                const std::vector<Eigen::Matrix3d>& axes, BoxObservation* box, BoxFit* fit);

// The box whose edges a person has marked, up to a few pixels beside where they are: fitted to the
// edges that the photo shows there, in each of its colours, and to the lines on its faces, which
// tell its directions; `box` then has these edges. To the marks where they state a standard
// deviation, and where the photo shows fewer edges or a box of other lengths.
Status FitMarkedBox(const cv::Mat& photo, const Camera& camera, const BoxOptions& options,
                    BoxObservation* box, BoxFit* fit);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_RECONSTRUCT_TRACE_BOX_H_
