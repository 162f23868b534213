#include "apps/studio/server.h"

#include <httplib.h>
#include <sys/socket.h>

#include <algorithm>
#include <chrono>
#include <functional>

#include "apps/common/document.h"
#include "apps/common/text.h"
#include "apps/studio/page.h"

namespace circline::apps {
namespace {

using httplib::Request;
using httplib::Response;

// A scene of a few hundred contours.
constexpr std::size_t kMaxRequestBytes = std::size_t{8} << 20;
const DocumentLimits kLimits = {16, 100'000};

// With a parameter, as httplib compresses a plain application/json, which takes it 30 ms.
constexpr char kJsonType[] = "application/json; charset=utf-8";

void SetJson(const Json& json, Response* response) {
  response->set_content(JsonText(json), kJsonType);
}

void SetError(int status, const std::string& sentence, Response* response) {
  response->status = status;
  SetJson({{"error", sentence}}, response);
}

void Guarded(Response* response, const std::function<void()>& work) {
  try {
    work();
  } catch (const RequestError& error) {
    SetError(error.status(), error.what(), response);
  } catch (const nlohmann::json::exception&) {  // What it says is of its own inside.
    SetError(400, "the request is not as the studio takes it: a value has another type", response);
  } catch (const std::exception& error) {  // Such as no memory left.
    SetError(500, std::string("the studio could not do it: ") + error.what(), response);
  }
}

// The whole body, however it is sent; no more than so many bytes are kept of it.
Json ReadBody(const httplib::ContentReader& reader) {
  std::string body;
  const bool whole = reader([&body](const char* data, std::size_t size) {
    if (body.size() + size > kMaxRequestBytes) return false;
    body.append(data, size);
    return true;
  });
  if (!whole) throw RequestError(413, "the request is larger than 8 MB, or was cut off");
  const std::size_t begin = std::min(body.find_first_not_of(" \t\r\n"), body.size());
  Json request;
  Status status = Status::Invalid("it must be a JSON object");  // Not another kind of document.
  if (body.compare(begin, 1, "{") == 0) status = ParseDocument(body, &request, kLimits);
  if (!status.ok()) throw RequestError(400, "the request: " + status.message);
  return request;
}

const char* UsualSentence(int status) {
  switch (status) {
    case 404:
      return "there is nothing at this address";
    case 413:
      return "the request is larger than 8 MB";
    case 414:
      return "the address is too long";
    default:
      return "the request could not be read";
  }
}

// Not httplib's own, which let two programs have one port.
void ReuseAddress(int socket) {
  const int yes = 1;
  setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof(yes));
}

}  // namespace

bool IsLoopback(const std::string& host, int port) {
  constexpr int kHttpPort = 80;  // The one that browsers do not write.
  for (const char* name : {"127.0.0.1", "localhost", "[::1]"}) {
    if (host == name + (":" + std::to_string(port))) return true;
    if (host == name && port == kHttpPort) return true;
  }
  return false;
}

class StudioServer::Routes {
 public:
  Routes(Studio* studio, const int* port) : studio_(studio), port_(port) {
    Protect();
    ServePage();
    ServeStudio();
  }
  httplib::Server& server() { return server_; }

 private:
  using Endpoint = Json (Studio::*)(const Json&);

  // Other pages of the browser, and names that somebody's name server points at this machine, are
  // turned away before anything is read.
  void Protect() {
    server_.set_socket_options(ReuseAddress);
    server_.set_tcp_nodelay(true);  // Else an answer waits 40 ms for its own acknowledgement.
    server_.set_keep_alive_max_count(10000);  // A handle that is dragged asks many times a second.
    server_.set_payload_max_length(kMaxRequestBytes);
    server_.set_default_headers(
        {{"Cache-Control", "no-store"},
         {"Content-Security-Policy",
          "default-src 'self'; img-src 'self' blob:; object-src 'none'; base-uri 'none'; "
          "frame-ancestors 'none'"},
         {"Cross-Origin-Resource-Policy", "same-origin"},
         {"Referrer-Policy", "no-referrer"},
         {"X-Content-Type-Options", "nosniff"}});
    server_.set_pre_routing_handler([this](const Request& request, Response& response) {
      if (request.ranges.size() > 1) {  // A small request for as many copies of a photo.
        SetError(416, "one range at a time", &response);
        response.set_header("Connection", "close");
        return httplib::Server::HandlerResponse::Handled;
      }
      if (IsAllowed(request)) return httplib::Server::HandlerResponse::Unhandled;
      SetError(403, "only pages of this studio, on this machine, may ask", &response);
      response.set_header("Connection", "close");
      return httplib::Server::HandlerResponse::Handled;
    });
    server_.set_error_handler([](const Request& /*request*/, Response& response) {
      if (response.body.empty())
        SetError(response.status, UsualSentence(response.status), &response);
    });
  }

