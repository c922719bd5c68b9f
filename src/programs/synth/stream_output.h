#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "mouthpiece/live.h"

namespace mouthpiece {

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
