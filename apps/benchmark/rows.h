// Rows of circline_benchmark.
#ifndef CIRCLINE_APPS_BENCHMARK_ROWS_H_
#define CIRCLINE_APPS_BENCHMARK_ROWS_H_

#include <benchmark/benchmark.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

namespace circline {

constexpr std::size_t kScenes = 64;  // Taken in turn, so that no branch is learnt by heart.
constexpr std::size_t kCountedScenes = 10000;

// Calls `solve` on every scene in turn.
template <typename Inputs, typename Solve>
void RunInTurn(benchmark::State& state, const std::vector<Inputs>& inputs, const Solve& solve) {
  std::size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(solve(inputs[i]));
    benchmark::ClobberMemory();
    i = i + 1 < inputs.size() ? i + 1 : 0;
  }
}

// Columns of the table of solvers, over `scenes`: hypotheses a call; how many of them are proper
// (finite rotations, unit normals facing the camera) and how often the truth is among them to
// 1e-6, in per cent. `errors` writes, for each hypothesis, its error in radians or of the logarithm
// of the focal length (NaN if it is improper), and returns how many there are.
template <typename Scene, typename Errors>
void CountHypotheses(benchmark::State& state, const std::vector<Scene>& scenes,
                     const Errors& errors) {
  constexpr double kExact = 1e-6;
  const auto counted = static_cast<double>(scenes.size());
  double hypotheses = 0, valid = 0, found = 0;
  for (const Scene& s : scenes) {
    std::array<double, 4> error;
    const auto count = static_cast<std::size_t>(errors(s, &error));
    bool hit = false;
    for (std::size_t i = 0; i < count; ++i) {
      valid += std::isfinite(error[i]) ? 1.0 : 0.0;
      hit = hit || error[i] < kExact;
    }
    hypotheses += static_cast<double>(count);
    found += hit ? 1.0 : 0.0;
  }
  state.counters["hypotheses"] = hypotheses / counted;
  state.counters["valid_pct"] = 100.0 * valid / hypotheses;
  state.counters["truth_found_pct"] = 100.0 * found / counted;
}

}  // namespace circline

#endif  // CIRCLINE_APPS_BENCHMARK_ROWS_H_
