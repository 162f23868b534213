// Least-squares fits of observations.
#include "circline/estimators/exactness.h"
#include "circline/estimators/observations.h"

namespace circline {

int CalibrateInliers(const Camera& camera, const std::vector<Eigen::Vector2d>& pixels,
                     const std::vector<std::uint8_t>& inliers,
                     std::vector<CalibratedPoint>* points) {
  points->clear();
  points->reserve(pixels.size());
  int dropped = 0;
  CalibratedPoint point;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    if (!inliers.empty() && inliers[i] == 0) continue;
    if (PixelToCalibrated(camera, pixels[i], &point)) {
      points->push_back(point);
    } else {
      ++dropped;
    }
  }
  return dropped;
}

void ResetFits(Observations* observations) {
  for (CircleObservation& circle : observations->circles) circle.fit.reset();
  for (PencilObservation& pencil : observations->pencils) {
    pencil.fit.reset();
    pencil.readings.clear();
    for (LineObservation& line : pencil.lines) line.fit.reset();
  }
}

void FitDirect(double default_sigma_px, Observations* observations,
               std::vector<std::string>* problems, const NoiseModel& noise, FitMemory* memory) {
  const auto report = [problems](const char* kind, const std::string& id, int line,
                                 const Status& status) {
    if (problems == nullptr || status.ok()) return;
    const std::string which = line >= 0 ? ", line " + std::to_string(line) : std::string();
    problems->push_back(kind + (" '" + id + "'") + which + ": " + status.message);
  };
  const auto sigma = [default_sigma_px](double own) { return own > 0.0 ? own : default_sigma_px; };
  FitMemory own_memory;
  if (memory == nullptr) memory = &own_memory;
  std::vector<CalibratedPoint>& points = memory->points;
  std::vector<LineFit>& fits = memory->fits;
  for (CircleObservation& circle : observations->circles) {
    if (circle.fit) continue;
    observations->num_dropped_points +=
        CalibrateInliers(observations->camera, circle.points, circle.inliers, &points);
    ConicFit fit;
    const double sigma_px = sigma(circle.sigma_px);
    const Status status = FitConic(points, sigma_px, &fit, nullptr, &memory->numbers);
    if (status.ok()) {
      fit.irregularity = Irregularity(points, fit.conic, noise);
      fit.ScaleCovariance(1.0 / noise.ContourWeight(sigma_px, circle.points, circle.inliers));
      circle.fit = fit;
    }
    report("circle", circle.id, -1, status);
  }
  for (PencilObservation& pencil : observations->pencils) {
    fits.clear();
    for (std::size_t i = 0; i < pencil.lines.size(); ++i) {
      LineObservation& line = pencil.lines[i];
      if (!line.fit) {
        observations->num_dropped_points +=
            CalibrateInliers(observations->camera, line.points, line.inliers, &points);
        LineFit fit;
        const double sigma_px = sigma(LineSigma(pencil, line));
        const Status status = FitLine(points, sigma_px, &fit);
        if (status.ok()) {
          fit.covariance /= noise.LineWeight(sigma_px, line.points, line.inliers);
          line.fit = fit;
        }
        report("pencil", pencil.id, static_cast<int>(i), status);
      }
      if (line.fit && line.is_parallel)
        fits.push_back(WithDirectionError(*line.fit, noise.line_direction_rad));
    }
    if (pencil.fit) continue;
    VanishingPointFit fit;
    const Status status = FitVanishingPoint(fits, &fit);
    if (status.ok()) pencil.fit = fit;
    report("pencil", pencil.id, -1, status);
  }
}

}  // namespace circline
