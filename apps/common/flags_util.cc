#include "apps/common/flags_util.h"

#include <fcntl.h>
#include <gflags/gflags.h>
#include <glog/logging.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <iterator>
#include <new>
#include <opencv2/core/utility.hpp>
#include <opencv2/core/utils/logger.hpp>
#include <sstream>
#include <vector>

#include "apps/common/storage_node.h"
#include "apps/common/text.h"
#include "circline/version.h"

namespace circline::apps {
namespace {

constexpr int kMaxFlagFileDepth = 8;

bool IsAppFlag(const gflags::CommandLineFlagInfo& flag) {
  return flag.filename.find("apps/") != std::string::npos;
}

// As the flags themselves, of the process.
std::vector<std::string>& FlagFilesRead() {
  static auto* const files = new std::vector<std::string>;
  return *files;
}

std::vector<gflags::CommandLineFlagInfo> AppFlags() {
  std::vector<gflags::CommandLineFlagInfo> all, flags;
  gflags::GetAllFlags(&all);
  std::copy_if(all.begin(), all.end(), std::back_inserter(flags), IsAppFlag);
  return flags;
}

// As a person writes it: gflags gives a number all its digits, 0.29999999999999999.
std::string DefaultText(const gflags::CommandLineFlagInfo& flag) {
  if (flag.type == "string") return "\"" + flag.default_value + "\"";
  double value = 0.0, read_back = 0.0;
  if (flag.type != "double" || !ParseDouble(flag.default_value, &value)) return flag.default_value;
  const std::string plain = FormatPlain(value);
  return ParseDouble(plain, &read_back) && read_back == value ? plain : flag.default_value;
}

Status UnknownFlag(const std::string& name) {
  std::vector<std::string> names = {"help", "version", "flagfile"};
  for (const auto& flag : AppFlags()) names.push_back(flag.name);
  return Status::Invalid("unknown flag --" + name + DidYouMean(name, names));
}

Status SetFlag(const std::string& name, const std::string& value, const std::string& type) {
  if (!gflags::SetCommandLineOption(name.c_str(), value.c_str()).empty()) return Status::Ok();
  const std::string expected = type == "double"   ? "a number"
                               : type == "bool"   ? "true or false"
                               : type == "uint64" ? "a whole number, 0 or more"
                                                  : "a whole number";
  return Status::Invalid("--" + name + "=" + value + ": must be " + expected);
}

class Parser {
 public:
  explicit Parser(CommandLine* command_line) : command_line_(command_line) {}

  Status Parse(const std::vector<std::string>& arguments, int depth) {
    for (std::size_t i = 0; i < arguments.size(); ++i) {
      const Status status = ParseOne(arguments, depth, &i);
      if (!status.ok()) return status;
    }
    return Status::Ok();
  }

 private:
  // Handles arguments[*i], and the next one where that is its value.
  Status ParseOne(const std::vector<std::string>& arguments, int depth, std::size_t* i) {
    const std::string& argument = arguments[*i];
    if (argument.size() < 2 || argument[0] != '-' || argument == "--") {
      return Status::Invalid("unexpected argument '" + argument + "'; flags begin with --");
    }
    const std::string text = argument.substr(argument[1] == '-' ? 2 : 1);
    const std::size_t equals = text.find('=');
    std::string name = text.substr(0, equals);
    std::replace(name.begin(), name.end(), '-', '_');
    if (IsHelp(name)) return Status::Ok();
    // These would have gflags read flags elsewhere, and end the process where it does not like
    // them.
    if (name == "fromenv" || name == "tryfromenv") return UnknownFlag(name);
    gflags::CommandLineFlagInfo info;
    const bool known = gflags::GetCommandLineFlagInfo(name.c_str(), &info);
    if (equals != std::string::npos) {
      return known ? Set(name, text.substr(equals + 1), info.type, depth) : UnknownFlag(name);
    }
    if (known && info.type == "bool") return SetFlag(name, "true", info.type);
    if (known && *i + 1 < arguments.size()) return Set(name, arguments[++*i], info.type, depth);
    if (known) return Status::Invalid("--" + name + ": its value is missing");
    if (name.compare(0, 2, "no") == 0 &&
        gflags::GetCommandLineFlagInfo(name.substr(2).c_str(), &info) && info.type == "bool") {
      return SetFlag(name.substr(2), "false", info.type);
    }
    return UnknownFlag(name);
  }

  bool IsHelp(const std::string& name) {
    if (name == "help" || name == "h" || name == "helpfull" || name == "helpshort") {
      command_line_->help = true;
      return true;
    }
    if (name == "version") command_line_->version = true;
    return name == "version";
  }

  Status Set(const std::string& name, const std::string& value, const std::string& type,
             int depth) {
    return name == "flagfile" ? ParseFile(value, depth) : SetFlag(name, value, type);
  }

  Status ParseFile(const std::string& path, int depth) {
    if (depth >= kMaxFlagFileDepth) {
      return Status::Invalid("--flagfile=" + path + ": flag files name one another");
    }
    FlagFilesRead().push_back(path);
    std::string text;
    Status status = ReadTextFile(path, &text);
    if (!status.ok()) return Status::Invalid("--flagfile: " + status.message);
    std::vector<std::string> arguments;
    for (const std::string& line : SplitList(text, '\n')) {
      if (!line.empty() && line[0] != '#') arguments.push_back(line);
    }
    status = Parse(arguments, depth + 1);
    return status.ok() ? status : Status::Invalid(path + ": " + status.message);
  }

