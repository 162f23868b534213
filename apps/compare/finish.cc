#include "apps/compare/finish.h"

#include <filesystem>

#include "apps/common/output_file.h"
#include "apps/compare/export.h"
#include "apps/compare/report.h"
#include "apps/compare/sweep.h"

namespace circline::apps {
namespace {

std::string BestSentence(const Summary& summary) {
  const SummaryRow* best = BestRow(summary);
  if (best == nullptr || LossPoints(summary).size() < 2) return "";
  return "best: " + DescribeRow(*best) + "\n";
}

Status SaveBest(const Summary& summary, const FinishOptions& options) {
  const SummaryRow* best = BestRow(summary);
  if (best == nullptr) {
    return Status::Failed("--save_options: no refined solver has an answer, so none is the best");
  }
  return WriteFile(options.save_options,
                   "# " + DescribeRow(*best) + "\n--robust_loss=" + best->key.loss +
                       "\n--loss_scale_px=" + best->key.ScaleText() + "\n" + options.other_flags);
}

}  // namespace

Status CheckFinish(const std::string& folder, const FinishOptions& options) {
  namespace fs = std::filesystem;
  if (options.save_options.empty()) return Status::Ok();
  std::error_code error;
  const fs::path parent = fs::absolute(options.save_options).lexically_normal().parent_path();
  if (parent == (fs::absolute(folder) / "").lexically_normal().parent_path() &&
      !fs::exists(parent, error)) {
    return Status::Ok();  // It is about to be made.
  }
  const Status status = CanWriteFile(options.save_options);
  return status.ok() ? status : Status::Invalid("--save_options: " + status.message);
}

Status FinishFolder(const std::string& folder, const FinishOptions& options,
                    ComparisonResult* result) {
  Digest digest;
  Status status = ReadDigest(folder, &digest);
  const Summary& summary = digest.summary;
  if (status.ok()) status = WriteFile(folder + "/summary.csv", summary.Csv());
  if (status.ok()) status = WriteReport(folder, digest);
  std::string notes;
  if (status.ok()) status = WriteExports(folder, options.exports, &notes);
  if (status.ok() && !options.save_options.empty()) status = SaveBest(summary, options);
  result->num_unreadable = summary.num_unreadable();
  result->table = summary.Table() + BestSentence(summary) + notes;
  return status;
}

}  // namespace circline::apps
