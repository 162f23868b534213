// The processes that share a run: this one alone, or those that mpirun started.
#ifndef CIRCLINE_APPS_COMPARE_RANKS_H_
#define CIRCLINE_APPS_COMPARE_RANKS_H_

#include <cstddef>
#include <memory>

#include "apps/compare/record.h"

namespace circline::apps {

// Built without CIRCLINE_WITH_MPI there is one rank, and nothing is ever sent. Calls from several
// threads must not overlap.
class Ranks {
 public:
  static const char* const kBuiltWith;  // " with MPI", or nothing.

  Ranks(int* argc, char*** argv);

  int rank() const { return rank_; }
  int count() const { return count_; }
  bool is_first() const { return rank_ == 0; }

  // What rank 0 says, on every rank.
  std::size_t FromFirst(std::size_t value) const;
  // To rank 0; waits where that is busy.
  void SendToFirst(const WorkedImage& image) const;
  // On rank 0: the next image of another rank.
  WorkedImage Receive(int from) const;
  // Ends every rank at once with this exit code; for rank 0 when it cannot go on.
  [[noreturn]] void Abort(int exit_code) const;

 private:
  int rank_ = 0, count_ = 1;
  std::shared_ptr<void> session_;  // Ends MPI with the last copy of this.
};

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMPARE_RANKS_H_
