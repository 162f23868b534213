// The scenes of each experiment, one function a kind: each draws until all is seen and the pose is
// determined.
#ifndef CIRCLINE_APPS_BENCHMARK_SCENES_KINDS_H_
#define CIRCLINE_APPS_BENCHMARK_SCENES_KINDS_H_

#include "apps/benchmark/scenes_experiments.h"
#include "circline/estimators/random.h"

namespace circline::apps {

// What tells the focal length.
enum class FocalEvidence {
  kPencils,  // Along X and Y.
  kCircleAndCenter,
  kCircleAndPencils,
  kCircles,
  kRings,
  kEqualCircles,  // Said to be of one size.
  kLattice,       // Of twelve discs, said to be of one size.
};

Scene DrawAnything(double noise_px, Random* random);
Scene DrawShortArc(double noise_px, Random* random);
// Arcs and a pencil of four lines; the bound says how well the plane is known.
Scene DrawLoneArcs(int num_arcs, double arc_deg, double noise_px, Random* random);
Scene DrawDiscs(double bleed_px, double noise_px, Random* random);
// One circle has a plane of its own or, where `tilt_deg` is 0, a radius that is stated wrongly.
Scene DrawOddCircle(int num_circles, double tilt_deg, double noise_px, Random* random);
// A circle, and pencils of segments of which the first `num_odd` have another direction.
Scene DrawOddLines(int num_pencils, int num_lines, int num_odd, double noise_px, Random* random);
Scene DrawUnknownFocal(FocalEvidence evidence, double factor, double log_focal_sigma,
                       double noise_px, Random* random);
// Of its points 40 % lie anywhere within 40 px.
Scene DrawOutliers(double noise_px, Random* random);
// Half of the circle, or more, and two lines or more along x.
Scene DrawCircleAndPencil(double noise_px, Random* random);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_BENCHMARK_SCENES_KINDS_H_
