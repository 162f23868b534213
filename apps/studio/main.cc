// circline_studio: a page in the browser to look at photos and to say what is what in them.
#include <gflags/gflags.h>
#include <pthread.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <iostream>
#include <string>
#include <thread>
#include <vector>

#include "apps/common/flags_util.h"
#include "apps/common/output_file.h"
#include "apps/common/written_files.h"
#include "apps/compare/export.h"
#include "apps/compare/options.h"
#include "apps/studio/server.h"
#include "apps/studio/studio.h"

DECLARE_string(images);
DECLARE_string(output);
DECLARE_string(scene);

DEFINE_int32(port, 8642, "Where on the loopback address the page is; 0 = any port that is free.");

namespace circline::apps {
namespace {

constexpr char kUsage[] =
    "circline_studio: a page in the browser: click circles, lines and axes, see the pose at once.\n"
    "\n"
    "  circline_studio --images=photos [--camera=calib.yml] [--port=8642]\n"
    "\n"
    "Serves a folder of photos on the loopback address until it is interrupted. Writes scene.json "
    "(a scene\n"
    "file for circline_compare), scene.draft.json and export/ into that folder, nothing else. "
    "Flags for the\n"
    "camera, detection and losses are those of circline_compare.\n"
    "Exit code 0: interrupted; 1: the server stopped by itself; 2: unusable flags, folder or port.";

Status CheckFlags() {
  if (FLAGS_images.empty()) return Status::Invalid("--images is missing: a folder with photos");
  return FLAGS_port >= 0 && FLAGS_port <= 65535 ? Status::Ok()
                                                : Status::Invalid("--port must be 0 to 65535");
}

Status ReadOptions(CompareOptions* options) {
  FLAGS_output = FLAGS_images;  // Nothing is written elsewhere.
  const Status status = OptionsFromFlags(options);
  options->solvers = {"joint"};
  options->overlays = false;
  return status.ok() ? CheckOneLoss(*options) : status;
}

Status ReadCamera(const CompareOptions& options, Camera* camera) {
  ImageSet images;
  const Status status = ImagesFromFlags(options.inputs, &images);
  if (status.ok()) *camera = images.At(0).observations.camera;
  return status;
}

// What is read is not written over; photos have other names.
Status CheckKept(const PhotoFolder& folder) {
  std::vector<std::string> written = {Studio::kSceneFile, Studio::kDraftFile};
  for (std::size_t n = 0; n < folder.size(); ++n) {
    const std::string below = std::string(Studio::kExportFolder) + "/" + folder.name(n) + "/";
    for (const ExportFormat& format : ExportFormats()) {
      for (const std::string& file : format.files) written.push_back(below + file);
    }
  }
  return WrittenFiles(folder.path(), written).CheckKept(FilesOfFlags());
}

// Until SIGINT or SIGTERM, for which this thread alone waits.
int ServeUntilSignal(const sigset_t& signals, StudioServer* server) {
  std::atomic<bool> asked{false}, ended{false};
  std::thread serving([&] {
    server->Serve();
    ended = true;
    if (!asked) kill(getpid(), SIGTERM);
  });
  int signal = 0;
  sigwait(&signals, &signal);
  const bool by_itself = ended;
  asked = true;
  while (!ended) {  // It may not have begun yet.
    server->Stop();
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  serving.join();
  if (by_itself) SayOnStderr("circline_studio: the server stopped");
  return by_itself ? kExitUnreadable : kExitOk;
}

int Serve() {
  CompareOptions options;
  PhotoFolder folder;
  Camera camera;
  Status status = CheckFlags();
  if (status.ok()) status = folder.Open(FLAGS_images);
  FolderLock lock;  // Two studios would each write over what the other one saved.
  if (status.ok()) status = lock.Acquire(folder.path());
  if (status.ok()) status = ReadOptions(&options);
  if (status.ok()) status = ReadCamera(options, &camera);
  if (status.ok()) status = CheckKept(folder);
  if (!status.ok()) return Refuse("circline_studio", status);
  const bool guess = options.inputs.guess.wanted;
  options.inputs.guess.wanted = false;  // The studio has a camera for each photo.
  Studio studio(options, folder, guess ? nullptr : &camera);
  status = studio.ReadFiles();
  if (!status.ok()) SayOnStderr("circline_studio: " + status.message);
  StudioServer server(&studio);
  status = server.Bind(FLAGS_port);
  if (!status.ok()) return Refuse("circline_studio", status);
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);  // In all threads to come.
  std::cout << "circline_studio: " << folder.size()
            << " photos at http://127.0.0.1:" << server.port() << "/ (Ctrl-C ends it)" << std::endl;
  return ServeUntilSignal(signals, &server);
}

}  // namespace
}  // namespace circline::apps

int main(int argc, char** argv) {
  // One folder, one solver, one loss.
  return circline::apps::RunApp(
      argc, argv, "circline_studio", circline::apps::kUsage, circline::apps::Serve,
      {"scene", "output", "merge", "resume", "shard", "solvers", "peers", "export_as", "roi",
       "plugin", "save_options", "list_solvers", "circle_radius", "overlays", "threads"});
}
