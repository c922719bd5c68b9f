#include "programs/program.h"

#include <cxxabi.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <new>
#include <system_error>
#include <thread>
#include <tuple>
#include <typeinfo>

#include "base/errors.h"
#include "base/json_text.h"
#include "base/unfinished.h"
#include "programs/config_defaults.h"
#include "retarget/rig/face_file.h"
#include "units/file/corpus.h"

namespace mouthpiece {
namespace {

constexpr std::chrono::milliseconds kShowAfter{1000};
constexpr std::chrono::milliseconds kRedrawEvery{100};
constexpr std::size_t kBarWidth = 30;

std::string_view program_name = "mouthpiece";  ///< of the arguments, which last as long as the process

ConfigDefaults config_defaults;  ///< of this run

std::string_view nameOf(std::string_view path) { return path.substr(path.find_last_of('/') + 1); }

/// Everything on one line, whatever the message holds.
int complain(std::string_view message) {
  std::fflush(stdout);
  fmt::print(stderr, "{}: {}\n", program_name, printable(message, 2000));
  return kExitBadInput;
}

constexpr std::string_view kNoMemory = "out of memory: the input is too large for this machine";
constexpr std::string_view kGivenUp = "a library gave up, most likely for want of memory";

/// The same with nothing allocated.
int complainWithoutMemory(std::string_view what = kNoMemory) {
  std::fflush(stdout);
  for (const std::string_view part : {program_name, std::string_view(": "), what, std::string_view("\n")})
    std::ignore = ::write(STDERR_FILENO, part.data(), part.size());
  return kExitBadInput;
}

std::string describe(const std::filesystem::filesystem_error& error) {
  const std::string path = error.path2().empty() ? error.path1().string() : error.path2().string();
  return fmt::format("{}: {}", printable(path, 400), error.code().message());
}

/// How many letters are to be put in, left out or changed to make one text of the other.
std::size_t distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t changed = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = std::exchange(row[j], std::min({changed, row[j] + 1, row[j - 1] + 1}));
    }
  }
  return row.back();
}

/// The program's command line and that of the command which was named.
std::vector<const CLI::App*> inUse(const CLI::App& app) {
  std::vector<const CLI::App*> in_use{&app};
  for (const CLI::App* each : app.get_subcommands()) in_use.push_back(each);
  return in_use;
}

/// The option or subcommand that a mistyped word of the command line is nearest to, of those that `app` and the
/// subcommand in use know; "" where none is near.
std::string nearestTo(std::string_view typed, const CLI::App& app) {
  const std::string_view word = typed.substr(0, typed.find('='));
  std::string best;
  std::size_t least = 1 + word.size() / 4;
  const auto consider = [&](const std::string& known) {
    const std::size_t away = distance(word, known);
    if (away <= least && (best.empty() || away < least)) {
      best = known;
      least = away;
    }
  };
  if (!word.starts_with("-")) {
    for (const CLI::App* each : app.get_subcommands({})) consider(each->get_name());
    return best;
  }
  for (const CLI::App* each : inUse(app)) {
    for (const CLI::Option* option : each->get_options()) {
      for (const std::string& name : option->get_lnames()) consider("--" + name);
    }
  }
  return best;
}

/// "; --audio took --out for its value" where an option's value is the name of another, else nothing.
std::string swallowedNames(const CLI::App& app) {
  std::string text;
  for (const CLI::App* each : inUse(app)) {
    for (const CLI::Option* option : each->get_options()) {
      for (const std::string& value : option->results()) {
        const CLI::Option* other = value.starts_with("--") ? each->get_option_no_throw(value) : nullptr;
        if (other != nullptr) text += fmt::format("; {} took {} for its value", option->get_name(), value);
      }
    }
  }
  return text;
}

