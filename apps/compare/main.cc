// circline_compare: photos through every solver; a table, a picture for each photo, a report.
#include <algorithm>
#include <exception>
#include <filesystem>
#include <iostream>
#include <string>
#include <vector>

#include "apps/common/flags_util.h"
#include "apps/common/written_files.h"
#include "apps/compare/export.h"
#include "apps/compare/inputs.h"
#include "apps/compare/options.h"
#include "apps/compare/ranks.h"
#include "apps/compare/run.h"

namespace circline::apps {
namespace {

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

// What a run writes into its output folder, or, as an absolute path, beside it.
std::vector<std::string> FilesWritten(const CompareOptions& options) {
  std::vector<std::string> names = {"results.jsonl", "observations.jsonl", "timings.jsonl",
                                    "summary.csv", "report.html"};
  // With --resume it has the same flags as before, and may be the file that they are read from.
  if (!options.resume) names.emplace_back("unfinished.flags");
  // Without --resume those of an earlier run are removed.
  if (options.overlays || !options.resume) names.emplace_back("overlays/*.png");
  for (const ExportFormat& format : ExportFormats()) {
    const std::vector<std::string>& asked = options.finish.exports;
    if (std::find(asked.begin(), asked.end(), format.name) != asked.end())
      names.insert(names.end(), format.files.begin(), format.files.end());
  }
  const std::string& best = options.finish.save_options;
  if (!best.empty()) names.push_back(std::filesystem::absolute(best).string());
  return names;
}

// The same for the shards that are joined; that none of them is the output folder is checked there.
Status CheckShardsKept(const CompareOptions& options) {
  if (options.finish.save_options.empty()) return Status::Ok();
  std::vector<std::string> read;
  for (const std::string& folder : options.inputs.merge) {
    for (const char* name : {"/results.jsonl", "/observations.jsonl", "/timings.jsonl"})
      read.push_back(folder + name);
  }
  return WrittenFiles("", {options.finish.save_options}).CheckKept(read);
}

// Only the first of several ranks speaks.
int RefuseOnce(const Status& status, const Ranks& ranks) {
  if (ranks.is_first()) SayOnStderr("circline_compare: " + status.message);
  return kExitUsage;
}

int Compare(const Ranks& ranks) {
  CompareOptions options;
  Status status = OptionsFromFlags(&options);
  if (!status.ok()) return RefuseOnce(status, ranks);
  ImageSet images;
  ComparisonResult result;
  if (!options.inputs.merge.empty()) {
    status = CheckInputsKept(images, options.output, FilesWritten(options));
    if (status.ok()) status = CheckShardsKept(options);
    if (status.ok() && ranks.is_first()) status = MergeComparison(options, &result);
  } else {
    status = ImagesFromFlags(options.inputs, &images);
    if (status.ok() && options.inputs.guess.wanted && ranks.is_first())
      SayOnStderr(DescribeGuess(options.inputs.guess));
    if (status.ok()) status = CheckInputsKept(images, options.output, FilesWritten(options));
    if (status.ok()) status = RunComparison(images, options, ranks, &result);
  }
  if (status.code == StatusCode::kInvalidArgument) return RefuseOnce(status, ranks);
  if (!ranks.is_first()) return kExitOk;
  std::cout << result.table;
  if (!status.ok()) return Refuse("circline_compare", status);
  std::cout << "report: " << options.output << "/report.html\n";
  return result.num_unreadable > 0 ? kExitUnreadable : kExitOk;
}

// What is asked for instead of a comparison; false if nothing is.
bool Answer(const CommandLine& command_line) {
  if (command_line.help) {
    std::cout << HelpText(kUsage);
  } else if (command_line.version) {
    std::cout << VersionText("circline_compare") << Ranks::kBuiltWith << "\n";
  } else if (ListSolversAsked()) {
    std::cout << ListSolvers();
  } else {
    return false;
  }
  return true;
}

int ParseAndCompare(int argc, char** argv, const Ranks& ranks) {
  CommandLine command_line;
  Status status = ParseCommandLine(argc, argv, &command_line);
  if (status.ok()) status = PluginsFromFlags();
  if (!status.ok()) return RefuseOnce(status, ranks);
  return Answer(command_line) ? kExitOk : Compare(ranks);
}

int RunOnRanks(int argc, char** argv) {
  const Ranks ranks(&argc, &argv);
  try {
    return ParseAndCompare(argc, argv, ranks);
  } catch (const std::exception& error) {
    if (ranks.count() == 1) throw;
    SayOnStderr(std::string("circline_compare: stopped: ") + error.what());
    ranks.Abort(kExitUnreadable);  // The others wait to be heard.
  }
}

}  // namespace
}  // namespace circline::apps

int main(int argc, char** argv) {
  return circline::apps::RunGuarded(argv[0], "circline_compare",
                                    [&] { return circline::apps::RunOnRanks(argc, argv); });
}
