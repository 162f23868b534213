// report.html: one file that shows everything, with nothing to fetch.
#ifndef CIRCLINE_APPS_COMPARE_REPORT_H_
#define CIRCLINE_APPS_COMPARE_REPORT_H_

#include <cstddef>
#include <string>
#include <vector>

#include "apps/compare/agreement.h"
#include "apps/compare/record.h"
#include "apps/compare/summary.h"
#include "circline/estimators/status.h"

namespace circline::apps {

// ---- Which photos are shown in full: a browser cannot open ten thousand ----

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

// ---- The report ----

// The output files of a folder boiled down to what the tables and plots need.
struct Digest {
  Summary summary;
  Agreement agreement;
  std::vector<ImageScore> scores;  // One for each image, in order.
};

// Reads results.jsonl and its companions, one image at a time. Not ok: a line that is not as this
// program writes it.
Status ReadDigest(const std::string& folder, Digest* digest);

// Photos shown in full, with their pictures; the others are listed by name.
inline constexpr std::size_t kMaxReportImages = 200;

// Writes report.html of a folder whose results.jsonl, its companions and overlays are there. Photos
// beyond `max_images` are not shown in full.
Status WriteReport(const std::string& folder, const Digest& digest,
                   std::size_t max_images = kMaxReportImages);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMPARE_REPORT_H_
