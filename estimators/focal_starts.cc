#include "circline/estimators/focal_starts.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include "circline/estimators/basics.h"
#include "circline/estimators/circle_focal.h"
#include "circline/estimators/closed_form_inputs.h"
#include "circline/estimators/closed_form_recipes.h"
#include "circline/estimators/focal_length.h"
#include "circline/estimators/plane_focal.h"

namespace circline {
namespace {

std::string Named(const char* kind, const std::string& id) {
  return std::string(kind) + " '" + id + "'";
}

bool AreAlongDifferentAxes(const PencilObservation& a, const PencilObservation& b) {
  return RunsAlongAxis(a) && RunsAlongAxis(b) && a.direction != b.direction;
}

// Two or more, all about one centre.
bool AreConcentric(const std::vector<const CircleObservation*>& circles) {
  const std::string& group = circles[0]->concentric;
  return circles.size() > 1 && !group.empty() &&
         std::all_of(circles.begin(), circles.end(),
                     [&group](const CircleObservation* c) { return c->concentric == group; });
}

// What the fits of one photo say of its focal length, each part of the evidence for itself.
class Starts {
 public:
  Starts(const Observations& observations, double sigma_px, const NoiseModel& noise,
         std::vector<std::string>* problems)
      : observations_(observations), sigma_px_(sigma_px), noise_(noise), problems_(problems) {
    for (const PencilObservation& pencil : observations.pencils) {
      if (pencil.fit) pencils_.push_back(&pencil);
    }
    for (const CircleObservation& circle : observations.circles) {
      if (!circle.fit) continue;
      circles_.push_back(&circle);
      in_plane_[&circle] = WithTiltError(*circle.fit, noise.circle_tilt_rad);
    }
  }

  std::vector<FocalStart> OfAll() {
    FromPencils();
    FromCenters();
    FromConcentricCircles();
    FromPlanes();
    return std::move(starts_);
  }

 private:
  using Circles = std::vector<const CircleObservation*>;

  // The solutions of one part of the evidence, or why it has none.
  void Add(const std::string& evidence, int count, const FocalSolution* solutions,
           FocalRefusal why) {
    const Camera& camera = observations_.camera;
    for (int i = 0; i < count; ++i) {
      const double shift =
          noise_.camera.principal_point_px / camera.fx * solutions[i].per_principal_point.norm();
      starts_.push_back({camera.fx * solutions[i].focal,
                         std::sqrt(solutions[i].variance + shift * shift), evidence});
    }
    if (count == 0) Report("focal length from " + evidence + ": " + FocalRefusalSentence(why));
  }
  void Report(const std::string& problem) {
    if (problems_ != nullptr) problems_->push_back(problem);
  }
  std::optional<KnownAngle> AngleBetween(const PencilObservation& a,
                                         const PencilObservation& b) const {
    const KnownAngle* known = FindKnownAngle(observations_.known_angles, a.id, b.id);
    if (known != nullptr) return *known;
    if (!AreAlongDifferentAxes(a, b)) return {};
    return KnownAngle{{a.id, b.id}, kRightAngle, std::sqrt(2.0) * noise_.pencil_axis_rad};
  }

  // Whether an angle is one of 90 degrees.
  static bool IsRight(const std::optional<KnownAngle>& angle) {
    constexpr double kRight = 1e-9;  // Cosine.
    return angle && std::abs(std::cos(angle->value)) <= kRight;
  }

  void FromPencils() {
    for (std::size_t i = 0; i < pencils_.size(); ++i) {
      for (std::size_t j = i + 1; j < pencils_.size(); ++j) {
        const PencilObservation &a = *pencils_[i], &b = *pencils_[j];
        const std::optional<KnownAngle> angle = AngleBetween(a, b);
        if (!angle) continue;
        FocalRefusal why = FocalRefusal::kNone;
        std::array<FocalSolution, 2> two;
        int count =
            FocalFromVanishingPoints(*a.fit, *b.fit, angle->value, angle->sigma, &two, &why);
        Add(Named("pencils", a.id) + " and '" + b.id + "'", count, two.data(), why);
        for (std::size_t k = j + 1; k < pencils_.size(); ++k) {
          const PencilObservation& c = *pencils_[k];
          if (!AreAlongDifferentAxes(a, b) || !AreAlongDifferentAxes(b, c) ||
              !AreAlongDifferentAxes(c, a)) {
            continue;
          }
          const std::optional<KnownAngle> of_bc = AngleBetween(b, c), of_ca = AngleBetween(c, a);
          if (!IsRight(angle) || !IsRight(of_bc) || !IsRight(of_ca)) continue;
          const double sigma = std::max({angle->sigma, of_bc->sigma, of_ca->sigma});
          FocalSolution one;
          count = FocalFromThreeVanishingPoints({*a.fit, *b.fit, *c.fit}, sigma, &one, &why);
          Add(Named("pencils", a.id) + ", '" + b.id + "' and '" + c.id + "'", count, &one, why);
        }
      }
    }
  }

