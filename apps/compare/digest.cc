#include "apps/compare/digest.h"

#include "apps/compare/record_files.h"

namespace circline::apps {

Status ReadDigest(const std::string& folder, Digest* digest) {
  RecordReader reader(folder);
  ImageRecord record;
  for (ImageLines lines; reader.Next(&lines);) {
    const Status status = ParseRecord(lines, &record);
    if (!status.ok()) return Status::Failed(folder + ": " + status.message);
    digest->summary.Add(record);
    digest->agreement.Add(record);
    digest->scores.push_back(ScoreOf(record));
  }
  return Status::Ok();
}

}  // namespace circline::apps
