// Command lines of one argument a line, as circline_compare reads them.
#include <gflags/gflags.h>

#include <sstream>
#include <string>
#include <vector>

#include "apps/common/flags_util.h"
#include "apps/compare/options.h"
#include "tests/fuzz/fuzz.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace circline;
  const gflags::FlagSaver restore;
  std::istringstream text(std::string(reinterpret_cast<const char*>(data), size));
  std::vector<std::string> arguments = {"circline_compare"};
  for (std::string line; std::getline(text, line);) {
    // Code is loaded from there: whoever names it is trusted.
    if (line.find("plugin") == std::string::npos) arguments.push_back(line);
  }
  std::vector<const char*> argv;
  for (const std::string& argument : arguments) argv.push_back(argument.c_str());
  apps::CommandLine command_line;
  Status status = apps::ParseCommandLine(static_cast<int>(argv.size()), argv.data(), &command_line);
  apps::CompareOptions options;
  if (status.ok()) status = apps::OptionsFromFlags(&options);
  if (!status.ok()) {
    fuzz::Expect(!status.message.empty(), "what is refused says why");
    return 0;
  }
  fuzz::Expect(options.fit.Validate().ok() && options.detection.Validate().ok(),
               "options from flags are valid");
  for (const apps::LossSetting& loss : options.losses)
    fuzz::Expect(loss.estimation.Validate().ok(), "options from flags are valid");
  return 0;
}
