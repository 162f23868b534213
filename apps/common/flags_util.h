// Command lines: gflags' flags, but an unknown flag or a bad value is an answer, not an exit(1).
#ifndef CIRCLINE_APPS_COMMON_FLAGS_UTIL_H_
#define CIRCLINE_APPS_COMMON_FLAGS_UTIL_H_

#include <functional>
#include <string>
#include <vector>

#include "circline/estimators/status.h"

namespace circline::apps {

// Exit codes of every app.
inline constexpr int kExitOk = 0;  // Every input gave an answer or a stated refusal.
inline constexpr int kExitUnreadable =
    1;                                // Some input could not be read (named); the rest was done.
inline constexpr int kExitUsage = 2;  // Unusable flags or scene file; nothing was written.

struct CommandLine {
  bool help = false;     // --help was asked for.
  bool version = false;  // --version was asked for.
};

// Sets gflags' variables from the arguments: --name=value, --name value, --name and --noname for
// booleans, one dash or two, --flagfile=FILE with a flag a line (# starts a comment). Not ok: one
// line that names the argument.
Status ParseCommandLine(int argc, const char* const* argv, CommandLine* command_line);

// Those that --flagfile has named, in the order in which they were read.
const std::vector<std::string>& FlagFiles();

// Usage and every flag defined under apps/ but the `others`, with its default.
std::string HelpText(const std::string& usage, const std::vector<std::string>& others = {});

// "circline_compare 0.1.0".
std::string VersionText(const std::string& app);

// What every main stands in: logging; an exception that nobody caught, or a standard output that
// cannot be written, is a sentence and exit code 1. `run` returns the exit code.
int RunGuarded(const char* program, const std::string& app, const std::function<int()>& run);

// All of an app's main but what it does: the above, the command line, --help, --version. `others`:
// flags of other programs that come with what it shares with them; it neither takes nor lists them.
int RunApp(int argc, char** argv, const std::string& app, const std::string& usage, int (*run)(),
           const std::vector<std::string>& others = {});

// The names in the comma-separated list of a flag, all of `known`. Not ok: one line that names it.
Status NamesFromFlag(const std::string& flag, const std::string& list,
                     const std::vector<std::string>& known, std::vector<std::string>* names);

// Says why an app does not go on; returns the exit code for that.
int Refuse(const std::string& app, const Status& status);

// One whole line on stderr.
void SayOnStderr(const std::string& line);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMMON_FLAGS_UTIL_H_
