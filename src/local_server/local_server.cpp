#include "local_server/local_server.h"

#include <fmt/format.h>
#include <httplib.h>
#include <poll.h>
#include <sys/random.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <semaphore>
#include <utility>

#include "base/errors.h"

namespace mouthpiece {
namespace {

constexpr std::size_t kMostErrorBytes = 1000;
constexpr std::size_t kTokenBytes = 16;
/// Connections whose requests are read at a time, besides those that are answered: who is silent keeps others waiting
/// only where he has as many, and then no longer than kHeadTime.
constexpr std::size_t kListeners = 32;
using ServerClock = std::chrono::steady_clock;
constexpr std::chrono::seconds kHeadTime(2), kReadTime(10), kWriteTime(30);

std::string randomToken() {
  std::array<unsigned char, kTokenBytes> bytes{};
  if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
    throw InputError("the system gives no random bytes; expected them for the server's token");
  std::string token;
  for (const unsigned char byte : bytes) token += fmt::format("{:02x}", byte);
  return token;
}

/// Takes as long for a token that is nearly right as for any other.
bool isSame(std::string_view given, std::string_view token) {
  if (given.size() != token.size()) return false;
  unsigned difference = 0;
  for (std::size_t i = 0; i < token.size(); ++i) difference |= static_cast<unsigned>(given[i] ^ token[i]);
  return difference == 0;
}

/// The library's pool, whose queue of accepted connections has no end otherwise: accepting waits while it is full.
class BoundedPool : public httplib::TaskQueue {
 public:
  BoundedPool(std::size_t threads, std::size_t most) : pool_(threads), room_(most) {}

  void enqueue(std::function<void()> work) override {
    {
      std::unique_lock lock(mutex_);
      freed_.wait(lock, [this] { return room_ > 0; });
      --room_;
    }
    pool_.enqueue([this, work = std::move(work)] {
      work();
      const std::scoped_lock lock(mutex_);
      ++room_;
      freed_.notify_one();
    });
  }
  void shutdown() override { pool_.shutdown(); }

 private:
  httplib::ThreadPool pool_;
  std::mutex mutex_;
  std::condition_variable freed_;
  std::size_t room_;
};

/// A connection whose request's head has to come within kHeadTime in all, and each piece of a body within kReadTime.
class Connection : public httplib::Stream {
 public:
  Connection(socket_t socket, const std::atomic<socket_t>& listener)
      : socket_(socket), listener_(listener), head_until_(ServerClock::now() + kHeadTime) {}

  void endHead() { head_until_.reset(); }

  [[nodiscard]] bool is_readable() const override {
    return at_ < got_ || wait(POLLIN, head_until_.value_or(ServerClock::now() + kReadTime));
  }
  [[nodiscard]] bool is_writable() const override { return wait(POLLOUT, ServerClock::now() + kWriteTime); }
  ssize_t read(char* to, std::size_t size) override {
    if (at_ == got_) {
      if (!is_readable()) return -1;
      const ssize_t count = ::recv(socket_, buffer_.data(), buffer_.size(), 0);
      if (count <= 0) return count;
      at_ = 0;
      got_ = static_cast<std::size_t>(count);
    }
    const std::size_t count = std::min(size, got_ - at_);
    std::copy_n(buffer_.data() + at_, count, to);
    at_ += count;
    return static_cast<ssize_t>(count);
  }
  ssize_t write(const char* from, std::size_t size) override {
    return is_writable() ? ::send(socket_, from, size, MSG_NOSIGNAL) : -1;
  }
  void get_remote_ip_and_port(std::string& ip, int& port) const override {
    ip = "127.0.0.1";
    port = 0;
  }
  void get_local_ip_and_port(std::string& ip, int& port) const override { get_remote_ip_and_port(ip, port); }
  [[nodiscard]] socket_t socket() const override { return socket_; }

 private:
  /// A server that is told to stop waits for no head.
  [[nodiscard]] bool wait(short event, ServerClock::time_point until) const {
    constexpr std::chrono::milliseconds kStep(100);
    pollfd state{socket_, event, 0};
    while (ServerClock::now() < until && !(head_until_ && listener_ == INVALID_SOCKET)) {
      const int ready = ::poll(&state, 1, static_cast<int>(kStep.count()));
      if (ready > 0) return true;
      if (ready < 0 && errno != EINTR) return false;
    }
    return false;
  }

