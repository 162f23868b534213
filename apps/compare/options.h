// What circline_compare was asked to do: the library's options, and where from and where to.
#ifndef CIRCLINE_APPS_COMPARE_OPTIONS_H_
#define CIRCLINE_APPS_COMPARE_OPTIONS_H_

#include <string>
#include <vector>

#include "apps/common/photo_file.h"
#include "apps/compare/estimation_flags.h"
#include "apps/compare/inputs.h"
#include "circline/estimators/closed_form_solvers.h"
#include "circline/estimators/status.h"
#include "circline/ransac/detection/detect_observations.h"
#include "circline/ransac/fit_observations.h"

namespace circline::apps {

struct FinishOptions {
  std::string save_options;          // File for the flags of the best loss and scale; may be empty.
  std::string other_flags;           // To stand in it as well, one a line.
  std::vector<std::string> exports;  // See WriteExports.
};

struct CompareOptions {
  std::string output;
  std::vector<std::string> solvers;  // Names; empty = all.
  std::vector<LossSetting> losses;   // One or more.
  FitOptions fit;
  DetectionOptions detection;
  ClosedFormOptions closed_form;
  int threads = 0;                         // 0 = as many as the machine has.
  double max_megapixels = kMaxMegapixels;  // Larger photos are refused.
  bool overlays = true;
  bool structure_tells_focal = true;  // Detection looks for the focal length where it is wide.
  bool resume = false;
  bool peers = false;  // Also run PeerSolvers().
  InputOptions inputs;
  FinishOptions finish;
  std::string result_flags;  // All flags that shape the results, one a line.
  // Of these, beside solvers and losses, those with another value than their own: "--seed=2".
  std::vector<std::string> unusual_flags;
};

// From the flags; not ok: one line that names the flag. Nothing but the file of --noise_model
// and the libraries of --plugin is read.
Status OptionsFromFlags(CompareOptions* options);

// For programs that make one answer of a photo: not ok where losses or their scales are lists.
Status CheckOneLoss(const CompareOptions& options);

// Loads the libraries of --plugin, whose solvers then are among the others (LoadPlugins).
Status PluginsFromFlags();

// Names of all solvers, closed form and refined, in the order of the registry.
std::vector<std::string> SolverNames();

// For --list_solvers: a line for each solver: name, stages, what it needs.
std::string ListSolvers();
bool ListSolversAsked();

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMPARE_OPTIONS_H_
