// What the fuzz targets have in common. A target is a file x_fuzz.cc with LLVMFuzzerTestOneInput;
// built by `cmake --preset fuzz` it is a program of libFuzzer's, and in every other build a test
// that runs its seeds and random inputs (replay.cc). What must hold of any input is an Expect.
#ifndef CIRCLINE_TESTS_FUZZ_FUZZ_H_
#define CIRCLINE_TESTS_FUZZ_FUZZ_H_

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>

#include "circline/estimators/observations.h"
#include "circline/estimators/pose.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace circline::fuzz {

// Ends the program where `condition` does not hold.
inline void Expect(bool condition, const char* sentence) {
  if (condition) return;
  std::fprintf(stderr, "does not hold: %s\n", sentence);
  std::abort();
}

// Reads values off an input; zeros behind its end.
class Bytes {
 public:
  Bytes(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}

  bool empty() const { return size_ == 0; }
  int Byte();
  int Below(int limit) { return Byte() % limit; }
  bool OneIn(int n) { return Below(n) == 0; }
  // Between the two, in 65536 steps.
  double Between(double low, double high);
  // Mostly one between the two; one in 64 is any double: infinite, not a number, denormal.
  double Number(double low, double high);

 private:
  const std::uint8_t* data_;
  std::size_t size_;
};

// A photo of up to three circles and three pencils, many of them the images of true ones, with
// roles, planes, sizes and noise of every kind; some break the rules of Observations::Validate.
Observations ArbitraryObservations(Bytes* bytes);

// What is promised of every estimate: a sentence or hypotheses; finite numbers, rotations,
// probabilities that sum to 1, covariances without negative variances.
void ExpectSound(const PoseEstimate& estimate);

}  // namespace circline::fuzz

#endif  // CIRCLINE_TESTS_FUZZ_FUZZ_H_
