// Robust losses by name. Each is rho(s) of the squared residual s = (r / sigma)^2 with rho(0) = 0
// and rho'(0) = 1; its tuning constant gives 95 % efficiency on Gaussian noise, so that one scale
// sigma serves all of them.
#ifndef CIRCLINE_ESTIMATORS_ROBUST_LOSS_H_
#define CIRCLINE_ESTIMATORS_ROBUST_LOSS_H_

#include <cmath>
#include <string>
#include <vector>

namespace circline {

enum class LossType { kTrivial, kHuber, kSoftLOne, kCauchy, kArctan, kTukey, kGemanMcClure };

// "trivial", "huber", "soft_l_one", "cauchy", "arctan", "tukey", "geman_mcclure".
const char* LossName(LossType type);
bool LossFromName(const std::string& name, LossType* type);
std::vector<std::string> LossNames();

// The constant c at which the loss, on unit Gaussian noise, keeps 95 % of the efficiency of least
// squares; infinity for the trivial loss.
double LossTuningConstant(LossType type);

// rho(s) and its derivative.
struct LossValue {
  double rho, rho_prime;
};
LossValue EvaluateLoss(LossType type, double s);

}  // namespace circline

#endif  // CIRCLINE_ESTIMATORS_ROBUST_LOSS_H_
