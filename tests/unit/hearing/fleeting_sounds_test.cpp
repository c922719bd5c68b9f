#include "hearing/alignment/acoustic_model.h"

#include <gtest/gtest.h>

namespace mouthpiece {
namespace {

TiedModel modelOf(const std::vector<std::string>& phones) {
  TiedModel model;
  for (const std::string& phone : phones) {
    const auto senone = static_cast<int>(model.senone_count++);
    model.codebooks.push_back({phone, {senone}, {}, {}});
  }
  return model;
}

TEST(FleetingSounds, AreWeighedAsIfTheFramesLeftOutWereHeard) {
  const TiedModel model = modelOf({"AA", "Y", "N", "HH"});
  // Frame 10 stands for half of what lies to each side; no frame for more than 30.
  const FleetingSounds fleeting(model, {0, 1, 2, 10, 18, 218});
  SenoneScorer::Scores scores(4, 3);
  scores.setConstant(10);
  fleeting.weigh(scores, 2);
  EXPECT_EQ(scores.row(0).maxCoeff(), 10) << "a vowel";
  EXPECT_EQ(scores.row(2).maxCoeff(), 10) << "a nasal can be held";
  EXPECT_EQ(scores(1, 0), 45);
  EXPECT_EQ(scores(1, 1), 80);
  EXPECT_EQ(scores(3, 1), 80);
  EXPECT_EQ(scores(1, 2), 300);
  scores.setConstant(30000);
  fleeting.weigh(scores, 3);
  EXPECT_EQ(scores(1, 0), 32767) << "no score runs over";
}

TEST(FleetingSounds, TellHowOftenTheyWereWeighed) {
  const FleetingSounds fleeting(modelOf({"Y"}), {0, 1, 2, 10, 18});
  EXPECT_DOUBLE_EQ(fleeting.timesWeighed(Phone::kY, 1, 3), (1 + 4.5 + 8) / 3);
  EXPECT_DOUBLE_EQ(fleeting.timesWeighed(Phone::kN, 1, 3), 1);
  EXPECT_DOUBLE_EQ(FleetingSounds().timesWeighed(Phone::kY, 0, 3), 1) << "spoken words";
}

}  // namespace
}  // namespace mouthpiece
