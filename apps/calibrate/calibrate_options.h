// What circline_calibrate is asked to do.
#ifndef CIRCLINE_APPS_CALIBRATE_CALIBRATE_OPTIONS_H_
#define CIRCLINE_APPS_CALIBRATE_CALIBRATE_OPTIONS_H_

#include <optional>
#include <string>

#include "apps/compare/options.h"
#include "circline/estimators/camera.h"
#include "circline/estimators/status.h"
#include "circline/refine/adjust_photos.h"

namespace circline::apps {

struct CalibrateOptions {
  CompareOptions compare;
  AdjustOptions adjust;
  std::optional<CameraModel> model;
  bool fix_principal_point = false;
  std::optional<double> aspect_sigma;
  std::string import;  // Folder of a COLMAP model; empty: none.
};

// Not ok: one line that names the flag. Nothing is read from disk.
Status CalibrateOptionsFromFlags(CalibrateOptions* options);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_CALIBRATE_CALIBRATE_OPTIONS_H_
