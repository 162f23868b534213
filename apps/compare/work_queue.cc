#include "apps/compare/work_queue.h"

#include <algorithm>
#include <condition_variable>
#include <map>
#include <mutex>
#include <opencv2/core/utility.hpp>

namespace circline::apps {
namespace {

constexpr std::size_t kMaxAhead = 256;  // Images taken before the oldest unfinished one is done.

class Queue {
 public:
  Queue(std::size_t count, const std::function<bool(std::size_t, const WorkedImage&)>& deliver)
      : count_(count), deliver_(deliver) {}

  // The next image to work on; false if there is none. Whoever holds the oldest image never waits
  // here, so somebody always goes on.
  bool Take(std::size_t* index) {
    std::unique_lock<std::mutex> lock(mutex_);
    room_.wait(lock, [this] { return stopped_ || next_ < delivered_ + kMaxAhead; });
    if (stopped_ || next_ >= count_) return false;
    *index = next_++;
    return true;
  }

  // The thread that finds the oldest image done delivers, unlocked, while others put theirs.
  void Put(std::size_t index, WorkedImage image) {
    std::unique_lock<std::mutex> lock(mutex_);
    waiting_.emplace(index, std::move(image));
    if (delivering_) return;
    delivering_ = true;
    while (!stopped_ && !waiting_.empty() && waiting_.begin()->first == delivered_) {
      const WorkedImage oldest = std::move(waiting_.begin()->second);
      waiting_.erase(waiting_.begin());
      lock.unlock();
      const bool go_on = deliver_(delivered_, oldest);
      lock.lock();
      ++delivered_;
      stopped_ = !go_on;
      room_.notify_all();
    }
    delivering_ = false;
  }

 private:
  const std::size_t count_;
  const std::function<bool(std::size_t, const WorkedImage&)>& deliver_;
  std::mutex mutex_;
  std::condition_variable room_;
  std::map<std::size_t, WorkedImage> waiting_;
  std::size_t next_ = 0, delivered_ = 0;
  bool delivering_ = false, stopped_ = false;
};

}  // namespace

void WorkInOrder(std::size_t count, const std::function<WorkedImage(std::size_t)>& work,
                 const std::function<bool(std::size_t, const WorkedImage&)>& deliver) {
  const std::size_t threads = static_cast<std::size_t>(std::max(1, cv::getNumThreads()));
  const int num_workers = static_cast<int>(std::min(threads, count));
  if (num_workers == 0) return;
  Queue queue(count, deliver);
  cv::parallel_for_(
      cv::Range(0, num_workers),
      [&](const cv::Range& range) {
        for (int i = range.start; i < range.end; ++i) {
          for (std::size_t index = 0; queue.Take(&index);) queue.Put(index, work(index));
        }
      },
      num_workers);
}

}  // namespace circline::apps
