#include "apps/common/in_parallel.h"

#include <mutex>
#include <opencv2/core/utility.hpp>

namespace circline::apps {
namespace {

// The pool orders what its threads do by atomic variables, which ThreadSanitizer cannot see in a
// library built without it. A lock it sees.
void Order() {
  static std::mutex mutex;
  const std::lock_guard<std::mutex> lock(mutex);
}

}  // namespace

void InParallel(int count, const std::function<void(int)>& work) {
  Order();
  cv::parallel_for_(cv::Range(0, count), [&work](const cv::Range& range) {
    Order();
    for (int i = range.start; i < range.end; ++i) work(i);
    Order();
  });
  Order();
}

}  // namespace circline::apps
