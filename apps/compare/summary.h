// What all images together say of each solver.
#ifndef CIRCLINE_APPS_COMPARE_SUMMARY_H_
#define CIRCLINE_APPS_COMPARE_SUMMARY_H_

#include <functional>
#include <string>
#include <vector>

#include "apps/compare/record.h"

namespace circline::apps {

// One solver with one loss over all images.
struct SummaryRow {
  SolverKey key;
  int images = 0, ok = 0, refused = 0, failed = 0;
  int with_truth = 0;      // Images whose truth an answer could be compared with.
  int ambiguous = 0;       // Images with two or more hypotheses and a truth.
  int best_is_better = 0;  // Images with a truth whose best hypothesis is the nearest to it.
  // Of the best hypothesis, one for each image that has it, in the order of images.
  std::vector<double> rotation_errors, normal_errors, worst_direction_errors, headline_errors,
      rms_px;
  std::vector<double> direction_errors;  // The same, one for each direction of the truth.
  std::vector<double> inlier_shares;
  std::vector<double> better_normal_errors;  // Of the hypothesis nearest to the truth.
  std::vector<float> microseconds;           // Of answers.
};

// A column of the table for people.
struct SummaryColumn {
  std::string title, explanation;
  bool left = false;  // Words stand to the left, numbers to the right.
  std::function<std::string(const SummaryRow&)> text;  // "-" where there is nothing to say.
};

class Summary {
 public:
  // Rows stand in the order in which the first image brings them.
  void Add(const ImageRecord& record);
  const std::vector<SummaryRow>& rows() const { return rows_; }
  int num_images() const { return num_images_; }
  int num_unreadable() const { return num_unreadable_; }
  // By median error, then by rms; rows that answer less than half of the images come after the
  // others, rows without an answer last.
  std::vector<const SummaryRow*> Ranked() const;
  // Without columns that have nothing to say in any row.
  std::vector<SummaryColumn> Columns() const;
  std::string Csv() const;    // In the order of rows().
  std::string Table() const;  // Ranked, aligned, for people; who refused every image is only named.

 private:
  std::vector<SummaryRow> rows_;
  int num_images_ = 0, num_unreadable_ = 0;
};

// NaN of nothing. The quantile interpolates between neighbours.
double Quantile(std::vector<double> values, double q);
double Median(const std::vector<double>& values);
double Mean(const std::vector<double>& values);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMPARE_SUMMARY_H_
