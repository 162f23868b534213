#include "apps/compare/report.h"

#include <algorithm>

#include "apps/common/in_parallel.h"
#include "apps/common/output_file.h"
#include "apps/common/report_page.h"
#include "apps/common/text.h"
#include "apps/compare/encode.h"
#include "apps/compare/record_files.h"
#include "apps/compare/report_parts.h"
#include "apps/compare/sweep.h"

namespace circline::apps {
namespace {

constexpr int kPictureWidth = 900;
constexpr std::size_t kMostNamed = 5000;  // More rows make a browser slow.
constexpr const char* kNotAll = " (the first 5000; results.jsonl has all)";

std::string Lead(const Summary& summary) {
  std::string text = std::to_string(summary.num_images()) +
                     (summary.num_images() == 1 ? " image, " : " images, ") +
                     std::to_string(summary.rows().size()) + " rows of solvers, stages and losses";
  if (summary.num_unreadable() > 0) {
    text += "; " + std::to_string(summary.num_unreadable()) + " could not be read";
  }
  return text + ".";
}

// Collects chapters and the links to them.
class Page {
 public:
  void Add(const std::string& id, const std::string& title, const std::string& html) {
    if (html.empty()) return;
    links_ += "<a href='#" + id + "'>" + title + "</a>";
    chapters_ += "<h2 id='" + id + "'>" + title + "</h2>" + html + "\n";
  }
  std::string Html() const { return "<nav>" + links_ + "</nav>" + chapters_; }

