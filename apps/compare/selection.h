// Which photos the report shows in full: a browser cannot open ten thousand.
#ifndef CIRCLINE_APPS_COMPARE_SELECTION_H_
#define CIRCLINE_APPS_COMPARE_SELECTION_H_

#include <cstddef>
#include <string>
#include <vector>

#include "apps/compare/record.h"

namespace circline::apps {

enum class Fate : unsigned char { kAnswered, kRefused, kUnreadable };

// How a photo fared: by the error of the answer to show, where there is no truth by its residual.
struct ImageScore {
  Fate fate = Fate::kRefused;
  bool has_truth = false;
  float value = 0.0F;  // Degrees or pixels; of answered photos.
};

ImageScore ScoreOf(const ImageRecord& record);

struct ShownImage {
  std::size_t position;  // In the list of scores.
  const char* why;       // "worst", "median", "refused" or "" where all are shown.
};

// All photos if there are no more than `limit`, in order. Else that many: a third those around the
// median, up to a third those that were refused or could not be read (the first ones), and for the
// rest the worst, in this order: worst, median, refused.
std::vector<ShownImage> SelectImages(const std::vector<ImageScore>& scores, std::size_t limit);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMPARE_SELECTION_H_
