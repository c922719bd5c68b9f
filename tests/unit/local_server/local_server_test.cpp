// Real requests over the loopback, good and hostile.
#include "local_server/local_server.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <httplib.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "base/errors.h"

namespace mouthpiece {
namespace {

/// A server with a few routes, answering in a thread of its own for as long as a test runs.
class Served {
 public:
  explicit Served(LocalServerOptions options = small()) : server_(options) {
    server_.get("/", [](const LocalRequest&) {
      return LocalReply{200, "text/html", "<p>page</p>", "default-src 'self'", ""};
    });
    server_.get("/echo", [](const LocalRequest& request) {
      return LocalReply{200, "text/plain", request.parameter("word") + "|" + request.parameter("token"), {}, {}};
    });
    server_.get("/refuse", [](const LocalRequest&) -> LocalReply { throw InputError("a.wav", "", "is \n no sound"); });
    server_.get("/break", [](const LocalRequest&) -> LocalReply { throw std::runtime_error("inside"); });
    server_.get("/file", [](const LocalRequest&) {
      return LocalReply{200, "audio/wav", "0123456789", {}, "a\"\r\nb/ü.wav"};
    });
    server_.get("/slow", [this](const LocalRequest&) {
      ++slow_;
      std::this_thread::sleep_for(std::chrono::milliseconds(200));
      --slow_;
      return LocalReply{};
    });
    server_.post("/size", [this](const LocalRequest& request) {
      ++posts_;
      return LocalReply{200, "text/plain", std::to_string(request.body.size()), {}, {}};
    });
    thread_ = std::thread([this] { server_.serve(); });
  }
  ~Served() {
    server_.stop();
    thread_.join();
  }

  static LocalServerOptions small() {
    LocalServerOptions options;
    options.max_body_bytes = 1000;
    return options;
  }

  LocalServer& server() { return server_; }
  int posts() const { return posts_; }
  httplib::Headers token() const { return {{"X-Mouthpiece-Token", server_.token()}}; }
  std::string host() const { return "127.0.0.1:" + std::to_string(server_.port()); }
  httplib::Client client() const { return httplib::Client("127.0.0.1", server_.port()); }

