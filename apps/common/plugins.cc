#include "apps/common/plugins.h"

#include <dlfcn.h>

#include <map>
#include <string>

#include "apps/common/text.h"
#include "circline/estimators/solver_plugin.h"
#include "circline/version.h"

namespace circline::apps {
namespace {

// By the names they were given; the system, too, keeps libraries by the program, not by the call.
std::map<std::string, PluginAddSolversFunction*>& Loaded() {
  static std::map<std::string, PluginAddSolversFunction*> loaded;
  return loaded;
}

// Before 1.0 every minor version may change the interface.
std::string Interface(const std::string& version) {
  return version.substr(0, version.find_last_of('.'));
}

Status LoadPlugin(const std::string& file) {
  // A plain name would be looked for in the system's folders.
  const std::string path = file.find('/') == std::string::npos ? "./" + file : file;
  void* library = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) return Status::Invalid(std::string("cannot be loaded: ") + dlerror());
  const auto version =
      reinterpret_cast<PluginVersionFunction*>(dlsym(library, kPluginVersionSymbol));
  const auto add_solvers =
      reinterpret_cast<PluginAddSolversFunction*>(dlsym(library, kPluginAddSolversSymbol));
  if (version == nullptr || add_solvers == nullptr)
    return Status::Invalid(file + " is no plug-in of circline: it lacks CIRCLINE_SOLVER_PLUGIN");
  if (Interface(version()) != Interface(CIRCLINE_VERSION_STRING)) {
    return Status::Invalid(file + " was built for circline " + version() + ", this is " +
                           CIRCLINE_VERSION_STRING);
  }
  Loaded()[file] = add_solvers;
  return Status::Ok();
}

}  // namespace

Status LoadPlugins(const std::string& files) {
  if (files.empty()) return Status::Ok();
  for (const std::string& file : SplitList(files)) {
    if (Loaded().count(file) > 0) continue;
    const Status status = LoadPlugin(file);
    if (!status.ok()) return Status::Invalid("--plugin: " + status.message);
  }
  return Status::Ok();
}

void AddPluginSolvers(const ClosedFormOptions& options, SolverRegistry* registry) {
  for (const auto& [file, add_solvers] : Loaded()) add_solvers(&options, registry);
}

}  // namespace circline::apps
