// HTTP on the loopback address: who may ask, how much, and what an error looks like.
#ifndef CIRCLINE_APPS_STUDIO_SERVER_H_
#define CIRCLINE_APPS_STUDIO_SERVER_H_

#include <memory>

#include "apps/studio/studio.h"
#include "circline/estimators/status.h"

namespace circline::apps {

// Whether a Host or the part of an Origin behind "http://" names this machine itself, at this port
// (80 may go without saying): 127.0.0.1, localhost, [::1].
bool IsLoopback(const std::string& host, int port);

class StudioServer {
 public:
  explicit StudioServer(Studio* studio);
  ~StudioServer();
  StudioServer(const StudioServer&) = delete;
  StudioServer& operator=(const StudioServer&) = delete;

  // Port 0: any that is free. Not ok: another program has it.
  Status Bind(int port);
  int port() const { return port_; }
  void Serve();  // Until Stop, or until the system ends it.
  void Stop();

 private:
  class Routes;
  std::unique_ptr<Routes> routes_;
  int port_ = 0;
};

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_STUDIO_SERVER_H_