/// What CLI11 says of a value that is missing, given twice, no number or out of bounds, as other errors say it.
/// (std::regex would run out of stack on a value of 100,000 letters.)
std::string plainly(const std::string& what, const CLI::App& app) {
  const auto told = [](std::string_view option, std::string_view found, std::string_view expected) {
    return fmt::format("{}: found {}; expected {}", option, found, expected);
  };
  const auto quoted = [](const std::string& value) { return fmt::format("'{}'", printable(value, 120)); };
  constexpr std::string_view kNoNumber = "Could not convert: ", kIs = " = ";
  if (const std::size_t is = what.find(kIs); what.starts_with(kNoNumber) && is != std::string::npos) {
    const std::string option = what.substr(kNoNumber.size(), is - kNoNumber.size());
    std::string type;
    for (const CLI::App* each : inUse(app)) {
      if (const CLI::Option* known = each->get_option_no_throw(option)) type = known->get_type_name();
    }
    const char* expected = type.starts_with("UINT")  ? "a whole number from 0"
                           : type.starts_with("INT") ? "a whole number"
                                                     : "a number";
    return told(option, quoted(what.substr(is + kIs.size())), expected);
  }
  const std::size_t colon = what.find(": ");
  if (colon == std::string::npos) return what;
  const std::string option = what.substr(0, colon), rest = what.substr(colon + 2);
  constexpr std::string_view kTooMany = "At Most 1 required but received ", kValue = "Value ",
                             kBounds = " not in range ", kTo = " to ", kNames = " not in {";
  if (rest.starts_with("1 required ") && rest.ends_with(" missing")) return told(option, "no value", "one");
  if (rest.starts_with(kTooMany)) return told(option, rest.substr(kTooMany.size()) + " values", "one");
  if (const std::size_t at = rest.rfind(kBounds), to = rest.rfind(kTo);
      rest.starts_with(kValue) && at != std::string::npos && to != std::string::npos && to > at) {
    const std::string least = rest.substr(at + kBounds.size(), to - at - kBounds.size());
    return told(option, quoted(rest.substr(kValue.size(), at - kValue.size())),
                fmt::format("{} to {}", std::stod(least), std::stod(rest.substr(to + kTo.size()))));
  }
  if (const std::size_t at = rest.rfind(kNames); at != std::string::npos && rest.ends_with('}')) {
    std::string names = rest.substr(at + kNames.size(), rest.size() - at - kNames.size() - 1);
    std::replace(names.begin(), names.end(), ',', '|');
    return told(option, quoted(rest.substr(0, at)), names);
  }
  return what;
}

/// Wrong usage on one line, as every other error: what CLI11 says, what may have been meant by words that nobody knows,
/// which options went astray, and whose help tells more.
std::string wrongUsage(const CLI::App* app, const CLI::Error& error) {
  constexpr std::size_t kLongest = 2000;
  const std::vector<std::string> unknown = app->remaining(true);
  // CLI11 names what is left over from the last to the first.
  const bool is_left_over = dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr;
  const std::string what =
      is_left_over ? fmt::format("nothing takes {}", fmt::join(unknown, " ")) : plainly(error.what(), *app);
  std::string text = fmt::format("{}: {}", program_name, printable(what, kLongest));
  for (const std::string& typed : unknown) {
    const std::string meant = nearestTo(typed, *app);
    if (!meant.empty() && meant != typed) text += fmt::format("; did you mean {}?", meant);
  }
  text += swallowedNames(*app);
  std::string command(program_name);
  for (const CLI::App* each : app->get_subcommands()) command += " " + each->get_name();
  return fmt::format("{} (`{} --help` tells more)\n", text, command);
}

/// An empty value is a variable that a script did not set: it is told, not taken for an option that is not given. Of a
/// text whoever speaks it tells. Throws InputError, and CLI11's error for a negative number where CLI11 takes one for a
/// large one.
void refuseOddValues(const CLI::App& app) {
  for (const CLI::Option* option : app.parse_order()) {
    const std::vector<std::string>& values = option->results();
    if (!option->check_name("--text") && std::find(values.begin(), values.end(), "") != values.end())
      throw InputError(option->get_name(), "", "is empty; expected a value, or to be left out");
    if (option->get_type_name().starts_with("UINT") && values.front().starts_with('-'))
      throw CLI::ConversionError(option->get_name(), values);
  }
  for (const CLI::App* command : app.get_subcommands()) refuseOddValues(*command);
}

