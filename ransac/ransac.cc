#include "circline/ransac/ransac.h"

#include <climits>
#include <numeric>

namespace circline {
namespace {

// The noise levels of the marginalised loss are uniform on (0, T / kSigmas]: T is 99.8 % of the
// largest one's points.
constexpr double kSigmas = 3.03;
constexpr int kTableSize = 256;

// Exponential integral E1 (Abramowitz and Stegun 5.1.11); the series serves 0 < t <= 5.
double ExponentialIntegral(double t) {
  constexpr double kEulerGamma = 0.57721566490153286;
  double sum = -kEulerGamma - std::log(t);
  double term = 1.0;
  for (int k = 1; k <= 60; ++k) {
    term *= -t / k;
    sum -= term / k;
  }
  return sum;
}

// MAGSAC++ for residuals of one degree of freedom. With t = r^2 / (2 sigma_max^2) the weight is
// proportional to E1(t) - E1(t_max) (equation 4 of the paper with n = 1), the loss to its integral.
struct MarginalTables {
  std::array<float, kTableSize + 1> loss, weight;

  MarginalTables() {
    const double t_max = kSigmas * kSigmas / 2.0;
    const double at_max = ExponentialIntegral(t_max);
    const double total = t_max * at_max + 1.0 - std::exp(-t_max) - t_max * at_max;
    // The weight has a (logarithmic) pole at 0: it is capped at half a step of the table.
    const double cap = ExponentialIntegral(0.5 * t_max / kTableSize) - at_max;
    loss[0] = 0.0f;
    weight[0] = 1.0f;
    for (int i = 1; i <= kTableSize; ++i) {
      const double t = t_max * i / kTableSize;
      const double e1 = ExponentialIntegral(t);
      const std::size_t k = static_cast<std::size_t>(i);
      loss[k] = static_cast<float>((t * e1 + 1.0 - std::exp(-t) - t * at_max) / total);
      weight[k] = static_cast<float>((e1 - at_max) / cap);
    }
  }
};

const MarginalTables& Tables() {
  static const MarginalTables tables;  // Immutable.
  return tables;
}

float Interpolate(const std::array<float, kTableSize + 1>& table, float u) {
  const float position = u * static_cast<float>(kTableSize);
  const int i = static_cast<int>(position);
  const std::size_t k = static_cast<std::size_t>(i);
  return table[k] + (table[k + 1] - table[k]) * (position - static_cast<float>(i));
}

// Expected number, of `draws` samples of m from n_all, that lie within the n best (T_n of PROSAC).
double PoolDraws(int n, int n_all, int m, double draws) {
  for (int i = 0; i < m; ++i) draws *= static_cast<double>(n - i) / (n_all - i);
  return draws;
}

}  // namespace

Status RansacOptions::Validate() const {
  // Written so that NaN fails too.
  if (!(threshold > 0.0) || !std::isfinite(threshold)) {
    return Status::Invalid("threshold must be positive");
  }
  if (!(confidence > 0.0 && confidence < 1.0)) {
    return Status::Invalid("confidence must be between 0 and 1, both excluded");
  }
  if (min_iterations < 0) return Status::Invalid("min_iterations must not be negative");
  if (max_iterations < 1) return Status::Invalid("max_iterations must be 1 or more");
  if (local_start < 0) return Status::Invalid("local_start must not be negative");
  if (local_samples < 0) return Status::Invalid("local_samples must not be negative");
  if (local_steps < 0) return Status::Invalid("local_steps must not be negative");
  if (!(max_seconds >= 0.0)) return Status::Invalid("max_seconds must not be negative");
  return Status::Ok();
}

Status RobustFitOptions::Validate() const {
  if (!(sigma_px > 0.0) || !std::isfinite(sigma_px)) {
    return Status::Invalid("sigma_px must be positive");
  }
  return ransac.Validate();
}

const char* StopReasonName(StopReason reason) {
  switch (reason) {
    case StopReason::kConfident:
      return "confident";
    case StopReason::kMaxIterations:
      return "max_iterations";
    case StopReason::kMaxSeconds:
      return "max_seconds";
    case StopReason::kTooFewData:
      return "too_few_data";
  }
  return "unknown";
}

int RequiredIterations(int num_data, int num_inliers, int num_samples, double confidence,
                       double good_samples) {
  if (num_inliers < num_samples) return INT_MAX;
  double p = good_samples;
  for (int i = 0; i < num_samples; ++i) {
    p *= static_cast<double>(num_inliers - i) / static_cast<double>(num_data - i);
  }
  if (p >= 1.0) return 1;
  const double draws = std::ceil(std::log1p(-confidence) / std::log1p(-p));
  if (!(draws < static_cast<double>(INT_MAX))) return INT_MAX;
  return std::max(1, static_cast<int>(draws));
}

std::vector<int> RandomOrder(int n, std::uint64_t seed) {
  std::vector<int> order(static_cast<std::size_t>(std::max(n, 0)));
  std::iota(order.begin(), order.end(), 0);
  Random random(seed);
  for (int i = n - 1; i > 0; --i) {
    std::swap(order[static_cast<std::size_t>(i)],
              order[static_cast<std::size_t>(random.UniformInt(i + 1))]);
  }
  return order;
}

RansacLoss::RansacLoss(ScoreType type) : type_(type) {
  if (type_ == ScoreType::kMagsac) Tables();
}

float RansacLoss::MarginalValue(float u) { return Interpolate(Tables().loss, u); }

float RansacLoss::MarginalWeight(float u) { return Interpolate(Tables().weight, u); }

double InlierWeights(const std::vector<double>& residuals, double threshold, int num_parameters,
                     double* sigma, std::vector<double>* weights) {
  int inside = 0, beside = 0;
  for (const double r : residuals) {
    const double size = std::abs(r);
    inside += size <= threshold ? 1 : 0;
    beside += size > threshold && size <= 3.0 * threshold ? 1 : 0;
  }
  // Density of the background per unit of the residual, two thresholds to either side. The half
  // keeps a trace of doubt where none was seen.
  const double background = (beside + 0.5) / (4.0 * threshold);
  const double num_inliers = std::max(1.0, inside - 2.0 * threshold * background);
  const double s = *sigma > 0.0 ? *sigma : threshold / kSigmas;
  const double peak = num_inliers * 0.3989422804014327 / s;
  double sum = 0.0, sum_squares = 0.0;
  weights->resize(residuals.size());
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    const double z = residuals[i] / s;
    double w = 0.0;
    if (std::abs(residuals[i]) <= threshold) {
      const double density = peak * std::exp(-0.5 * z * z);
      w = density / (density + background);
      sum += w;
      sum_squares += w * residuals[i] * residuals[i];
    }
    (*weights)[i] = w;
  }
  const double dof = sum - num_parameters;
  if (dof >= 1.0) {
    *sigma = std::min(std::max(std::sqrt(sum_squares / dof), 1e-3 * threshold), threshold / 2.0);
  }
  return sum;
}

