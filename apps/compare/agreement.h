// How far the solvers' answers lie apart, where there is a truth and where there is none.
#ifndef CIRCLINE_APPS_COMPARE_AGREEMENT_H_
#define CIRCLINE_APPS_COMPARE_AGREEMENT_H_

#include <cstddef>
#include <optional>
#include <vector>

#include "apps/compare/record.h"

namespace circline::apps {

// For each pair of solvers the angles between the plane's normals, up to sign, of their best
// hypotheses: what every solver determines, whichever axes it chose.
class Agreement {
 public:
  void Add(const ImageRecord& record);
  const std::vector<SolverKey>& keys() const { return keys_; }  // Of the first loss.
  // Degrees; absent where no photo has both answers.
  std::optional<double> MedianDeg(std::size_t i, std::size_t j) const;
  // Photos that have both.
  std::size_t Count(std::size_t i, std::size_t j) const { return At(i, j).size(); }

 private:
  using Angles = std::vector<float>;
  static std::size_t Slot(std::size_t i, std::size_t j);
  const Angles& At(std::size_t i, std::size_t j) const { return angles_[Slot(i, j)]; }

  std::vector<SolverKey> keys_;
  std::vector<std::size_t> positions_;  // Of the keys in ImageRecord::solvers.
  std::vector<Angles> angles_;          // Pairs i > j, row by row.
};

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMPARE_AGREEMENT_H_
