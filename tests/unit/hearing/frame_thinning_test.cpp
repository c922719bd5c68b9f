#include "hearing/alignment/phone_decoder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace mouthpiece {
namespace {

using Cepstra = std::vector<std::vector<float>>;

/// `count` frames of one sound, each a little different.
void hold(Cepstra& cepstra, float colour, std::size_t count, float noise = 0.05F) {
  std::mt19937 random(static_cast<unsigned>(cepstra.size()));
  std::normal_distribution<float> spread(0, noise);
  for (std::size_t i = 0; i < count; ++i) {
    std::vector<float> frame;
    for (int k = 0; k < 13; ++k) frame.push_back(colour * static_cast<float>(k) + spread(random));
    cepstra.push_back(frame);
  }
}

std::size_t countIn(const std::vector<std::size_t>& kept, std::size_t first, std::size_t end) {
  return static_cast<std::size_t>(
      std::count_if(kept.begin(), kept.end(), [&](std::size_t i) { return i >= first && i < end; }));
}

TEST(FrameThinning, KeepsChangesAndDropsWhatIsHeld) {
  for (const float noise : {0.05F, 0.3F}) {
    Cepstra cepstra;
    hold(cepstra, 1, 300, noise);
    hold(cepstra, 2, 8, noise);
    hold(cepstra, 0.5F, 300, noise);
    const auto kept = thinFrames(cepstra, 60);
    EXPECT_NEAR(static_cast<double>(kept.size()), 60, 5) << noise;
    EXPECT_TRUE(std::is_sorted(kept.begin(), kept.end()));
    EXPECT_EQ(kept.front(), 0U);
    EXPECT_EQ(kept.back(), cepstra.size() - 1);
    EXPECT_EQ(countIn(kept, 298, 310), 12U) << "every frame of the short sound and beside it";
    EXPECT_LT(countIn(kept, 20, 280), 40U) << "of 260";
  }
}

TEST(FrameThinning, ShortSoundsStayAsTheyAre) {
  Cepstra cepstra;
  hold(cepstra, 1, 50);
  EXPECT_EQ(thinFrames(cepstra, 50).size(), 50U);
  EXPECT_EQ(thinFrames(cepstra, 500).size(), 50U);
  EXPECT_TRUE(thinFrames({}, 10).empty());
}

TEST(FrameThinning, StandsWhatNeverChanges) {
  const Cepstra digital_silence(1000, std::vector<float>(13, 0.0F));
  const auto kept = thinFrames(digital_silence, 100);
  EXPECT_EQ(kept.front(), 0U);
  EXPECT_EQ(kept.back(), 999U);
  EXPECT_NEAR(static_cast<double>(kept.size()), 100, 2) << "spread evenly";
}

}  // namespace
}  // namespace mouthpiece
