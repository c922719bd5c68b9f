#pragma once

#include <atomic>
#include <cstddef>
#include <exception>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>

#include "mouthpiece/errors.h"
#include "mouthpiece/live.h"
#include "programs/synth/stream_ends.h"

namespace mouthpiece {

/// Words or sentences of an input that cannot be said, which a stream goes on without.
class UnsaidWords {
 public:
  /// Tells of one, unless `quiet`. `line`: where it stands in `file`, from 1.
  void add(const std::string& file, std::size_t line, const InputError& why, bool quiet);
  void said() { is_any_said_ = true; }
  [[nodiscard]] std::size_t count() const { return count_; }
  /// Throws the first one's InputError where nothing else was said.
  void expectAnySaid() const;

 private:
  std::optional<InputError> first_;
  std::size_t count_ = 0;
  bool is_any_said_ = false;
};

/// Words with their times from a file or a pipe, said by a stream while their sound comes beside them: a word waits for
/// its sound, which tells when each of its phones is said.
class WordsBesideSound {
 public:
  /// `file`: lines START END WORD, read by a thread of their own. `in_real_time`: frames are pulled when their time
  /// comes, so that a word waits no longer than they can.
  WordsBesideSound(std::string file, LiveStream& stream, const LiveOptions& options, bool in_real_time,
                   const std::atomic<bool>& is_stopped, bool quiet);
  ~WordsBesideSound();
  WordsBesideSound(const WordsBesideSound&) = delete;
  WordsBesideSound& operator=(const WordsBesideSound&) = delete;

  /// The sound that follows, in [-1, 1]. Waits while words whose sound has come are still being said.
  void pushSound(std::span<const float> samples);
  /// No sound follows: the words that are left are said, and silence to the sound's end. Throws InputError for a line
  /// that is none.
  void finish();
  /// Words that cannot be said, after finish().
  [[nodiscard]] std::size_t leftOut() const { return unsaid_.count(); }
  /// Words that were said before all their sound had come.
  [[nodiscard]] std::size_t withoutSound() const { return without_sound_; }

 private:
  void readWords();
  /// Waits for the sound; false when nobody wants more.
  [[nodiscard]] bool waitForSound(const TimeSpan& span);
  [[nodiscard]] Seconds shownUntil() const;
  [[nodiscard]] Seconds heardUntil() const;

  std::string file_;
  LiveStream& stream_;
  const LiveOptions options_;
  const bool in_real_time_;
  const std::atomic<bool>& is_stopped_;
  const bool quiet_;
  UnsaidWords unsaid_;                 ///< of the reading thread
  std::atomic<bool> is_over_ = false;  ///< nobody asks for more words
  std::atomic<bool> has_all_sound_ = false;
  std::atomic<bool> is_saying_ = false;   ///< a word whose sound has come
  std::atomic<bool> is_read_ = false;     ///< the file, or what of it can be
  std::atomic<bool> has_words_ = false;   ///< a line has come
  std::atomic<std::size_t> samples_ = 0;  ///< that have come
  std::atomic<std::size_t> without_sound_ = 0;
  std::mutex pushing_;         ///< one thread at a time may push
  std::exception_ptr failed_;  ///< of the reading thread, once is_read_
  std::thread reading_;
};

}  // namespace mouthpiece
