#include "circline/refine/graph.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "circline/refine/block_chain.h"
#include "circline/refine/mostly_exact.h"

namespace circline {
namespace {

using RowMajorBlock = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor,
                                    kCameraSize, kCameraSize>;

}  // namespace

std::unique_ptr<ceres::Manifold> ShiftManifold(const Shifts& sigmas) {
  std::vector<int> held;
  for (int k = 0; k < kCameraSize; ++k) {
    if (!(sigmas[static_cast<std::size_t>(k)] > 0.0)) held.push_back(k);
  }
  if (held.size() == kCameraSize) return nullptr;
  return std::make_unique<ceres::SubsetManifold>(kCameraSize, held);
}

BlockMatrix Block::PlusJacobian(const double* at) const {
  if (manifold == nullptr) return BlockMatrix::Identity(size, size);
  RowMajorBlock J(manifold->AmbientSize(), manifold->TangentSize());
  manifold->PlusJacobian(at, J.data());
  return J;
}

BlockMatrix Block::Chart(const double* at) const {
  if (manifold == nullptr) return BlockMatrix::Identity(size, size);
  RowMajorBlock J(tangent_size(), size);
  manifold->MinusJacobian(at, J.data());
  return J;
}

int Graph::AddBlock(int size, const std::vector<double>& value,
                    std::unique_ptr<ceres::Manifold> manifold, bool is_constant) {
  blocks_.push_back({static_cast<int>(values_.size()), size, std::move(manifold), is_constant});
  values_.insert(values_.end(), value.begin(), value.end());
  values_.resize(static_cast<std::size_t>(blocks_.back().offset + size), 0.0);
  return static_cast<int>(blocks_.size()) - 1;
}

int Graph::AddTerm(ceres::CostFunction* owned, std::vector<int> blocks, int feature,
                   std::unique_ptr<ceres::LossFunction> loss) {
  blocks.erase(std::remove(blocks.begin(), blocks.end(), -1), blocks.end());
  terms_.push_back({std::unique_ptr<ceres::CostFunction>(owned), std::move(blocks), feature,
                    dynamic_cast<FeatureCost*>(owned), std::move(loss)});
  return static_cast<int>(terms_.size()) - 1;
}

int Graph::AddDeviation(const std::vector<double>& sigmas, int feature,
                        std::unique_ptr<ceres::LossFunction> loss) {
  const int block = AddBlock(static_cast<int>(sigmas.size()), {});
  AddTerm(NewGaussianPrior(sigmas), {block}, feature, std::move(loss));
  return block;
}

int Graph::AddShape(double sigma, int feature) {
  const int block = AddDeviation({sigma, sigma}, feature, std::make_unique<MostlyExact>());
  terms_.back().is_counted_at_once = true;
  return block;
}

void Graph::Parameters(const Term& term, const double* x, const double** out) const {
  for (std::size_t k = 0; k < term.blocks.size(); ++k) out[k] = x + block(term.blocks[k]).offset;
}

double Graph::TwiceCost(const Term& term, const double* x) const {
  const double* parameters[kMostBlocks];
  Parameters(term, x, parameters);
  double rho[3] = {TwiceCostOf(*term.cost, term.weighed, Weighing(), parameters), 0.0, 0.0};
  if (term.loss != nullptr && std::isfinite(rho[0])) term.loss->Evaluate(rho[0], rho);
  return rho[0];
}

double Graph::LargestRms(const std::vector<const Term*>& terms, const double* x) const {
  double most = 0.0;
  const double* parameters[kMostBlocks];
  Weighing least_squares;
  least_squares.stretch = 1e4;  // So wide a loss is none.
  for (const Term* term : terms) {
    if (term->weighed == nullptr) continue;
    Parameters(*term, x, parameters);
    const ImagePoints* points = term->weighed->points();
    const double count =
        points == nullptr ? 1.0 : points->options().weight * static_cast<double>(points->size());
    const double square =
        TwiceCostOf(*term->cost, term->weighed, least_squares, parameters) / std::max(1.0, count);
    if (std::isfinite(square)) most = std::max(most, square);
  }
  return std::sqrt(most);
}

void Graph::SetWeighing(const Weighing& weighing) const {
  for (const Term& term : terms_) {
    if (term.weighed != nullptr) term.weighed->set_weighing(weighing);
  }
}

std::vector<int> Graph::BlocksOf(const std::vector<const Term*>& terms) const {
  std::vector<int> blocks;
  std::vector<std::uint8_t> is_known(blocks_.size(), 0);
  for (const Term* term : terms) {
    for (const int block : term->blocks) {
      if (std::exchange(is_known[static_cast<std::size_t>(block)], 1) == 0) blocks.push_back(block);
    }
  }
  return blocks;
}

int Graph::Fill(const std::vector<const Term*>& terms, double* x, ceres::Problem* problem) const {
  int unknowns = 0;
  for (const int index : BlocksOf(terms)) {
    const Block& block = this->block(index);
    problem->AddParameterBlock(x + block.offset, block.size, block.manifold.get());
    if (block.is_constant) problem->SetParameterBlockConstant(x + block.offset);
    unknowns += block.tangent_size();
  }
  std::vector<double*> parameters;
  for (const Term* term : terms) {
    parameters.clear();
    for (const int index : term->blocks) parameters.push_back(x + block(index).offset);
    problem->AddResidualBlock(term->cost.get(), term->loss.get(), parameters);
  }
  return unknowns;
}

}  // namespace circline
