// Images through many threads, the results out in order.
#ifndef CIRCLINE_APPS_COMPARE_WORK_QUEUE_H_
#define CIRCLINE_APPS_COMPARE_WORK_QUEUE_H_

#include <cstddef>
#include <functional>

#include "apps/compare/record.h"

namespace circline::apps {

// What is left to do with a photo once it is solved: to draw it, and to write its lines. Called
// once, by any thread.
using Finishing = std::function<WorkedImage()>;

// Calls `work` for 0 .. count - 1 in OpenCV's thread pool, on as many threads as cv::getNumThreads
// says. What `work` returns is called in one more thread, so that the next image need not wait for
// it; where that thread falls behind, by the one that worked. `deliver` gets what came of it: one
// call at a time, in order. Only so many images wait for their turn that memory does not depend on
// `count`. A `deliver` that returns false ends it; so does what one of them throws, which is thrown
// again.
void WorkInOrder(std::size_t count, const std::function<Finishing(std::size_t)>& work,
                 const std::function<bool(std::size_t, const WorkedImage&)>& deliver);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMPARE_WORK_QUEUE_H_
