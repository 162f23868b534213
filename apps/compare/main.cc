// circline_compare: photos through every solver; a table, a picture for each photo, a report.
#include <exception>
#include <iostream>
#include <string>

#include "apps/common/flags_util.h"
#include "apps/compare/options.h"
#include "apps/compare/ranks.h"
#include "apps/compare/run.h"

namespace {

using circline::Status;
using circline::apps::CommandLine;
using circline::apps::CompareOptions;
using circline::apps::Ranks;

constexpr char kUsage[] =
    "circline_compare: camera pose from circles and parallel lines, by every solver, compared.\n"
    "\n"
    "  circline_compare --scene=set/scene.yaml --output=out\n"
    "  circline_compare --images='photos/*.jpg' --camera=calib.yml --output=out\n"
    "  circline_compare --merge=shard0,shard1 --output=out\n"
    "\n"
    "Writes results.jsonl, observations.jsonl, summary.csv, timings.jsonl, report.html and "
    "overlays/*.png.\n"
    "Exit code 0: every image gave an answer or a stated refusal; 1: some input could not be read "
    "(named,\n"
    "the rest is done); 2: unusable flags or scene file (nothing is written).";

// Only the first of several ranks speaks.
int Refuse(const Status& status, const Ranks& ranks) {
  if (ranks.is_first()) circline::apps::SayOnStderr("circline_compare: " + status.message);
  return circline::apps::kExitUsage;
}

int Compare(const Ranks& ranks) {
  CompareOptions options;
  Status status = circline::apps::OptionsFromFlags(&options);
  if (!status.ok()) return Refuse(status, ranks);
  circline::apps::ComparisonResult result;
  if (!options.inputs.merge.empty()) {
    if (ranks.is_first()) status = circline::apps::MergeComparison(options, &result);
  } else {
    circline::apps::ImageSet images;
    status = circline::apps::ImagesFromFlags(options.inputs, &images);
    if (status.ok() && options.inputs.guess.wanted && ranks.is_first())
      circline::apps::SayOnStderr(circline::apps::DescribeGuess(options.inputs.guess));
    if (status.ok()) status = circline::apps::RunComparison(images, options, ranks, &result);
  }
  if (status.code == circline::StatusCode::kInvalidArgument) return Refuse(status, ranks);
  if (!ranks.is_first()) return circline::apps::kExitOk;
  std::cout << result.table;
  if (!status.ok()) {
    circline::apps::SayOnStderr("circline_compare: " + status.message);
    return circline::apps::kExitUnreadable;
  }
  std::cout << "report: " << options.output << "/report.html\n";
  return result.num_unreadable > 0 ? circline::apps::kExitUnreadable : circline::apps::kExitOk;
}

// What is asked for instead of a comparison; false if nothing is.
bool Answer(const CommandLine& command_line) {
  if (command_line.help) {
    std::cout << circline::apps::HelpText(kUsage);
  } else if (command_line.version) {
    std::cout << circline::apps::VersionText("circline_compare") << Ranks::kBuiltWith << "\n";
  } else if (circline::apps::ListSolversAsked()) {
    std::cout << circline::apps::ListSolvers();
  } else {
    return false;
  }
  return true;
}

int ParseAndCompare(int argc, char** argv, const Ranks& ranks) {
  CommandLine command_line;
  Status status = circline::apps::ParseCommandLine(argc, argv, &command_line);
  if (status.ok()) status = circline::apps::PluginsFromFlags();
  if (!status.ok()) return Refuse(status, ranks);
  return Answer(command_line) ? circline::apps::kExitOk : Compare(ranks);
}

}  // namespace

int main(int argc, char** argv) {
  return circline::apps::RunGuarded(argv[0], "circline_compare", [&] {
    const Ranks ranks(&argc, &argv);
    try {
      return ParseAndCompare(argc, argv, ranks);
    } catch (const std::exception& error) {
      if (ranks.count() == 1) throw;
      circline::apps::SayOnStderr(std::string("circline_compare: stopped: ") + error.what());
      ranks.Abort(circline::apps::kExitUnreadable);  // The others wait to be heard.
      return circline::apps::kExitUnreadable;
    }
  });
}
