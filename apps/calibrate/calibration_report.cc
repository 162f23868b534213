#include "apps/calibrate/calibration_report.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>

#include "apps/calibrate/calibration_files.h"
#include "apps/common/report_page.h"
#include "apps/common/svg_plot.h"
#include "apps/common/text.h"
#include "apps/compare/report_parts.h"
#include "circline/estimators/basics.h"

namespace circline::apps {
namespace {

constexpr int kColumns = 12, kRows = 9;  // Cells of the photo.

struct Cell {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  int count = 0;
};
using Field = std::array<Cell, kColumns * kRows>;

Field FieldOf(const AdjustedPhotos& adjusted, int camera) {
  const Camera& c = adjusted.cameras[static_cast<std::size_t>(camera)].camera;
  Field field;
  for (const AdjustedPhoto& photo : adjusted.photos) {
    if (photo.camera != camera || !photo.status.ok()) continue;
    for (const AdjustedResidual& r : photo.residuals) {
      const int x = std::clamp(static_cast<int>(r.pixel.x() / std::max(1, c.width) * kColumns), 0,
                               kColumns - 1),
                y = std::clamp(static_cast<int>(r.pixel.y() / std::max(1, c.height) * kRows), 0,
                               kRows - 1);
      Cell& cell = field[static_cast<std::size_t>(y * kColumns + x)];
      cell.sum += r.offset;
      ++cell.count;
    }
  }
  return field;
}

// Mean residuals by cell, as arrows so many times as long.
std::string FieldSvg(const AdjustedPhotos& adjusted, int camera) {
  constexpr double kLonger = 200.0;
  constexpr int kFewest = 10;  // Points: the mean of fewer shows their noise.
  const Camera& c = adjusted.cameras[static_cast<std::size_t>(camera)].camera;
  const Field field = FieldOf(adjusted, camera);
  const double w = 640.0, h = w * c.height / std::max(1, c.width), scale = w / std::max(1, c.width);
  std::ostringstream svg;
  svg << "<svg viewBox=\"-1 -1 " << w + 2 << " " << h + 2 << "\" role=\"img\">"
      << "<rect width=\"" << w << "\" height=\"" << h
      << "\" fill=\"none\" stroke=\"currentColor\" stroke-opacity=\".4\"/>";
  for (int y = 0; y < kRows; ++y) {
    for (int x = 0; x < kColumns; ++x) {
      const Cell& cell = field[static_cast<std::size_t>(y * kColumns + x)];
      const double px = (x + 0.5) * w / kColumns, py = (y + 0.5) * h / kRows;
      if (cell.count < kFewest) {
        svg << "<circle cx=\"" << px << "\" cy=\"" << py
            << "\" r=\"3\" fill=\"currentColor\" fill-opacity=\".12\"/>";
        continue;
      }
      const Eigen::Vector2d arrow = kLonger * scale * cell.sum / cell.count;
      svg << "<line x1=\"" << px << "\" y1=\"" << py << "\" x2=\"" << px + arrow.x() << "\" y2=\""
          << py + arrow.y() << "\" stroke=\"var(--accent)\" stroke-width=\"1.6\"/><circle cx=\""
          << px << "\" cy=\"" << py << "\" r=\"2\" fill=\"var(--accent)\"/>";
    }
  }
  svg << "</svg>";
  return svg.str();
}

std::vector<int> Estimated(const AdjustedCamera& made) {
  std::vector<int> shifts;
  for (int shift = 0; shift < kCameraSize; ++shift) {
    if (made.Sigma(shift) > 0.0) shifts.push_back(shift);
  }
  return shifts;
}

std::string CorrelationTable(const AdjustedCamera& made) {
  const std::vector<int> rows = Estimated(made);
  const auto name = [&](int shift) { return ShiftName(made.camera.model, shift); };
  std::ostringstream html;
  html << "<div class=\"scroll\"><table class=\"matrix\"><tr><th></th>";
  for (const int p : rows) html << "<th>" << name(p) << "</th>";
  html << "</tr>";
  for (const int p : rows) {
    html << "<tr><th class=\"l\">" << name(p) << "</th>";
    for (const int q : rows) {
      const double r = made.covariance[static_cast<std::size_t>(p * kCameraSize + q)] /
                       (made.Sigma(p) * made.Sigma(q));
      html << "<td style=\"background:rgba(31,111,209," << 0.5 * std::abs(r) << ")\">"
           << FormatFixed(r, 2) << "</td>";
    }
    html << "</tr>";
  }
  html << "</table></div>";
  return html.str();
}

std::string ParameterTable(const AdjustedCamera& made) {
  const Camera& c = made.camera;
  std::ostringstream html;
  const auto row = [&](const std::string& name, double value, double sigma, const char* unit,
                       int decimals) {
    html << "<tr>" << CellHtml(name, "l") << CellHtml(FormatFixed(value, decimals))
         << CellHtml(sigma > 0.0 ? FormatShort(sigma, 2) : "held") << CellHtml(unit, "l")
         << "</tr>";
  };
  html << "<div class=\"scroll\"><table class=\"named\"><tr><th class=\"l\">parameter</th><th>value"
          "</th><th>sigma</th><th class=\"l\">unit</th></tr>";
  row("fx", c.fx, made.SigmaFocalPx(), "px", 2);
  row("fy", c.fy, c.fy * std::hypot(made.Sigma(0), made.Sigma(1)), "px", 2);
  row("cx", c.cx, made.Sigma(2), "px", 2);
  row("cy", c.cy, made.Sigma(3), "px", 2);
  for (std::size_t k = 0; k < c.distortion.size(); ++k) {
    const double sigma = made.Sigma(4 + static_cast<int>(k));
    if (sigma > 0.0 || c.distortion[k] != 0.0)
      row(ShiftName(c.model, 4 + static_cast<int>(k)), c.distortion[k], sigma, "", 5);
  }
  html << "</table></div>";
  return html.str();
}

// How the focal length's deviation falls as photos are added.
std::string SigmaPlot(const AdjustedCamera& made) {
  Plot plot;
  plot.title = "Focal length";
  plot.x_label = "photos, in their order";
  plot.y_label = "standard deviation, %";
  plot.log_x = plot.log_y = true;
  plot.height = 260;
  PlotSeries series{"from the first photos alone", SeriesColor(0), false, true, {}};
  constexpr double kPercent = 100.0;
  for (const auto& [count, sigma] : made.sigma_by_photos) {
    if (sigma > 0.0) series.points.emplace_back(count, kPercent * sigma);
  }
  if (series.points.size() < 2) return "";
  plot.x_min = series.points.front().first;
  plot.x_max = series.points.back().first;
  plot.y_min = 0.7 * series.points.back().second;
  plot.y_max = 1.4 * series.points.front().second;
  plot.series.push_back(std::move(series));
  return "<h3>What each photo has added</h3><div style=\"max-width:640px\">" + RenderSvg(plot) +
         "</div>";
}

std::string Pictures(const AdjustedPhotos& adjusted, const std::vector<std::string>& names,
                     const std::vector<std::string>& pictures) {
  std::string html;
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    if (pictures[i].empty()) continue;
    html += "<div><section class=\"image\"><h3>" + EscapeHtml(names[i]) +
            (adjusted.photos[i].status.ok() ? "" : "<small>left out</small>") + "</h3><figure>" +
            PictureHtml(names[i] + ", with what was found in it", pictures[i]) +
            "</figure></section></div>";
  }
  if (html.empty()) return "";
  return "<h2>What was found in them</h2><p class=\"lead\">Seen through the estimated camera, each "
         "photo on its own.</p>" +
         OverlayLegend() + "<div class=\"two\">" + html + "</div>";
}

std::string PhotoTable(const AdjustedPhotos& adjusted, const std::vector<std::string>& names) {
  std::ostringstream html;
  html << "<div class=\"scroll\"><table class=\"named sortable\"><thead><tr><th class=\"l\">photo"
          "</th><th>rms px</th><th>misfit</th><th>points</th><th class=\"l\">left out</th></tr>"
          "</thead><tbody>";
  for (std::size_t i = 0; i < names.size(); ++i) {
    const AdjustedPhoto& photo = adjusted.photos[i];
    const bool ok = photo.status.ok();
    html << "<tr>" << CellHtml(names[i], "l") << CellHtml(ok ? FormatFixed(photo.rms_px, 3) : "-")
         << CellHtml(ok ? FormatFixed(photo.misfit, 2) : "-")
         << CellHtml(ok ? std::to_string(photo.residuals.size()) : "-")
         << CellHtml(ok ? JoinList(photo.left_out, ", ") : WhyLeftOut(photo, names), "say")
         << "</tr>";
  }
  html << "</tbody></table></div>";
  return html.str();
}

// Whether photos show circles enough to be matched by how they lie, and these are not the same.
bool HaveSheetsOfTheirOwn(const AdjustedPhotos& adjusted, int camera) {
  constexpr int kFewest = 4;  // Circles that make a pattern.
  if (adjusted.rigid) return false;
  std::vector<int> counts(adjusted.photos.size(), 0);
  for (const AdjustedCircle& circle : adjusted.circles) {
    if (circle.photo >= 0) ++counts[static_cast<std::size_t>(circle.photo)];
  }
  int sheets = 0;
  for (std::size_t i = 0; i < counts.size(); ++i)
    sheets += adjusted.photos[i].camera == camera && counts[i] >= kFewest ? 1 : 0;
  return sheets > 1;
}

}  // namespace