  void FromCenters() {
    for (const CircleObservation* circle : circles_) {
      Measured center = MeasuredCenter(observations_, *circle, sigma_px_);
      if (!center.present() && circle->diameters.size() >= 2) {
        const Status status = GatherDiameters(observations_.camera, *circle, sigma_px_, &center);
        if (!status.ok()) Report("focal length: " + status.message);
      }
      if (!center.present()) continue;
      FocalRefusal why = FocalRefusal::kNone;
      FocalSolution one;
      const int count = FocalFromCircleAndCenter(
          *circle->fit, center.value, center.columns * center.columns.transpose(), &one, &why);
      Add(Named("circle", circle->id) + " and its centre", count, &one, why);
    }
  }

  void FromConcentricCircles() {
    for (std::size_t i = 0; i < circles_.size(); ++i) {
      for (std::size_t j = i + 1; j < circles_.size(); ++j) {
        const CircleObservation &a = *circles_[i], &b = *circles_[j];
        if (a.concentric.empty() || a.concentric != b.concentric) continue;
        FocalRefusal why = FocalRefusal::kNone;
        FocalSolution one;
        const int count =
            FocalFromConcentricCircles(in_plane_.at(&a), in_plane_.at(&b), &one, &why);
        Add("concentric " + Named("circles", a.id) + " and '" + b.id + "'", count, &one, why);
      }
    }
  }

  // The pencils of a plane, a pair at a right angle first, if there is one.
  void AddPencils(const std::string& plane, PlaneEvidence* evidence) const {
    std::vector<const PencilObservation*> pencils;
    for (const PencilObservation* pencil : pencils_) {
      const bool along_plane =
          pencil->direction == PencilDirection::kX || pencil->direction == PencilDirection::kY;
      const bool of_world = !plane.empty() && plane == observations_.frame.plane;
      if (pencil->plane == plane || (of_world && along_plane)) pencils.push_back(pencil);
    }
    evidence->pencil_sigma = noise_.pencil_axis_rad;
    for (std::size_t i = 0; i < pencils.size() && !evidence->orthogonal_pencils; ++i) {
      for (std::size_t j = i + 1; j < pencils.size() && !evidence->orthogonal_pencils; ++j) {
        const std::optional<KnownAngle> angle = AngleBetween(*pencils[i], *pencils[j]);
        if (!IsRight(angle)) continue;
        evidence->orthogonal_pencils = true;
        evidence->pencil_sigma = std::max(evidence->pencil_sigma, angle->sigma);
        std::swap(pencils[0], pencils[i]);
        std::swap(pencils[1], pencils[j]);
      }
    }
    for (const PencilObservation* pencil : pencils) evidence->pencils.push_back(&*pencil->fit);
  }

  void FromPlane(const std::string& plane, const Circles& circles,
                 const std::vector<double>& radii) {
    PlaneEvidence evidence;
    evidence.radii = radii;
    evidence.radius_sigma = noise_.radius;
    for (const CircleObservation* circle : circles) {
      evidence.circles.push_back(&in_plane_.at(circle));
      evidence.radius_sigma = std::max(evidence.radius_sigma, circle->radius_sigma);
    }
    AddPencils(plane, &evidence);
    if (radii.empty() && evidence.pencils.empty() && AreConcentric(circles)) return;
    std::string name = "the circles of plane '" + plane + "'";
    if (circles.size() == 1) name = Named("circle", circles[0]->id) + " in plane '" + plane + "'";
    if (!radii.empty()) name += ", their radii compared";
    if (!evidence.pencils.empty()) name += ", and pencils along it";

    FocalRefusal why = FocalRefusal::kNone;
    if (circles.size() == 2 && radii.empty() && evidence.pencils.empty()) {
      std::array<FocalSolution, 2> two;
      const int count =
          FocalFromCoplanarCircles(*evidence.circles[0], *evidence.circles[1], &two, &why);
      Add(name, count, two.data(), why);
      return;
    }
    const Camera& camera = observations_.camera;
    // Half the photo's longer side over the tangents of 60 and 5 degrees; the guess, where the
    // photo has no size, is off by no more than a factor of 8.
    const double half = 0.5 * std::max(camera.width, camera.height) / camera.fx;
    const double low = half > 0.0 ? half / 1.7320508 : 0.125;
    const double high = half > 0.0 ? half / 0.0874887 : 8.0;
    std::array<FocalSolution, 4> four;
    const int count = FocalFromPlane(evidence, low, high, &four, &why);
    Add(name, count, four.data(), why);
  }

