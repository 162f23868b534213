// Memory of a computation that is made again and again. Internal: not installed.
#ifndef CIRCLINE_REFINE_TRACK_SCRATCH_H_
#define CIRCLINE_REFINE_TRACK_SCRATCH_H_

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <deque>
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
    explicit Scope(Scratch* scratch) : scratch_(*scratch), used_(scratch->used_) {}
    ~Scope() { scratch_.used_ = used_; }
    Scope(const Scope&) = delete;
    Scope& operator=(const Scope&) = delete;

   private:
    Scratch& scratch_;
    std::size_t used_;
  };

  // Their values are anything.
  Matrix NewMatrix(Eigen::Index rows, Eigen::Index cols) { return {Take(rows * cols), rows, cols}; }
  Vector NewVector(Eigen::Index size) { return {Take(size), size}; }
  void Clear() { used_ = 0; }

 private:
  double* Take(Eigen::Index size) {
    if (used_ == buffers_.size()) buffers_.emplace_back();
    Eigen::VectorXd& buffer = buffers_[used_++];
    if (buffer.size() < size) buffer.resize(size);
    return buffer.data();
  }

  std::deque<Eigen::VectorXd> buffers_;  // One a matrix.
  std::size_t used_ = 0;                 // The first ones.
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

// Of rows or columns, as Eigen takes them without a copy of their memory.
inline Eigen::Map<const Eigen::Matrix<Eigen::Index, Eigen::Dynamic, 1>> Indices(
    const std::vector<Eigen::Index>& indices) {
  return {indices.data(), static_cast<Eigen::Index>(indices.size())};
}

// The upper half as the lower one.
inline void Symmetrize(Eigen::MatrixXd* M) {
  M->triangularView<Eigen::StrictlyUpper>() = M->transpose();
}

// A vector that keeps what it no longer has, for the memory in it.
template <typename T>
class Kept {
 public:
  // Of any value.
  T& Add() {
    if (size_ == all_.size()) all_.emplace_back();
    return all_[size_++];
  }
  // One of those kept that `fits`, else a new one.
  template <typename Fits>
  T& Recycle(const Fits& fits) {
    const auto one = std::find_if(end(), all_.end(), fits);
    if (one == all_.end()) {
      all_.emplace_back();
      std::swap(all_[size_], all_.back());
    } else {
      std::swap(*one, *end());
    }
    return all_[size_++];
  }
  void Shorten(std::size_t size) { size_ = size; }
  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  T& operator[](std::size_t i) { return all_[i]; }
  const T& operator[](std::size_t i) const { return all_[i]; }
  auto begin() { return all_.begin(); }
  auto end() { return all_.begin() + static_cast<std::ptrdiff_t>(size_); }
  auto begin() const { return all_.begin(); }
  auto end() const { return all_.begin() + static_cast<std::ptrdiff_t>(size_); }

 private:
  std::vector<T> all_;
  std::size_t size_ = 0;
};

}  // namespace circline

#endif  // CIRCLINE_REFINE_TRACK_SCRATCH_H_