void Sampler::Reset(int num_data, int num_samples, std::uint64_t seed,
                    const std::vector<int>* order, int uniform_after) {
  random_ = Random(seed);
  num_data_ = num_data;
  num_samples_ = num_samples;
  order_ = order;
  draw_ = 0;
  pool_ = num_samples;
  pool_until_ = 1;
  pool_draws_ = order != nullptr && num_data >= num_samples
                    ? PoolDraws(pool_, num_data, num_samples, uniform_after)
                    : 0.0;
}

void Sampler::DrawFrom(int n, int count, int* sample) {
  for (int i = 0; i < count; ++i) {
    bool repeated = true;
    while (repeated) {
      sample[i] = random_.UniformInt(n);
      repeated = std::find(sample, sample + i, sample[i]) != sample + i;
    }
  }
}

void Sampler::Draw(int* sample) {
  if (order_ == nullptr) return DrawFrom(num_data_, num_samples_, sample);
  ++draw_;
  // Equation 3 and step 1 of algorithm 1 of Chum and Matas: the pool grows by one datum each time
  // as many samples have been drawn from it as uniform sampling would have.
  while (draw_ > pool_until_ && pool_ < num_data_) {
    const double next = pool_draws_ * (pool_ + 1) / (pool_ + 1 - num_samples_);
    pool_until_ += static_cast<int>(std::ceil(next - pool_draws_));
    pool_draws_ = next;
    ++pool_;
  }
  if (draw_ > pool_until_) {
    DrawFrom(num_data_, num_samples_, sample);
  } else {
    // The newest datum of the pool and others of it (step 2): no sample is drawn twice for long.
    DrawFrom(std::max(pool_ - 1, num_samples_ - 1), num_samples_ - 1, sample);
    sample[num_samples_ - 1] = pool_ - 1;
  }
  for (int i = 0; i < num_samples_; ++i) sample[i] = (*order_)[static_cast<std::size_t>(sample[i])];
}

}  // namespace circline