int parse(CLI::App& app, int argc, const char* const* argv, bool& finished) {
  std::vector<std::string> arguments(argv + std::min(argc, 1), argv + argc);
  const bool asks_help = std::any_of(arguments.begin(), arguments.end(), [](const std::string& argument) {
    return argument == "--help" || argument == "-h" || argument == "--version";
  });
  if (!asks_help) config_defaults = ConfigDefaults(app, arguments);
  arguments = config_defaults.before(std::move(arguments));
  std::reverse(arguments.begin(), arguments.end());  // as CLI11 takes them
  app.failure_message(wrongUsage);
  try {
    app.parse(std::move(arguments));
    refuseOddValues(app);
    finished = false;
    return kExitDone;
  } catch (const CLI::ParseError& error) {
    finished = true;
    const std::string told = plainly(error.what(), app), placed = config_defaults.placed(told);
    if (error.get_exit_code() != 0 && placed != told) return complain(placed);
    return app.exit(error) == 0 ? kExitDone : kExitWrongUsage;
  }
}

[[noreturn]] void endWithoutMemory(std::string_view why) {
  endUnfinished();
  std::_Exit(complainWithoutMemory(why));
}

bool has_returned = false;  ///< from what main() runs

/// Libraries in C that find no memory (PocketSphinx, Flite) tell so and call exit().
void endIfALibraryExits() {
  if (!has_returned) endWithoutMemory(kGivenUp);
}

/// Where an exception cannot be caught: destructors of libraries that allocate (JSON's do) find no memory. One that is
/// stopped by a noexcept of the standard library's (its folders' entries copy paths) has no type here.
[[noreturn]] void endUncaught() {
  const std::type_info* thrown = abi::__cxa_current_exception_type();
  if (thrown == nullptr && std::uncaught_exceptions() > 0) endWithoutMemory(kGivenUp);
  if (thrown == nullptr || (*thrown != typeid(std::bad_alloc) && *thrown != typeid(std::bad_array_new_length)))
    std::abort();
  endWithoutMemory(kNoMemory);
}

int runAction(CLI::App& app, int argc, const char* const* argv, const std::function<int()>& action) {
  bool finished = false;
  int code = parse(app, argc, argv, finished);
  if (!finished) code = action();
  if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0) throw InputError("stdout", "", "cannot be written");
  return code;
}

/// Ends the process as the signal would have, after what it has begun is cleared away.
[[noreturn]] void endBySignal(int signal) {
  endUnfinished();
  if (::isatty(STDERR_FILENO) == 1) std::fputs("\r\x1B[K", stderr);  // where a progress bar may stand
  std::signal(signal, SIG_DFL);
  sigset_t one;
  sigemptyset(&one);
  sigaddset(&one, signal);
  ::pthread_sigmask(SIG_UNBLOCK, &one, nullptr);
  std::raise(signal);
  std::_Exit(128 + signal);
}

/// From here on a thread waits for what ends a process from outside; what the caller's shell has it ignore (nohup)
/// stays ignored, and where the machine gives no thread a signal ends the process at once. To be called before other
/// threads start: they inherit the mask.
void awaitSignals() {
  sigset_t awaited;
  sigemptyset(&awaited);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGQUIT}) {
    struct sigaction action {};
    if (::sigaction(signal, nullptr, &action) == 0 && action.sa_handler != SIG_IGN) sigaddset(&awaited, signal);
  }
  ::pthread_sigmask(SIG_BLOCK, &awaited, nullptr);
  try {
    std::thread([awaited] {
      int signal = 0;
      while (::sigwait(&awaited, &signal) != 0) {
      }
      endBySignal(signal);
    }).detach();
  } catch (const std::system_error&) {
    ::pthread_sigmask(SIG_UNBLOCK, &awaited, nullptr);
  }
}

/// The exit code for the exception in flight, which is told.
int complainOfException() {
  try {
    throw;
  } catch (const InputError& error) {
    return complain(config_defaults.placed(error.what()));
  } catch (const InternalError& error) {
    return complain(fmt::format("internal error, please report it: {}", error.what()));
  } catch (const std::bad_alloc&) {
    return complainWithoutMemory();
  } catch (const std::filesystem::filesystem_error& error) {
    return complain(describe(error));
  } catch (const std::system_error& error) {
    return complain(fmt::format("the system refuses: {}", error.what()));
  } catch (const std::exception& error) {
    return complain(fmt::format("internal error, please report it: {}", error.what()));
  }
}

