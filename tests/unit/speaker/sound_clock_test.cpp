#include "speaker/sound_clock.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace mouthpiece {
namespace {

constexpr Seconds kChunk = 0.02;

/// The furthest that sound of 20 s is ahead when it comes by chunks, `first` of it at once, each a chunk's time after
/// the one before where `is_said` now; each is heard in `heard`.
Seconds furthestAhead(Seconds first, bool is_said, Seconds heard) {
  const SoundClock::Clock::time_point made{};
  const auto at = [&](Seconds time) {
    return made + std::chrono::duration_cast<SoundClock::Clock::duration>(std::chrono::duration<double>(time));
  };
  SoundClock clock(made);
  Seconds now = 0, furthest = -100;
  for (Seconds sound = 0; sound < 20; sound += kChunk) {
    if (is_said) now = std::max(now, sound + kChunk - first);  // it comes no sooner than it is said
    clock.come(at(now), sound, kChunk);
    furthest = std::max(furthest, clock.ahead(at(now), sound + kChunk));
    now += heard;
    clock.leave(at(now));
  }
  return furthest;
}

TEST(SoundClock, WhoSpeaksIsNotAhead) {
  EXPECT_LT(furthestAhead(0, true, 0.004), 0.01);
  EXPECT_LT(furthestAhead(0.9, true, 0.004), 0.01) << "what was said while the program started comes at once";
  EXPECT_LT(furthestAhead(0, true, 0.030), 0.01) << "a machine that is too slow";
}

TEST(SoundClock, AFileIs) {
  EXPECT_GT(furthestAhead(0, false, 0.004), 10);
  EXPECT_LT(furthestAhead(0, false, 0.040), 0) << "where hearing takes longer than the sound does";
}

}  // namespace
}  // namespace mouthpiece
