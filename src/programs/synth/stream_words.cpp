#include "programs/synth/stream_words.h"

#include <chrono>
#include <utility>
#include <vector>

#include "base/text_numbers.h"
#include "mouthpiece/errors.h"
#include "programs/program.h"
#include "programs/synth/stream_ends.h"

namespace mouthpiece {
namespace {

/// Frames and sound are looked at so often.
void waitAWhile() { std::this_thread::sleep_for(std::chrono::milliseconds(2)); }

constexpr Seconds kAhead = 2.0;       ///< so much is said ahead of what is pulled
constexpr Seconds kSoundAhead = 10;   ///< of what is said: a stream keeps the last half a minute
constexpr Seconds kResampled = 0.05;  ///< after a word its last sound has been resampled, too
/// So long after the sound its first word may come: a pipe that nobody writes to does not end.
constexpr std::chrono::seconds kPatience(5);

}  // namespace

void UnsaidWords::add(const std::string& file, std::size_t line, const InputError& why, bool quiet) {
  const InputError told(file, std::to_string(line), why.what());
  printNotice(std::string("warning: ") + told.what() + "; it is left out", quiet);
  if (!first_) first_ = told;
  ++count_;
}

void UnsaidWords::expectAnySaid() const {
  if (first_ && !is_any_said_) throw InputError(*first_);
}

WordsBesideSound::WordsBesideSound(std::string file, LiveStream& stream, const LiveOptions& options, bool in_real_time,
                                   const std::atomic<bool>& is_stopped, bool quiet)
    : file_(std::move(file)),
      stream_(stream),
      options_(options),
      in_real_time_(in_real_time),
      is_stopped_(is_stopped),
      quiet_(quiet) {
  reading_ = std::thread([this] {
    try {
      readWords();
    } catch (...) {
      failed_ = std::current_exception();
    }
    is_saying_ = false;
    is_read_ = true;
  });
}

WordsBesideSound::~WordsBesideSound() {
  is_over_ = true;
  if (reading_.joinable()) reading_.join();
}

Seconds WordsBesideSound::shownUntil() const {
  return static_cast<double>(stream_.counts().frames) / stream_.frameRateHz();
}

Seconds WordsBesideSound::heardUntil() const { return static_cast<double>(samples_) / options_.sample_rate_hz; }

bool WordsBesideSound::waitForSound(const TimeSpan& span) {
  const auto is_needed = [&] {
    const Seconds shown = shownUntil();
    return in_real_time_ && shown > 0 && shown + options_.look_ahead >= span.start;
  };
  while (heardUntil() < span.end + kResampled && !has_all_sound_ && !is_needed()) {
    if (is_over_) return false;
    waitAWhile();
  }
  return !is_over_;
}

void WordsBesideSound::readWords() {
  InputLines lines(file_, is_over_);
  std::vector<std::string> fields;
  while (const std::optional<std::string> line = lines.next()) {
    has_words_ = true;
    if (!splitLabel(*line, fields)) continue;
    const std::optional<double> start = parseNumber(fields[0]);
    const std::optional<double> end = fields.size() > 1 ? parseNumber(fields[1]) : std::nullopt;
    const std::string place = std::to_string(lines.lineNumber());
    if (!start || !end || fields.size() < 3)
      throw InputError(file_, place, "found '" + fields[0] + " ...'; expected START END WORD in seconds");
    const TimeSpan span{*start, *end};
    if (!waitForSound(span)) return;
    is_saying_ = true;
    const bool has_sound = heardUntil() >= span.end;
    try {
      const std::scoped_lock lock(pushing_);
      stream_.push(fields[2], span);
      unsaid_.said();
      if (!has_sound) ++without_sound_;
    } catch (const InputError& error) {
      if (!isTime(span)) throw InputError(file_, place, error.what());
      unsaid_.add(file_, lines.lineNumber(), error, quiet_);
    }
    while (!is_over_ && stream_.saidUntil() > shownUntil() + kAhead + options_.look_ahead) waitAWhile();
    is_saying_ = false;
  }
  unsaid_.expectAnySaid();
}

void WordsBesideSound::pushSound(std::span<const float> samples) {
  while (is_saying_ && !is_stopped_ && heardUntil() > stream_.saidUntil() + kSoundAhead) waitAWhile();
  if (is_read_ && failed_) finish();
  {
    const std::scoped_lock lock(pushing_);
    stream_.pushSoundOfWords(samples);
  }
  samples_ += samples.size();
}

void WordsBesideSound::finish() {
  has_all_sound_ = true;
  const auto patient_until = std::chrono::steady_clock::now() + kPatience;
  while (!is_read_ && !is_stopped_) {
    if (!has_words_ && std::chrono::steady_clock::now() > patient_until)
      throw InputError(file_, "", "nobody has written to it, and the sound is over; expected lines START END WORD");
    waitAWhile();
  }
  is_over_ = true;
  reading_.join();
  if (failed_) std::rethrow_exception(failed_);
  if (!is_stopped_ && heardUntil() > stream_.saidUntil()) stream_.silence(heardUntil());
}

}  // namespace mouthpiece
