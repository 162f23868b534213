// The noise of points for fits that nobody has made yet. Internal: not installed.
#ifndef CIRCLINE_REFINE_FIT_SIGMA_H_
#define CIRCLINE_REFINE_FIT_SIGMA_H_

#include "circline/refine/estimate_pose.h"

namespace circline {

// Standard deviation, pixels, that FitDirect takes for features that state none; what they scatter
// by is measured on these fits.
inline double FitSigmaPx(const EstimationOptions& options) {
  constexpr double kDefaultSigmaPx = 0.4;
  const double scale = options.line_loss.scale_px;
  return scale > 0.0 ? scale : kDefaultSigmaPx;
}

}  // namespace circline

#endif  // CIRCLINE_REFINE_FIT_SIGMA_H_
