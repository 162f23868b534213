// The parts of circline_compare by themselves: queue, records, selection, agreement.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <new>
#include <opencv2/core/utility.hpp>
#include <set>
#include <thread>
#include <vector>

#include "apps/compare/agreement.h"
#include "apps/compare/other_planes.h"
#include "apps/compare/overlay.h"
#include "apps/compare/pixel_ellipse.h"
#include "apps/compare/record_files.h"
#include "apps/compare/report.h"
#include "apps/compare/sweep.h"
#include "apps/compare/work_queue.h"
#include "circline/estimators/basics.h"
#include "circline/estimators/pose.h"
#include "tests/apps/test_files.h"
#include "tests/pinhole_camera.h"

namespace circline::apps {
namespace {

TEST(WorkQueue, DeliversInOrderAndKeepsNearTheOldest) {
  cv::setNumThreads(2);
  constexpr std::size_t kCount = 2000;
  std::atomic<std::size_t> started{0}, delivered{0};
  std::atomic<std::size_t> most_ahead{0};
  std::vector<std::size_t> order;
  WorkInOrder(
      kCount,
      [&](std::size_t i) {
        const std::size_t ahead = ++started - delivered;
        std::size_t most = most_ahead;
        while (ahead > most && !most_ahead.compare_exchange_weak(most, ahead)) {
        }
        if (i == 0) std::this_thread::sleep_for(std::chrono::milliseconds(200));  // The slow one.
        return [i] {
          // One that is slow to draw: the others are worked on and drawn meanwhile.
          if (i == kCount / 2) std::this_thread::sleep_for(std::chrono::milliseconds(200));
          WorkedImage image;
          image.lines.results = std::to_string(i);
          return image;
        };
      },
      [&](std::size_t i, const WorkedImage& image) {
        EXPECT_EQ(image.lines.results, std::to_string(i));
        order.push_back(i);
        ++delivered;
        return true;
      });
  ASSERT_EQ(order.size(), kCount);
  EXPECT_TRUE(std::is_sorted(order.begin(), order.end()));
  EXPECT_LE(most_ahead, 300U);  // Not all the others while the slow one is worked on.
}

TEST(WorkQueue, EndsWhenDeliveryFails) {
  for (const int threads : {1, 2}) {
    cv::setNumThreads(threads);
    int delivered = 0;
    WorkInOrder(
        1000, [](std::size_t) { return [] { return WorkedImage(); }; },
        [&](std::size_t i, const WorkedImage&) {
          ++delivered;
          return i < 5;
        });
    EXPECT_EQ(delivered, 6);
  }
}

TEST(WorkQueue, ThrowsWhatAThreadThrows) {
  const auto nothing = [](std::size_t) { return [] { return WorkedImage(); }; };
  const auto fail = [](std::size_t i) {
    if (i == 7) throw std::bad_alloc();
  };
  for (const int threads : {1, 2}) {
    cv::setNumThreads(threads);
    const auto go_on = [](std::size_t, const WorkedImage&) { return true; };
    EXPECT_THROW(WorkInOrder(
                     1000, [&](std::size_t i) { return fail(i), nothing(i); }, go_on),
                 std::bad_alloc);
    EXPECT_THROW(
        WorkInOrder(
            1000, [&](std::size_t i) { return [&, i] { return fail(i), WorkedImage(); }; }, go_on),
        std::bad_alloc);
    EXPECT_THROW(WorkInOrder(1000, nothing,
                             [&](std::size_t i, const WorkedImage&) { return fail(i), true; }),
                 std::bad_alloc);
  }
}

TEST(PixelEllipse, CoverageIsTheArcsShareOfTheTurn) {
  for (const int degrees : {90, 180, 270}) {
    CircleObservation circle;
    for (int i = 0; i <= degrees; i += 2) {
      const double t = i * kDegree;
      circle.points.emplace_back(300.0 + 50.0 * std::cos(t), 200.0 + 30.0 * std::sin(t));
    }
    PixelEllipse seen;
    ASSERT_TRUE(FitPixelEllipse(circle, &seen));
    EXPECT_NEAR(seen.coverage, degrees / 360.0, 1e-6);
  }
}

ImageLines OneImage(int index) {
  const std::string i = std::to_string(index);
  return {"{\"result\":" + i + "}\n{\"result\":" + i + "}\n",
          "{\"index\":" + i + ",\"lines\":{\"results\":2,\"timings\":1}}\n",
          "{\"time\":" + i + "}\n"};
}

TEST(RecordFiles, GoesOnAfterTheLastWholeImage) {
  const TestFolder folder;
  {
    RecordWriter writer(folder.path(), {});
    for (int i = 0; i < 3; ++i) ASSERT_TRUE(writer.Append(OneImage(i)).ok());
  }
  const std::string whole = ReadAll(folder / "results.jsonl");
  const std::size_t one = whole.size() / 3;
  // Cut anywhere in the third image: two are whole.
  for (const std::size_t keep : {2 * one, 2 * one + 1, 2 * one + one / 2, 3 * one - 1}) {
    std::filesystem::resize_file(folder / "results.jsonl", keep);
    RecordReader reader(folder.path());
    ImageLines lines;
    int count = 0;
    while (reader.Next(&lines)) ++count;
    EXPECT_EQ(count, 2) << keep;
    RecordWriter writer(folder.path(), reader.bytes_read());
    ASSERT_TRUE(writer.Append(OneImage(2)).ok());
    EXPECT_EQ(ReadAll(folder / "results.jsonl"), whole);
  }
}

TEST(Record, NamesALineThatIsNotOfThisProgram) {
  ImageRecord record;
  EXPECT_FALSE(ParseRecord({"", "not json\n", ""}, &record).ok());
  EXPECT_FALSE(ParseRecord({"{\"solver\":1}\n", OneImage(0).observations, ""}, &record).ok());
  const std::string unknown_model =
      R"({"index":0,"set_size":1,"image":"a.png","detected":true,"ellipses":[],"segments":[],)"
      R"("pencils":[],"camera":{"id":"k","model":"fish"}})";
  EXPECT_NE(ParseRecord({"", unknown_model, ""}, &record).message.find("'fish' is not one of"),
            std::string::npos);
}

// The same pose, seen through the camera given and through a wrong one that was refined to it.
TEST(Overlay, DrawsWithTheRefinedFocalLength) {
  const auto draw = [](double given, double focal_scale) {
    SceneImage image;
    ImageRun run;
    run.image = &image;
    run.photo = cv::Mat(480, 640, CV_8UC3, cv::Scalar::all(90));
    run.observations.camera = CenteredCamera(given, 640, 480);
    CircleObservation circle;  // Without a fit: its points alone say where the grid is.
    circle.id = "c";
    circle.plane = "p";
    circle.points = {{200.0, 150.0}, {420.0, 140.0}, {450.0, 330.0}, {190.0, 350.0}};
    run.observations.circles = {circle};
    PoseHypothesis hypothesis;
    hypothesis.cam_from_world.rotation =
        ExpRotation({0.6, 0.2, 0.1}) * Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();
    hypothesis.cam_from_world.translation = Eigen::Vector3d(0.0, 0.0, 5.0);
    hypothesis.focal_scale = focal_scale;
    SolverRun solver;
    solver.solver = "joint";
    solver.estimate.hypotheses = {hypothesis};
    solver.errors.resize(1);
    run.solvers = {solver};
    return DrawOverlay(run);
  };
  const cv::Mat expected = draw(600.0, 1.0);
  EXPECT_EQ(cv::norm(draw(500.0, 1.2), expected, cv::NORM_INF), 0.0);
  EXPECT_GT(cv::norm(draw(500.0, 1.0), expected, cv::NORM_INF), 0.0);
}

SolverRun RunOf(const std::string& solver, const LossSetting* loss, double tilt_deg,
                double probability) {
  SolverRun run;
  run.solver = solver;
  run.loss = loss;
  PoseHypothesis hypothesis;
  hypothesis.cam_from_world.rotation = ExpRotation({tilt_deg * kDegree, 0.0, 0.0});
  hypothesis.probability = probability;
  run.estimate.hypotheses = {hypothesis};
  return run;
}

TEST(OtherPlanes, SureAnswersThatContradictEachOtherSaySo) {
  const LossSetting first, second;
  std::vector<SolverRun> runs = {
      RunOf("line_pairs", nullptr, 0.0, 1.0),         RunOf("line_pairs", &first, 1.0, 0.95),
      RunOf("line_pairs", &second, 40.0, 0.95),       RunOf("parallel_circles", &first, 30.0, 0.8),
      RunOf("concentric_circles", &first, 4.0, 0.99), RunOf("joint", &first, 31.0, 0.92)};
  NoteOtherPlanes(&runs);
  using Notes = std::vector<std::string>;
  const std::string others = "others are as sure of another plane: ";
  EXPECT_EQ(runs[0].estimate.notes, Notes{others + "joint (31 deg away)"});
  EXPECT_EQ(runs[1].estimate.notes, Notes{others + "joint (30 deg away)"});
  EXPECT_EQ(runs[2].estimate.notes, Notes{});  // Another loss has rivals of its own.
  EXPECT_EQ(runs[3].estimate.notes, Notes{});  // Not sure.
  EXPECT_EQ(runs[4].estimate.notes, Notes{others + "joint (27 deg away)"});
  EXPECT_EQ(runs[5].estimate.notes,
            Notes{others + "line_pairs (31 deg away), concentric_circles (27 deg away)"});
}

TEST(Selection, TakesWorstMedianAndRefused) {
  std::vector<ImageScore> scores;
  for (int i = 0; i < 1000; ++i) {
    ImageScore score;
    score.fate = i % 10 == 3 ? Fate::kRefused : Fate::kAnswered;
    score.has_truth = true;
    score.value = static_cast<float>((i * 7919) % 1000);  // All different.
    scores.push_back(score);
  }
  const std::vector<ShownImage> shown = SelectImages(scores, 90);
  ASSERT_EQ(shown.size(), 90U);
  std::set<std::size_t> positions;
  std::vector<float> worst, median;
  int refused = 0;
  for (const ShownImage& image : shown) {
    positions.insert(image.position);
    const std::string why = image.why;
    if (why == "worst") worst.push_back(scores[image.position].value);
    if (why == "median") median.push_back(scores[image.position].value);
    if (why == "refused") {
      ++refused;
      EXPECT_EQ(scores[image.position].fate, Fate::kRefused);
    }
  }
  EXPECT_EQ(positions.size(), 90U);  // None twice.
  EXPECT_EQ(refused, 30);
  ASSERT_EQ(worst.size(), 30U);
  ASSERT_EQ(median.size(), 30U);
  std::vector<float> values;
  for (const ImageScore& score : scores) {
    if (score.fate == Fate::kAnswered) values.push_back(score.value);
  }
  std::sort(values.rbegin(), values.rend());
  EXPECT_EQ(worst, std::vector<float>(values.begin(), values.begin() + 30));
  EXPECT_EQ(median, std::vector<float>(values.begin() + 435, values.begin() + 465));
}

TEST(Selection, ShowsAllOfAFew) {
  const std::vector<ImageScore> scores(7);
  const std::vector<ShownImage> shown = SelectImages(scores, 10);
  ASSERT_EQ(shown.size(), 7U);
  for (std::size_t i = 0; i < 7; ++i) {
    EXPECT_EQ(shown[i].position, i);
    EXPECT_STREQ(shown[i].why, "");
  }
}

SolverRecord Answer(const std::string& solver, double tilt_deg) {
  SolverRecord record;
  record.key = {solver, "refined", "huber", 1.0};
  record.status = "ok";
  HypothesisRecord hypothesis;
  hypothesis.rotation = ExpRotation({tilt_deg * kDegree, 0.0, 0.0});
  record.hypotheses = {hypothesis};
  return record;
}

TEST(Agreement, MedianAngleOfThePlanes) {
  Agreement agreement;
  for (int i = 0; i <= 10000; ++i) {  // More than are kept.
    ImageRecord record;
    record.solvers = {Answer("a", 10.0), Answer("b", 10.0 + i * 1e-3), Answer("c", 190.0)};
    if (i % 2 == 0) record.solvers[2].hypotheses.clear();
    agreement.Add(record);
  }
  ASSERT_EQ(agreement.keys().size(), 3U);
  EXPECT_NEAR(*agreement.MedianDeg(0, 1), 5.0, 0.02);
  EXPECT_EQ(*agreement.MedianDeg(0, 1), *agreement.MedianDeg(1, 0));
  EXPECT_NEAR(*agreement.MedianDeg(0, 2), 0.0, 1e-5);  // The normal's sense does not count.
  EXPECT_EQ(agreement.Count(0, 2), 5000U);
}

SolverRecord Refined(const std::string& loss, double scale, double error_deg, int num_inliers) {
  SolverRecord record = Answer("joint", 0.0);
  record.key.loss = loss;
  record.key.scale_px = scale;
  HypothesisRecord& hypothesis = record.hypotheses.front();
  if (error_deg > 0.0) hypothesis.errors.rotation_deg = error_deg;
  hypothesis.rms_px = 0.01 * num_inliers;
  hypothesis.num_inliers = num_inliers;
  hypothesis.num_observations = 100;
  return record;
}

TEST(Summary, TimesAreThoseOfAnswers) {
  Summary summary;
  for (const double microseconds : {1.0, 1.0, 100.0, 300.0}) {
    ImageRecord record;
    record.solvers = {Refined("huber", 0.5, 0.3, 90)};
    record.solvers[0].microseconds = microseconds;
    if (microseconds < 2.0) record.solvers[0].hypotheses.clear();
    summary.Add(record);
  }
  EXPECT_EQ(summary.rows().at(0).microseconds, (std::vector<float>{100.0F, 300.0F}));
}

TEST(Sweep, BestHasTheSmallestErrorOfThoseThatAnswer) {
  Summary summary;
  for (int i = 0; i < 10; ++i) {
    ImageRecord record;
    record.solvers = {Refined("huber", 0.5, 0.3, 90), Refined("huber", 0.0, 0.2, 90),
                      Refined("tukey", 0.5, 0.1, 90)};
    if (i % 2 == 0) record.solvers[2].hypotheses.clear();  // Only the easy half.
    summary.Add(record);
  }
  const SummaryRow* best = BestRow(summary);
  ASSERT_NE(best, nullptr);
  EXPECT_EQ(best->key.Name(), "joint refined, huber auto");
  EXPECT_EQ(LossPoints(summary).size(), 3U);
}

TEST(Sweep, WithoutTruthTheMostInliersThenTheSmallestResidual) {
  Summary summary;
  ImageRecord record;
  record.solvers = {Refined("huber", 0.1, 0.0, 40), Refined("tukey", 1.0, 0.0, 95),
                    Refined("huber", 1.0, 0.0, 80)};
  summary.Add(record);
  EXPECT_EQ(BestRow(summary)->key.Name(), "joint refined, tukey 1");
}

}  // namespace
}  // namespace circline::apps