  socket_t socket_;
  const std::atomic<socket_t>& listener_;
  std::optional<ServerClock::time_point> head_until_;  ///< none: it has come
  std::array<char, 1 << 14> buffer_{};
  std::size_t at_ = 0, got_ = 0;
};

/// The library's own way of reading gives a connection five seconds to begin, and ten for each letter.
class ImpatientServer : public httplib::Server {
 private:
  /// A connection serves one request: what a refused one has left unread is not taken for the next.
  bool process_and_close_socket(socket_t socket) override {
    Connection connection(socket, svr_sock_);
    bool is_closed = false;
    const bool is_answered =
        process_request(connection, true, is_closed, [&connection](const httplib::Request&) { connection.endHead(); });
    ::shutdown(socket, SHUT_RDWR);
    ::close(socket);
    return is_answered;
  }
};

/// The library would let a second server of the same user share the port.
void takePortAlone(socket_t socket) {
  const int yes = 1;
  ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
}

std::string safeFileName(std::string name) {
  for (char& c : name) {
    const bool is_plain =
        (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' || c == '_' || c == '-';
    if (!is_plain) c = '_';
  }
  return name;
}

void send(httplib::Response& response, LocalReply reply) {
  if (reply.status != 200) response.status = reply.status;  // else the library tells 200 from 206
  response.set_header("Content-Security-Policy", reply.policy);
  if (!reply.file_name.empty())
    response.set_header("Content-Disposition", "attachment; filename=\"" + safeFileName(reply.file_name) + "\"");
  if (reply.status != 200 || reply.body.empty()) return response.set_content(reply.body, reply.type);
  // The library packs what is given whole, as tightly as can be: seconds for a page that goes nowhere but next door.
  const std::size_t length = reply.body.size();
  response.set_content_provider(
      length, reply.type, [body = std::move(reply.body)](std::size_t from, std::size_t count, httplib::DataSink& sink) {
        return sink.write(body.data() + from, count);
      });
}

LocalReply answered(const LocalServer::Handler& handler, const LocalRequest& request) {
  try {
    return handler(request);
  } catch (const InputError& error) {
    return errorReply(400, error.what());
  } catch (const std::bad_alloc&) {
    return errorReply(500, "out of memory: the input is too large for this machine");
  } catch (const std::exception& error) {
    return errorReply(500, fmt::format("internal error, please report it: {}", error.what()));
  }
}

bool isHtmlForm(std::string_view type) {
  return type.starts_with("multipart/") || type.starts_with("application/x-www-form-urlencoded");
}

}  // namespace

struct LocalServer::Data {
  explicit Data(std::size_t threads) : free_to_answer(static_cast<std::ptrdiff_t>(threads)) {}

  ImpatientServer server;
  std::counting_semaphore<> free_to_answer;
  int port = 0;
  std::string token = randomToken();
  std::map<std::string, Handler> gets, posts;
  std::mutex mutex;
  std::condition_variable ended;
  bool is_serving = false;
  std::atomic<bool> is_stopped = false;