std::vector<std::string> Advice(const AdjustedPhotos& adjusted, int camera) {
  const AdjustedCamera& made = adjusted.cameras[static_cast<std::size_t>(camera)];
  std::vector<std::string> advice;
  if (made.num_photos == 0) return advice;
  constexpr double kFlat = 0.35;  // 20 degrees.
  double most_tilt = 0.0;
  Eigen::Vector2d tilts = Eigen::Vector2d::Zero();
  for (const AdjustedPhoto& photo : adjusted.photos) {
    if (photo.camera != camera || !photo.status.ok()) continue;
    const Eigen::Vector3d n = photo.cam_from_world.rotation.col(2);
    const double tilt = std::acos(std::min(1.0, std::abs(n.z())));
    most_tilt = std::max(most_tilt, tilt);
    tilts.x() = std::max(tilts.x(), std::abs(std::asin(std::clamp(n.x(), -1.0, 1.0))));
    tilts.y() = std::max(tilts.y(), std::abs(std::asin(std::clamp(n.y(), -1.0, 1.0))));
  }
  if (most_tilt < kFlat) {
    advice.push_back("Tilt the sheet more: no photo has it tilted by more than " +
                     FormatFixed(most_tilt / kDegree, 0) +
                     " degrees; 30 to 50 tell the focal length best.");
  } else if (std::min(tilts.x(), tilts.y()) < 0.5 * kFlat) {
    advice.push_back(
        tilts.x() < tilts.y()
            ? "Tilt the sheet about a vertical axis, too: all photos tilt it up or down."
            : "Tilt the sheet about a horizontal axis, too: all photos tilt it sideways.");
  }
  const Field field = FieldOf(adjusted, camera);
  const char* const corners[] = {"upper left", "upper right", "lower left", "lower right"};
  for (int k = 0; k < 4; ++k) {
    const int x0 = k % 2 == 0 ? 0 : kColumns - kColumns / 4, y0 = k < 2 ? 0 : kRows - kRows / 4;
    int seen = 0;
    for (int y = y0; y < y0 + kRows / 4; ++y) {
      for (int x = x0; x < x0 + kColumns / 4; ++x)
        seen += field[static_cast<std::size_t>(y * kColumns + x)].count;
    }
    if (seen == 0)
      advice.push_back(std::string("Fill the ") + corners[k] +
                       " corner: nothing was seen there, and distortion is largest in corners.");
  }
  if (HaveSheetsOfTheirOwn(adjusted, camera)) {
    advice.emplace_back(
        "Show one flat sheet, and all of it, in every photo: here the circles of each count as "
        "those of another sheet, and tell less.");
  }
  if (made.num_photos < 5) advice.emplace_back("Take five photos or more, from different sides.");
  return advice;
}

