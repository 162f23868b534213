// Grids of equal squares, of lines and of circles: as terms of many photos, found and judged.
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "circline/estimators/statistics.h"
#include "circline/refine/evidence_points.h"
#include "circline/refine/many/adjust_problem.h"
#include "circline/refine/many/adjustment.h"

namespace circline {

double AdjustProblem::GridSigma(const AdjustInput& photo, double share) const {
  double told = std::numeric_limits<double>::infinity();
  for (const auto& [key, place] : photo.grid->places) {
    const LineObservation& line = photo.observations->pencils[key.first].lines[key.second];
    told = std::min(told, LeastSigma(line.fit->covariance));
  }
  told *= photo.grid->cam_from_board.translation.norm();
  return std::max(share * options_.noise_model.grid_line * photo.grid->width, kExactShare * told);
}

// All pieces of a line of the board are off their place by the same.
int AdjustProblem::AddGridPlace(std::size_t photo, std::size_t pencil, std::size_t line,
                                const CurveCost& cost, std::vector<int> blocks) {
  constexpr double kPieces = 0.1;  // Of the deviation of the whole.
  const AdjustInput& input = photos_[photo];
  const auto found = input.grid->places.find({pencil, line});
  if (found == input.grid->places.end()) return -1;
  const PencilObservation& observed = input.observations->pencils[pencil];
  const int axis = AxisAcross(observed);
  int& off = grid_lines_.emplace(std::make_tuple(photo, axis, found->second), -1).first->second;
  if (off < 0) off = AddDeviation({GridSigma(input, 1.0)});
  blocks.insert(blocks.end(), {off, cameras_[input.camera]});
  return AddTerm(NewGridLinePrior(input.observations->camera, observed.lines[line].fit->line,
                                  cost.points()->Middle(nullptr).head<2>(),
                                  options_.noise_model.line_direction_rad > 0.0, axis,
                                  found->second, GridSigma(input, kPieces)),
                 std::move(blocks));
}

// Circles' centres are off their places by what a board's lines are.
void AdjustProblem::AddLattice(std::size_t world, const SquareLattice& lattice) {
  Eigen::Vector2d origin, side;
  if (!lattice.Fit(layouts_[world], &origin, &side)) return;
  double told = std::numeric_limits<double>::infinity();
  for (const auto& [place, id] : lattice.circles) {
    const auto circle = circles_.find({world, id});
    if (circle != circles_.end()) told = std::min(told, circle->second.told);
  }
  if (!std::isfinite(told)) return;  // No photo shows any of them.
  const double sigma =
      std::max(options_.noise_model.grid_line * lattice.Width() * side.norm(), kExactShare * told);
  const int from = AddBlock(2, {origin.x(), origin.y()}), along = AddBlock(2, {side.x(), side.y()});
  lattice_frames_.insert(lattice_frames_.end(), {from, along});
  for (const auto& [place, id] : lattice.circles) {
    const auto circle = circles_.find({world, id});
    if (circle == circles_.end()) continue;
    lattice_places_.push_back(
        {world, place,
         AddTerm(NewLatticePrior(place, sigma), {circle->second.center, from, along})});
  }
}

std::vector<AdjustProblem::GridLine> AdjustProblem::GridLines() const {
  std::vector<GridLine> lines;
  for (const auto& [key, off] : grid_lines_) {
    const auto& [photo, axis, place] = key;
    lines.push_back({photo, axis, place, *Values(off) / GridSigma(photos_[photo], 1.0)});
  }
  return lines;
}

std::vector<AdjustProblem::LatticeCircle> AdjustProblem::LatticeCircles() const {
  std::vector<LatticeCircle> circles;
  const double* parameters[kMostBlocks];
  for (const LatticePlace& at : lattice_places_) {
    circles.push_back({at.world, at.place, Eigen::Vector2d::Zero()});
    Parameters(term(at.term), values().data(), parameters);
    term(at.term).cost->Evaluate(parameters, circles.back().deviations.data(), nullptr);
  }
  return circles;
}

namespace {

// What was taken to lie on a grid, by how far each is off its place, standard deviations.
struct GridVerdict {
  std::size_t worst = 0;
  bool worst_is_off = false;  // By what the others are.
  bool is_none = false;       // They are off on the whole.
};

// `unknowns`: of the grid's place and size.
GridVerdict JudgeGrid(std::vector<double> off, int unknowns) {
  constexpr double kLeastScale = 0.3;   // Lines as exact as that are seen on some photos.
  constexpr double kByChance = 1e-3;    // Probability that a board is as bent as that.
  constexpr double kGaussian = 1.4826;  // Deviation over the median's, of a Gaussian.
  double chi2 = 0.0;
  for (double& deviation : off) {
    chi2 += deviation * deviation;
    deviation = std::abs(deviation);
  }
  GridVerdict verdict;
  const double scale = std::clamp(kGaussian * Median(off), kLeastScale, 1.0);
  verdict.worst = static_cast<std::size_t>(std::max_element(off.begin(), off.end()) - off.begin());
  verdict.worst_is_off = off[verdict.worst] > kInlierSigmas * scale;
  verdict.is_none = !verdict.worst_is_off &&
                    chi2 > ChiSquareLimit(static_cast<int>(off.size()) - unknowns, kByChance);
  return verdict;
}

}  // namespace

// Lines of boards that are off their place: rims, and rows that were made of another size. Of each
// board the one that is off most: it draws the others with it. And grids that are none.
bool Adjustment::LeaveGridLinesOut() {
  constexpr int kUnknowns = 3;  // Place and size of a board in its plane.
  std::map<std::size_t, std::vector<AdjustProblem::GridLine>> boards;
  for (const AdjustProblem::GridLine& line : problem_->GridLines())
    boards[line.photo].push_back(line);
  bool any = false;
  for (const auto& [photo, lines] : boards) {
    AdjustInput& input = inputs_[photo];
    std::vector<double> off;
    for (const AdjustProblem::GridLine& line : lines) off.push_back(line.deviations);
    const GridVerdict verdict = JudgeGrid(off, kUnknowns);
    const AdjustProblem::GridLine& worst = lines[verdict.worst];
    if (verdict.worst_is_off) grids_[photo]->Remove(prepared_[photo], worst.axis, worst.place);
    const bool is_none = verdict.is_none || !input.grid->HasBothAxes(prepared_[photo]);
    if (is_none) input.grid = nullptr;
    any = any || verdict.worst_is_off || is_none;
  }
  return any;
}

// The same of circles.
bool Adjustment::LeaveLatticeCirclesOut() {
  constexpr int kUnknowns = 4;  // Place, size and turn of a lattice in its plane.
  std::map<std::size_t, std::vector<AdjustProblem::LatticeCircle>> lattices;
  for (const AdjustProblem::LatticeCircle& circle : problem_->LatticeCircles())
    lattices[circle.world].push_back(circle);
  bool any = false;
  for (const auto& [world, circles] : lattices) {
    std::vector<double> off;
    for (const AdjustProblem::LatticeCircle& circle : circles)
      off.insert(off.end(), {circle.deviations.x(), circle.deviations.y()});
    const GridVerdict verdict = JudgeGrid(off, kUnknowns);
    SquareLattice& lattice = lattices_[world];
    if (verdict.worst_is_off) lattice.circles.erase(circles[verdict.worst / 2].place);
    if (verdict.is_none || !lattice.HasEnough()) lattice.circles.clear();
    any = any || verdict.worst_is_off || lattice.circles.empty();
  }
  return any;
}

// Where lines alone are seen, and lie on a grid of squares, or circles do. True where there are
// any.
bool Adjustment::FindGrids() {
  if (!options_.square_grids) return false;
  ParallelFor(given_.size(), options_.num_threads, [&](std::size_t i) {
    const AdjustInput& input = inputs_[i];
    if (input.takes_part && layouts_[input.world].empty() && input.given == nullptr)
      grids_[i] = FindSquareGrid(prepared_[i], problem_->PoseAt(i).rotation);
  });
  lattices_.clear();
  for (const Layout& layout : FoundLayouts()) lattices_.push_back(FindSquareLattice(layout));
  return std::any_of(grids_.begin(), grids_.end(),
                     [](const std::optional<SquareGrid>& grid) { return grid.has_value(); }) ||
         HasLattice();
}

bool Adjustment::HasLattice() const {
  return std::any_of(lattices_.begin(), lattices_.end(),
                     [](const SquareLattice& lattice) { return !lattice.circles.empty(); });
}

// These are the worlds of their photos.
void Adjustment::StartOnGrids() {
  for (std::size_t i = 0; i < inputs_.size(); ++i) {
    if (!grids_[i]) continue;
    inputs_[i].grid = &*grids_[i];
    inputs_[i].pose = grids_[i]->cam_from_board;
  }
}

}  // namespace circline
