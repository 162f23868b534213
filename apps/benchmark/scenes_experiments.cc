#include "apps/benchmark/scenes_experiments.h"

#include <string>
#include <utility>
#include <vector>

#include "apps/benchmark/scenes_kinds.h"
#include "apps/common/text.h"

namespace circline::apps {
namespace {

std::vector<SceneRow> LoneArcRows() {
  std::vector<SceneRow> rows;
  for (const int arcs : {1, 2}) {
    for (const double deg : {60.0, 90.0, 120.0}) {
      rows.push_back({std::to_string(arcs) + " of " + FormatPlain(deg) + " deg",
                      [=](double noise, Random* r) { return DrawLoneArcs(arcs, deg, noise, r); }});
    }
  }
  return rows;
}

std::vector<SceneRow> OddCircleRows() {
  std::vector<SceneRow> rows;
  for (const int n : {3, 2}) {
    for (const double tilt : {5.0, 10.0, 15.0, 0.0}) {
      const std::string what = tilt > 0.0 ? FormatPlain(tilt) + " deg" : "radius 5 % off";
      rows.push_back({"one of " + std::to_string(n) + ", " + what,
                      [=](double noise, Random* r) { return DrawOddCircle(n, tilt, noise, r); }});
    }
  }
  return rows;
}

// The focal length that is given is so many times the true one.
std::vector<SceneRow> UnknownFocalRows(
    const std::vector<std::pair<std::string, FocalEvidence>>& evidence,
    const std::vector<double>& factors, double log_focal_sigma) {
  std::vector<SceneRow> rows;
  for (const auto& [name, kind] : evidence) {
    for (const double factor : factors) {
      rows.push_back({name + ", " + FormatPlain(factor) + " f",
                      [kind = kind, factor, log_focal_sigma](double noise, Random* r) {
                        return DrawUnknownFocal(kind, factor, log_focal_sigma, noise, r);
                      }});
    }
  }
  return rows;
}

SceneRow BleedRow(const std::string& name, double bleed_px) {
  return {name, [=](double noise, Random* r) { return DrawDiscs(bleed_px, noise, r); }};
}

SceneRow OddLinesRow(const std::string& name, int pencils, int lines, int odd) {
  return {name,
          [=](double noise, Random* r) { return DrawOddLines(pencils, lines, odd, noise, r); }};
}

}  // namespace

std::vector<SceneExperiment> SceneExperiments() {
  const std::vector<LossType> cauchy = {LossType::kCauchy};
  return {
      {"random",
       "scenes of every kind",
       1,
       150,
       {0.1, 0.5, 1.0, 2.0},
       cauchy,
       {{"", DrawAnything}}},
      {"short_arcs",
       "three whole circles and an arc of 45 to 60 deg",
       2,
       200,
       {0.5, 1.0},
       cauchy,
       {{"", DrawShortArc}}},
      {"lone_arcs",
       "one or two circles, an arc of each, and a pencil of four lines; the bound 20 deg or less",
       9,
       100,
       {0.5},
       cauchy,
       LoneArcRows()},
      {"odd_circles",
       "one circle has a plane of its own, or a wrong radius, by 10 sigma or more; errors are of "
       "the pose by the others",
       3,
       100,
       {0.5},
       cauchy,
       OddCircleRows()},
      {"bleed",
       "twelve equal discs, all too large, noise model of photographs",
       4,
       100,
       {0.2},
       cauchy,
       {BleedRow("as drawn", 0.0), BleedRow("by 0.2 px", 0.2), BleedRow("by 0.3 px", 0.3)},
       true},
      {"focal_length",
       "the focal length given is so many times the true one, its prior 0.5 of log f, the bound on "
       "it 0.1 or less",
       5,
       15,
       {0.5},
       cauchy,
       UnknownFocalRows({{"rings", FocalEvidence::kRings},
                         {"circles", FocalEvidence::kCircles},
                         {"circle, pencils", FocalEvidence::kCircleAndPencils}},
                        {0.63, 0.77, 0.9, 1.1, 1.3, 1.6}, 0.5)},
      {"unknown_focal",
       "the same, all kinds of evidence, prior 1.0",
       10,
       15,
       {0.5},
       {LossType::kTrivial},
       UnknownFocalRows({{"two pencils", FocalEvidence::kPencils},
                         {"circle, centre", FocalEvidence::kCircleAndCenter},
                         {"circle, pencils", FocalEvidence::kCircleAndPencils},
                         {"circles", FocalEvidence::kCircles},
                         {"rings", FocalEvidence::kRings},
                         {"equal circles", FocalEvidence::kEqualCircles},
                         {"lattice", FocalEvidence::kLattice}},
                        {0.5, 0.71, 1.0, 1.41, 2.0}, 1.0)},
      {"outliers",
       "two coplanar circles, 40 % outliers within 40 px",
       6,
       200,
       {0.5, 1.0},
       {LossType::kCauchy, LossType::kTukey},
       {{"", DrawOutliers}}},
      {"circle_and_pencil",
       "a circle and a pencil, no outliers",
       7,
       300,
       {0.5, 2.0},
       {LossType::kTrivial, LossType::kCauchy},
       {{"", DrawCircleAndPencil}}},
      {"odd_lines",
       "a circle and segments, of which some have another direction, by 10 sigma or more",
       8,
       80,
       {0.5},
       {LossType::kTrivial, LossType::kHuber, LossType::kCauchy, LossType::kTukey,
        LossType::kGemanMcClure},
       {OddLinesRow("rim, 5 kerbs, none odd", 1, 5, 0), OddLinesRow("rim, 5 kerbs, 1 odd", 1, 5, 1),
        OddLinesRow("rim, 5 kerbs, 2 odd", 1, 5, 2),
        OddLinesRow("circle, 2 x 10 lines, 1 odd", 2, 10, 1),
        OddLinesRow("circle, 2 x 10 lines, 3 odd", 2, 10, 3)}}};
}

}  // namespace circline::apps
