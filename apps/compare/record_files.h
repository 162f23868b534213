// results.jsonl, observations.jsonl and timings.jsonl of a folder, image by image.
#ifndef CIRCLINE_APPS_COMPARE_RECORD_FILES_H_
#define CIRCLINE_APPS_COMPARE_RECORD_FILES_H_

#include <array>
#include <cstdint>
#include <fstream>
#include <string>

#include "apps/common/output_file.h"
#include "apps/compare/record.h"
#include "circline/estimators/status.h"

namespace circline::apps {

// Reads images in the order in which they were written, holding one at a time.
class RecordReader {
 public:
  explicit RecordReader(const std::string& folder);
  // False after the last image that is there whole.
  bool Next(ImageLines* lines);
  // Of the image that Next has returned last, in the whole set.
  std::size_t index() const { return counts_.index; }
  // Of what Next has returned: results, observations, timings.
  const std::array<std::uint64_t, 3>& bytes_read() const { return bytes_read_; }

 private:
  std::ifstream results_, observations_, timings_;
  LineCounts counts_;
  std::array<std::uint64_t, 3> bytes_read_{};
};

// Appends images. Each file grows by whole lines, an image at a time and the results last, so that
// what results.jsonl has is done. What a kill cuts off RecordReader does not return.
class RecordWriter {
 public:
  // Cuts the files back to `keep_bytes` of each: zeros to begin, RecordReader::bytes_read to go on.
  RecordWriter(const std::string& folder, const std::array<std::uint64_t, 3>& keep_bytes);
  // Not ok: names the file that cannot be written.
  Status Append(const ImageLines& lines);

 private:
  AppendFile results_, observations_, timings_;
};

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMPARE_RECORD_FILES_H_
