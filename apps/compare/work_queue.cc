#include "apps/compare/work_queue.h"

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <exception>
#include <map>
#include <mutex>
#include <opencv2/core/utility.hpp>
#include <thread>
#include <utility>

#include "apps/common/in_parallel.h"

namespace circline::apps {
namespace {

constexpr std::size_t kMaxAhead = 256;     // Images begun before the oldest unfinished one is done.
constexpr std::size_t kMaxUnfinished = 4;  // Photos that wait in memory to be drawn.

class Queue {
 public:
  Queue(std::size_t count, const std::function<bool(std::size_t, const WorkedImage&)>& deliver)
      : count_(count), deliver_(deliver) {}

  // The next image to work on; false if there is none. Whoever holds the oldest image never waits
  // here, so somebody always goes on.
  bool Next(std::size_t* index) {
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
      bool go_on = false;
      Guard([&] { go_on = deliver_(delivered_, oldest); });
      lock.lock();
      ++delivered_;
      stopped_ = stopped_ || !go_on;
      room_.notify_all();
    }
    delivering_ = false;
  }

  // What throws, such as where no memory is left, ends all; Finish throws it again.
  template <typename Work>
  void Guard(const Work& work) {
    try {
      work();
    } catch (...) {
      const std::lock_guard<std::mutex> lock(mutex_);
      stopped_ = true;
      if (!thrown_) thrown_ = std::current_exception();
      room_.notify_all();
    }
  }

  // After all threads.
  void Finish() const {
    if (thrown_) std::rethrow_exception(thrown_);
  }

 private:
  const std::size_t count_;
  const std::function<bool(std::size_t, const WorkedImage&)>& deliver_;
  std::mutex mutex_;
  std::condition_variable room_;
  std::map<std::size_t, WorkedImage> waiting_;
  std::size_t next_ = 0, delivered_ = 0;
  bool delivering_ = false, stopped_ = false;
  std::exception_ptr thrown_;
};

// Finishes images in a thread of its own; all that it accepted, before it ends.
class Finisher {
 public:
  explicit Finisher(Queue* queue) : queue_(queue), thread_([this] { Run(); }) {}
  Finisher(const Finisher&) = delete;
  Finisher& operator=(const Finisher&) = delete;
  ~Finisher() {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      closed_ = true;
    }
    work_.notify_one();
    thread_.join();
  }

  // False if enough wait already: the image stays with the caller.
  bool Accept(std::size_t index, Finishing* finishing) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (waiting_.size() >= kMaxUnfinished) return false;
      waiting_.emplace_back(index, std::move(*finishing));
    }
    work_.notify_one();
    return true;
  }

 private:
  void Run() {
    std::unique_lock<std::mutex> lock(mutex_);
    while (true) {
      work_.wait(lock, [this] { return closed_ || !waiting_.empty(); });
      if (waiting_.empty()) return;
      {
        const auto [index, finishing] = std::move(waiting_.front());
        waiting_.pop_front();
        lock.unlock();
        queue_->Guard([&, i = index, &finish = finishing] { queue_->Put(i, finish()); });
      }
      lock.lock();
    }
  }

  Queue* const queue_;
  std::mutex mutex_;
  std::condition_variable work_;
  std::deque<std::pair<std::size_t, Finishing>> waiting_;
  bool closed_ = false;
  std::thread thread_;  // The last, so that it finds the others made.
};

}  // namespace

void WorkInOrder(std::size_t count, const std::function<Finishing(std::size_t)>& work,
                 const std::function<bool(std::size_t, const WorkedImage&)>& deliver) {
  const std::size_t threads = static_cast<std::size_t>(std::max(1, cv::getNumThreads()));
  const std::size_t num_workers = std::min(threads, count);
  if (num_workers == 0) return;
  Queue queue(count, deliver);
  {
    Finisher finisher(&queue);
    const auto work_all = [&] {
      for (std::size_t index = 0; queue.Next(&index);) {
        Finishing finishing = work(index);
        if (!finisher.Accept(index, &finishing)) queue.Put(index, finishing());
      }
    };
    InParallel(num_workers, [&](std::size_t) { queue.Guard(work_all); });
  }
  queue.Finish();
}

}  // namespace circline::apps
