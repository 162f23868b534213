#include <algorithm>
#include <cmath>
#include <utility>

#include "apps/common/report_page.h"
#include "apps/common/text.h"
#include "apps/compare/report_parts.h"

namespace circline::apps {
namespace {

std::string StageText(const SolverRecord& run) {
  return run.key.stage == "refined" ? "refined" : "closed form";
}

std::string SigmaText(const HypothesisRecord& hypothesis) {
  if (hypothesis.rotation_is_free) {
    const double normal = hypothesis.sigma_normal_deg;
    return std::isfinite(normal) ? "normal " + FormatShort(normal, 2) : "free";
  }
  std::vector<std::string> parts;
  for (const double sigma : hypothesis.sigma_rotation_deg)
    parts.push_back(std::isfinite(sigma) ? FormatShort(sigma, 2) : "free");
  if (hypothesis.sigma_rotation_deg.array().isInf().all()) return "-";  // A peer says nothing.
  return JoinList(parts, " / ");
}

std::string ErrorText(const std::optional<double>& error) {
  return error ? FormatShort(*error) : "-";
}

std::string FocalText(const HypothesisRecord& h) {
  if (!std::isfinite(h.focal_px)) return "-";
  const std::string sigma =
      std::isfinite(h.focal_sigma_px) ? " \u00b1 " + FormatShort(h.focal_sigma_px, 2) : "";
  return FormatFixed(h.focal_px, 1) + sigma;
}

std::string DirectionText(const PoseErrors& errors) {
  std::vector<std::string> parts;
  for (const auto& [id, error] : errors.directions_deg)
    parts.push_back(id + " " + FormatShort(error));
  return parts.empty() ? "-" : JoinList(parts, ", ");
}

std::string Sentences(const SolverRecord& solver) {
  std::vector<std::string> sentences;
  if (!solver.message.empty()) sentences.push_back(solver.message);
  if (!solver.decided_by.empty()) sentences.push_back("Decided by: " + solver.decided_by);
  sentences.insert(sentences.end(), solver.notes.begin(), solver.notes.end());
  return JoinList(sentences, " | ");
}

// What some hypothesis of the image has: errors, a focal length of its own.
struct Columns {
  bool rotation = false, normal = false, translation = false, directions = false, focal = false;
  explicit Columns(const ImageRecord& record) {
    for (const SolverRecord& solver : record.solvers) {
      for (const HypothesisRecord& hypothesis : solver.hypotheses) {
        const PoseErrors& errors = hypothesis.errors;
        rotation = rotation || errors.rotation_deg;
        normal = normal || errors.normal_deg;
        translation = translation || errors.translation_deg;
        directions = directions || !errors.directions_deg.empty();
        focal = focal || std::isfinite(hypothesis.focal_px);
      }
    }
  }
};

std::string SolverHead(const Columns& columns) {
  std::string html =
      "<tr><th class='l'>solver</th><th class='l'>stage</th><th class='l'>loss, scale px</th>"
      "<th>hypothesis</th><th>probability</th>";
  if (columns.rotation) html += "<th>rotation<br>error &deg;</th>";
  if (columns.normal) html += "<th>normal<br>error &deg;</th>";
  if (columns.translation) html += "<th>translation<br>error &deg;</th>";
  if (columns.directions) html += "<th class='l'>direction error &deg;</th>";
  if (columns.focal) html += "<th>focal<br>length px</th>";
  return html +
         "<th>rms px</th><th>inliers</th><th>sigma of<br>rotation &deg;</th><th>time</th>"
         "<th class='l'>remarks</th></tr>";
}

std::string HypothesisRow(const SolverRecord& run, std::size_t i, const Columns& columns,
                          bool shown) {
  const HypothesisRecord& h = run.hypotheses[i];
  const PoseErrors& errors = h.errors;
  std::string html = i > 0 ? "<tr class='more'>" : shown ? "<tr class='shown'>" : "<tr>";
  html += i > 0 ? "<td></td><td></td><td></td>"
                : CellHtml(run.key.solver, "l") + CellHtml(StageText(run), "l") +
                      CellHtml(run.key.LossText(), "l");
  html += CellHtml(std::to_string(i + 1) + " of " + std::to_string(run.hypotheses.size())) +
          CellHtml(FormatFixed(h.probability, 3));
  if (columns.rotation) html += CellHtml(ErrorText(errors.rotation_deg));
  if (columns.normal) html += CellHtml(ErrorText(errors.normal_deg));
  if (columns.translation) html += CellHtml(ErrorText(errors.translation_deg));
  if (columns.directions) html += CellHtml(DirectionText(errors), "l");
  if (columns.focal) html += CellHtml(FocalText(h));
  html += CellHtml(FormatShort(h.rms_px)) +
          CellHtml(std::to_string(h.num_inliers) + " / " + std::to_string(h.num_observations)) +
          CellHtml(SigmaText(h));
  html += i > 0 ? "<td></td><td></td>"
                : CellHtml(FormatMicroseconds(run.microseconds)) + CellHtml(Sentences(run), "say");
  return html + "</tr>";
}

std::string SolverTable(const ImageRecord& record, const std::vector<SolverKey>& keys) {
  const SolverRecord* shown = AnswerToShow(record.solvers);
  if (shown == nullptr) return "";
  const Columns columns(record);
  std::string html = "<div class='scroll'><table><thead>" + SolverHead(columns) + "</thead><tbody>";
  for (const SolverRecord& solver : record.solvers) {
    const bool wanted = std::find(keys.begin(), keys.end(), solver.key) != keys.end();
    if (!wanted && &solver != shown) continue;
    for (std::size_t i = 0; i < solver.hypotheses.size(); ++i) {
      html += HypothesisRow(solver, i, columns, &solver == shown);
    }
  }
  return html + "</tbody></table></div>";
}

// Solvers without an answer, those with the same sentence together.
std::string Refusals(const ImageRecord& record) {
  std::vector<std::pair<std::string, std::vector<std::string>>> groups;  // Sentence, solvers.
  for (const SolverRecord& solver : record.solvers) {
    if (solver.HasAnswer()) continue;
    const std::string sentence = solver.status + ": " + Sentences(solver);
    auto group = std::find_if(groups.begin(), groups.end(),
                              [&](const auto& g) { return g.first == sentence; });
    if (group == groups.end()) group = groups.insert(groups.end(), {sentence, {}});
    if (group->second.empty() || group->second.back() != solver.key.solver) {
      group->second.push_back(solver.key.solver);
    }
  }
  if (groups.empty()) return "";
  std::string html = "<ul class='say'>";
  for (const auto& [sentence, solvers] : groups) {
    html +=
        "<li><b>" + EscapeHtml(JoinList(solvers, ", ")) + "</b> " + EscapeHtml(sentence) + "</li>";
  }
  return html + "</ul>";
}

// At most so many sentences, so that a hundred bad points do not hide the rest.
std::string Problems(std::vector<std::string> problems) {
  constexpr std::size_t kMost = 8;
  if (problems.size() > kMost) {
    const std::string more = "and " + std::to_string(problems.size() - kMost) + " more";
    problems.resize(kMost);
    problems.push_back(more);
  }
  return ListHtml(problems);
}

std::string EvidenceText(const ImageRecord& record) {
  const auto count = [](std::size_t number, const std::string& what) {
    return std::to_string(number) + " " + what + (number == 1 ? "" : "s");
  };
  std::string text = count(record.num_ellipses, "ellipse") + ", " +
                     count(record.num_segments, "segment") + " in " +
                     count(record.num_pencils, "pencil") + ", " +
                     (record.detected ? "all detected in the photo" : "as the scene file says");
  for (const auto& [stage, microseconds] : record.stages)
    text += "; " + stage + " " + FormatMicroseconds(microseconds);
  return text;
}

}  // namespace

std::string ImageSection(const ImageRecord& record, const std::vector<SolverKey>& keys,
                         const std::string& picture, const std::string& why) {
  std::string html = "<section class='image' data-why='" + why + "'><h3>" +
                     EscapeHtml(record.name) + (why.empty() ? "" : "<small>" + why + "</small>") +
                     "</h3>";
  if (!record.error.empty()) {
    return html + "<p class='failed'>Not read: " + EscapeHtml(record.error) + ".</p></section>\n";
  }
  html += "<div class='two'>";
  if (!picture.empty()) {
    html += "<figure>" + PictureHtml(record.name + ", with what was found in it", picture) +
            "</figure>";
  }
  html += "<div><p class='lead'>" + EscapeHtml(EvidenceText(record)) + ".</p>";
  if (!record.camera_from.empty())
    html += "<p class='lead'>Camera: " + EscapeHtml(record.camera_from) + ".</p>";
  if (!record.overlay.empty()) {
    html += "<p class='lead'>Full picture: " + EscapeHtml(record.overlay) + "</p>";
  }
  return html + Problems(record.problems) + Refusals(record) + "</div></div>" +
         SolverTable(record, keys) + "</section>\n";
}

std::string OverlayLegend() {
  const std::vector<std::pair<const char*, const char*>> entries = {
      {"#ffd700",
       "fitted ellipses, pale where the pose does not use them; cross: image of the circle's "
       "centre, "
       "ring: that of the second hypothesis"},
      {"#ff4646", "X, and lines along it"},
      {"#3cdc50", "Y"},
      {"#328cff", "Z, or the plane's normal"},
      {"#e650dc", "lines along a free direction (a colour each)"},
      {"#78e6ff", "dashed: vanishing line of the plane"}};
  std::string html = "<p class='legend'>";
  for (const auto& [color, text] : entries) {
    html += std::string("<span><i style='background:") + color + "'></i>" + EscapeHtml(text) +
            "</span>";
  }
  return html + "</p>";
}

}  // namespace circline::apps
