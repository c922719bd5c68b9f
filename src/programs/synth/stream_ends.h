#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "mouthpiece/errors.h"
#include "mouthpiece/live.h"

namespace mouthpiece {

/// The bytes of standard input or a file, as they come. Waiting ends when `is_stopped` is set.
class InputBytes {
 public:
  /// `file`: "stdin" or a path. Throws InputError where it cannot be opened.
  InputBytes(std::string file, const std::atomic<bool>& is_stopped);
  ~InputBytes();
  InputBytes(const InputBytes&) = delete;
  InputBytes& operator=(const InputBytes&) = delete;

  /// What is there, at least one byte and at most `most`; "" at the end.
  std::string some(std::size_t most);
  /// So many bytes, fewer at the end.
  std::string exactly(std::size_t count);
  /// How many were read.
  [[nodiscard]] std::size_t offset() const { return offset_; }

 private:
  std::string file_;
  int descriptor_;
  const std::atomic<bool>& is_stopped_;
  std::size_t offset_ = 0;
};

/// Its lines, without their ends. Throws InputError for one of over 64 KiB.
class InputLines {
 public:
  InputLines(std::string file, const std::atomic<bool>& is_stopped)
      : input_(file, is_stopped), file_(std::move(file)) {}
  /// nullopt at the end.
  std::optional<std::string> next();
  [[nodiscard]] std::size_t lineNumber() const { return line_number_; }

 private:
  InputBytes input_;
  std::string file_, read_;
  std::size_t line_number_ = 0;
};

/// Text sentence by sentence: to a full stop, question or exclamation mark before a blank, other scripts' stop, or a
/// line's end; sentences of over 80 characters to the last comma or other pause within these, not under 30, or the next
/// one: a voice takes long to say a long sentence. Those of over 400 to a blank.
class SentenceReader {
 public:
  /// `file`: "-" for standard input.
  SentenceReader(const std::string& file, const std::atomic<bool>& is_stopped)
      : input_(file == "-" ? "stdin" : file, is_stopped) {}
  /// With something to say in it; nullopt at the end.
  std::optional<std::string> next();
  /// Where the last one begins, from 1.
  [[nodiscard]] std::size_t lineNumber() const { return line_number_; }

 private:
  std::optional<std::size_t> endOfSentence() const;

  InputBytes input_;
  std::string read_;
  std::size_t line_number_ = 0, lines_before_ = 0;  ///< the second: ends of lines before `read_`
  bool is_over_ = false;
};

/// Whether a word may be said then; what is wrong with one that may be is the word.
inline bool isTime(const TimeSpan& span) { return span.start >= 0 && span.end >= span.start; }

/// The fields of a line of labels between blanks; false for an empty line or a comment (#).
bool splitLabel(const std::string& line, std::vector<std::string>& fields);

/// Where the frames of a stream go.
class StreamOutput {
 public:
  virtual ~StreamOutput() = default;
  /// Throws InputError where it cannot be written.
  virtual void write(const Frame& frame) = 0;
};

enum class StreamRows { kArkit, kMarkers, kVertices };

/// A line of JSON a frame on stdout (docs/formats/stream.md).
std::unique_ptr<StreamOutput> jsonLines();
/// Rows of little-endian floats on stdout: the time in seconds, then the values.
std::unique_ptr<StreamOutput> floatRows(StreamRows what);
/// Live Link Face's datagrams. `address`: HOST:PORT. Throws InputError for one that is none.
std::unique_ptr<StreamOutput> liveLinkPackets(const std::string& address, double frame_rate_hz,
                                              const std::string& subject);

/// A mono 16-bit WAV that is whole after every write().
class GrowingWav {
 public:
  /// Throws InputError where it cannot be written.
  explicit GrowingWav(const std::string& path);
  ~GrowingWav();
  /// Silence up to `begin` seconds from the start, then the sound. All have one rate.
  void write(const Sound& sound, Seconds begin);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace mouthpiece
