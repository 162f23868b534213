// Memory of a computation that is made again and again. Internal: not installed.
#ifndef CIRCLINE_REFINE_SCRATCH_H_
#define CIRCLINE_REFINE_SCRATCH_H_

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

namespace circline {

// Matrices whose sizes change from call to call, in memory that is kept: once it has been as large
// as it needs to be, nothing is allocated.
class Scratch {
 public:
  using Matrix = Eigen::Map<Eigen::MatrixXd>;
  using Vector = Eigen::Map<Eigen::VectorXd>;

  // What is taken during its life is free again at its end.
  class Scope {
   public:
    explicit Scope(Scratch* scratch)
        : scratch_(*scratch), chunk_(scratch->chunk_), used_(scratch->used_) {}
    ~Scope() {
      scratch_.chunk_ = chunk_;
      scratch_.used_ = used_;
    }
    Scope(const Scope&) = delete;
    Scope& operator=(const Scope&) = delete;

   private:
    Scratch& scratch_;
    std::size_t chunk_, used_;
  };

  // Their values are anything.
  Matrix NewMatrix(Eigen::Index rows, Eigen::Index cols) { return {Take(rows * cols), rows, cols}; }
  Vector NewVector(Eigen::Index size) { return {Take(size), size}; }
  void Clear() { chunk_ = used_ = 0; }

 private:
  double* Take(Eigen::Index numbers) {
    constexpr std::size_t kLeast = 4096;  // Numbers of a chunk.
    const auto size = static_cast<std::size_t>(numbers);
    while (chunk_ < chunks_.size() && used_ + size > chunks_[chunk_].size) {
      ++chunk_;
      used_ = 0;
    }
    if (chunk_ == chunks_.size()) {
      const std::size_t room = std::max(kLeast, size);
      chunks_.push_back({std::make_unique<double[]>(room), room});
    }
    double* out = chunks_[chunk_].numbers.get() + used_;
    used_ += size;
    return out;
  }

  struct Chunk {
    std::unique_ptr<double[]> numbers;
    std::size_t size;
  };
  std::vector<Chunk> chunks_;
  std::size_t chunk_ = 0, used_ = 0;  // Where the next matrix goes.
};

// Points a map to another one's memory, as Eigen documents it.
template <typename Map>
void Rebind(const Map& to, Map* map) {
  new (map) Map(to);
}

// M = L L^T in its place. False where it is not positive definite.
inline bool FactorInPlace(Eigen::Ref<Eigen::MatrixXd> M) {
  return Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>>(M).info() == Eigen::Success;
}
// X = L^-1 X, and (L L^T)^-1 X.
template <typename Root>
void HalfSolveInPlace(const Root& L, Eigen::Ref<Eigen::MatrixXd> X) {
  L.template triangularView<Eigen::Lower>().solveInPlace(X);
}
template <typename Root>
void SolveInPlace(const Root& L, Eigen::Ref<Eigen::MatrixXd> X) {
  L.template triangularView<Eigen::Lower>().solveInPlace(X);
  L.template triangularView<Eigen::Lower>().transpose().solveInPlace(X);
}
// Logarithm of det(L L^T).
template <typename Root>
double LogDetOfRoot(const Root& L) {
  return 2.0 * L.diagonal().array().log().sum();
}

// out = M(rows, cols), and M(rows, cols) = in.
template <typename Out>
void Gather(const Eigen::MatrixXd& M, const std::vector<Eigen::Index>& rows,
            const std::vector<Eigen::Index>& cols, Out* out) {
  for (std::size_t j = 0; j < cols.size(); ++j) {
    for (std::size_t i = 0; i < rows.size(); ++i)
      (*out)(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = M(rows[i], cols[j]);
  }
}
template <typename In>
void Scatter(const In& in, const std::vector<Eigen::Index>& rows,
             const std::vector<Eigen::Index>& cols, Eigen::MatrixXd* M) {
  for (std::size_t j = 0; j < cols.size(); ++j) {
    for (std::size_t i = 0; i < rows.size(); ++i)
      (*M)(rows[i], cols[j]) = in(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
  }
}

// M = (M + M^T) / 2.
inline void Symmetrize(Eigen::MatrixXd* M) {
  for (Eigen::Index j = 0; j < M->cols(); ++j) {
    for (Eigen::Index i = 0; i < j; ++i) (*M)(i, j) = (*M)(j, i) = 0.5 * ((*M)(i, j) + (*M)(j, i));
  }
}

// Objects that nobody has now, kept for their memory.
template <typename T>
class Spares {
 public:
  T Take() {
    if (spares_.empty()) return T();
    T out = std::move(spares_.back());
    spares_.pop_back();
    return out;
  }
  void Give(T&& spare) { spares_.push_back(std::move(spare)); }
  // Their first ones stay.
  void Resize(std::size_t size, std::vector<T>* all) {
    while (all->size() > size) {
      Give(std::move(all->back()));
      all->pop_back();
    }
    while (all->size() < size) all->push_back(Take());
  }

 private:
  std::vector<T> spares_;
};

}  // namespace circline

#endif  // CIRCLINE_REFINE_SCRATCH_H_
