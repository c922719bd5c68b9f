#include "base/child_process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <thread>

#include "base/errors.h"
#include "base/text_encoding.h"
#include "base/unfinished.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr std::size_t kKeptOutput = 16384, kLongestAnswer = 1 << 20, kLongestSaid = 300;
constexpr int kAnswers = STDERR_FILENO + 1;
constexpr std::string_view kFolderPrefix = "mouthpiece.";

class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() { close(); }
  void close() {
    if (number_ >= 0) ::close(number_);
    number_ = -1;
  }
  [[nodiscard]] int number() const { return number_; }

 private:
  int number_;
};

/// A stream between two processes. A socket, since writing to one whose reader is gone can be told not to raise a
/// signal.
struct Stream {
  /// `name`: of the program that is to have the other end.
  explicit Stream(std::string_view name) : Stream(ends(name)) {}
  Descriptor ours, its;

 private:
  explicit Stream(const std::array<int, 2>& ends) : ours(ends[0]), its(ends[1]) {}
  static std::array<int, 2> ends(std::string_view name) {
    std::array<int, 2> both{};
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, both.data()) != 0)
      throw InputError(name, "", "cannot be started: no pipe");
    return both;
  }
};

/// What is done in the child between fork and exec.
class SpawnActions {
 public:
  /// `input`: a descriptor; -1: nothing is to be read. `answers`: what becomes kAnswers; -1: nothing does.
  SpawnActions(const fs::path& folder, int input, int output, int answers) {
    MOUTHPIECE_EXPECT(posix_spawn_file_actions_init(&actions_) == 0);
    posix_spawn_file_actions_addchdir_np(&actions_, folder.c_str());
    if (input < 0) {
      posix_spawn_file_actions_addopen(&actions_, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    } else {
      posix_spawn_file_actions_adddup2(&actions_, input, STDIN_FILENO);
    }
    posix_spawn_file_actions_adddup2(&actions_, output, STDOUT_FILENO);
    posix_spawn_file_actions_adddup2(&actions_, output, STDERR_FILENO);
    if (answers >= 0) posix_spawn_file_actions_adddup2(&actions_, answers, kAnswers);
    posix_spawn_file_actions_addclosefrom_np(&actions_, answers < 0 ? kAnswers : kAnswers + 1);
    MOUTHPIECE_EXPECT(posix_spawnattr_init(&attributes_) == 0);
    // A group of its own, so that its children end with it; the usual signals, whatever this process holds back.
    sigset_t none, all;
    sigemptyset(&none);
    sigfillset(&all);
    posix_spawnattr_setsigmask(&attributes_, &none);
    posix_spawnattr_setsigdefault(&attributes_, &all);
    posix_spawnattr_setflags(&attributes_, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
  }
  SpawnActions(const SpawnActions&) = delete;
  SpawnActions& operator=(const SpawnActions&) = delete;
  ~SpawnActions() {
    posix_spawnattr_destroy(&attributes_);
    posix_spawn_file_actions_destroy(&actions_);
  }
  [[nodiscard]] const posix_spawn_file_actions_t* actions() const { return &actions_; }
  [[nodiscard]] const posix_spawnattr_t* attributes() const { return &attributes_; }

 private:
  posix_spawn_file_actions_t actions_{};
  posix_spawnattr_t attributes_{};
};

std::vector<char*> pointersTo(std::vector<std::string>& strings) {
  std::vector<char*> pointers;
  for (std::string& string : strings) pointers.push_back(string.data());
  pointers.push_back(nullptr);
  return pointers;
}

pid_t startChild(const fs::path& program, const std::vector<std::string>& arguments, const fs::path& folder, int input,
                 int output, int answers = -1) {
  std::vector<std::string> argument_strings{program.string()};
  argument_strings.insert(argument_strings.end(), arguments.begin(), arguments.end());
  std::vector<std::string> environment_strings{"PATH=/usr/local/bin:/usr/bin:/bin", "HOME=" + folder.string(),
                                               "TMPDIR=" + folder.string(), "LC_ALL=C"};
  // Who stays to answer has much memory: in large pages a network's start and first answer take 0.45 s, not 0.53. What
  // it frees goes back at once: kept, it grew by a tenth in minutes.
  if (answers >= 0)
    environment_strings.emplace_back("GLIBC_TUNABLES=glibc.malloc.hugetlb=1:glibc.malloc.trim_threshold=131072");
  auto argv = pointersTo(argument_strings);
  auto environment = pointersTo(environment_strings);
  const SpawnActions actions(folder, input, output, answers);
  pid_t child = 0;
  const int error =
      posix_spawn(&child, program.c_str(), actions.actions(), actions.attributes(), argv.data(), environment.data());
  if (error != 0) {
    throw InputError(program.string(), "", fmt::format("cannot be started: {}", std::strerror(error)));
  }
  return child;
}

/// Waits until all is taken; false when nobody reads any more.
bool sendAll(int socket, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t sent = ::send(socket, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent > 0) {
      bytes.remove_prefix(static_cast<std::size_t>(sent));
    } else if (sent == 0 || errno != EINTR) {
      return false;
    }
  }
  return true;
}

int millisecondsUntil(Clock::time_point deadline) {
  const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now()).count();
  return static_cast<int>(std::clamp<long long>(left, 0, 1000));
}

