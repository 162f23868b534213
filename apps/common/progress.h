// How far a long run is, on stderr.
#ifndef CIRCLINE_APPS_COMMON_PROGRESS_H_
#define CIRCLINE_APPS_COMMON_PROGRESS_H_

#include <chrono>
#include <mutex>
#include <string>

namespace circline::apps {

// Silent for the first second. On a terminal one line is refreshed; elsewhere a line is written
// every ten seconds. Many threads may call it.
class Progress {
 public:
  // Of `total`, `done` were there before; the rate does not count them.
  Progress(std::string what, int total, int done = 0);
  ~Progress();
  void Advance();
  void Clear() const;  // Makes room for another line on a terminal.

 private:
  using Clock = std::chrono::steady_clock;
  void Print(double seconds, bool last);

  std::string what_;
  int total_, done_, before_;
  std::mutex mutex_;  // Of what changes.
  bool terminal_;
  bool printed_ = false;
  Clock::time_point start_, last_print_;
};

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMMON_PROGRESS_H_
