#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>

namespace mouthpiece {

/// A request that has passed every check: it comes from this machine, names it, and knows the token.
struct LocalRequest {
  std::map<std::string, std::string> parameters;  ///< of the query, decoded, without the token; of two alike the first
  std::string_view body;                          ///< as it was sent; any bytes; it stays until the reply is given

  /// "" where it is missing.
  [[nodiscard]] std::string parameter(const std::string& name) const;
};

struct LocalReply {
  int status = 200;
  std::string type = "application/json";
  std::string body = "{}";
  /// Content-Security-Policy; the default lets a document do nothing at all.
  std::string policy = "default-src 'none'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'";
  std::string file_name;  ///< not "": the browser saves it under this name; letters, digits, '.', '_' and '-' stay
};

struct LocalServerOptions {
  int port = 0;                            ///< 0: one that is free
  std::size_t max_body_bytes = 64u << 20;  ///< a longer body is refused with 413
  std::size_t threads = 4;                 ///< requests that are answered at the same time, at least 1
  std::size_t max_waiting = 16;            ///< connections that wait to be read; more wait in the system's queue
};

/// A web server for the pages of one user on one machine. It listens on 127.0.0.1 alone and answers only a request
/// whose Host (and Origin, where one is sent) is its own address, so that no site of the network can reach it through
/// the user's browser (DNS rebinding), and which knows the random token of this run: as the parameter `token` or the
/// header `X-Mouthpiece-Token`. Only the named routes exist; no file is served by its path. What fails is told as
/// `{"error": "one line"}`. A connection that has not sent the head of its request after 2 s is closed.
class LocalServer {
 public:
  using Handler = std::function<LocalReply(const LocalRequest&)>;

  /// Binds the port. Throws InputError when that is not free.
  explicit LocalServer(const LocalServerOptions& options = {});
  LocalServer(const LocalServer&) = delete;
  LocalServer& operator=(const LocalServer&) = delete;
  /// Stops, and waits for what is being answered.
  ~LocalServer();

  /// `path` is an exact path, "/lines"; it replies to GET, or to POST. Handlers run in several threads at a time. An
  /// InputError of theirs becomes 400 with its text, anything else 500. To be called before serve().
  void get(const std::string& path, Handler handler);
  void post(const std::string& path, Handler handler);

  [[nodiscard]] int port() const;
  [[nodiscard]] const std::string& token() const;
  /// What to open in a browser: "http://127.0.0.1:PORT/?token=TOKEN".
  [[nodiscard]] std::string address() const;

  /// Answers until stop() is called from another thread; at once when it has been.
  void serve();
  void stop();

 private:
  struct Data;
  std::unique_ptr<Data> data_;
};

/// {"error": text} with its control characters shown and its length bounded.
LocalReply errorReply(int status, std::string_view text);

}  // namespace mouthpiece