  /// A socket of somebody who has said nothing yet.
  int connected() const {
    const int socket = ::socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(server_.port()));
    ::inet_pton(AF_INET, "127.0.0.1", &address.sin_addr);
    EXPECT_EQ(::connect(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    return socket;
  }

  /// What comes back for `bytes` as they are; `ends`: the sender goes before all of them have come.
  std::string raw(const std::string& bytes, bool ends = false) const {
    const int socket = connected();
    EXPECT_EQ(::send(socket, bytes.data(), bytes.size(), MSG_NOSIGNAL), static_cast<ssize_t>(bytes.size()));
    if (ends) ::shutdown(socket, SHUT_WR);
    std::string reply(1 << 16, '\0');
    std::size_t got = 0;
    for (ssize_t more = 1; more > 0 && got<reply.size(); got += more> 0 ? static_cast<std::size_t>(more) : 0)
      more = ::recv(socket, reply.data() + got, reply.size() - got, 0);
    ::close(socket);
    reply.resize(got);
    return reply;
  }

 private:
  std::atomic<int> posts_ = 0, slow_ = 0;
  LocalServer server_;
  std::thread thread_;
};

int statusOf(const std::string& reply) { return reply.size() > 12 ? std::stoi(reply.substr(9, 3)) : 0; }

TEST(LocalServer, AnswersItsOwnPageWithTheToken) {
  Served served;
  const std::string address = served.server().address();
  EXPECT_EQ(address.find("http://" + served.host() + "/?token="), 0u);
  auto client = served.client();
  const auto page = client.Get(address.substr(address.find("/?")));
  ASSERT_TRUE(page);
  EXPECT_EQ(page->status, 200);
  EXPECT_EQ(page->body, "<p>page</p>");
  EXPECT_EQ(page->get_header_value("Content-Security-Policy"), "default-src 'self'");
  EXPECT_EQ(page->get_header_value("X-Content-Type-Options"), "nosniff");
  EXPECT_EQ(page->get_header_value("Referrer-Policy"), "no-referrer");
  EXPECT_EQ(page->get_header_value("Cache-Control"), "no-store");
}

TEST(LocalServer, TakesTheTokenAsHeaderAndHandsParametersOn) {
  Served served;
  auto client = served.client();
  const auto echo = client.Get("/echo?word=a%20b%C3%BC&word=second", served.token());
  ASSERT_TRUE(echo);
  EXPECT_EQ(echo->body, "a bü|");
}

TEST(LocalServer, RefusesWhoDoesNotKnowTheToken) {
  Served served;
  auto client = served.client();
  std::string nearly = served.server().token();
  nearly.back() = nearly.back() == '0' ? '1' : '0';
  for (const std::string& target :
       {std::string("/"), std::string("/?token="), "/?token=" + nearly, "/?token=" + served.server().token() + "0"}) {
    const auto reply = client.Get(target);
    ASSERT_TRUE(reply) << target;
    EXPECT_EQ(reply->status, 403) << target;
    EXPECT_NE(reply->body.find("\"error\":"), std::string::npos);
    EXPECT_EQ(reply->body.find(served.server().token()), std::string::npos);
    EXPECT_EQ(reply->get_header_value("Content-Security-Policy").find("default-src 'none'"), 0u);
  }
  // A wrong header is not made good by a right parameter.
  const auto mixed = client.Get("/?token=" + served.server().token(), {{"X-Mouthpiece-Token", "wrong"}});
  ASSERT_TRUE(mixed);
  EXPECT_EQ(mixed->status, 403);
}

TEST(LocalServer, HasANewTokenEachRun) {
  const LocalServer one, other;
  EXPECT_EQ(one.token().size(), 32u);
  EXPECT_NE(one.token(), other.token());
  EXPECT_NE(one.port(), other.port());
}

TEST(LocalServer, RefusesOtherHostsAndOrigins) {
  Served served;
  const std::string tail = "X-Mouthpiece-Token: " + served.server().token() + "\r\nConnection: close\r\n\r\n";
  const auto status = [&](const std::string& heads) {
    return statusOf(served.raw("GET /echo HTTP/1.1\r\n" + heads + tail));
  };
  const std::string host = "Host: " + served.host() + "\r\n";
  const std::string port = std::to_string(served.server().port());
  EXPECT_EQ(status(host), 200);
  EXPECT_EQ(status("Host: localhost:" + port + "\r\n"), 200);
  EXPECT_EQ(status(host + "Origin: http://" + served.host() + "\r\n"), 200);
  EXPECT_EQ(status(""), 403);
  EXPECT_EQ(status("Host: evil.example\r\n"), 403);
  EXPECT_EQ(status("Host: evil.example:" + port + "\r\n"), 403);
  EXPECT_EQ(status("Host: 127.0.0.1\r\n"), 403);
  EXPECT_EQ(status(host + "Host: evil.example\r\n"), 403);
  EXPECT_EQ(status(host + "Origin: http://evil.example\r\n"), 403);
  EXPECT_EQ(status(host + "Origin: null\r\n"), 403);
  EXPECT_EQ(status(host + "Origin: https://" + served.host() + "\r\n"), 403);
}

TEST(LocalServer, HasItsNamedRoutesAlone) {
  Served served;
  auto client = served.client();
  for (const char* target : {"/etc/passwd", "/../../../etc/passwd", "/%2e%2e/%2e%2e/etc/passwd", "/echo/", "//echo",
                             "/ech.", "/local_server_test.cpp", "/.*"}) {
    const auto reply = client.Get(target, served.token());
    ASSERT_TRUE(reply) << target;
    EXPECT_EQ(reply->status, 404) << target;
  }
  EXPECT_EQ(client.Get("/size", served.token())->status, 405);
  EXPECT_EQ(client.Post("/echo", served.token(), "a", "text/plain")->status, 405);
  EXPECT_EQ(client.Delete("/echo", served.token())->status, 405);
  EXPECT_EQ(client.Options("/echo", served.token())->status, 405);
}

TEST(LocalServer, TakesBodiesUpToItsLimitAsTheyAre) {
  Served served;
  auto client = served.client();
  const auto reply = client.Post("/size", served.token(), std::string(1000, '\0'), "application/octet-stream");
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->body, "1000");
  const auto too_long = client.Post("/size", served.token(), std::string(1001, 'a'), "application/octet-stream");
  ASSERT_TRUE(too_long);
  EXPECT_EQ(too_long->status, 413);
  EXPECT_NE(too_long->body.find("expected at most 1000"), std::string::npos);
  EXPECT_EQ(served.posts(), 1);
}

TEST(LocalServer, RefusesBodiesWhoseLengthItCannotKnow) {
  Served served;
  const std::string heads =
      "POST /size HTTP/1.1\r\nHost: " + served.host() + "\r\nX-Mouthpiece-Token: " + served.server().token() + "\r\n";
  EXPECT_EQ(statusOf(served.raw(heads + "\r\n")), 411);
  EXPECT_EQ(statusOf(served.raw(heads + "Transfer-Encoding: chunked\r\n\r\nffffff\r\naaaa")), 415);
  EXPECT_EQ(statusOf(served.raw(heads + "Content-Length: 3\r\nContent-Encoding: gzip\r\n\r\nabc")), 415);
  EXPECT_EQ(statusOf(served.raw(heads + "Content-Length: 3\r\nContent-Length: 2\r\n\r\nabc")), 411);
  EXPECT_EQ(
      statusOf(served.raw(heads + "Content-Length: 3\r\nContent-Type: multipart/form-data; boundary=a\r\n\r\nabc")),
      415);
  EXPECT_EQ(
      statusOf(served.raw(heads + "Content-Length: 3\r\nContent-Type: application/x-www-form-urlencoded\r\n\r\na=b")),
      415);
  EXPECT_EQ(served.posts(), 0);
}

TEST(LocalServer, SurvivesBrokenRequests) {
  Served served;
  served.raw("", true);
  served.raw(std::string(100, '\0'), true);
  served.raw("GET\r\n\r\n", true);
  served.raw("GET / HTTP/9.9\r\n\r\n");
  EXPECT_GE(statusOf(served.raw("GET /" + std::string(10'000, 'a') + " HTTP/1.1\r\n\r\n")), 400);
  served.raw("GET / HTTP/1.1\r\nHost: " + std::string(20'000, 'a') + "\r\n\r\n", true);
  served.raw("GET /%ff%00%zz?%=%&&== HTTP/1.1\r\nRange: bytes=9-1,,\r\n\r\n", true);
  // A body that ends early reaches no handler.
  served.raw("POST /size HTTP/1.1\r\nHost: " + served.host() + "\r\nX-Mouthpiece-Token: " + served.server().token() +
                 "\r\nContent-Length: 500\r\n\r\nabc",
             true);
  EXPECT_EQ(served.posts(), 0);
  auto client = served.client();
  EXPECT_EQ(client.Get("/echo?word=still", served.token())->body, "still|");
}

TEST(LocalServer, TellsErrorsInOneLine) {
  Served served;
  auto client = served.client();
  const auto refused = client.Get("/refuse", served.token());
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->status, 400);
  EXPECT_EQ(refused->body, "{\"error\":\"a.wav: is \\\\x0A no sound\"}\n");
  const auto broken = client.Get("/break", served.token());
  ASSERT_TRUE(broken);
  EXPECT_EQ(broken->status, 500);
  EXPECT_EQ(broken->body, "{\"error\":\"internal error, please report it: inside\"}\n");
}

TEST(LocalServer, NamesDownloadsAndServesOneRange) {
  Served served;
  auto client = served.client();
  const auto file = client.Get("/file", served.token());
  ASSERT_TRUE(file);
  EXPECT_EQ(file->get_header_value("Content-Disposition"), "attachment; filename=\"a___b___.wav\"");
  httplib::Headers heads = served.token();
  heads.emplace("Range", "bytes=2-4");
  const auto part = client.Get("/file", heads);
  ASSERT_TRUE(part);
  EXPECT_EQ(part->status, 206);
  EXPECT_EQ(part->body, "234");
  heads = served.token();
  heads.emplace("Range", "bytes=0-,0-,0-,0-");
  EXPECT_EQ(client.Get("/file", heads)->status, 416);
}

/// The way is short: packing a page's megabytes takes seconds.
TEST(LocalServer, SendsPagesUnpacked) {
  const Served served;
  httplib::Headers heads = served.token();
  heads.emplace("Accept-Encoding", "gzip, br");
  auto client = served.client();
  client.set_decompress(false);
  const auto reply = client.Get("/", heads);
  ASSERT_TRUE(reply);
  EXPECT_FALSE(reply->has_header("Content-Encoding"));
  EXPECT_EQ(reply->body, "<p>page</p>");
}

TEST(LocalServer, AnswersMoreAtATimeThanItHasThreads) {
  LocalServerOptions options;
  options.threads = 2;
  options.max_waiting = 1;
  Served served(options);
  std::atomic<int> answered = 0;
  std::vector<std::thread> askers;
  for (int i = 0; i < 8; ++i) {
    askers.emplace_back([&] {
      const auto reply = served.client().Get("/slow", served.token());
      answered += reply && reply->status == 200;
    });
  }
  for (std::thread& asker : askers) asker.join();
  EXPECT_EQ(answered, 8);
}

/// Connections of others, who know no token and say nothing, or a letter now and then, keep nobody waiting for long.
TEST(LocalServer, AnswersWhileOthersAreSilent) {
  Served served;
  constexpr int kSilent = 24, kDripping = 8;
  std::vector<int> sockets;
  for (int i = 0; i < kSilent + kDripping; ++i) sockets.push_back(served.connected());
  std::jthread drip([&](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      for (int i = 0; i < kDripping; ++i)
        static_cast<void>(::send(sockets[static_cast<std::size_t>(i)], "G", 1, MSG_NOSIGNAL));
      std::this_thread::sleep_for(std::chrono::milliseconds(300));
    }
  });
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  const auto start = std::chrono::steady_clock::now();
  auto client = served.client();
  client.set_read_timeout(60);
  const auto reply = client.Get("/", served.token());
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->status, 200);
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(6)) << "on a busy machine";
  drip.request_stop();
  drip.join();
  for (const int socket : sockets) ::close(socket);
}

TEST(LocalServer, TellsHowLongABodyMayBe) {
  Served served;
  const auto reply = served.client().Post("/size", served.token(), std::string(1001, 'x'), "text/plain");
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->status, 413);
  EXPECT_NE(reply->body.find("1001 bytes long; expected at most 1000"), std::string::npos) << reply->body;
  EXPECT_EQ(served.posts(), 0);
}

TEST(LocalServer, StopsWhileItAnswers) {
  const auto start = std::chrono::steady_clock::now();
  {
    Served served;
    std::thread asker([&] { served.client().Get("/slow", served.token()); });
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    served.server().stop();
    asker.join();
  }
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(5));
  LocalServer never;
  never.stop();
  never.serve();  // returns at once
}

TEST(LocalServer, RefusesAPortThatIsTaken) {
  Served served;
  LocalServerOptions options;
  options.port = served.server().port();
  EXPECT_THROW(LocalServer{options}, InputError);
}

}  // namespace
}  // namespace mouthpiece
