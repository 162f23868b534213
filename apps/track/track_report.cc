#include "apps/track/track_report.h"

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <utility>

#include "apps/common/output_file.h"
#include "apps/common/report_page.h"
#include "apps/common/text.h"
#include "apps/compare/encode.h"
#include "apps/compare/summary.h"
#include "apps/track/track_plots.h"

namespace circline::apps {
namespace {

constexpr int kPictureWidth = 640;
constexpr std::size_t kMostPictures = 24, kMostRows = 2000;

struct Counts {
  int tracked = 0, predicted = 0, lost = 0, unusable = 0, begun = 0, cold = 0;
  std::vector<double> observe_us, cold_us, track_us;

  explicit Counts(const std::vector<TrackedFrame>& frames) {
    for (const TrackedFrame& f : frames) {
      begun += f.reinitialized ? 1 : 0;
      if (!f.error.empty()) {
        ++unusable;
        continue;
      }
      ++(!f.has_pose ? lost : f.predicted_only ? predicted : tracked);
      cold += f.cold ? 1 : 0;
      (f.cold ? cold_us : observe_us).push_back(f.observe_us);
      if (f.has_pose) track_us.push_back(f.track_us);
    }
  }
};

std::string TimesText(const std::vector<double>& microseconds) {
  if (microseconds.empty()) return "-";
  return FormatMicroseconds(Median(microseconds)) +
         " (99 %: " + FormatMicroseconds(Quantile(microseconds, 0.99)) + ")";
}

// The frames' rows of the summary: what, and how much of it.
std::vector<std::pair<std::string, std::string>> SummaryRows(
    const std::vector<TrackedFrame>& frames) {
  const Counts counts(frames);
  std::vector<std::pair<std::string, std::string>> rows = {
      {"frames", std::to_string(frames.size())},
      {"tracked", std::to_string(counts.tracked)},
      {"only predicted", std::to_string(counts.predicted)},
      {"without a pose", std::to_string(counts.lost)},
      {"not usable", std::to_string(counts.unusable)},
      {"the track begins (anew)", std::to_string(counts.begun)},
      {"the whole frame looked at", std::to_string(counts.cold)},
      {"features followed, median", TimesText(counts.observe_us)},
      {"whole frame looked at, median", TimesText(counts.cold_us)},
      {"pose, median", TimesText(counts.track_us)}};
  std::vector<double> errors;
  double sum = 0.0;
  int count = 0;
  for (const TrackedFrame& f : frames) {
    if (f.error_deg) errors.push_back(*f.error_deg);
    if (!f.nees) continue;
    sum += *f.nees;
    ++count;
  }
  if (!errors.empty()) {
    rows.emplace_back("error, median", FormatShort(Median(errors)) + " deg (90 %: " +
                                           FormatShort(Quantile(errors, 0.9)) + ")");
  }
  if (count > 0) rows.emplace_back("NEES by degree of freedom, mean", FormatShort(sum / count));
  return rows;
}

std::string FateText(const TrackedFrame& f) {
  if (!f.error.empty()) return "not usable";
  if (!f.has_pose) return "no pose";
  std::string text = f.reinitialized ? "begins" : f.predicted_only ? "predicted" : "tracked";
  return f.cold ? text + ", whole frame" : text;
}

// The frames to show: where the track begins, and others evenly.
std::vector<std::size_t> FramesToShow(const std::vector<TrackedFrame>& frames) {
  std::vector<std::size_t> shown;
  const std::size_t step = 1 + frames.size() / kMostPictures;
  for (std::size_t i = 0; i < frames.size() && shown.size() < 2 * kMostPictures; ++i) {
    if (!frames[i].overlay.empty() && (i % step == 0 || frames[i].reinitialized))
      shown.push_back(i);
  }
  return shown;
}

std::string Pictures(const std::string& folder, const std::vector<TrackedFrame>& frames) {
  std::string html;
  for (const std::size_t i : FramesToShow(frames)) {
    const cv::Mat picture = cv::imread(folder + "/" + frames[i].overlay, cv::IMREAD_COLOR);
    if (picture.empty()) continue;
    const std::string caption = "frame " + std::to_string(i) + ", " +
                                FormatFixed(frames[i].time_s, 2) + " s, " + FateText(frames[i]);
    html += "<figure>" + PictureHtml(caption, EncodeJpeg(picture, kPictureWidth)) + "<figcaption>" +
            EscapeHtml(caption) + "</figcaption></figure>\n";
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
    html += "<tr><td class='l'>" + EscapeHtml(f.name) + "</td><td>" + FormatFixed(f.time_s, 3) +
            "</td><td class='l'>" + FateText(f) + "</td><td>" +
            (f.has_pose ? FormatFixed(f.probabilities.front(), 3) : "-") + "</td><td>" +
            (f.sigma_deg ? FormatShort(*f.sigma_deg) : "-") + "</td><td>" +
            (f.error_deg ? FormatShort(*f.error_deg) : "-") + "</td><td class='say'>" +
            EscapeHtml(f.error.empty() ? f.message : f.error) + "</td></tr>\n";
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
    html += "<tr><td class='l'>" + what + "</td><td>" + value + "</td></tr>";
  html += "</table>";
  if (!frames.empty()) html += "<h2>Over time</h2>" + TrackPlots(frames);
  html += Pictures(folder, frames) + FrameTable(frames) + PageEnd();
  return WriteFile(folder + "/report.html", html);
}

}  // namespace circline::apps
