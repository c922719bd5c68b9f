#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <mutex>
#include <vector>

#include "deform/surface/face_motion.h"
#include "mouthpiece/live.h"
#include "mouthpiece/motion.h"
#include "retarget/rig/face_rig.h"

namespace mouthpiece {

/// Puts chunks of sound that carry their place into a row: what is missing between them, what comes twice, what comes
/// too late. Places and lengths are in samples.
class ChunkOrder {
 public:
  explicit ChunkOrder(int sample_rate_hz) : rate_hz_(sample_rate_hz) {}

  /// What to do with a chunk: hear so much silence, then its samples from `skipped` on.
  struct Place {
    std::size_t silence = 0;
    std::size_t skipped = 0;
  };
  /// A chunk that follows what came before.
  void follow(std::size_t count) { next_ += count; }
  /// A chunk with its place; tells `counts` of what is wrong with it. Throws InputError for one that is over ten
  /// seconds ahead.
  Place place(std::uint64_t at, std::size_t count, LiveCounts& counts);
  /// Whether a chunk begins behind what is missing, and ends within a tenth of a second from there: what it waits for
  /// may have changed places with it.
  [[nodiscard]] bool mayWait(std::uint64_t at, std::size_t count) const;
  /// Whether something is missing before it.
  [[nodiscard]] bool isAhead(std::uint64_t at) const;
  /// So much was shown without its sound.
  void passOver(std::size_t count);

 private:
  struct Stretch {
    std::uint64_t begin, end;
  };
  int rate_hz_;
  std::uint64_t next_ = 0;           ///< sample of our clock
  std::int64_t shift_ = 0;           ///< of the sender's clock to ours
  std::deque<Stretch> passed_over_;  ///< of our clock, the latest
  std::uint64_t late_in_a_row_ = 0;  ///< samples
};

/// All that a frame shows; the mesh is posed when it is pulled.
struct ShownFrame {
  std::vector<double> markers_mm;
  std::array<float, kArkitShapes> arkit{};
  LipPose lips;
  TonguePose tongue;
  std::vector<double> face_markers;  ///< empty: no face
  std::vector<LipGap> lip_gaps;
  GazeTurn gaze;
};

/// `to` becomes what lies between `from` and `rest`, as far as `way` (0 to 1) says. All have the same sizes.
void lerpFrame(const ShownFrame& from, const ShownFrame& rest, double way, ShownFrame& to);

/// A ring of frames that grows while they are added and gives no memory back: what is taken leaves room for others.
class FrameRing {
 public:
  [[nodiscard]] std::size_t size() const { return count_; }
  /// A frame at the end, to be filled; it holds what some earlier one held.
  ShownFrame& add();
  /// The first frame changes places with `frame`. There is one.
  void take(ShownFrame& frame);

 private:
  std::vector<ShownFrame> frames_;
  std::size_t first_ = 0, count_ = 0;
};

}  // namespace mouthpiece
