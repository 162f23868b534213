// report.html as its readers get it.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <string>

#include "apps/common/svg_plot.h"
#include "apps/compare/record.h"
#include "apps/compare/report.h"
#include "tests/apps/board_set.h"
#include "tests/apps/run_compare.h"
#include "tests/apps/test_files.h"

namespace circline::apps {
namespace {

std::string RunSweep(const TestFolder& folder) {
  EXPECT_EQ(CompareScene(MakeSet(folder, kMissingImage), folder / "out",
                         "--robust_loss=huber,tukey --loss_scale_px=0.5,1,auto")
                .exit_code,
            1);
  return folder / "out";
}

// What the closed forms say of parts of the evidence is no pose where all of it gives none.
TEST(CompareReport, ShowsNoPoseThatTheJointSolverRefuses) {
  ImageRecord record;
  for (const char* solver : {"line_pairs", "joint"}) {
    SolverRecord& made = record.solvers.emplace_back();
    made.key = {solver, "refined", "cauchy"};
    made.hypotheses.resize(1);
    made.hypotheses[0].probability = 1.0;
  }
  ASSERT_NE(AnswerToShow(record.solvers), nullptr);
  EXPECT_EQ(AnswerToShow(record.solvers)->key.solver, "joint");
  record.solvers[1].hypotheses.clear();
  EXPECT_EQ(AnswerToShow(record.solvers), nullptr);
  record.solvers.push_back(record.solvers[0]);  // With another loss it does not.
  record.solvers[2].key = {"joint", "refined", "huber"};
  ASSERT_NE(AnswerToShow(record.solvers), nullptr);
  EXPECT_EQ(AnswerToShow(record.solvers)->key.loss, "huber");
  record.solvers.resize(1);  // It was not asked.
  ASSERT_NE(AnswerToShow(record.solvers), nullptr);
  EXPECT_EQ(AnswerToShow(record.solvers)->key.solver, "line_pairs");
}

TEST(CompareReport, ShowsSomeImagesAndNamesTheOthers) {
  const TestFolder folder;
  const std::string out = RunSweep(folder);
  std::string report = ReadAll(out + "/report.html");
  EXPECT_EQ(Count(report, "<section class='image'"), 7);
  EXPECT_EQ(Count(report, "data:image/jpeg;base64,"), 6);
  EXPECT_CONTAINS(report, "Not read: the file does not exist");

  Digest digest;
  ASSERT_TRUE(ReadDigest(out, &digest).ok());
  ASSERT_TRUE(WriteReport(out, digest, 4).ok());
  report = ReadAll(out + "/report.html");
  EXPECT_EQ(Count(report, "<section class='image'"), 4);
  EXPECT_EQ(Count(report, "data-why='worst'"), 2);
  EXPECT_EQ(Count(report, "data-why='median'"), 1);
  EXPECT_EQ(Count(report, "data-why='refused'"), 1);
  EXPECT_EQ(Count(report, "data:image/jpeg;base64,"), 3);
  EXPECT_EQ(Count(report, "<td class='l'>overlays/tilt"), 3);  // Named, not shown.
}

// Of the six losses and scales the tables show each solver's best; for a photo, too, and besides
// the answer that its picture shows.
TEST(CompareReport, ShowsTheBestOfASweep) {
  const TestFolder folder;
  const std::string report = ReadAll(RunSweep(folder) + "/report.html");
  const auto joint_rows = [](const std::string& html) {
    return Count(html, "<td class='l'>joint</td><td class='l'>refined</td>");
  };
  const std::size_t summary = report.find("<h2 id='summary'"),
                    curves = report.find("<h2 id='curves'");
  EXPECT_EQ(joint_rows(report.substr(summary, curves - summary)), 6);
  EXPECT_EQ(Count(report, "<tr class='rest'><td class='l'>joint<"), 5);
  const std::size_t image = report.find("<section class='image'");
  const std::size_t next = report.find("<section class='image'", image + 1);
  const int shown = joint_rows(report.substr(image, next - image));
  EXPECT_GE(shown, 1);
  EXPECT_LE(shown, 2);
}

TEST(CompareReport, NarrowAxesHaveLabels) {
  for (const auto& [low, high] : {std::pair(0.031, 0.044), std::pair(0.09, 0.13)}) {
    EXPECT_GE(PlotTicks(true, low, high).size(), 3U);
  }
  EXPECT_EQ(PlotTicks(true, 0.1, 10.0).size(), 7U);
}

TEST(CompareReport, HasEveryChapterAndNothingFromElsewhere) {
  const TestFolder folder;
  const std::string report = ReadAll(RunSweep(folder) + "/report.html");
  for (const char* chapter : {"summary", "curves", "sweep", "agreement", "images"}) {
    EXPECT_EQ(Count(report, std::string("<h2 id='") + chapter + "'"), 1) << chapter;
  }
  for (const char* reference : {"http:", "https:", "<link", "url(", "@import", "src='/", "src=\"",
                                "//cdn", "srcset", "<iframe", "fetch(", "XMLHttpRequest"}) {
    EXPECT_EQ(Count(report, reference), 0) << reference;
  }
  EXPECT_CONTAINS(report, "Best: ");
  for (const char* number : {">nan", ">-nan", ">inf", "'nan", "M nan", " nan"}) {
    EXPECT_EQ(Count(report, number), 0) << number;
  }
}

// The page in a real browser. Errors of scripts show as lines of its log; what it would fetch has
// no network to come from, so a reference elsewhere shows there as well.
TEST(CompareReport, RunsInABrowserWithoutAnError) {
  if (std::system("command -v chromium > /dev/null 2>&1") != 0) {
    GTEST_SKIP() << "no chromium here: apt-get install chromium";
  }
  const TestFolder folder;
  const std::string out = RunSweep(folder);
  // A copy that clicks through what can be clicked, then says what became of it.
  std::string page = ReadAll(out + "/report.html");
  const std::string clicks =
      "<script>"
      "document.querySelectorAll('th').forEach(function(h){h.click();h.click()});"
      "document.querySelectorAll('.choose button').forEach(function(b){b.click()});"
      "document.querySelector('figure img').click();"
      "var zoom=document.getElementById('zoom');"
      "zoom.dispatchEvent(new WheelEvent('wheel',{deltaY:-300,clientX:9,clientY:9}));"
      "document.title='brief='+document.querySelectorAll('table.brief').length"
      "+' open='+zoom.classList.contains('on');"
      "document.dispatchEvent(new KeyboardEvent('keydown',{key:'ArrowRight'}));"
      "document.dispatchEvent(new KeyboardEvent('keydown',{key:'Escape'}));"
      "document.title+=' closed='+!zoom.classList.contains('on');"
      "var head=document.querySelector('#summary+div th');"
      "while(!head.classList.contains('down'))head.click();"
      "var names=Array.from(document.querySelectorAll('#summary+div tbody tr')).map(function(r){"
      "return r.cells[0].textContent});"
      "document.title+=' sorted='+(names.join()==names.slice().sort().reverse().join())"
      "+' requests='+performance.getEntriesByType('resource').filter(function(e){"
      "return !e.name.startsWith('data:')}).length"
      "</script></body>";
  const std::size_t end = page.rfind("</body>");
  ASSERT_NE(end, std::string::npos);
  page.replace(end, 7, clicks);
  folder.Write("page.html", page);
  const auto [exit_code, dom, log] = RunProgram(
      "env",
      "HOME='" + folder.path() +
          "' timeout 120 chromium --headless --no-sandbox --disable-gpu --disable-dev-shm-usage "
          "--enable-logging=stderr --v=0 --virtual-time-budget=3000 --dump-dom 'file://" +
          folder / "page.html" + "'");
  ASSERT_EQ(exit_code, 0) << log;
  const std::string title =
      dom.substr(dom.find("<title>"), dom.find("</title>") - dom.find("<title>"));
  EXPECT_EQ(Count(log, "CONSOLE"), 0) << log;
  EXPECT_EQ(title, "<title>brief=0 open=true closed=true sorted=true requests=0");
}

}  // namespace
}  // namespace circline::apps