std::string CalibrationReport(const AdjustedPhotos& adjusted, const std::vector<std::string>& names,
                              const std::vector<std::string>& pictures) {
  std::ostringstream html;
  html << PageTop("circline: calibration") << "<h1>Calibration</h1><p class=\"lead\">"
       << names.size() << " photos, "
       << (adjusted.rigid ? "one sheet seen from all of them" : "each with a sheet of its own")
       << (adjusted.metric ? ", metric" : "") << "</p>" << ListHtml(adjusted.notes);
  for (std::size_t c = 0; c < adjusted.cameras.size(); ++c) {
    const AdjustedCamera& made = adjusted.cameras[c];
    const std::string which = adjusted.cameras.size() > 1 ? " " + made.camera.id : "";
    html << "<h2>Camera" << EscapeHtml(which) << "</h2><p class=\"lead\">" << made.num_photos
         << " photos, rms " << FormatShort(made.rms_px) << " px</p>";
    if (!made.at_prior.empty()) {
      html << "<p class=\"failed\">The photos say next to nothing of: "
           << EscapeHtml(JoinList(made.at_prior, ", ")) << ".</p>";
    }
    html << "<div class=\"two\"><div>" << ParameterTable(made) << "</div><div>"
         << FieldSvg(adjusted, static_cast<int>(c))
         << "<p class=\"lead\">Mean residuals over the photo, 200 times as long; grey: fewer than "
            "ten points seen"
            "</p></div></div><h3>Correlations</h3>"
         << CorrelationTable(made) << SigmaPlot(made);
    const std::vector<std::string> advice = Advice(adjusted, static_cast<int>(c));
    if (!advice.empty()) html << "<h3>What would help most</h3>" << ListHtml(advice, "");
  }
  html << "<h2>Photos</h2>" << PhotoTable(adjusted, names) << Pictures(adjusted, names, pictures)
       << PageEnd();
  return html.str();
}

}  // namespace circline::apps
