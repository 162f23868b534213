#include "apps/compare/record_files.h"

namespace circline::apps {
namespace {

// Appends the next `count` whole lines; false where there are fewer.
bool ReadLines(std::size_t count, std::ifstream* file, std::string* text) {
  text->clear();
  std::string line;
  for (std::size_t i = 0; i < count; ++i) {
    if (!std::getline(*file, line) || file->eof()) return false;  // No line end: cut off.
    *text += line + "\n";
  }
  return true;
}

}  // namespace

RecordReader::RecordReader(const std::string& folder)
    : results_(folder + "/results.jsonl", std::ios::binary),
      observations_(folder + "/observations.jsonl", std::ios::binary),
      timings_(folder + "/timings.jsonl", std::ios::binary) {}

bool RecordReader::Next(ImageLines* lines) {
  const bool whole = ReadLines(1, &observations_, &lines->observations) &&
                     ReadLineCounts(lines->observations, &counts_) &&
                     ReadLines(counts_.results, &results_, &lines->results) &&
                     ReadLines(counts_.timings, &timings_, &lines->timings);
  if (!whole) return false;
  bytes_read_[0] += lines->results.size();
  bytes_read_[1] += lines->observations.size();
  bytes_read_[2] += lines->timings.size();
  return true;
}

RecordWriter::RecordWriter(const std::string& folder,
                           const std::array<std::uint64_t, 3>& keep_bytes)
    : results_(folder + "/results.jsonl", keep_bytes[0]),
      observations_(folder + "/observations.jsonl", keep_bytes[1]),
      timings_(folder + "/timings.jsonl", keep_bytes[2]) {}

Status RecordWriter::Append(const ImageLines& lines) {
  Status status = timings_.Append(lines.timings);
  if (status.ok()) status = observations_.Append(lines.observations);
  if (status.ok()) status = results_.Append(lines.results);
  return status;
}

}  // namespace circline::apps
