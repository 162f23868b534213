#ifndef CIRCLINE_TESTS_TRIALS_H_
#define CIRCLINE_TESTS_TRIALS_H_

#include <algorithm>
#include <cstdlib>

namespace circline {

// Sanitizers make a trial many times as long, and what they look for is on the way that every trial
// takes. Means and rates are claimed by the builds without them, on all trials.
#ifdef CIRCLINE_SANITIZED
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif

// How many trials a statistical test takes. Where they are few, it makes no claim on their means:
// `if (kSanitized) return;`.
constexpr int Trials(int number) { return kSanitized ? std::max(number / 20, 3) : number; }

// The same, unless the environment says how many.
inline int Trials(const char* variable, int number) {
  const char* text = std::getenv(variable);
  return text != nullptr && std::atoi(text) > 0 ? std::atoi(text) : Trials(number);
}

}  // namespace circline

#endif  // CIRCLINE_TESTS_TRIALS_H_