 private:
  std::string links_, chapters_;
};

std::string Plots(const std::string& plots) {
  return plots.empty() ? "" : "<div class='plots'>" + plots + "</div>";
}

std::string SweepChapter(const Summary& summary) {
  const std::string table = SweepTable(summary);
  const SummaryRow* best = BestRow(summary);
  if (table.empty() || best == nullptr) return "";
  return "<p class='lead'>Best: " + EscapeHtml(DescribeRow(*best)) + ".</p>" + table + "<br>" +
         Plots(SweepPlots(summary));
}

std::string SweepNote(const Summary& summary) {
  if (LossPoints(summary).size() < 2) return "";
  return "<p class='lead'>Each solver with its best loss and scale, and the answer drawn in the "
         "picture; results.jsonl has the others.</p>";
}

std::string AgreementChapter(const Agreement& agreement) {
  const std::string table = AgreementTable(agreement);
  return table.empty() ? ""
                       : "<p class='lead'>Median angle between the plane normals that two solvers "
                         "answer, degrees.</p>" +
                             table;
}

std::string Chapters(const Digest& digest) {
  const Summary& summary = digest.summary;
  Page page;
  page.Add("summary", "Summary", SummaryTable(summary));
  page.Add("curves", "Share of images within an error", Plots(CumulativePlots(summary)));
  page.Add("sweep", "Losses and scales", SweepChapter(summary));
  page.Add("agreement", "Agreement", AgreementChapter(digest.agreement));
  page.Add("images", "Images", OverlayLegend() + SweepNote(summary));
  return page.Html();
}

// Buttons that choose between the kinds of photos, where not all are shown.
std::string Chooser(const std::vector<ShownImage>& shown, std::size_t num_images) {
  if (shown.size() == num_images) return "";
  return "<p class='lead'>" + std::to_string(shown.size()) + " of " + std::to_string(num_images) +
         " images are shown; the names of the others stand below.</p><p class='choose'>"
         "<button class='on' value=''>all</button><button value='worst'>worst</button>"
         "<button value='median'>median</button><button value='refused'>refused or not read"
         "</button></p>";
}

std::string OtherImage(const ImageRecord& record, const ImageScore& score) {
  const char* unit = score.has_truth ? " \u00b0" : " px";
  const std::string fate = score.fate == Fate::kRefused      ? "refused"
                           : score.fate == Fate::kUnreadable ? "not read"
                                                             : FormatShort(score.value) + unit;
  return "<tr>" + CellHtml(record.name, "l") + CellHtml(fate) + CellHtml(record.overlay, "l") +
         "</tr>\n";
}

// Pictures are made by all threads, a few at a time.
void WriteSections(const std::string& folder, const std::vector<ShownImage>& shown,
                   const std::vector<SolverKey>& keys, const std::vector<ImageRecord>& records,
                   OutputFile* file) {
  constexpr std::size_t kAtATime = 16;
  for (std::size_t begin = 0; begin < shown.size(); begin += kAtATime) {
    const std::size_t count = std::min(kAtATime, shown.size() - begin);
    std::vector<std::string> pictures(count);
    InParallel(count, [&](std::size_t i) {
      const std::string& overlay = records[begin + i].overlay;
      if (!overlay.empty()) pictures[i] = JpegOfFile(folder + "/" + overlay, kPictureWidth);
    });
    for (std::size_t i = 0; i < count; ++i) {
      file->Write(ImageSection(records[begin + i], keys, pictures[i], shown[begin + i].why));
    }
  }
}

// Second pass over the files: photos to show are kept for the order of the selection, the others
// become a row each.
Status AddImages(const std::string& folder, const Digest& digest, std::size_t max_images,
                 OutputFile* file) {
  const std::vector<ShownImage> shown = SelectImages(digest.scores, max_images);
  std::vector<int> slots(digest.scores.size(), -1);
  for (std::size_t i = 0; i < shown.size(); ++i) slots[shown[i].position] = static_cast<int>(i);
  std::vector<ImageRecord> records(shown.size());
  std::string others;
  std::size_t num_others = 0;
  RecordReader reader(folder);
  ImageLines lines;
  for (std::size_t i = 0; i < slots.size() && reader.Next(&lines); ++i) {
    ImageRecord record;
    if (slots[i] < 0) lines.results.clear(), lines.timings.clear();
    const Status status = ParseRecord(lines, &record);
    if (!status.ok()) return Status::Failed(folder + ": " + status.message);
    if (slots[i] < 0) {
      if (++num_others <= kMostNamed) others += OtherImage(record, digest.scores[i]);
    } else {
      records[static_cast<std::size_t>(slots[i])] = std::move(record);
    }
  }
  std::vector<SolverKey> keys;  // The rows of the tables of single images.
  for (const SummaryRow* row : RowsToShow(digest.summary)) keys.push_back(row->key);
  file->Write(Chooser(shown, slots.size()));
  WriteSections(folder, shown, keys, records, file);
  if (!others.empty()) {
    file->Write(
        "<details><summary>The other images" + std::string(num_others > kMostNamed ? kNotAll : "") +
        "</summary><div class='scroll'>"
        "<table class='sortable'><thead><tr><th class='l'>image</th><th>error or residual</th>"
        "<th class='l'>picture</th></tr></thead><tbody>" +
        others + "</tbody></table></div></details>\n");
  }
  return Status::Ok();
}

}  // namespace

ImageScore ScoreOf(const ImageRecord& record) {
  ImageScore score;
  if (!record.error.empty()) {
    score.fate = Fate::kUnreadable;
    return score;
  }
  const SolverRecord* shown = AnswerToShow(record.solvers);
  if (shown == nullptr) return score;
  const HypothesisRecord& best = shown->hypotheses.front();
  const std::optional<double> error = best.errors.Headline();
  score.fate = Fate::kAnswered;
  score.has_truth = error.has_value();
  score.value = static_cast<float>(error.value_or(best.rms_px));
  return score;
}

std::vector<ShownImage> SelectImages(const std::vector<ImageScore>& scores, std::size_t limit) {
  std::vector<ShownImage> shown;
  if (scores.size() <= limit) {
    for (std::size_t i = 0; i < scores.size(); ++i) shown.push_back({i, ""});
    return shown;
  }
  std::vector<std::size_t> answered, others;
  for (std::size_t i = 0; i < scores.size(); ++i) {
    (scores[i].fate == Fate::kAnswered ? answered : others).push_back(i);
  }
  // Worst first: those with a truth before those without, whose residual is another measure.
  std::stable_sort(answered.begin(), answered.end(), [&](std::size_t a, std::size_t b) {
    if (scores[a].has_truth != scores[b].has_truth) return scores[a].has_truth;
    return scores[a].value > scores[b].value;
  });
  const std::size_t refused =
      std::min(others.size(), std::max(limit / 3, limit - std::min(limit, answered.size())));
  const std::size_t middle = std::min(answered.size(), limit / 3);
  const std::size_t worst = std::min(answered.size() - middle, limit - refused - middle);
  for (std::size_t i = 0; i < worst; ++i) shown.push_back({answered[i], "worst"});
  const std::size_t first =
      std::max(worst, answered.size() / 2 - std::min(answered.size() / 2, middle / 2));
  const std::size_t begin = std::min(first, answered.size() - middle);
  for (std::size_t i = begin; i < begin + middle; ++i) shown.push_back({answered[i], "median"});
  for (std::size_t i = 0; i < refused; ++i) shown.push_back({others[i], "refused"});
  return shown;
}

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

Status WriteReport(const std::string& folder, const Digest& digest, std::size_t max_images) {
  OutputFile file(folder + "/report.html");
  file.Write(PageTop("circline: comparison") +
             "<h1>Pose from circles and parallel lines</h1><p class='lead'>" +
             EscapeHtml(Lead(digest.summary)) + "</p>\n" + Chapters(digest));
  const Status status = AddImages(folder, digest, max_images, &file);
  if (!status.ok()) return status;
  file.Write(PageEnd());
  return file.Commit();
}

}  // namespace circline::apps
