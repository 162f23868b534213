// Runs a fuzz target without libFuzzer: `x_fuzz COUNT [SEED_FILES]` runs the files, COUNT changes
// of each with a fixed generator, and COUNT inputs of random bytes. What ends it by abort() is
// written to failed_input.
#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include "tests/fuzz/fuzz.h"

namespace {

using Input = std::vector<std::uint8_t>;

const Input* running = nullptr;

void WriteRunning(int /*signal*/) {
  std::ofstream("failed_input", std::ios::binary)
      .write(reinterpret_cast<const char*>(running->data()),
             static_cast<std::streamsize>(running->size()));
}

void Run(const Input& input) {
  running = &input;
  LLVMFuzzerTestOneInput(input.data(), input.size());
}

std::uint8_t RandomByte(std::mt19937* random) {
  return static_cast<std::uint8_t>((*random)() & 0xff);
}

std::size_t Below(std::size_t limit, std::mt19937* random) { return (*random)() % limit; }

// One to four places set, cut out, or doubled.
Input Changed(Input input, std::mt19937* random) {
  for (std::size_t i = 1 + Below(4, random); i > 0 && !input.empty(); --i) {
    const auto begin = input.begin() + static_cast<std::ptrdiff_t>(Below(input.size(), random));
    const auto end =
        begin + std::min<std::ptrdiff_t>(input.end() - begin,
                                         static_cast<std::ptrdiff_t>(Below(32, random)));
    const Input piece(begin, end);
    switch (Below(3, random)) {
      case 0:
        *begin = RandomByte(random);
        break;
      case 1:
        input.erase(begin, end);
        break;
      default:
        input.insert(begin, piece.begin(), piece.end());
    }
  }
  return input;
}

}  // namespace

int main(int argc, char** argv) {
  const int count = argc > 1 ? std::atoi(argv[1]) : 1000;
  std::mt19937 random(1);
  std::signal(SIGABRT, WriteRunning);
  for (int i = 2; i < argc; ++i) {
    std::ifstream file(argv[i], std::ios::binary);
    const Input seed((std::istreambuf_iterator<char>(file)), {});
    circline::fuzz::Expect(!seed.empty(), argv[i]);
    Run(seed);
    for (int k = 0; k < count; ++k) Run(Changed(seed, &random));
  }
  for (int k = 0; k < count; ++k) {
    Input input(Below(1500, &random));
    std::generate(input.begin(), input.end(), [&] { return RandomByte(&random); });
    Run(input);
  }
  return 0;
}
