// Work shared among threads.
#ifndef CIRCLINE_APPS_COMMON_IN_PARALLEL_H_
#define CIRCLINE_APPS_COMMON_IN_PARALLEL_H_

#include <cstddef>
#include <functional>

namespace circline::apps {

// How many threads a program has for all that OpenCV's pool does; 0 or less: as they are. More than
// there are cores would gain nothing, and the pool would print that it has none.
void UseThreads(int count);

// Calls work(0) to work(count - 1) in OpenCV's thread pool, on as many threads as cv::getNumThreads
// says. What is thrown is thrown here.
void InParallel(std::size_t count, const std::function<void(std::size_t)>& work);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMMON_IN_PARALLEL_H_
