#include "apps/common/in_parallel.h"

#include <algorithm>
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

// Not a lambda: OpenCV would look at it in the thread before the lock.
class Body : public cv::ParallelLoopBody {
 public:
  explicit Body(const std::function<void(std::size_t)>& work) : work_(work) {}
  void operator()(const cv::Range& range) const override {
    Order();
    for (int i = range.start; i < range.end; ++i) work_(static_cast<std::size_t>(i));
    Order();
  }

 private:
  const std::function<void(std::size_t)>& work_;
};

}  // namespace

void UseThreads(int count) {
  if (count > 0) cv::setNumThreads(std::min(count, cv::getNumberOfCPUs()));
}

void InParallel(std::size_t count, const std::function<void(std::size_t)>& work) {
  const Body body(work);
  Order();
  cv::parallel_for_(cv::Range(0, static_cast<int>(count)), body);
  Order();
}

}  // namespace circline::apps
