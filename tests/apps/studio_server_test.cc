// The studio's server as a stranger meets it: who may ask, what may be read and written, and what
// becomes of requests that are malformed, huge or hostile.
// clang-format off: httplib.h includes resolv.h, which has a macro _res, a name of Eigen's.
#include "apps/studio/server.h"
// clang-format on

#include <gtest/gtest.h>
#include <httplib.h>

#include <cstdlib>
#include <filesystem>
#include <iterator>
#include <random>
#include <thread>

#include "apps/studio/studio.h"
#include "tests/apps/studio_disc.h"
#include "tests/apps/test_files.h"

namespace circline::apps {
namespace {

namespace fs = std::filesystem;

class StudioServerTest : public testing::Test {
 protected:
  StudioServerTest() { cv::imwrite(folder_ / "disc.png", DiscPhoto(320, 240)); }
  ~StudioServerTest() override { Stop(); }

  void Start() {
    studio_ = OpenStudio(folder_.path());
    server_ = std::make_unique<StudioServer>(studio_.get());
    ASSERT_TRUE(server_->Bind(0).ok());
    thread_ = std::thread([this] { server_->Serve(); });
    client_ = std::make_unique<httplib::Client>("127.0.0.1", server_->port());
    while (!client_->Get("/")) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  void Stop() {
    if (!thread_.joinable()) return;
    client_.reset();
    server_->Stop();
    thread_.join();
  }

  // The answer; `status` receives its status, 0 where the connection was cut.
  Json Post(const std::string& address, const std::string& body, int* status) {
    const httplib::Result result = client_->Post(address, body, "application/json");
    *status = result ? result->status : 0;
    return result ? Json::parse(result->body, nullptr, false) : Json();
  }
  Json Ask(const std::string& address, const Json& request, int expected = 200) {
    int status = 0;
    Json answer = Post(address, request.dump(), &status);
    EXPECT_EQ(status, expected) << answer;
    if (expected != 200) {
      EXPECT_TRUE(answer.contains("error")) << answer;
    }
    return answer;
  }
  Json DiscScene() { return SceneOfDisc(Ask("/api/detect", {{"image", 0}})); }
  bool IsAlive() {
    const httplib::Result result = client_->Get("/api/images");
    return result && result->status == 200;
  }

  TestFolder folder_;
  std::unique_ptr<Studio> studio_;
  std::unique_ptr<StudioServer> server_;
  std::unique_ptr<httplib::Client> client_;
  std::thread thread_;
};

TEST_F(StudioServerTest, DetectsEstimatesAndSavesAScene) {
  Start();
  const Json scene = DiscScene();
  const Json estimate = Ask("/api/estimate", {{"image", "disc.png"}, {"scene", scene}});
  EXPECT_EQ(estimate["status"], "ok");
  ASSERT_GE(estimate["hypotheses"].size(), 2U);  // For each focal length that it may be.
  EXPECT_EQ(estimate["hypotheses"][0]["rotation"].size(), 9U);
  EXPECT_EQ(estimate["drawings"][0]["circles"][0]["id"], scene["circles"][0]["id"]);
  const Json saved = Ask("/api/save", {{"image", 0}, {"scene", scene}});
  std::vector<SceneImage> images;
  const Status status = ReadScene(saved["file"].get<std::string>(), {}, &images);
  ASSERT_TRUE(status.ok()) << status.message;
  ASSERT_EQ(images.size(), 1U);
  EXPECT_EQ(images[0].observations.circles[0].radius, 2.0);
  // A guessed camera is written with how little it is known.
  EXPECT_GE(images[0].camera_sigma.log_focal.value_or(0.0), 0.25);
}

TEST_F(StudioServerTest, KeepsDraftAndSceneOverARestart) {
  Start();
  const Json state = {{"scene", DiscScene()}, {"hypothesis", 1}};
  Ask("/api/draft", {{"image", 0}, {"state", state}});
  Ask("/api/save", {{"image", 0}, {"scene", state["scene"]}});
  Stop();
  Start();
  const httplib::Result result = client_->Get("/api/session/0");
  ASSERT_TRUE(result);
  const Json session = Json::parse(result->body);
  EXPECT_EQ(session["draft"], state);
  EXPECT_EQ(session["saved"]["circles"], state["scene"]["circles"]);
}

TEST_F(StudioServerTest, DoesNotWriteOverASceneThatItCannotRead) {
  folder_.Write("scene.json", "{ \"pictures\": [] }");
  Start();
  const Json answer = Ask("/api/save", {{"image", 0}, {"scene", Json::object()}}, 409);
  EXPECT_CONTAINS(answer["error"].get<std::string>(), "pictures");
  EXPECT_EQ(ReadAll(folder_ / "scene.json"), "{ \"pictures\": [] }");
}

TEST_F(StudioServerTest, AnswersOnlyItsOwnPage) {
  Start();
  const std::string port = std::to_string(server_->port());
  const auto status = [&](const httplib::Headers& headers) {
    const httplib::Result result = client_->Get("/api/images", headers);
    return result ? result->status : 0;
  };
  EXPECT_EQ(status({{"Host", "localhost:" + port}}), 200);
  EXPECT_EQ(status({{"Host", "localhost"}}), 403);
  EXPECT_EQ(status({{"Host", "example.org"}}), 403);
  EXPECT_EQ(status({{"Host", "example.org:" + port}}), 403);
  EXPECT_EQ(status({{"Host", "127.0.0.1.example.org:" + port}}), 403);
  EXPECT_EQ(status({{"Origin", "http://127.0.0.1:" + port}}), 200);
  for (const std::string origin :
       {"http://example.org", "null", "https://127.0.0.1", "file://", "http://127.0.0.1:1",
        "http://127.0.0.1", "http://localhost.example.org"}) {
    EXPECT_EQ(status({{"Origin", origin}}), 403) << origin;
  }
  EXPECT_FALSE(fs::exists(folder_ / "scene.json"));
}

TEST_F(StudioServerTest, RefusesWhatLeadsOutOfTheFolder) {
  const TestFolder outside;
  cv::imwrite(outside / "secret.png", DiscPhoto(64, 64));
  fs::create_symlink(outside / "secret.png", folder_ / "link.png");
  fs::create_symlink(outside / "scene.json", folder_ / "scene.json");
  fs::create_directory_symlink(outside.path(), folder_ / "export");
  Start();
  const httplib::Result link = client_->Get("/api/image/1");
  ASSERT_TRUE(link);
  EXPECT_EQ(link->status, 403);
  EXPECT_CONTAINS(link->body, "leads out");
  const Json scene = DiscScene();
  Ask("/api/save", {{"image", 0}, {"scene", scene}}, 409);
  Ask("/api/export", {{"image", 0}, {"scene", scene}, {"format", "gltf"}}, 409);
  for (const std::string address :
       {"/../secret.png", "/api/image/../../secret.png", "/api/image/%2e%2e%2fsecret.png",
        "/etc/passwd", "/api/image/-1", "/api/image/99999999999999999999", "/api/image/7"}) {
    const httplib::Result result = client_->Get(address);
    ASSERT_TRUE(result) << address;
    EXPECT_EQ(result->status, 404) << address;
  }
  Json away = scene;
  away["file"] = "../secret.png";
  Ask("/api/estimate", {{"image", 0}, {"scene", away}}, 400);
  Ask("/api/detect", {{"image", "../secret.png"}}, 404);
  EXPECT_EQ(std::distance(fs::directory_iterator(outside.path()), fs::directory_iterator()), 1);
}

TEST_F(StudioServerTest, SaysWhatIsWrongWithAPhoto) {
  folder_.Write("a_broken.jpg", "no photo");
  folder_.Write("b_empty.png", "");
  Start();
  for (const char* name : {"a_broken.jpg", "b_empty.png"}) {
    const Json answer = Ask("/api/detect", {{"image", name}}, 422);
    EXPECT_CONTAINS(answer["error"].get<std::string>(), name);
  }
  Ask("/api/detect", {{"image", "disc.png"}});
}

TEST_F(StudioServerTest, SurvivesMalformedAndHugeRequests) {
  Start();
  const std::string image = "{\"image\":0,\"scene\":";
  const std::vector<std::string> requests = {"",
                                             "{",
                                             "[]",
                                             "null",
                                             "\"",
                                             "{\"image\":-1}",
                                             "{\"image\":0.5}",
                                             "{\"image\":{}}",
                                             "{\"image\":18446744073709551615}",
                                             "\xff\xfe",
                                             std::string("{\0}", 3),
                                             std::string(100000, '['),
                                             image + std::string(100000, '{') + "}"};
  const std::vector<std::string> scenes = {
      "{\"circles\":[{\"id\":\"c\",\"contour\":[1e999,1]}]}}",
      "{\"circles\":[{\"id\":\"c\",\"contour\":\"no\"}]}}",
      "{\"circles\":[{\"id\":\"c\",\"contour\":[1,2,3,4]}]}}",
      "{\"circles\":[{\"id\":\"c\",\"roi\":[-1e9,0,1,1]}]}}",
      "{\"pencils\":[{\"id\":\"\\\"\\\\\\n\",\"segments\":[1,2,3,4]}]}}",
      "{\"pencils\":[{\"id\":\"x\",\"segments\":[]}]}}",
      "[]}",
      "7}"};
  const std::vector<std::string> odd = {
      "{\"circles\":[{\"id\":\"c\",\"contour\":[1,2,3,4,5,6,7,8,9,10]}]}}",
      "{\"circles\":[{\"id\":\"c\",\"roi\":[-1e5,-1e5,1e6,1e6]}]}}",
      "{},\"hypothesis\":-1}",
      "{},\"hypothesis\":1e300}",
      "{},\"measure\":[{\"kind\":\"length\",\"points\":[1]}]}",
      "{},\"measure\":{\"kind\":7}}"};
  const auto expect = [&](const std::string& address, const std::string& body, bool may_do) {
    int status = 0;
    const Json answer = Post(address, body, &status);
    EXPECT_TRUE((may_do && status == 200) ||
                (status >= 400 && status < 500 && answer.contains("error")))
        << address << " " << body.substr(0, 80) << " " << status << " " << answer;
  };
  for (const char* address : {"/api/estimate", "/api/save", "/api/export"}) {
    for (const std::string& scene : scenes) expect(address, image + scene, false);
    for (const std::string& scene : odd) expect(address, image + scene, true);
  }
  for (const char* address :
       {"/api/detect", "/api/estimate", "/api/save", "/api/draft", "/api/export"}) {
    for (const std::string& body : requests) expect(address, body, false);
  }
  int status = 0;
  Post("/api/draft", "{\"image\":0,\"state\":{\"a\":\"" + std::string(9 << 20, 'x') + "\"}}",
       &status);
  EXPECT_TRUE(status == 413 || status == 0) << status;
  // The same without a stated length.
  std::size_t sent = 0;
  const std::string piece(1 << 16, ' ');
  client_->Post(
      "/api/draft",
      [&](std::size_t, httplib::DataSink& sink) {
        sink.write(piece.data(), piece.size());
        sent += piece.size();
        if (sent > (std::size_t{64} << 20)) sink.done();
        return true;
      },
      "application/json");
  EXPECT_LT(sent, std::size_t{32} << 20);
  EXPECT_TRUE(IsAlive());
}

TEST_F(StudioServerTest, RefusesAHypothesisThatIsNotThere) {
  Start();
  const Json scene = DiscScene();
  const std::size_t count =
      Ask("/api/estimate", {{"image", 0}, {"scene", scene}})["hypotheses"].size();
  ASSERT_GE(count, 2U);
  for (const char* address : {"/api/estimate", "/api/export"}) {
    Json request = {{"image", 0}, {"scene", scene}, {"format", "tum"}, {"hypothesis", count - 1}};
    Ask(address, request);
    for (const Json& none : {Json(count), Json(99), Json(-1), Json("x"), Json(0.5), Json()}) {
      request["hypothesis"] = none;
      EXPECT_CONTAINS(Ask(address, request, 400)["error"].get<std::string>(),
                      "'hypothesis' must be a whole number, 0 to ");
    }
  }
}

TEST_F(StudioServerTest, NamesWhatIsMissing) {
  Start();
  const auto error = [&](const std::string& address, const Json& request) {
    return Ask(address, request, 400)["error"].get<std::string>();
  };
  EXPECT_EQ(error("/api/draft", {{"image", 0}}), "'state' is missing");
  EXPECT_EQ(error("/api/save", {{"image", 0}}), "'scene' is missing");
  EXPECT_EQ(error("/api/export", {{"image", 0}, {"scene", Json::object()}}), "'format' is missing");
  EXPECT_EQ(
      error("/api/export", {{"image", 0}, {"scene", DiscScene()}, {"format", 7}}).find("json"),
      std::string::npos);
}

TEST_F(StudioServerTest, GivesOneRangeOfAPhoto) {
  Start();
  const auto get = [&](const std::string& ranges) {
    return client_->Get("/api/image/0", {{"Range", "bytes=" + ranges}});
  };
  const auto one = get("0-99");
  ASSERT_TRUE(one);
  EXPECT_EQ(one->status, 206);
  EXPECT_EQ(one->body.size(), 100U);
  const auto many = get("0-99,0-99");
  ASSERT_TRUE(many);
  EXPECT_EQ(many->status, 416);
}

// Requests with bytes changed at random.
TEST_F(StudioServerTest, SurvivesFuzzedRequests) {
  Start();
  const char* const given = std::getenv("CIRCLINE_FUZZ_REQUESTS");
  const int count = given != nullptr ? std::atoi(given) : 300;
  Json scene = DiscScene();
  // Fewer points, so that most changes fall on what is between them.
  Json contour = Json::array();
  for (std::size_t i = 0; i + 1 < scene["circles"][0]["contour"].size(); i += 40) {
    contour.push_back(scene["circles"][0]["contour"][i]);
    contour.push_back(scene["circles"][0]["contour"][i + 1]);
  }
  scene["circles"][0]["contour"] = contour;
  scene["pencils"] = {{{"id", "x"}, {"segments", {10, 10, 200, 12}}, {"direction", "x"}}};
  scene["frame"] = {{"x_axis", {160, 120, 200, 120}}, {"plane", "p"}};
  scene["known"] = {{"length", {{{"points", {10, 10, 90, 12}}, {"value", 3.0}}}}};
  const std::string whole =
      Json({{"image", 0}, {"scene", scene}, {"hypothesis", 0}, {"measure", Json::array()}}).dump();
  std::mt19937 random(7);
  const auto below = [&](std::size_t n) { return random() % n; };
  for (int i = 0; i < count; ++i) {
    std::string body = whole;
    for (std::size_t k = 0; k < 1 + below(4); ++k) {
      const std::size_t at = below(body.size());
      const std::size_t from = below(body.size()), length = below(20);
      if (below(2) == 0)
        body[at] = "{}[]\":,-9e. \\"[below(13)];
      else if (below(2) == 0)
        body.erase(at, length);
      else
        body.insert(at, body.substr(from, length));
    }
    int status = 0;
    const Json answer = Post("/api/estimate", body, &status);
    ASSERT_TRUE(status == 200 || (status >= 400 && status < 500)) << status << " " << body;
  }
  EXPECT_TRUE(IsAlive());
}

TEST_F(StudioServerTest, TwoCannotHaveOnePort) {
  Start();
  StudioServer second(studio_.get());
  const Status status = second.Bind(server_->port());
  EXPECT_FALSE(status.ok());
  EXPECT_CONTAINS(status.message, "another program uses it");
}

TEST(StudioServer, KnowsTheLoopbackAddress) {
  for (const char* host : {"127.0.0.1", "localhost", "[::1]", "127.0.0.1:80", "localhost:80"})
    EXPECT_TRUE(IsLoopback(host, 80)) << host;
  for (const char* host : {"", "127.0.0.1:81", "127.0.0.2", "localhost.org", "localhost:80:80",
                           "LOCALHOST.", "0.0.0.0", "127.0.0.1:080"}) {
    EXPECT_FALSE(IsLoopback(host, 80)) << host;
  }
  EXPECT_TRUE(IsLoopback("localhost:8642", 8642));
  EXPECT_FALSE(IsLoopback("localhost", 8642));  // That is port 80, another program's.
}

}  // namespace
}  // namespace circline::apps
