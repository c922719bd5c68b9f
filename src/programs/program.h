#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace CLI {  // NOLINT(readability-identifier-naming): not ours
class App;
}

namespace mouthpiece {

/// Exit codes of all our programs.
inline constexpr int kExitDone = 0;
inline constexpr int kExitBadInput = 1;
inline constexpr int kExitWrongUsage = 2;

/// A command line to serve: `synth` itself, or one of the subcommands of `corpus` and `retarget`. Each stands in a
/// source file of its own, options beside what they do; makeCommand() makes one from the two.
struct Command {
  std::string name;
  std::string what;     ///< one line of help
  std::string example;  ///< shown after the help; may have several lines
  /// Declares the options and returns what runs once they are read; its result is the exit code.
  std::function<std::function<int()>(CLI::App&)> add;
};

/// All of a main(): what `run` returns is the exit code. This is the one place that catches: InputError, a file system
/// error, no memory, an output that cannot be printed, an internal error -> one line "PROGRAM: ..." on stderr, 1.
int caught(int argc, const char* const* argv, int (*run)(int argc, const char* const* argv));

/// Parses the command line and runs the subcommand that it names, or else `program` itself; one without `add` needs a
/// subcommand. Wrong usage -> 2, `--help` -> 0. Throws what the command throws.
int runProgram(const Command& program, const std::vector<Command>& subcommands, int argc, const char* const* argv);

/// Whether an option ("--voice") has its value from the user's config file, not from the command line.
bool isUsersDefault(std::string_view option);

/// The flag that all (sub)commands share: --quiet, no progress and no notices.
void addQuietFlag(CLI::App& app, bool& quiet);
/// --json, for the (sub)commands that print facts.
void addJsonFlag(CLI::App& app, bool& json);

/// A command whose options are read into an `Options` with a member `quiet`: addOptions() declares the others, and
/// run() is called with what was read.
template <typename Options>
Command makeCommand(std::string name, std::string what, std::string example, void (*addOptions)(CLI::App&, Options&),
                    int (*run)(const Options&)) {
  const auto add = [addOptions, run](CLI::App& app) -> std::function<int()> {
    const auto options = std::make_shared<Options>();
    addQuietFlag(app, options->quiet);
    addOptions(app, *options);
    return [options, run] { return run(*options); };
  };
  return {std::move(name), std::move(what), std::move(example), add};
}

/// To stdout, as it is.
void printText(std::string_view text);
/// To stdout, indented by two; text that is no UTF-8 is shown with U+FFFD.
void printJson(const nlohmann::json& facts);
/// One line on stderr, "PROGRAM: text", unless `quiet`.
void printNotice(std::string_view text, bool quiet);

/// A bar on stderr: drawn only when stderr is a terminal, `quiet` is off and the work has taken over a second; wiped
/// when it goes out of scope. advance() may be called from several threads.
class ProgressBar {
 public:
  ProgressBar(std::string label, std::size_t total_steps, bool quiet);
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  void advance(std::size_t steps = 1);
  /// For work that counts for itself: `done` of the steps are finished.
  void setDone(std::size_t done);

 private:
  void draw();

  std::string label_;
  std::size_t total_steps_;
  bool enabled_;
  std::atomic<std::size_t> done_ = 0;
  std::chrono::steady_clock::time_point started_, last_drawn_;
  bool drawn_ = false;
  std::mutex mutex_;
};

}  // namespace mouthpiece
