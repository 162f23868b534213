// report.html of a calibration: how well the camera is known, what is left over and where, and
// which photo would help most.
#ifndef CIRCLINE_APPS_CALIBRATE_CALIBRATION_REPORT_H_
#define CIRCLINE_APPS_CALIBRATE_CALIBRATION_REPORT_H_

#include <string>
#include <vector>

#include "circline/refine/adjust_photos.h"

namespace circline::apps {

// `pictures`: of photos, JPEG, by photo; may be empty.
std::string CalibrationReport(const AdjustedPhotos& adjusted, const std::vector<std::string>& names,
                              const std::vector<std::string>& pictures);

// What one more photo should show, a sentence each; empty where nothing stands out.
std::vector<std::string> Advice(const AdjustedPhotos& adjusted, int camera);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_CALIBRATE_CALIBRATION_REPORT_H_