  bool IsAllowed(const Request& request) const {
    if (request.get_header_value_count("Host") != 1 ||
        !IsLoopback(request.get_header_value("Host"), *port_)) {
      return false;
    }
    if (!request.has_header("Origin")) return true;  // Not sent with a page's own GET.
    const std::string origin = request.get_header_value("Origin"), http = "http://";
    return request.get_header_value_count("Origin") == 1 &&
           origin.compare(0, http.size(), http) == 0 &&
           IsLoopback(origin.substr(http.size()), *port_);
  }

  void ServePage() {
    for (const PageFile& file : PageFiles()) {
      const std::string address = file.name == "index.html" ? "/" : "/" + file.name;
      server_.Get(address, [&file](const Request&, Response& response) {
        response.set_content(file.content, file.type);
      });
    }
  }

  void ServeStudio() {
    server_.Get("/api/images", [this](const Request&, Response& response) {
      Guarded(&response, [&] { SetJson(studio_->Images(), &response); });
    });
    server_.Get("/api/image/([0-9]{1,7})", [this](const Request& request, Response& response) {
      Guarded(&response, [&] {
        ShownPhoto photo = studio_->Photo(std::stoul(request.matches[1]));
        response.set_header("X-Photo-Size",
                            std::to_string(photo.width) + "x" + std::to_string(photo.height));
        response.set_content(photo.bytes, photo.type);
      });
    });
    server_.Get("/api/session/([0-9]{1,7})", [this](const Request& request, Response& response) {
      Guarded(&response,
              [&] { SetJson(studio_->Session(std::stoul(request.matches[1])), &response); });
    });
    Post("/api/detect", &Studio::Detect);
    Post("/api/estimate", &Studio::Estimate);
    Post("/api/save", &Studio::Save);
    Post("/api/draft", &Studio::Draft);
    Post("/api/export", &Studio::Export);
  }

  void Post(const char* address, Endpoint endpoint) {
    server_.Post(address, [this, endpoint](const Request&, Response& response,
                                           const httplib::ContentReader& reader) {
      Guarded(&response, [&] {
        const auto started = std::chrono::steady_clock::now();
        SetJson((studio_->*endpoint)(ReadBody(reader)), &response);
        const std::chrono::duration<double, std::milli> took =
            std::chrono::steady_clock::now() - started;
        // Of the answer's milliseconds, those that are not the browser's.
        response.set_header("Server-Timing", "work;dur=" + FormatFixed(took.count(), 2));
      });
    });
  }

  httplib::Server server_;
  Studio* studio_;
  const int* port_;
};

StudioServer::StudioServer(Studio* studio) : routes_(std::make_unique<Routes>(studio, &port_)) {}

StudioServer::~StudioServer() = default;

Status StudioServer::Bind(int port) {
  constexpr char kAddress[] = "127.0.0.1";
  port_ = port == 0 ? routes_->server().bind_to_any_port(kAddress) : port;
  if (port_ > 0 && (port == 0 || routes_->server().bind_to_port(kAddress, port)))
    return Status::Ok();
  return Status::Invalid("--port=" + std::to_string(port) +
                         ": cannot be had; another program uses it (--port=0 takes a free one)");
}

void StudioServer::Serve() { routes_->server().listen_after_bind(); }

void StudioServer::Stop() { routes_->server().stop(); }

}  // namespace circline::apps