  CommandLine* command_line_;
};

// OpenCV prints each error before it throws; what is thrown reaches the user as one line of ours.
int IgnoreOpenCvError(int, const char*, const char*, const char*, int, void*) { return 0; }

// A file that is opened must not get the number of a stream that was closed: errors would land in
// it. A closed standard output stays one that cannot be written.
bool OccupyStandardStreams() {
  for (int descriptor = 0; descriptor <= 2; ++descriptor) {
    const int mode = descriptor == STDOUT_FILENO ? O_RDONLY : O_RDWR;
    if (fcntl(descriptor, F_GETFD) == -1 && open("/dev/null", mode) != descriptor) return false;
  }
  return true;
}

}  // namespace

Status ParseCommandLine(int argc, const char* const* argv, CommandLine* command_line) {
  return Parser(command_line).Parse({argv + std::min(argc, 1), argv + argc}, 0);
}

const std::vector<std::string>& FlagFiles() { return FlagFilesRead(); }

std::string HelpText(const std::string& usage, const std::vector<std::string>& others) {
  std::ostringstream text;
  text << usage << "\n\nFlags:\n";
  for (const auto& flag : AppFlags()) {
    if (std::find(others.begin(), others.end(), flag.name) != others.end()) continue;
    text << "  --" << flag.name << " (" << DefaultText(flag) << ")\n      " << flag.description
         << "\n";
  }
  text << "  --flagfile\n      Reads flags from a file, one a line.\n"
       << "  --help, --version\n      Say this, or the version, and do nothing else.\n";
  return text.str();
}

std::string VersionText(const std::string& app) { return app + " " CIRCLINE_VERSION_STRING; }

void SayOnStderr(const std::string& line) {
  std::fputs((WithoutControls(line) + "\n").c_str(), stderr);
}

Status NamesFromFlag(const std::string& flag, const std::string& list,
                     const std::vector<std::string>& known, std::vector<std::string>* names) {
  names->clear();
  if (list.empty()) return Status::Ok();
  for (const std::string& name : SplitList(list)) {
    if (std::find(known.begin(), known.end(), name) == known.end())
      return Status::Invalid("--" + flag + ": " + NotOneOf(name, known));
    names->push_back(name);
  }
  return Status::Ok();
}

int Refuse(const std::string& app, const Status& status) {
  SayOnStderr(app + ": " + status.message);
  return status.code == StatusCode::kInvalidArgument ? kExitUsage : kExitUnreadable;
}

namespace {

// To stderr (--minloglevel=0 shows it; people are told by SayOnStderr); OpenCV's own messages
// become ours.
void InitAppLogging(const char* app) {
  FLAGS_logtostderr = true;
  FLAGS_log_prefix = false;
  FLAGS_minloglevel = google::GLOG_FATAL;  // What goes wrong is in the results.
  google::InitGoogleLogging(app);
  cv::redirectError(IgnoreOpenCvError);
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
}

// Not ok where one of another program's flags was given: `app` does not have it.
Status CheckNotGiven(const std::string& app, const std::vector<std::string>& flags) {
  for (const std::string& name : flags) {
    gflags::CommandLineFlagInfo info;
    if (gflags::GetCommandLineFlagInfo(name.c_str(), &info) &&
        info.current_value != info.default_value)
      return Status::Invalid("--" + name + ": is not a flag of " + app);
  }
  return Status::Ok();
}

int ParseAndRun(int argc, char** argv, const std::string& app, const std::string& usage,
                int (*run)(), const std::vector<std::string>& others) {
  CommandLine command_line;
  const Status status = ParseCommandLine(argc, argv, &command_line);
  if (!status.ok()) return Refuse(app, status);
  if (command_line.help) {
    std::cout << HelpText(usage, others);
  } else if (command_line.version) {
    std::cout << VersionText(app) << "\n";
  } else {
    const Status own = CheckNotGiven(app, others);
    return own.ok() ? run() : Refuse(app, own);
  }
  return kExitOk;
}

// Where an exception cannot be passed on: nlohmann's JSON allocates in its destructor.
[[noreturn]] void EndWithoutMemory() noexcept {
  try {
    if (std::current_exception()) throw;
  } catch (const std::bad_alloc&) {
    std::fputs("circline: stopped: not enough memory\n", stderr);
    std::_Exit(kExitUnreadable);
  } catch (...) {
  }
  std::abort();
}

}  // namespace

int RunGuarded(const char* program, const std::string& app, const std::function<int()>& run) {
  if (!OccupyStandardStreams()) return kExitUnreadable;
  InitAppLogging(program);
  std::set_terminate(EndWithoutMemory);
  int code = kExitUnreadable;
  try {
    code = run();
  } catch (const std::exception& error) {  // Such as no memory left.
    SayOnStderr(app + ": stopped: " + Words(error));
  }
  std::cout.flush();
  if (std::cout && std::fflush(stdout) == 0) return code;
  SayOnStderr(app + ": standard output cannot be written");
  return std::max(code, kExitUnreadable);
}

int RunApp(int argc, char** argv, const std::string& app, const std::string& usage, int (*run)(),
           const std::vector<std::string>& others) {
  return RunGuarded(argv[0], app, [&] { return ParseAndRun(argc, argv, app, usage, run, others); });
}

}  // namespace circline::apps
