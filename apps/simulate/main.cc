// circline_simulate: the paper's simulation, with the bound beside it.
#include <iostream>

#include "apps/common/flags_util.h"
#include "apps/common/output_file.h"
#include "apps/simulate/options.h"
#include "apps/simulate/plot.h"
#include "apps/simulate/simulate.h"
#include "apps/simulate/street_trials.h"

namespace {

using circline::Status;

constexpr char kUsage[] =
    "circline_simulate: a circle and two pairs of parallel lines under noise and outliers; every "
    "method\n"
    "against the Cramer-Rao bound.\n"
    "\n"
    "  circline_simulate --output=out\n"
    "  circline_simulate --trials=500 --noise_px=1 --outlier_ratio=0,0.3,0.5 "
    "--outlier_kind=cluster --output=out\n"
    "  circline_simulate --scene=street --trials=1000 --output=out\n"
    "\n"
    "Writes simulation.csv and simulation.svg, or street.csv. Exit code 0: done; 1: the results "
    "could not be "
    "written;\n"
    "2: unusable flags (nothing is written).";

int Refuse(const Status& status, int exit_code) {
  circline::apps::SayOnStderr("circline_simulate: " + status.message);
  return exit_code;
}

Status SimulateStreet(const circline::apps::SimulationOptions& options, const std::string& output) {
  const std::vector<circline::apps::StreetTrial> trials = circline::apps::SimulateStreets(
      options.trials, options.focal_sigma, options.seed, options.threads);
  std::cout << circline::apps::StreetSummary(trials);
  return circline::apps::WriteFile(output + "/street.csv", circline::apps::StreetCsv(trials));
}

Status SimulatePaper(const circline::apps::SimulationOptions& options, const std::string& output) {
  const std::vector<circline::apps::SimulationRow> rows = circline::apps::Simulate(options);
  std::cout << circline::apps::SimulationTable(rows);
  const Status status =
      circline::apps::WriteFile(output + "/simulation.csv", circline::apps::SimulationCsv(rows));
  if (!status.ok()) return status;
  return circline::apps::WriteFile(output + "/simulation.svg",
                                   circline::apps::RenderSimulation(rows));
}

int Simulate() {
  circline::apps::SimulationOptions options;
  std::string output;
  Status status = circline::apps::SimulationFromFlags(&options, &output);
  if (status.ok()) status = circline::apps::CreateFolder(output);
  if (!status.ok()) return Refuse(status, circline::apps::kExitUsage);
  status = options.scene == circline::apps::SimulatedScene::kStreet
               ? SimulateStreet(options, output)
               : SimulatePaper(options, output);
  return status.ok() ? circline::apps::kExitOk : Refuse(status, circline::apps::kExitUnreadable);
}

}  // namespace

int main(int argc, char** argv) {
  return circline::apps::RunApp(argc, argv, "circline_simulate", kUsage, Simulate);
}
