#include "apps/compare/camera_guess.h"

#include <gflags/gflags.h>

#include <algorithm>
#include <cmath>

#include "apps/common/exif.h"
#include "apps/common/text.h"
#include "circline/estimators/basics.h"
#include "circline/refine/adjust_photos.h"

DEFINE_double(focal_px, 0.0,
              "Where there is no calibration: a guess of the focal length, pixels. Without it and "
              "--fov_deg that which the photo's EXIF data state, else 60 degrees.");
DEFINE_double(fov_deg, 0.0,
              "The same from the field of view along the longer side of the photo, degrees.");

namespace circline::apps {
namespace {

constexpr double kUsualFovDeg = 60.0;
// Of log f: of a guess that somebody makes, of EXIF's figure where it is the lens's, and of no
// figure at all.
constexpr double kGuessSigma = 0.25, kExifSigma = 0.05, kUnknownSigma = 0.5;
// Beyond lies what no lens has, pixels.
constexpr double kMostPixels = 1e7;

double FocalOfFov(double fov_deg, int width, int height) {
  return 0.5 * std::max(width, height) / std::tan(0.5 * fov_deg * kDegree);
}

std::string AccuracyText(double sigma, double doubtful) {
  if (!(sigma > 0.0)) return ", taken as exact";
  std::string words = ", +- " + FormatShort(100.0 * sigma) + " %";
  if (doubtful > 0.0) {
    words +=
        " (one chance in ten that it is a placeholder: +- " + FormatShort(100.0 * doubtful) + " %)";
  }
  return words;
}

}  // namespace

StatedCameraSigma CameraGuess::Stated() const {
  if (!is_exact || !IsGiven()) return stated;
  const CameraSigma sigma = stated.Over(CameraSigma::Exact());
  return {sigma.log_focal, sigma.log_aspect, sigma.principal_point_px, sigma.k1,
          sigma.doubtful_log_focal};
}

GuessedCamera CameraGuess::ForPhoto(const std::string& path, int width, int height,
                                    const CameraSigma& calibrated) const {
  GuessedCamera guess;
  Camera& camera = guess.camera;
  camera.id = "guessed";
  camera.width = width;
  camera.height = height;
  camera.cx = 0.5 * (width - 1);
  camera.cy = 0.5 * (height - 1);
  double sigma = kGuessSigma, doubtful = 0.0;
  if (focal_px > 0.0) {
    camera.fx = focal_px;
    guess.words = "--focal_px=" + FormatShort(focal_px);
  } else if (fov_deg > 0.0) {
    camera.fx = FocalOfFov(fov_deg, width, height);
    guess.words = "--fov_deg=" + FormatShort(fov_deg);
  } else {
    const ExifFocalLength exif = ReadExifFocalLength(path, width, height);
    const bool is_stated = exif.focal_px > 0.0;
    camera.fx = is_stated ? exif.focal_px : FocalOfFov(kUsualFovDeg, width, height);
    sigma = is_stated ? kExifSigma : kUnknownSigma;
    doubtful = is_stated ? kUnknownSigma : 0.0;
    guess.words =
        is_stated ? exif.words : FormatShort(kUsualFovDeg) + " degrees, as nothing is known";
    if (!is_stated && !exif.words.empty()) guess.words += " (" + exif.words + ")";
    // Photos through one lens are of one camera.
    if (is_stated) camera.id += "_" + FormatShort(exif.focal_px);
  }
  camera.fy = camera.fx;
  const StatedCameraSigma known = Stated();
  doubtful = known.doubtful_log_focal.value_or(known.log_focal ? 0.0 : doubtful);
  sigma = known.log_focal.value_or(sigma);
  CameraSigma focal;
  focal.log_focal = sigma;
  focal.doubtful_log_focal = doubtful;
  if (focal.IsEstimated()) camera.model = CameraModel::kOpenCV;
  guess.sigma = focal.IsEstimated() ? known.Over(UnknownCamera(camera)) : calibrated;
  guess.sigma.log_focal = sigma;
  guess.sigma.doubtful_log_focal = doubtful;
  guess.words = "focal length " + FormatShort(camera.fx) + " px from " + guess.words +
                AccuracyText(sigma, doubtful);
  return guess;
}

std::string DescribeGuess(const CameraGuess& guess) {
  if (guess.IsGiven()) {
    const double sigma = guess.Stated().log_focal.value_or(kGuessSigma);
    if (!(sigma > 0.0)) return "the camera is a guess, its focal length taken as exact";
    return "the camera is a guess, its focal length good to " + FormatShort(100.0 * sigma) +
           " % (--focal_sigma); what the photo says of it counts";
  }
  return "no camera is given: each photo has the focal length of its EXIF data, else that of " +
         FormatShort(kUsualFovDeg) +
         " degrees, and what it shows counts (--camera takes a calibration; circline_calibrate "
         "makes one of a handful of photos)";
}

Status CameraGuessFromFlags(CameraGuess* guess) {
  guess->focal_px = FLAGS_focal_px;
  guess->fov_deg = FLAGS_fov_deg;
  if (!(guess->focal_px >= 0.0) || !(guess->focal_px <= kMostPixels)) {
    return Status::Invalid("--focal_px must be positive, and no more than " +
                           FormatShort(kMostPixels));
  }
  // Beyond, the focal length is none that a lens or a photo has.
  if (!(guess->fov_deg == 0.0 || (guess->fov_deg >= 0.01 && guess->fov_deg <= 179.0))) {
    return Status::Invalid("--fov_deg must be between 0.01 and 179");
  }
  return Status::Ok();
}

}  // namespace circline::apps