  /// What is wrong with a request before anything of its body is read; nothing to say about a good one.
  [[nodiscard]] std::optional<LocalReply> refusal(const httplib::Request& request) const;
  [[nodiscard]] bool isOurAddress(std::string_view host) const {
    return host == fmt::format("127.0.0.1:{}", port) || host == fmt::format("localhost:{}", port);
  }
  /// A header that comes twice may mean one thing to us and another to the library.
  [[nodiscard]] static std::string onlyHeader(const httplib::Request& request, const char* name) {
    return request.get_header_value_count(name) == 1 ? request.get_header_value(name) : std::string();
  }
  [[nodiscard]] bool knowsToken(const httplib::Request& request) const {
    const std::string given = request.has_header("X-Mouthpiece-Token") ? onlyHeader(request, "X-Mouthpiece-Token")
                                                                       : request.get_param_value("token");
    return isSame(given, token);
  }
  void answer(const Handler& handler, const httplib::Request& request, httplib::Response& response);
};

std::optional<LocalReply> LocalServer::Data::refusal(const httplib::Request& request) const {
  if (!isOurAddress(onlyHeader(request, "Host")))
    return errorReply(403, fmt::format("expected the host 127.0.0.1:{}; another site may not ask this server", port));
  constexpr std::string_view kHttp = "http://";
  const std::string origin = request.get_header_value("Origin");
  if (request.has_header("Origin") && !(origin.starts_with(kHttp) && isOurAddress(origin.substr(kHttp.size()))))
    return errorReply(403, "another site may not ask this server");
  if (!knowsToken(request))
    return errorReply(403, "expected the token of this run; open the address that the program has printed");
  const bool reads = request.method == "GET" || request.method == "HEAD";
  if (!reads && request.method != "POST") return errorReply(405, "expected GET or POST");
  if (!(reads ? gets : posts).contains(request.path))
    return (reads ? posts : gets).contains(request.path)
               ? errorReply(405, fmt::format("expected {} here", reads ? "POST" : "GET"))
               : errorReply(404, "there is nothing at this address");
  // The library limits neither what it unpacks nor what comes in chunks, and would take a form apart.
  if (request.has_header("Transfer-Encoding") || request.has_header("Content-Encoding"))
    return errorReply(415, "expected a body as it is, neither packed nor in chunks");
  if (!reads && onlyHeader(request, "Content-Length").empty()) return errorReply(411, "expected Content-Length");
  if (isHtmlForm(request.get_header_value("Content-Type")))
    return errorReply(415, "expected the bytes themselves or JSON, no HTML form");
  if (request.ranges.size() > 1) return errorReply(416, "expected one range of bytes at most");
  return {};
}

void LocalServer::Data::answer(const Handler& handler, const httplib::Request& request, httplib::Response& response) {
  LocalRequest asked;
  for (const auto& [name, value] : request.params) {
    if (name != "token") asked.parameters.emplace(name, value);
  }
  asked.body = request.body;
  free_to_answer.acquire();
  LocalReply reply = answered(handler, asked);
  free_to_answer.release();
  send(response, std::move(reply));
}

std::string LocalRequest::parameter(const std::string& name) const {
  const auto found = parameters.find(name);
  return found == parameters.end() ? std::string() : found->second;
}

LocalServer::LocalServer(const LocalServerOptions& options)
    : data_(std::make_unique<Data>(std::max<std::size_t>(options.threads, 1))) {
  httplib::Server& server = data_->server;
  const std::size_t threads = std::max<std::size_t>(options.threads, 1) + kListeners;
  server.new_task_queue = [threads, most = threads + options.max_waiting] { return new BoundedPool(threads, most); };
  server.set_socket_options(takePortAlone);
  server.set_payload_max_length(options.max_body_bytes);
  server.set_default_headers({{"X-Content-Type-Options", "nosniff"},
                              {"Referrer-Policy", "no-referrer"},
                              {"Cache-Control", "no-store"},
                              {"Cross-Origin-Resource-Policy", "same-origin"},
                              {"Cross-Origin-Opener-Policy", "same-origin"}});
  server.set_pre_routing_handler([this](const httplib::Request& request, httplib::Response& response) {
    std::optional<LocalReply> refused = data_->refusal(request);
    if (!refused) return httplib::Server::HandlerResponse::Unhandled;
    send(response, std::move(*refused));
    return httplib::Server::HandlerResponse::Handled;
  });
  server.set_error_handler([most = options.max_body_bytes](const httplib::Request& request,
                                                           httplib::Response& response) {
    if (!response.body.empty()) return;
    const std::string too_long =
        fmt::format("the body is {} bytes long; expected at most {}", request.get_header_value("Content-Length"), most);
    send(response, errorReply(response.status, response.status == 413 ? too_long : "a broken request"));
  });
  data_->port = options.port;
  const bool is_bound = options.port == 0 ? (data_->port = server.bind_to_any_port("127.0.0.1")) > 0
                                          : server.bind_to_port("127.0.0.1", options.port);
  if (!is_bound)
    throw InputError(fmt::format("127.0.0.1:{} cannot be listened at; expected a port that is free", options.port));
}

LocalServer::~LocalServer() {
  stop();
  std::unique_lock lock(data_->mutex);
  data_->ended.wait(lock, [this] { return !data_->is_serving; });
}

void LocalServer::get(const std::string& path, Handler handler) {
  data_->gets[path] = std::move(handler);
  data_->server.Get(path, [this, path](const httplib::Request& request, httplib::Response& response) {
    data_->answer(data_->gets.at(path), request, response);
  });
}

void LocalServer::post(const std::string& path, Handler handler) {
  data_->posts[path] = std::move(handler);
  data_->server.Post(path, [this, path](const httplib::Request& request, httplib::Response& response) {
    data_->answer(data_->posts.at(path), request, response);
  });
}

int LocalServer::port() const { return data_->port; }
const std::string& LocalServer::token() const { return data_->token; }
std::string LocalServer::address() const {
  return fmt::format("http://127.0.0.1:{}/?token={}", data_->port, data_->token);
}

void LocalServer::serve() {
  {
    const std::scoped_lock lock(data_->mutex);
    if (data_->is_stopped) return;
    data_->is_serving = true;
  }
  data_->server.listen_after_bind();
  const std::scoped_lock lock(data_->mutex);
  data_->is_serving = false;
  data_->ended.notify_all();
}

void LocalServer::stop() {
  std::unique_lock lock(data_->mutex);
  data_->is_stopped = true;
  // The library's stop() does nothing before its loop has begun.
  while (data_->is_serving) {
    data_->server.stop();
    data_->ended.wait_for(lock, std::chrono::milliseconds(20));
  }
}

LocalReply errorReply(int status, std::string_view text) {
  LocalReply reply;
  reply.status = status;
  reply.body = nlohmann::json{{"error", printable(text, kMostErrorBytes)}}.dump() + "\n";
  return reply;
}

}  // namespace mouthpiece