Clock::time_point deadlineIn(Seconds time_limit) {
  return Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(time_limit));
}

/// Appends what can be read at once; false where nothing comes any more.
bool readSome(int descriptor, std::string& text) {
  std::array<char, 4096> block{};
  const ssize_t taken = ::read(descriptor, block.data(), block.size());
  if (taken == 0 || (taken < 0 && errno != EINTR)) return false;
  if (taken > 0) text.append(block.data(), static_cast<std::size_t>(taken));
  return true;
}
void keepLast(std::string& output) {
  if (output.size() > 2 * kKeptOutput) output.erase(0, output.size() - kKeptOutput);
}

/// Reads until the child closes its output; false when the deadline came first.
bool readUntil(int descriptor, Clock::time_point deadline, std::string& output) {
  while (Clock::now() < deadline) {
    pollfd waiting{descriptor, POLLIN, 0};
    if (::poll(&waiting, 1, millisecondsUntil(deadline)) <= 0) continue;
    if (!readSome(descriptor, output)) return true;
    keepLast(output);
  }
  return false;
}

/// Waits for the end; nullopt when the deadline came first. What the child itself started ends with it.
std::optional<int> waitUntil(pid_t child, Clock::time_point deadline) {
  while (true) {
    siginfo_t ended{};
    const int result = ::waitid(P_PID, static_cast<id_t>(child), &ended, WEXITED | WNOHANG | WNOWAIT);
    if (result != 0 && errno != EINTR) return 127;
    if (result == 0 && ended.si_pid == child) break;
    if (Clock::now() >= deadline) return std::nullopt;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  ::kill(-child, SIGKILL);  // before it is waited for: until then the group's number is nobody else's
  int status = 0;
  while (::waitpid(child, &status, 0) < 0) {
    if (errno != EINTR) return 127;
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

/// A child that ends with this, if it has not been waited for.
class RunningChild {
 public:
  explicit RunningChild(const std::function<pid_t()>& start) : unfinished_([&] { return number_ = start(); }) {}
  RunningChild(const RunningChild&) = delete;
  RunningChild& operator=(const RunningChild&) = delete;
  ~RunningChild() {
    if (number_ == 0) return;
    ::kill(-number_, SIGKILL);
    waitUntil(number_, Clock::time_point::max());
  }
  void hasEnded() { number_ = 0; }
  [[nodiscard]] pid_t number() const { return number_; }

 private:
  pid_t number_ = 0;
  Unfinished unfinished_;
};

}  // namespace

fs::path temporaryFolder() {
  std::error_code error;
  fs::path folder = fs::temp_directory_path(error);
  return error ? fs::path("/tmp") : folder;
}

PrivateFolder::PrivateFolder() {
  const fs::path base = temporaryFolder();
  sweepLeftovers(base, std::string(kFolderPrefix), "", LeftoverKind::kFolder);
  std::string pattern = fs::absolute(base / kFolderPrefix).string() + "XXXXXX";
  unfinished_.emplace([&] {
    if (::mkdtemp(pattern.data()) == nullptr) {
      throw InputError(base.string(), "", fmt::format("takes no temporary folder: {}", std::strerror(errno)));
    }
    try {
      path_ = pattern;
      lock_.emplace(::open(path_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
      return path_;
    } catch (...) {  // no memory to note it
      ::rmdir(pattern.c_str());
      throw;
    }
  });
}

PrivateFolder::~PrivateFolder() {
  try {
    fs::remove_all(path_);
  } catch (const std::exception&) {  // the next start sweeps it
  }
}

std::optional<fs::path> findProgram(std::string_view name) {
  const char* variable = std::getenv("PATH");
  std::string_view rest = variable == nullptr ? std::string_view("/usr/bin:/bin") : std::string_view(variable);
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find(':'), rest.size());
    const fs::path folder(rest.substr(0, end));
    rest.remove_prefix(std::min(end + 1, rest.size()));
    if (!folder.is_absolute()) continue;  // the current folder is no place to find programs in
    const fs::path program = folder / name;
    std::error_code error;
    if (fs::is_regular_file(program, error) && ::access(program.c_str(), X_OK) == 0) return program;
  }
  return std::nullopt;
}

ChildResult runChild(const fs::path& program, const std::vector<std::string>& arguments, const fs::path& folder,
                     Seconds time_limit) {
  return runChild(program, arguments, folder, time_limit, nullptr);
}

ChildResult runChild(const fs::path& program, const std::vector<std::string>& arguments, const fs::path& folder,
                     Seconds time_limit, const std::function<void(const ChildInput&)>& feed) {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) throw InputError(program.string(), "", "cannot be started: no pipe");
  Descriptor read_end(ends[0]), write_end(ends[1]);
  std::optional<Stream> input;
  if (feed) input.emplace(program.string());
  const auto deadline = deadlineIn(time_limit);
  RunningChild running(
      [&] { return startChild(program, arguments, folder, input ? input->its.number() : -1, write_end.number()); });
  const pid_t child = running.number();
  write_end.close();
  if (input) input->its.close();
  ChildResult result;
  std::exception_ptr thrown;
  std::jthread feeding;
  if (feed) {
    feeding = std::jthread([&] {
      try {
        feed([&](std::string_view bytes) { return sendAll(input->ours.number(), bytes); });
      } catch (...) {
        thrown = std::current_exception();
        ::kill(-child, SIGKILL);
      }
      input->ours.close();
    });
  }
  result.timed_out = !readUntil(read_end.number(), deadline, result.output);
  if (result.timed_out) ::kill(-child, SIGKILL);  // what waits to feed it goes on then
  if (feeding.joinable()) feeding.join();
  std::optional<int> exit_code = result.timed_out ? std::nullopt : waitUntil(child, deadline);
  if (!exit_code) {
    result.timed_out = true;
    ::kill(-child, SIGKILL);
    exit_code = waitUntil(child, Clock::time_point::max());
  }
  running.hasEnded();
  if (thrown) std::rethrow_exception(thrown);
  result.exit_code = exit_code.value_or(127);
  return result;
}

struct AnsweringChild::Running {
  Running(const fs::path& program, const std::vector<std::string>& arguments, std::string of)
      : name(std::move(of)), input(name), output(name), answers(name), child([&] {
          return startChild(program, arguments, folder.path(), input.its.number(), output.its.number(),
                            answers.its.number());
        }) {
    for (Stream* stream : {&input, &output, &answers}) stream->its.close();
  }

  std::string name, said, answer;
  PrivateFolder folder;
  Stream input, output, answers;
  RunningChild child;
};

AnsweringChild::AnsweringChild(const fs::path& program, const std::vector<std::string>& arguments, std::string name)
    : running_(std::make_unique<Running>(program, arguments, std::move(name))) {}

AnsweringChild::~AnsweringChild() = default;

std::string AnsweringChild::ask(std::string_view request, Seconds time_limit, const std::stop_token& stop) {
  constexpr int kLooksForStop = 50;  // ms
  Running& child = *running_;
  const auto deadline = deadlineIn(time_limit);
  const auto failed = [&] {
    readUntil(child.output.ours.number(), std::min(deadline, deadlineIn(1)), child.said);
    return InputError(child.name, "", fmt::format("failed: {}", printable(child.said, kLongestSaid)));
  };
  child.answer.clear();
  while (!child.answer.ends_with('\n')) {
    if (Clock::now() >= deadline) throw InputError(child.name, "", "hung");
    if (stop.stop_requested()) throw InputError(child.name, "", "was given up");
    const int until =
        stop.stop_possible() ? std::min(kLooksForStop, millisecondsUntil(deadline)) : millisecondsUntil(deadline);
    std::array<pollfd, 3> waiting{{{child.answers.ours.number(), POLLIN, 0},
                                   {child.output.ours.number(), POLLIN, 0},
                                   {request.empty() ? -1 : child.input.ours.number(), POLLOUT, 0}}};
    if (::poll(waiting.data(), waiting.size(), until) <= 0) continue;
    if (waiting[2].revents != 0) {
      const ssize_t sent =
          ::send(child.input.ours.number(), request.data(), request.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
      if (sent < 0 && errno != EAGAIN && errno != EINTR) throw failed();
      request.remove_prefix(static_cast<std::size_t>(std::max<ssize_t>(sent, 0)));
    }
    if (waiting[1].revents != 0 && !readSome(child.output.ours.number(), child.said)) child.output.ours.close();
    keepLast(child.said);
    if (waiting[0].revents != 0 && !readSome(child.answers.ours.number(), child.answer)) throw failed();
    if (child.answer.size() > kLongestAnswer) throw InputError(child.name, "", "says too much");
  }
  child.answer.pop_back();
  return child.answer;
}

}  // namespace mouthpiece
