#include "synthesis/curve_ablation.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "support/spoken_phones.h"
#include "vocal/viseme_curves.h"

namespace mouthpiece {
namespace {

using samples::spokenPhones;

/// A vowel sung over two notes, the second with vibrato, that sounds like another vowel for a while.
AudioTags sungTags() {
  AudioTags tags;
  tags.notes = {{{0.6, 1.0}, 200}, {{1.1, 1.9}, 300}, {{2.1, 2.4}, 250}};
  tags.vibrato = {{{1.2, 1.9}, 6, 0.5}};
  for (int k = 0; k < 300; ++k) {
    const bool sounds_like_i = k >= 130 && k < 180;
    tags.vowels.push_back({k * 0.01, sounds_like_i ? 0.1 : 0.9, 0, sounds_like_i ? 0.9 : 0.1, 0, 0, 0});
  }
  return tags;
}

class CurveAblation : public ::testing::Test {
 protected:
  CurveAblation() {
    style_.ma = StyleSignal(0.7);
    style_.ps = StyleSignal(0.8);
    for (int k = 0; k < 300; ++k) times_.push_back(k * 0.01);
    variants_ = ablateCurves(labels_, sungTags(), style_, genericPoses(), times_);
  }

  [[nodiscard]] const CurveVariant& variant(const std::string& name) const {
    return *std::find_if(variants_.begin(), variants_.end(), [&](const CurveVariant& v) { return v.name == name; });
  }

  SpeechLabels labels_ = spokenPhones({{Phone::kM, 0.1}, {Phone::kAA, 1.3}, {Phone::kS, 0.15}, {Phone::kIY, 0.4}});
  VocalStyle style_;
  std::vector<Seconds> times_;
  std::vector<CurveVariant> variants_;
};

TEST_F(CurveAblation, HasEachPartLeftOutOnce) {
  std::vector<std::string> names;
  for (const CurveVariant& each : variants_) names.push_back(each.name);
  EXPECT_EQ(names, (std::vector<std::string>{"all", "without Ma", "without Ps", "without vowel modification",
                                             "without vibrato", "as speech"}));
  EXPECT_EQ(variant("all").curves, vocalCurves(labels_, sungTags(), style_));
  for (const CurveVariant& each : variants_) {
    EXPECT_EQ(each.lip_opening_mm.size(), times_.size());
    EXPECT_EQ(each.chin_drop_mm.size(), times_.size());
  }
}

TEST_F(CurveAblation, EachPartChangesWhatItIsToChange) {
  const auto at = [&](const char* name, const char* curve, Seconds time) {
    const AnimationCurve* found = findCurve(variant(name).curves, curve);
    return found == nullptr ? 0.0 : found->valueAt(time);
  };
  const Seconds s_middle = labels_.phones[3].span.middle();
  EXPECT_GT(at("without Ma", "S", s_middle), at("all", "S", s_middle) + 0.3) << "the consonant stays whole";
  EXPECT_EQ(findCurve(variant("without vowel modification").curves, "lipSpread"), nullptr);
  EXPECT_GT(at("all", "lipSpread", 1.5), 0.3);
  const auto turns = [&](const char* name) {
    int count = 0;
    for (Seconds time = 1.25; time < 1.9; time += 0.01) {
      const double before = at(name, "Ah", time) - at(name, "Ah", time - 0.01);
      const double after = at(name, "Ah", time + 0.01) - at(name, "Ah", time);
      count += before * after < -1e-9 ? 1 : 0;  // not the noise of a flat curve
    }
    return count;
  };
  EXPECT_GE(turns("all"), 6) << "seven a second, up and down";
  EXPECT_LE(turns("without vibrato"), 1);
  EXPECT_LE(turns("without Ps"), 1);
  EXPECT_EQ(variant("as speech").curves.size(), vocalCurves(labels_, {}, {}).size() + 1)
      << "speech, and the larynx, which no parameter governs";
}

}  // namespace
}  // namespace mouthpiece