void setExample(CLI::App& app, std::string_view example) {
  std::string footer = "Example:\n  ";
  for (const char c : example) {
    footer += c;
    if (c == '\n') footer += "  ";
  }
  app.footer(footer);
}

}  // namespace

int caught(int argc, const char* const* argv, int (*run)(int argc, const char* const* argv)) {
  if (argc > 0) program_name = nameOf(argv[0]);
  std::set_terminate(endUncaught);
  std::atexit(endIfALibraryExits);
  // Nothing is played here: libraries of voices shall not look for a sound server, which keeps folders of its own.
  ::setenv("PULSE_SERVER", "unix:/dev/null", 1);
  int code = kExitBadInput;
  try {
    code = run(argc, argv);
  } catch (...) {
    try {
      code = complainOfException();
    } catch (...) {  // not even room for the words
      code = complainWithoutMemory();
    }
  }
  has_returned = true;
  return code;
}

int runProgram(const Command& program, const std::vector<Command>& subcommands, int argc, const char* const* argv) {
  CLI::App app(program.what, program.name);
  setExample(app, program.example);
  app.set_version_flag("--version", fmt::format("{} {} (commit {}; corpus format {}, face format {})", program.name,
                                                MOUTHPIECE_PROGRAM_VERSION, MOUTHPIECE_COMMIT, kCorpusFormatVersion,
                                                kFaceFormatVersion));
  std::function<int()> chosen;
  if (program.add) {
    chosen = program.add(app);
  } else {
    app.require_subcommand(1);
  }
  for (const Command& command : subcommands) {
    CLI::App* added = app.add_subcommand(command.name, command.what);
    setExample(*added, command.example);
    added->callback([&chosen, run = command.add(*added)] { chosen = run; });
  }
  awaitSignals();
  // A closed pipe and a file over the limit of its size are then ordinary write errors.
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  return runAction(app, argc, argv, [&chosen] { return chosen(); });
}

bool isUsersDefault(std::string_view option) { return config_defaults.has(option); }

void addQuietFlag(CLI::App& app, bool& quiet) {
  app.add_flag("--quiet,-q", quiet, "Print neither progress nor notices");
}

void addJsonFlag(CLI::App& app, bool& json) { app.add_flag("--json", json, "Print the facts as JSON"); }

void printText(std::string_view text) {
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size()) {
    throw InputError("stdout", "", fmt::format("cannot be written: {}", std::strerror(errno)));
  }
}

void printJson(const nlohmann::json& facts) { printText(jsonText(facts, 2) + "\n"); }

void printNotice(std::string_view text, bool quiet) {
  if (quiet) return;
  std::fflush(stdout);
  fmt::print(stderr, "{}: {}\n", program_name, printable(text, 2000));
}

ProgressBar::ProgressBar(std::string label, std::size_t total_steps, bool quiet)
    : label_(std::move(label)),
      total_steps_(total_steps),
      enabled_(!quiet && total_steps > 0 && ::isatty(STDERR_FILENO) == 1),
      started_(std::chrono::steady_clock::now()),
      last_drawn_(started_) {}

ProgressBar::~ProgressBar() {
  if (drawn_) std::fputs("\r\x1B[K", stderr);
}

void ProgressBar::advance(std::size_t steps) {
  done_ += steps;
  if (enabled_) draw();
}

void ProgressBar::setDone(std::size_t done) {
  done_ = done;
  if (enabled_) draw();
}

void ProgressBar::draw() {
  const std::scoped_lock lock(mutex_);
  const auto now = std::chrono::steady_clock::now();
  if (now - started_ < kShowAfter || now - last_drawn_ < kRedrawEvery) return;
  last_drawn_ = now;
  const std::size_t done = std::min(done_.load(), total_steps_);
  const std::size_t filled = kBarWidth * done / total_steps_;
  fmt::print(stderr, "\r{} [{:=<{}}{: <{}}] {}/{}\x1B[K", label_, "", filled, "", kBarWidth - filled, done,
             total_steps_);
  std::fflush(stderr);
  drawn_ = true;
}

}  // namespace mouthpiece
