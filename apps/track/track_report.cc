#include "apps/track/track_report.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "apps/common/output_file.h"
#include "apps/common/report_page.h"
#include "apps/common/text.h"
#include "apps/compare/encode.h"
#include "apps/compare/summary.h"

namespace circline::apps {
namespace {

constexpr int kPictureWidth = 640;
constexpr std::size_t kMostPictures = 24, kMostRows = 2000;

std::string TimesText(const std::vector<double>& microseconds) {
  if (microseconds.empty()) return "-";
  return FormatMicroseconds(Median(microseconds)) +
         " (99 %: " + FormatMicroseconds(Quantile(microseconds, 0.99)) + ")";
}

// The rows of the summary: what, and how much of it.
std::vector<std::pair<std::string, std::string>> SummaryRows(
    const std::vector<TrackedFrame>& frames) {
  int tracked = 0, predicted = 0, lost = 0, unusable = 0, begun = 0, cold = 0;
  std::vector<double> observe_us, cold_us, track_us, errors, nees;
  for (const TrackedFrame& f : frames) {
    begun += f.reinitialized ? 1 : 0;
    if (f.error_deg) errors.push_back(*f.error_deg);
    if (f.nees) nees.push_back(*f.nees);
    if (!f.error.empty()) {
      ++unusable;
      continue;
    }
    ++(!f.has_pose ? lost : f.predicted_only ? predicted : tracked);
    cold += f.cold ? 1 : 0;
    (f.cold ? cold_us : observe_us).push_back(f.observe_us);
    if (f.has_pose) track_us.push_back(f.track_us);
  }
  std::vector<std::pair<std::string, std::string>> rows = {
      {"frames", std::to_string(frames.size())},
      {"tracked", std::to_string(tracked)},
      {"only predicted", std::to_string(predicted)},
      {"without a pose", std::to_string(lost)},
      {"not usable", std::to_string(unusable)},
      {"the track begins (anew)", std::to_string(begun)},
      {"the whole frame looked at", std::to_string(cold)},
      {"features followed, median", TimesText(observe_us)},
      {"whole frame looked at, median", TimesText(cold_us)},
      {"pose, median", TimesText(track_us)}};
  if (!errors.empty()) {
    rows.emplace_back("error, median", FormatShort(Median(errors)) + " deg (90 %: " +
                                           FormatShort(Quantile(errors, 0.9)) + ")");
  }
  if (!nees.empty()) {
    const double sum = std::accumulate(nees.begin(), nees.end(), 0.0);
    rows.emplace_back("NEES by degree of freedom, mean",
                      FormatShort(sum / static_cast<double>(nees.size())));
  }
  return rows;
}

std::string FateText(const TrackedFrame& f) {
  if (!f.error.empty()) return "not usable";
  if (!f.has_pose) return "no pose";
  std::string text = f.reinitialized ? "begins" : f.predicted_only ? "predicted" : "tracked";
  return f.cold ? text + ", whole frame" : text;
}

// The frames where the track begins, and others evenly.
std::string Pictures(const std::string& folder, const std::vector<TrackedFrame>& frames) {
  std::string html;
  const std::size_t step = 1 + frames.size() / kMostPictures;
  std::size_t shown = 0;
  for (std::size_t i = 0; i < frames.size() && shown < 2 * kMostPictures; ++i) {
    const TrackedFrame& f = frames[i];
    if (f.overlay.empty() || (i % step != 0 && !f.reinitialized)) continue;
    ++shown;
    const std::string jpeg = JpegOfFile(folder + "/" + f.overlay, kPictureWidth);
    if (jpeg.empty()) continue;
    const std::string caption =
        "frame " + std::to_string(i) + ", " + FormatFixed(f.time_s, 2) + " s, " + FateText(f);
    html += "<figure>" + PictureHtml(caption, jpeg) + "<figcaption>" + EscapeHtml(caption) +
            "</figcaption></figure>\n";
  }
  return html.empty() ? "" : "<h2>Frames</h2><div class='plots'>" + html + "</div>";
}

std::string FrameTable(const std::vector<TrackedFrame>& frames) {
  std::string html =
      "<h2>All frames</h2><details><summary>" + std::to_string(frames.size()) + " frames" +
      (frames.size() > kMostRows ? " (the first 2000)" : "") +
      "</summary><div class='scroll'><table class='named sortable'><thead><tr><th class='l'>frame"
      "</th><th>time, s</th><th class='l'>what</th><th>probability</th><th>sigma, deg</th>"
      "<th>error, deg</th><th class='l'>message</th></tr></thead><tbody>";
  for (std::size_t i = 0; i < std::min(frames.size(), kMostRows); ++i) {
    const TrackedFrame& f = frames[i];
    html += "<tr>" + CellHtml(f.name, "l") + CellHtml(FormatFixed(f.time_s, 3)) +
            CellHtml(FateText(f), "l") +
            CellHtml(f.has_pose ? FormatFixed(f.probabilities.front(), 3) : "-") +
            CellHtml(FormatShort(f.sigma_deg.value_or(kUnknown))) +
            CellHtml(FormatShort(f.error_deg.value_or(kUnknown))) +
            CellHtml(f.error.empty() ? f.message : f.error, "say") + "</tr>\n";
  }
  return html + "</tbody></table></div></details>";
}

}  // namespace

std::string TrackTable(const std::vector<TrackedFrame>& frames) {
  std::string text;
  for (const auto& [what, value] : SummaryRows(frames)) {
    text += what + std::string(what.size() < 34 ? 34 - what.size() : 1, ' ') + value + "\n";
  }
  return text;
}

Status WriteTrackReport(const std::string& folder, const std::vector<TrackedFrame>& frames) {
  std::string html =
      PageTop("circline: track") + "<h1>Poses of a moving camera</h1><h2>Summary</h2><table>";
  for (const auto& [what, value] : SummaryRows(frames))
    html += "<tr>" + CellHtml(what, "l") + CellHtml(value) + "</tr>";
  html += "</table>";
  if (!frames.empty()) html += "<h2>Over time</h2>" + TrackPlots(frames);
  html += Pictures(folder, frames) + FrameTable(frames) + PageEnd();
  return WriteFile(folder + "/report.html", html);
}

}  // namespace circline::apps
