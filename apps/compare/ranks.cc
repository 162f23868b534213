#include "apps/compare/ranks.h"

#include <cstdlib>
#include <string>

#ifdef CIRCLINE_WITH_MPI
#include <mpi.h>
#endif

namespace circline::apps {

#ifdef CIRCLINE_WITH_MPI
namespace {

void SendText(const std::string& text) {
  MPI_Send(text.data(), static_cast<int>(text.size()), MPI_CHAR, 0, 0, MPI_COMM_WORLD);
}

std::string ReceiveText(int from) {
  MPI_Status status;
  int size = 0;
  MPI_Probe(from, 0, MPI_COMM_WORLD, &status);
  MPI_Get_count(&status, MPI_CHAR, &size);
  std::string text(static_cast<std::size_t>(size), '\0');
  MPI_Recv(text.data(), size, MPI_CHAR, from, 0, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
  return text;
}

}  // namespace

const char* const Ranks::kBuiltWith = " with MPI";

Ranks::Ranks(int* argc, char*** argv) {
  int provided = 0;
  MPI_Init_thread(argc, argv, MPI_THREAD_SERIALIZED, &provided);
  session_ = std::shared_ptr<void>(nullptr, [](void*) { MPI_Finalize(); });
  MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
  MPI_Comm_size(MPI_COMM_WORLD, &count_);
}

std::size_t Ranks::FromFirst(std::size_t value) const {
  unsigned long long shared = value;
  MPI_Bcast(&shared, 1, MPI_UNSIGNED_LONG_LONG, 0, MPI_COMM_WORLD);
  return static_cast<std::size_t>(shared);
}

// In the order in which they are received; an image is well unless its last text says why not.
void Ranks::SendToFirst(const WorkedImage& image) const {
  for (const std::string* text : {&image.lines.results, &image.lines.observations,
                                  &image.lines.timings, &image.read_error, &image.status.message}) {
    SendText(*text);
  }
}

WorkedImage Ranks::Receive(int from) const {
  WorkedImage image;
  for (std::string* text : {&image.lines.results, &image.lines.observations, &image.lines.timings,
                            &image.read_error, &image.status.message}) {
    *text = ReceiveText(from);
  }
  if (!image.status.message.empty()) image.status.code = StatusCode::kFailed;
  return image;
}

void Ranks::Abort(int exit_code) const {
  MPI_Abort(MPI_COMM_WORLD, exit_code);
  std::exit(exit_code);
}

#else

const char* const Ranks::kBuiltWith = "";

Ranks::Ranks(int* /*argc*/, char*** /*argv*/) {}
std::size_t Ranks::FromFirst(std::size_t value) const { return value; }
void Ranks::SendToFirst(const WorkedImage& /*image*/) const {}
WorkedImage Ranks::Receive(int /*from*/) const { return {}; }
void Ranks::Abort(int exit_code) const { std::exit(exit_code); }

#endif

}  // namespace circline::apps