  void FromPlanes() {
    std::map<std::string, Circles> planes;
    for (const CircleObservation* circle : circles_) {
      if (!circle->plane.empty()) planes[circle->plane].push_back(circle);
    }
    for (auto& [plane, circles] : planes) {
      std::stable_sort(circles.begin(), circles.end(), [](const auto* a, const auto* b) {
        return a->fit->Covariance().trace() < b->fit->Covariance().trace();
      });
      // More add little to a start.
      constexpr std::size_t kMaxCircles = 12;
      if (circles.size() > kMaxCircles) circles.resize(kMaxCircles);
      // Circles whose radii compare: known, or equal by their group.
      std::map<std::string, Circles> alike;
      for (const CircleObservation* circle : circles) {
        if (circle->radius > 0.0 || !circle->radius_group.empty()) {
          alike[circle->radius > 0.0 ? std::string() : circle->radius_group].push_back(circle);
        }
      }
      bool all_alike = false;
      for (const auto& [group, members] : alike) {
        if (members.size() < 2) continue;
        std::vector<double> radii;
        for (const CircleObservation* circle : members) {
          radii.push_back(circle->radius > 0.0 ? circle->radius : 1.0);
        }
        FromPlane(plane, members, radii);
        all_alike = members.size() == circles.size();
      }
      if (!all_alike) FromPlane(plane, circles, {});
    }
  }

  const Observations& observations_;
  double sigma_px_;
  const NoiseModel& noise_;
  std::vector<std::string>* problems_;
  std::vector<const PencilObservation*> pencils_;          // Those with fits.
  Circles circles_;                                        // Those with fits.
  std::map<const CircleObservation*, ConicFit> in_plane_;  // As parts of a plane.
  std::vector<FocalStart> starts_;
};

// The start of the same evidence that is nearest; null where there is none.
const FocalStart* Nearest(const FocalStart& start, const std::vector<FocalStart>& others) {
  const FocalStart* nearest = nullptr;
  double least = std::numeric_limits<double>::infinity();
  for (const FocalStart& other : others) {
    const double apart = std::abs(std::log(other.focal_px / start.focal_px));
    if (other.evidence == start.evidence && apart < least) nearest = &other, least = apart;
  }
  return nearest;
}

// Points are undistorted with the guess: what its error does to the starts, by fits with the
// focal length a little longer and shorter.
void AddErrorOfGuess(const Observations& observations, double sigma_px, const NoiseModel& noise,
                     std::vector<FocalStart>* starts) {
  constexpr double kStep = 0.05;  // Of log focal length.
  std::array<std::vector<FocalStart>, 2> moved;
  for (std::size_t side = 0; side < 2; ++side) {
    Observations refitted = observations;
    const double factor = std::exp(side == 0 ? kStep : -kStep);
    refitted.camera.fx *= factor;
    refitted.camera.fy *= factor;
    ResetFits(&refitted);
    FitDirect(sigma_px, &refitted, nullptr, noise);
    moved[side] = Starts(refitted, sigma_px, noise, nullptr).OfAll();
  }
  for (FocalStart& start : *starts) {
    const FocalStart *up = Nearest(start, moved[0]), *down = Nearest(start, moved[1]);
    // A start that does not survive is no surer than the guess.
    const double slope = up != nullptr && down != nullptr
                             ? std::log(up->focal_px / down->focal_px) / (2.0 * kStep)
                             : 1.0;
    start.sigma_log = std::hypot(start.sigma_log, slope * noise.camera.log_focal);
  }
}

// The surest first, without those that agree with a surer one.
std::vector<FocalStart> Distinct(std::vector<FocalStart> starts) {
  std::stable_sort(starts.begin(), starts.end(), [](const FocalStart& a, const FocalStart& b) {
    return a.sigma_log < b.sigma_log;
  });
  std::vector<FocalStart> distinct;
  for (const FocalStart& start : starts) {
    const bool is_new = std::none_of(distinct.begin(), distinct.end(), [&](const FocalStart& d) {
      return std::abs(std::log(d.focal_px / start.focal_px)) <=
             std::hypot(d.sigma_log, start.sigma_log);
    });
    if (is_new) distinct.push_back(start);
  }
  return distinct;
}

}  // namespace

std::vector<FocalStart> FocalLengthStarts(const Observations& observations, double default_sigma_px,
                                          const NoiseModel& noise,
                                          std::vector<std::string>* problems) {
  const Status camera = observations.camera.Validate();
  if (!camera.ok()) {
    if (problems != nullptr) problems->push_back("focal length: " + camera.message);
    return {};
  }
  std::vector<FocalStart> starts = Starts(observations, default_sigma_px, noise, problems).OfAll();
  if (noise.camera.log_focal > 0.0 && noise.camera.BendsWithFocal(observations.camera)) {
    AddErrorOfGuess(observations, default_sigma_px, noise, &starts);
  }
  return Distinct(std::move(starts));
}

}  // namespace circline
