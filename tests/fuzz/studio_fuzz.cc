// Requests to the studio, over a socket. The first byte picks an address to which the rest is
// posted, or says that the rest is all that is sent; "PORT" there is the port's number.
// clang-format off: httplib.h includes resolv.h, which has a macro _res, a name of Eigen's.
#include "apps/studio/server.h"
// clang-format on

#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>

#include "apps/studio/studio.h"
#include "tests/apps/studio_disc.h"
#include "tests/fuzz/fuzz.h"

namespace circline::fuzz {
namespace {

// libFuzzer's clock interrupts calls.
template <typename Call>
ssize_t Uninterrupted(const Call& call) {
  ssize_t n;
  do {
    n = call();
  } while (n < 0 && errno == EINTR);
  return n;
}

// A studio of one small photo, for the whole run.
class Served {
 public:
  Served() {
    std::string folder = std::filesystem::temp_directory_path() / "circline_fuzz_XXXXXX";
    Expect(mkdtemp(folder.data()) != nullptr, "a folder can be made");
    static const std::string made = folder;
    std::atexit([] { std::filesystem::remove_all(made); });
    cv::imwrite(folder + "/disc.png", apps::DiscPhoto(96, 72));
    apps::PhotoFolder photos;
    Expect(photos.Open(folder).ok(), "the folder can be opened");
    studio_ = std::make_unique<apps::Studio>(apps::StudioOptions(), photos, nullptr);
    Expect(studio_->ReadFiles().ok(), "nothing is there yet");
    server_ = std::make_unique<apps::StudioServer>(studio_.get());
    Expect(server_->Bind(0).ok(), "a port is free");
    std::thread([this] { server_->Serve(); }).detach();
  }

  int port() const { return server_->port(); }

  // What is answered to these bytes until the connection ends. `is_all`: nothing else comes, of
  // which httplib is told; it does not answer then.
  std::string Ask(const std::string& request, bool is_all) const {
    const int connection = socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port()));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const auto* const to = reinterpret_cast<const sockaddr*>(&address);
    Expect(connect(connection, to, sizeof(address)) == 0, "the studio serves");
    // It may end the connection before it has read everything.
    for (std::size_t sent = 0; sent < request.size();) {
      const ssize_t n = Uninterrupted([&] {
        return send(connection, request.data() + sent, request.size() - sent, MSG_NOSIGNAL);
      });
      if (n <= 0) break;
      sent += static_cast<std::size_t>(n);
    }
    if (is_all) shutdown(connection, SHUT_WR);
    std::string answer;
    char buffer[4096];
    const auto receive = [&] { return recv(connection, buffer, sizeof(buffer), 0); };
    for (ssize_t n; (n = Uninterrupted(receive)) > 0;)
      answer.append(buffer, static_cast<std::size_t>(n));
    close(connection);
    return answer;
  }

 private:
  std::unique_ptr<apps::Studio> studio_;
  std::unique_ptr<apps::StudioServer> server_;
};

}  // namespace
}  // namespace circline::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace circline;
  static const auto* const served = new fuzz::Served;
  static constexpr const char* kAddresses[] = {"detect", "estimate", "save", "draft", "export"};
  if (size == 0) return 0;
  std::string rest(reinterpret_cast<const char*>(data) + 1, size - 1);
  if (data[0] >= 'a' + std::size(kAddresses) || data[0] < 'a') {
    const std::string port = "PORT";
    for (std::size_t at; (at = rest.find(port)) != std::string::npos;)
      rest.replace(at, port.size(), std::to_string(served->port()));
    const std::string answer = served->Ask(rest, true);
    fuzz::Expect(answer.empty() || answer.compare(0, 9, "HTTP/1.1 ") == 0, "an answer is HTTP");
    return 0;
  }
  const std::string answer = served->Ask(
      std::string("POST /api/") + kAddresses[data[0] - 'a'] +
          " HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(served->port()) +
          "\r\nConnection: close\r\nContent-Type: application/json\r\nContent-Length: " +
          std::to_string(rest.size()) + "\r\n\r\n" + rest,
      false);
  const std::size_t body = answer.find("\r\n\r\n");
  fuzz::Expect(body != std::string::npos, "a request is answered");
  const auto json = nlohmann::json::parse(answer.substr(body + 4), nullptr, false);
  fuzz::Expect(json.is_object(), "an answer is a JSON object");
  const int status = std::atoi(answer.c_str() + 9);
  fuzz::Expect(status == 200 || (status >= 400 && status < 500), "nothing breaks within");
  fuzz::Expect(status == 200 || json.value("error", "") != "", "what is refused says why");
  return 0;
}
