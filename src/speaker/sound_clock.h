#pragma once

#include <chrono>

#include "mouthpiece/labels.h"

namespace mouthpiece {

/// How far the sound of a stream lies ahead of who says it. A file that is sent at once is ahead, and can be waited
/// for; who speaks now is not, even where a program took a second to start and gets that second at once.
class SoundClock {
 public:
  using Clock = std::chrono::steady_clock;

  explicit SoundClock(Clock::time_point made) : began_(made - durationOf(kStart)), left_(made) {}

  /// A chunk of `length` comes, after sound of `before`. Where one had to wait for it, it was only just said.
  void come(Clock::time_point now, Seconds before, Seconds length) {
    if (secondsOf(now - left_) > kPause * length) began_ = now - durationOf(before + length);
  }
  /// The chunk has been heard.
  void leave(Clock::time_point now) { left_ = now; }
  /// Below zero where sound waits to be heard.
  [[nodiscard]] Seconds ahead(Clock::time_point now, Seconds sound) const { return sound - secondsOf(now - began_); }

 private:
  static constexpr Seconds kStart = 1;    ///< that a stream may take to be there, while its sound comes already
  static constexpr double kPause = 0.25;  ///< of a chunk's length: quicker ones were there before

  static Seconds secondsOf(Clock::duration duration) { return std::chrono::duration<double>(duration).count(); }
  static Clock::duration durationOf(Seconds seconds) {
    return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
  }

  Clock::time_point began_, left_;
};

}  // namespace mouthpiece
