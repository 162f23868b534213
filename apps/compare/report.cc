#include "apps/compare/report.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <sstream>

#include "apps/common/svg_plot.h"
#include "apps/common/text.h"
#include "apps/compare/results.h"

namespace circline::apps {
namespace {

constexpr double kDegreesPerRadian = 57.295779513082323;
constexpr std::size_t kMaxCurves = 18;

const char* const kStyle = R"css(
:root{--bg:#fff;--fg:#1c2430;--soft:#5d6978;--line:#dde3ea;--card:#f6f8fa;--accent:#1f6fd1;--good:#1d8348;--bad:#c0392b}
@media(prefers-color-scheme:dark){:root{--bg:#14181d;--fg:#e4e9ef;--soft:#9aa7b5;--line:#2d353f;--card:#1b2127;--accent:#6cb0ff;--good:#5fcf8d;--bad:#ff8a7a}}
*{box-sizing:border-box}
body{margin:0 auto;max-width:1280px;padding:28px 24px 80px;background:var(--bg);color:var(--fg);font:15px/1.5 system-ui,-apple-system,"Segoe UI",sans-serif}
h1{font-size:26px;margin:0 0 4px}h2{font-size:19px;margin:40px 0 12px}h3{font-size:16px;margin:0 0 10px;overflow-wrap:anywhere}
p.lead{margin:0 0 20px;color:var(--soft)}
.scroll{overflow-x:auto;border:1px solid var(--line);border-radius:8px}
table{border-collapse:collapse;width:100%;font-size:13px;font-variant-numeric:tabular-nums}
th,td{padding:6px 10px;text-align:right;white-space:nowrap;border-bottom:1px solid var(--line)}
tr:last-child td{border-bottom:0}
th{background:var(--card);font-weight:600;vertical-align:bottom}
table.sortable th{cursor:pointer}
th.up:after{content:" \25B4"}th.down:after{content:" \25BE"}
.l{text-align:left}td.say{text-align:left;white-space:normal;min-width:220px;color:var(--soft)}
tr.more td{color:var(--soft)}tr.shown td{background:var(--card)}
.ok{color:var(--good)}.refused{color:var(--soft)}.failed{color:var(--bad);font-weight:600}
.plots{display:grid;grid-template-columns:repeat(auto-fit,minmax(420px,1fr));gap:20px}
.plots>div,section.image{border:1px solid var(--line);border-radius:8px;padding:16px}
svg{width:100%;height:auto;display:block}
section.image{margin:0 0 22px}
.two{display:flex;flex-wrap:wrap;gap:20px;margin:0 0 14px}.two>div{flex:1 1 300px}
figure{margin:0;flex:0 1 720px}figure.big{flex-basis:100%}figure img{display:block;width:100%;border-radius:6px;cursor:zoom-in}
figure.big img{cursor:zoom-out}
ul.say{margin:6px 0 12px;padding-left:18px;color:var(--soft);font-size:13px}
.legend span{display:inline-block;margin-right:16px}.legend i{display:inline-block;width:12px;height:12px;border-radius:3px;margin-right:5px;vertical-align:-1px}
)css";

const char* const kScript = R"js(
document.querySelectorAll('table.sortable').forEach(function(table){
  var heads=table.querySelectorAll('th');
  heads.forEach(function(head,column){head.addEventListener('click',function(){
    var up=!head.classList.contains('up');
    heads.forEach(function(h){h.className=h.className.replace(/ ?(up|down)\b/g,'')});
    head.classList.add(up?'up':'down');
    var body=table.tBodies[0],rows=Array.from(body.rows);
    function value(row){var text=row.cells[column].textContent.trim(),number=parseFloat(text);
      return text==='-'?Infinity:isNaN(number)?text:number}
    rows.sort(function(a,b){var x=value(a),y=value(b);
      var order=typeof x===typeof y?(x<y?-1:x>y?1:0):(typeof x==='number'?-1:1);return up?order:-order});
    rows.forEach(function(row){body.appendChild(row)})})})});
document.querySelectorAll('figure img').forEach(function(image){
  image.addEventListener('click',function(){image.parentNode.classList.toggle('big')})});
)js";

std::string Cell(const std::string& text, const char* css = nullptr) {
  return std::string("<td") + (css == nullptr ? "" : std::string(" class='") + css + "'") + ">" +
         EscapeHtml(text) + "</td>";
}

std::string LossText(const LossSetting* loss) {
  return loss == nullptr ? "-" : loss->loss + ", " + ScaleText(*loss);
}

// ---- One image ----

std::string StageText(const SolverRun& run) {
  return run.stage == SolverStage::kRefined ? "refined" : "closed form";
}

std::string SigmaText(const PoseHypothesis& hypothesis) {
  if (hypothesis.RotationIsFree()) {
    const std::optional<double> normal = SigmaNormalDeg(hypothesis);
    return normal ? "normal " + FormatShort(*normal, 2) : "free";
  }
  const Eigen::Vector3d sigma = hypothesis.SigmaRotation() * kDegreesPerRadian;
  std::vector<std::string> parts;
  for (int i = 0; i < 3; ++i)
    parts.push_back(std::isfinite(sigma[i]) ? FormatShort(sigma[i], 2) : "free");
  return JoinList(parts, " / ");
}

std::string ErrorText(const std::optional<double>& error) {
  return error ? FormatShort(*error) : "-";
}

std::string DirectionText(const PoseErrors& errors) {
  std::vector<std::string> parts;
  for (const auto& [id, error] : errors.directions_deg)
    parts.push_back(id + " " + FormatShort(error));
  return parts.empty() ? "-" : JoinList(parts, ", ");
}

std::string Sentences(const PoseEstimate& estimate) {
  std::vector<std::string> sentences;
  if (!estimate.status.message.empty()) sentences.push_back(estimate.status.message);
  if (!estimate.decided_by.empty()) sentences.push_back("Decided by: " + estimate.decided_by);
  sentences.insert(sentences.end(), estimate.notes.begin(), estimate.notes.end());
  return JoinList(sentences, " | ");
}

// Which errors some hypothesis of the image has.
struct TruthColumns {
  bool rotation = false, normal = false, translation = false, directions = false;
  explicit TruthColumns(const ImageRun& run) {
    for (const SolverRun& solver : run.solvers) {
      for (const PoseErrors& errors : solver.errors) {
        rotation = rotation || errors.rotation_deg;
        normal = normal || errors.normal_deg;
        translation = translation || errors.translation_deg;
        directions = directions || !errors.directions_deg.empty();
      }
    }
  }
};

std::string SolverHead(const TruthColumns& truth) {
  std::string html =
      "<tr><th class='l'>solver</th><th class='l'>stage</th><th class='l'>loss, scale px</th>"
      "<th>hypothesis</th><th>probability</th>";
  if (truth.rotation) html += "<th>rotation<br>error &deg;</th>";
  if (truth.normal) html += "<th>normal<br>error &deg;</th>";
  if (truth.translation) html += "<th>translation<br>error &deg;</th>";
  if (truth.directions) html += "<th class='l'>direction error &deg;</th>";
  return html +
         "<th>rms px</th><th>inliers</th><th>sigma of<br>rotation &deg;</th><th>time</th>"
         "<th class='l'>remarks</th></tr>";
}

std::string HypothesisRow(const SolverRun& run, std::size_t i, const TruthColumns& truth,
                          bool shown) {
  const PoseHypothesis& h = run.estimate.hypotheses[i];
  const PoseErrors& errors = run.errors[i];
  std::string html = i > 0 ? "<tr class='more'>" : shown ? "<tr class='shown'>" : "<tr>";
  html += i > 0 ? "<td></td><td></td><td></td>"
                : Cell(run.solver, "l") + Cell(StageText(run), "l") + Cell(LossText(run.loss), "l");
  html += Cell(std::to_string(i + 1) + " of " + std::to_string(run.estimate.hypotheses.size())) +
          Cell(FormatFixed(h.probability, 3));
  if (truth.rotation) html += Cell(ErrorText(errors.rotation_deg));
  if (truth.normal) html += Cell(ErrorText(errors.normal_deg));
  if (truth.translation) html += Cell(ErrorText(errors.translation_deg));
  if (truth.directions) html += Cell(DirectionText(errors), "l");
  html += Cell(FormatShort(h.rms_px)) +
          Cell(std::to_string(h.num_inliers) + " / " + std::to_string(h.num_observations)) +
          Cell(SigmaText(h));
  html += i > 0 ? "<td></td><td></td>"
                : Cell(FormatMicroseconds(run.microseconds)) + Cell(Sentences(run.estimate), "say");
  return html + "</tr>";
}

bool HasAnswer(const SolverRun& run) {
  return run.estimate.status.ok() && !run.estimate.hypotheses.empty();
}

std::string SolverTable(const ImageRun& run) {
  if (std::none_of(run.solvers.begin(), run.solvers.end(), HasAnswer)) return "";
  const TruthColumns truth(run);
  const SolverRun* shown = RunToShow(run);
  std::string html = "<div class='scroll'><table><thead>" + SolverHead(truth) + "</thead><tbody>";
  for (const SolverRun& solver : run.solvers) {
    if (!HasAnswer(solver)) continue;
    for (std::size_t i = 0; i < solver.estimate.hypotheses.size(); ++i) {
      html += HypothesisRow(solver, i, truth, &solver == shown);
    }
  }
  return html + "</tbody></table></div>";
}

// Solvers without an answer, those with the same sentence together.
std::string Refusals(const ImageRun& run) {
  std::vector<std::pair<std::string, std::vector<std::string>>> groups;  // Sentence, solvers.
  for (const SolverRun& solver : run.solvers) {
    if (HasAnswer(solver)) continue;
    const std::string sentence =
        std::string(StatusText(solver.estimate.status)) + ": " + Sentences(solver.estimate);
    auto group = std::find_if(groups.begin(), groups.end(),
                              [&](const auto& g) { return g.first == sentence; });
    if (group == groups.end()) group = groups.insert(groups.end(), {sentence, {}});
    if (group->second.empty() || group->second.back() != solver.solver) {
      group->second.push_back(solver.solver);
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
std::string Problems(const std::vector<std::string>& problems) {
  constexpr std::size_t kMost = 8;
  if (problems.empty()) return "";
  std::string html = "<ul class='say'>";
  for (std::size_t i = 0; i < std::min(kMost, problems.size()); ++i) {
    html += "<li>" + EscapeHtml(problems[i]) + "</li>";
  }
  if (problems.size() > kMost) {
    html += "<li>and " + std::to_string(problems.size() - kMost) + " more</li>";
  }
  return html + "</ul>";
}

std::string EvidenceText(const ImageRun& run) {
  std::size_t num_segments = 0;
  for (const PencilObservation& pencil : run.observations.pencils)
    num_segments += pencil.lines.size();
  std::string text =
      std::to_string(run.observations.circles.size()) + " ellipses, " +
      std::to_string(num_segments) + " segments in " +
      std::to_string(run.observations.pencils.size()) + " pencils, " +
      (run.image->detect_everything ? "all detected in the photo" : "as the scene file gives them");
  for (const auto& [stage, microseconds] : run.stages)
    text += "; " + stage + " " + FormatMicroseconds(microseconds);
  return text;
}

// ---- The summary ----

std::string SummaryTable(const Summary& summary) {
  std::vector<SummaryColumn> columns = summary.Columns();
  columns.push_back({"time ms", "median time of a call", false, [](const SummaryRow& row) {
                       return FormatShort(Median(row.microseconds) * 1e-3);
                     }});
  std::string html = "<div class='scroll'><table class='sortable'><thead><tr>";
  for (const SummaryColumn& column : columns) {
    html += std::string("<th") + (column.left ? " class='l'" : "") + " title='" +
            EscapeHtml(column.explanation) + "'>" + EscapeHtml(column.title) + "</th>";
  }
  html += "</tr></thead><tbody>";
  for (const SummaryRow* row : summary.Ranked()) {
    html += "<tr>";
    for (const SummaryColumn& column : columns) {
      html += Cell(column.text(*row), column.left ? "l" : nullptr);
    }
    html += "</tr>";
  }
  return html + "</tbody></table></div>";
}

std::size_t NumLosses(const std::vector<const SummaryRow*>& rows) {
  std::set<const LossSetting*> losses;
  for (const SummaryRow* row : rows) {
    if (row->loss != nullptr) losses.insert(row->loss);
  }
  return losses.size();
}

// Share of images within x degrees, as steps; images without an answer never get there.
PlotSeries CumulativeCurve(const SummaryRow& row, std::vector<double> errors, double x_min,
                           double x_max) {
  PlotSeries series;
  series.name = row.Name();
  std::sort(errors.begin(), errors.end());
  double share = 0.0;
  series.points.emplace_back(x_min, 0.0);
  for (std::size_t i = 0; i < errors.size(); ++i) {
    const double x = std::clamp(errors[i], x_min, x_max);
    series.points.emplace_back(x, share);
    share = static_cast<double>(i + 1) / row.images;
    series.points.emplace_back(x, share);
  }
  series.points.emplace_back(x_max, share);
  return series;
}

std::string ErrorPlot(const Summary& summary, const std::string& title,
                      std::vector<double> SummaryRow::*errors) {
  Plot plot;
  plot.title = title;
  plot.x_label = "error, degrees";
  plot.y_label = "share of images";
  plot.log_x = plot.percent_y = true;
  double low = 10.0, high = 1.0;
  std::vector<const SummaryRow*> rows;
  for (const SummaryRow* row : summary.Ranked()) {
    if ((row->*errors).empty()) continue;
    for (const double error : row->*errors) {
      low = std::min(low, error);
      high = std::max(high, error);
    }
    if (rows.size() < kMaxCurves) rows.push_back(row);
  }
  if (rows.empty()) return "";
  plot.x_min = std::clamp(std::pow(10.0, std::floor(std::log10(std::max(low, 1e-6)))), 1e-3, 1.0);
  plot.x_max = std::clamp(high * 1.05, 2.0, 180.0);
  const bool several_losses = NumLosses(rows) > 1;
  std::map<std::string, std::size_t> colors;
  for (const SummaryRow* row : rows) {
    PlotSeries series = CumulativeCurve(*row, row->*errors, plot.x_min, plot.x_max);
    const bool by_loss = several_losses && row->loss != nullptr;
    const std::string key = row->solver + (by_loss ? " " + LossText(row->loss) : "");
    const std::size_t color = colors.emplace(key, colors.size()).first->second;
    series.color = SeriesColor(color);
    series.dashed = row->stage == SolverStage::kClosedForm;
    plot.series.push_back(std::move(series));
  }
  return "<div>" + RenderSvg(plot) + "</div>";
}

std::string Legend() {
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

std::string Lead(const Summary& summary) {
  std::string text = std::to_string(summary.num_images()) +
                     (summary.num_images() == 1 ? " image, " : " images, ") +
                     std::to_string(summary.rows().size()) + " rows of solvers, stages and losses";
  if (summary.num_unreadable() > 0) {
    text += "; " + std::to_string(summary.num_unreadable()) + " could not be read";
  }
  return text + ".";
}

}  // namespace

std::string ReportSection(const ImageRun& run, const std::vector<std::uint8_t>& picture,
                          const std::string& overlay_file) {
  std::ostringstream html;
  html << "<section class='image'><h3>" << EscapeHtml(run.image->name) << "</h3>";
  if (!run.read_error.empty()) {
    html << "<p class='failed'>Not read: " << EscapeHtml(run.read_error) << ".</p></section>\n";
    return html.str();
  }
  html << "<div class='two'>";
  if (!picture.empty()) {
    html << "<figure><img alt='" << EscapeHtml(run.image->name)
         << ", with what was found in it' src='data:image/jpeg;base64," << EncodeBase64(picture)
         << "'></figure>";
  }
  html << "<div><p class='lead'>" << EscapeHtml(EvidenceText(run)) << ".</p>";
  if (picture.empty() && !overlay_file.empty()) {
    html << "<p class='lead'>Picture: " << EscapeHtml(overlay_file) << "</p>";
  }
  html << Problems(run.problems) << Refusals(run) << "</div></div>" << SolverTable(run)
       << "</section>\n";
  return html.str();
}

std::string RenderReport(const Summary& summary, const std::vector<std::string>& sections) {
  std::ostringstream html;
  html << "<!DOCTYPE html>\n<html lang='en'><head><meta charset='utf-8'>"
       << "<meta name='viewport' content='width=device-width,initial-scale=1'><title>circline: "
          "comparison</title><style>"
       << kStyle
       << "</style></head><body>\n<h1>Pose from circles and parallel lines</h1><p class='lead'>"
       << EscapeHtml(Lead(summary)) << "</p>\n<h2>Summary</h2>" << SummaryTable(summary) << "\n";
  const std::string plots =
      ErrorPlot(summary, "Rotation error", &SummaryRow::rotation_errors) +
      ErrorPlot(summary, "Normal error of the best hypothesis", &SummaryRow::normal_errors) +
      ErrorPlot(summary, "Direction error", &SummaryRow::direction_errors);
  if (!plots.empty())
    html << "<h2>Share of images within an error</h2><div class='plots'>" << plots << "</div>\n";
  html << "<h2>Images</h2>" << Legend() << "\n";
  for (const std::string& section : sections) html << section;
  html << "<script>" << kScript << "</script></body></html>\n";
  return html.str();
}

}  // namespace circline::apps
