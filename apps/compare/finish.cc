#include "apps/compare/finish.h"

#include "apps/common/output_file.h"
#include "apps/compare/digest.h"
#include "apps/compare/report.h"

namespace circline::apps {

Status FinishFolder(const std::string& folder, ComparisonResult* result) {
  Digest digest;
  Status status = ReadDigest(folder, &digest);
  if (status.ok()) status = WriteFile(folder + "/summary.csv", digest.summary.Csv());
  if (status.ok()) status = WriteReport(folder, digest);
  result->num_unreadable = digest.summary.num_unreadable();
  result->table = digest.summary.Table();
  return status;
}

}  // namespace circline::apps
