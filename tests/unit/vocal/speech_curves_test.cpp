// VOCAL 4.2, "Generating a speech curve", number by number (docs/theory/vocal/vocal.md, table of fidelity).
#include <gtest/gtest.h>

#include <algorithm>

#include "support/spoken_phones.h"
#include "vocal/viseme_curves.h"
#include "vocal/viseme_events.h"

namespace mouthpiece {
namespace {

using samples::spokenPhones;

const AnimationCurve& curveOf(const CurveSet& curves, std::string_view name) {
  const AnimationCurve* curve = findCurve(curves, name);
  if (curve == nullptr) throw std::runtime_error("no curve " + std::string(name));
  return *curve;
}

CurveSet speech(const std::vector<std::pair<Phone, Seconds>>& phones) {
  return visemeCurves(spokenPhones(phones), {}, {});
}

TEST(SpeechCurves, FourKeysAtThePapersTimes) {
  const AnimationCurve curve = curveOf(speech({{Phone::kAA, 0.1}}), "Ah");
  ASSERT_EQ(curve.keys.size(), 4U);
  EXPECT_NEAR(curve.keys[0].time, 0.5 - 0.120, 1e-12) << "120 ms before phonation";
  EXPECT_NEAR(curve.keys[1].time, 0.5, 1e-12) << "apex at the beginning";
  EXPECT_NEAR(curve.keys[2].time, 0.5 + 0.75 * 0.1, 1e-12) << "sustained until 75 %";
  EXPECT_NEAR(curve.keys[3].time, 0.6 + 0.120, 1e-12) << "120 ms after";
  EXPECT_EQ(curve.keys[0].value, 0);
  EXPECT_EQ(curve.keys[3].value, 0);
}

TEST(SpeechCurves, AmplitudesOfThePaper) {
  const auto apex = [](Phone phone, Seconds length) {
    double highest = 0;
    for (const AnimationCurve& curve : speech({{phone, length}})) {
      for (const CurveKey& key : curve.keys) highest = std::max(highest, key.value);
    }
    return highest;
  };
  for (const Phone phone : {Phone::kB, Phone::kP, Phone::kM, Phone::kF, Phone::kV, Phone::kS, Phone::kSH})
    EXPECT_DOUBLE_EQ(apex(phone, 0.1), 1.0) << phoneName(phone);
  for (const Phone phone : {Phone::kT, Phone::kK, Phone::kL, Phone::kR, Phone::kW, Phone::kTH})
    EXPECT_DOUBLE_EQ(apex(phone, 0.1), 0.6) << phoneName(phone);
  EXPECT_DOUBLE_EQ(apex(Phone::kAA, 0.199), 0.6);
  EXPECT_DOUBLE_EQ(apex(Phone::kAA, 0.201), 0.8);
}

TEST(SpeechCurves, RepeatedVisemesThatOverlapShareOneKey) {
  // IY N IY: 0.18 s between; 120 ms ahead of the second onset lies after the first's hold.
  const AnimationCurve curve = curveOf(speech({{Phone::kIY, 0.1}, {Phone::kN, 0.18}, {Phone::kIY, 0.1}}), "Ee");
  ASSERT_EQ(curve.keys.size(), 7U);
  EXPECT_NEAR(curve.keys[3].time, 0.78 - 0.120, 1e-12);
  EXPECT_NEAR(curve.keys[3].value, 0.5 * 0.6, 1e-12) << "VC = 0.5 in speech";
}

TEST(SpeechCurves, TheSharedKeyIsMidwayWhereThereIsNoRoom) {
  // 0.05 s between: 120 ms ahead would lie inside the first vowel.
  const AnimationCurve curve = curveOf(speech({{Phone::kIY, 0.1}, {Phone::kN, 0.05}, {Phone::kIY, 0.1}}), "Ee");
  ASSERT_EQ(curve.keys.size(), 7U);
  EXPECT_NEAR(curve.keys[3].time, 0.5 * (0.575 + 0.65), 1e-12);
  EXPECT_NEAR(curve.keys[3].value, 0.5 * 0.6, 1e-12);
}

TEST(SpeechCurves, FarApartNothingIsShared) {
  const AnimationCurve curve = curveOf(speech({{Phone::kIY, 0.1}, {Phone::kN, 0.30}, {Phone::kIY, 0.1}}), "Ee");
  EXPECT_EQ(curve.keys.size(), 8U);
}

TEST(SpeechCurves, AdjacentRepeatsAreOneViseme) {
  const AnimationCurve curve =
      curveOf(speech({{Phone::kAA, 0.1}, {Phone::kP, 0.06}, {Phone::kM, 0.08}, {Phone::kIY, 0.1}}), "MBP");
  ASSERT_EQ(curve.keys.size(), 4U);
  EXPECT_NEAR(curve.keys[1].time, 0.6, 1e-12);
  EXPECT_NEAR(curve.keys[2].time, 0.66 + 0.75 * 0.08, 1e-12);
  EXPECT_EQ(curve.keys[1].value, 1);
}

TEST(SpeechCurves, LipHeavyStartsEarlierEndsLaterAndRoundsItsNeighbours) {
  // T UW: the T is spoken with round lips; its own lip part is gone, its jaw part is not.
  const CurveSet curves = speech({{Phone::kIY, 0.1}, {Phone::kT, 0.08}, {Phone::kUW, 0.1}});
  const AnimationCurve& round = curveOf(curves, "Oo");
  EXPECT_NEAR(round.keys[1].time, 0.6, 1e-12) << "round already where the T begins";
  EXPECT_NEAR(round.keys[0].time, 0.6 - 0.150, 1e-12) << "150 ms ahead";
  EXPECT_NEAR(round.keys.back().time, 0.78 + 0.150, 1e-12);
  EXPECT_TRUE(curveOf(curves, "LNTD").keys.empty());
  EXPECT_FALSE(curveOf(curves, "LNTD_jaw").keys.empty());
}

/// JALI's rule by words: a target looks ahead inside its word, the last phone of a word looks back.
TEST(SpeechCurves, ConsonantsLookAheadInTheirWordAndItsLastOneBack) {
  const auto lipsOf = [](const std::vector<Phone>& first, const std::vector<Phone>& second, Phone consonant) {
    std::vector<std::pair<Phone, Seconds>> phones;
    for (const auto& word : {first, second}) {
      for (const Phone phone : word) phones.emplace_back(phone, 0.1);
    }
    SpeechLabels labels = spokenPhones(phones);
    std::size_t next = 1;
    for (const auto& word : {first, second}) {
      for (std::size_t i = next; i < next + word.size(); ++i) labels.phones[i].word = labels.words.size();
      labels.words.push_back({"word", {PhoneIndex(next), PhoneIndex(next + word.size() - 1)}});
      next += word.size();
    }
    const auto events = coarticulated(fourKeyEvents(labels), labels);
    const auto own = std::find_if(events.begin(), events.end(), [&](const VisemeEvent& event) {
      return labels.phones[event.phone.value].phone == consonant;
    });
    return own->lips;
  };
  using enum Phone;
  EXPECT_EQ(lipsOf({kT, kUW}, {kS, kIY}, kS), 1) << "two see: S looks ahead, at IY";
  EXPECT_EQ(lipsOf({kIY, kS}, {kUW, kT}, kS), 1) << "ease oot: S is its word's last and looks back, at IY";
  EXPECT_EQ(lipsOf({kS, kUW}, {kT, kIY}, kS), 0) << "sue: S looks ahead, at UW";
  EXPECT_EQ(lipsOf({kL, kUW, kS}, {kT, kIY}, kS), 0) << "loose: S is the last and looks back, at UW";
  EXPECT_EQ(lipsOf({kL, kUW, kS, kIY}, {kT, kIY}, kS), 1) << "Lucy: S looks ahead, at IY";
  EXPECT_EQ(lipsOf({kF, kUW}, {kT, kIY}, kF), 1) << "a labial keeps its lips";
}

TEST(SpeechCurves, LipHeavyCombinesWithLabials) {
  const CurveSet curves = speech({{Phone::kB, 0.08}, {Phone::kUW, 0.1}});
  EXPECT_EQ(curveOf(curves, "MBP").valueAt(0.5), 1) << "the lips close all the same";
  EXPECT_GT(curveOf(curves, "Oo").valueAt(0.5), 0) << "and are rounding already";
}

TEST(SpeechCurves, TongueOnlyLeavesTheLipsAlone) {
  const CurveSet curves = speech({{Phone::kAA, 0.1}, {Phone::kG, 0.1}, {Phone::kIY, 0.1}});
  EXPECT_TRUE(curveOf(curves, "GK").keys.empty());
  EXPECT_NEAR(curveOf(curves, "GK_jaw").valueAt(0.62), 0.6, 1e-12) << "longer than a frame: it narrows the jaw";
}

TEST(SpeechCurves, ShortObstruentsLeaveTheJawAlone) {
  const CurveSet alone = speech({{Phone::kAA, 0.1}, {Phone::kD, 0.03}, {Phone::kIY, 0.1}});
  EXPECT_TRUE(curveOf(alone, "LNTD").keys.empty());
  EXPECT_EQ(findCurve(alone, "LNTD_jaw"), nullptr) << "neither lips nor jaw: both parts are alike, empty";
  const CurveSet pair = speech({{Phone::kAA, 0.1}, {Phone::kD, 0.03}, {Phone::kZ, 0.06}, {Phone::kIY, 0.1}});
  EXPECT_FALSE(curveOf(pair, "LNTD_jaw").keys.empty()) << "with a similar neighbour it does";
}

TEST(SpeechCurves, AspiratesHaveTheNextVowelsShape) {
  const CurveSet curves = speech({{Phone::kHH, 0.08}, {Phone::kIY, 0.1}});
  EXPECT_EQ(findCurve(curves, "H"), nullptr);
  EXPECT_NEAR(curveOf(curves, "Ee").keys[1].time, 0.5, 1e-12) << "reached where the H begins";
}

TEST(SpeechCurves, DiphthongsGoThroughTwoVisemes) {
  const CurveSet brief = speech({{Phone::kAY, 0.15}});
  EXPECT_NEAR(curveOf(brief, "Ah").keys[1].time, 0.5, 1e-12);
  EXPECT_NEAR(curveOf(brief, "Ee").keys[1].time, 0.575, 1e-12);
  const CurveSet sustained = speech({{Phone::kAY, 0.3}});
  EXPECT_NEAR(curveOf(sustained, "Ee").keys[1].time, 0.68 + 0.06, 1e-12) << "120 ms about the turn, 120 before the end";
  for (Seconds time = 0.5; time < 0.8; time += 0.01)
    EXPECT_LE(curveOf(sustained, "Ah").valueAt(time) + curveOf(sustained, "Ee").valueAt(time), 0.8 + 1e-9) << time;
}

TEST(SpeechCurves, HeldDiphthongsKeepTheirFirstVowel) {
  const CurveSet held = speech({{Phone::kOW, 2.0}});
  const AnimationCurve open = curveOf(held, "Oh"), close = curveOf(held, "Oo");
  EXPECT_GT(open.valueAt(0.5 + 1.7), 0.7) << "held to the last 180 ms";
  EXPECT_LT(close.valueAt(0.5 + 1.7), 0.05);
  EXPECT_GT(close.valueAt(0.5 + 1.96), open.valueAt(0.5 + 1.96)) << "then it vanishes";
}

TEST(SpeechCurves, PlosivesBeforeAPauseLetGo) {
  EXPECT_GT(curveOf(speech({{Phone::kAA, 0.1}, {Phone::kP, 0.08}}), "Uh").valueAt(0.74), 0.1);
  EXPECT_EQ(findCurve(speech({{Phone::kAA, 0.1}, {Phone::kM, 0.08}}), "Uh"), nullptr) << "nasals need not";
}

TEST(SpeechCurves, LabialsLetGoAtOnceAndNothingElseDoes) {
  const auto share_left = [](Phone phone, const std::string& viseme) {
    const AnimationCurve curve = curveOf(speech({{phone, 0.1}}), viseme);
    const CurveKey held = curve.keys[2], gone = curve.keys[3];
    EXPECT_NEAR(held.time - curve.keys[1].time, 0.075, 1e-12) << "held to 75 % of the phone";
    return curve.valueAt(held.time + 0.1 * (gone.time - held.time)) / held.value;
  };
  EXPECT_NEAR(share_left(Phone::kB, "MBP"), 0.9 * 0.9 * 1.1, 1e-12) << "(1 - u)^2 (1 + u)";
  EXPECT_NEAR(share_left(Phone::kF, "FV"), 0.9 * 0.9 * 1.1, 1e-12);
  EXPECT_NEAR(share_left(Phone::kS, "S"), 0.9 * 0.9 * 1.2, 1e-12) << "(1 - u)^2 (1 + 2 u), flat at first";
}

TEST(SpeechCurves, SilenceDrawsNothing) { EXPECT_TRUE(speech({}).empty()); }

}  // namespace
}  // namespace mouthpiece
