#include "apps/common/progress.h"

#include <unistd.h>

#include <cstdio>
#include <utility>

#include "apps/common/text.h"

namespace circline::apps {
namespace {

constexpr double kQuietSeconds = 1.0;
constexpr double kTerminalSeconds = 0.2;
constexpr double kLogSeconds = 10.0;

std::string FormatDuration(double seconds) {
  const int whole = static_cast<int>(seconds + 0.5);
  if (whole < 60) return std::to_string(whole) + " s";
  if (whole < 3600) return std::to_string(whole / 60) + " min " + std::to_string(whole % 60) + " s";
  return std::to_string(whole / 3600) + " h " + std::to_string(whole % 3600 / 60) + " min";
}

}  // namespace

Progress::Progress(std::string what, int total, int done)
    : what_(std::move(what)),
      total_(total),
      done_(done),
      before_(done),
      terminal_(isatty(STDERR_FILENO) != 0),
      start_(Clock::now()),
      last_print_(start_) {}

Progress::~Progress() {
  if (printed_ && terminal_) std::fputs("\n", stderr);
}

void Progress::Clear() const {
  if (printed_ && terminal_) std::fputs("\r\033[K", stderr);
}

void Progress::Advance() {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++done_;
  const Clock::time_point now = Clock::now();
  const double seconds = std::chrono::duration<double>(now - start_).count();
  const double since_print = std::chrono::duration<double>(now - last_print_).count();
  const bool last = done_ == total_ && printed_;
  if (seconds < kQuietSeconds) return;
  if (!last && since_print < (terminal_ ? kTerminalSeconds : kLogSeconds)) return;
  last_print_ = now;
  Print(seconds, done_ == total_);
}

void Progress::Print(double seconds, bool last) {
  const double rate = (done_ - before_) / seconds;
  std::string line = std::to_string(done_) + " of " + std::to_string(total_) + " " + what_ + ", " +
                     FormatShort(rate, 2) + "/s, ";
  line +=
      last ? "in " + FormatDuration(seconds) : FormatDuration((total_ - done_) / rate) + " left";
  std::fprintf(stderr, terminal_ ? "\r%s\033[K" : "%s\n", line.c_str());
  std::fflush(stderr);
  printed_ = true;
}

}  // namespace circline::apps
