#include "vocal/vocal_style.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "base/errors.h"
#include "support/spoken_phones.h"

namespace mouthpiece {
namespace {

using samples::spokenPhones;

TEST(StyleSignal, GoesStraightBetweenItsPointsAndHoldsBeyond) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> share(0, 1);
    StyleSignal signal;
    Seconds time = 0;
    for (std::size_t count = 1 + seed % 7; count > 0; --count)
      signal.points.push_back({time += 0.01 + share(random), share(random)});
    for (const StyleSignal::Point& point : signal.points) EXPECT_DOUBLE_EQ(signal.at(point.time), point.value);
    EXPECT_EQ(signal.at(-1), signal.points.front().value);
    EXPECT_EQ(signal.at(1e6), signal.points.back().value);
    for (std::size_t i = 1; i < signal.points.size(); ++i) {
      const StyleSignal::Point &a = signal.points[i - 1], &b = signal.points[i];
      EXPECT_NEAR(signal.at(0.5 * (a.time + b.time)), 0.5 * (a.value + b.value), 1e-12);
    }
    EXPECT_EQ(signal.isConstant(), signal.points.size() == 1);
  }
  EXPECT_EQ(StyleSignal().at(3), 0);
  EXPECT_TRUE(StyleSignal(0.4).isConstant());
  EXPECT_EQ(StyleSignal(0.4).at(-7), 0.4);
}

TEST(StyleSignal, ComesFromRowsOfTimeAndValue) {
  const StyleSignal signal = parseStyleSignal("time_s,value\n0.5,0.2\n\n 1 , 0.8 \r\n2,1\n", "ma.csv", 1);
  ASSERT_EQ(signal.points.size(), 3U);
  EXPECT_EQ(signal.points[1], (StyleSignal::Point{1, 0.8}));
  EXPECT_EQ(parseStyleSignal("0,2", "ja.csv", kLargestArticulation).at(0), 2);
}

TEST(StyleSignal, RefusesOtherRowsWithTheirLine) {
  const auto complaint = [](std::string_view text) -> std::string {
    try {
      parseStyleSignal(text, "ma.csv", 1);
    } catch (const InputError& error) {
      return error.what();
    }
    return "nothing";
  };
  EXPECT_EQ(complaint("").rfind("ma.csv: ", 0), 0U);
  EXPECT_EQ(complaint("time,value\n").rfind("ma.csv: ", 0), 0U) << "a header alone";
  EXPECT_EQ(complaint("0,1\n1\n").rfind("ma.csv:2: ", 0), 0U);
  EXPECT_EQ(complaint("0,1\n1,2\n").rfind("ma.csv:2: ", 0), 0U) << "over the largest";
  EXPECT_EQ(complaint("0,1\n1,-0.1\n").rfind("ma.csv:2: ", 0), 0U);
  EXPECT_EQ(complaint("0,1\n1,nan\n").rfind("ma.csv:2: ", 0), 0U);
  EXPECT_EQ(complaint("0,1\ninf,1\n").rfind("ma.csv:2: ", 0), 0U);
  EXPECT_EQ(complaint("0,1\n0,1\n").rfind("ma.csv:2: ", 0), 0U) << "times that do not rise";
  EXPECT_EQ(complaint("0,1\ntime,value\n").rfind("ma.csv:2: ", 0), 0U) << "a header in the middle";
  EXPECT_EQ(complaint("0,1,5\n").rfind("ma.csv:1: ", 0), 0U);
}

TEST(StyleChoice, IsANumberAutoOrAFile) {
  EXPECT_EQ(parseStyleChoice("0.25", "--ma", 1, true).constant, 0.25);
  EXPECT_TRUE(parseStyleChoice("auto", "--ma", 1, true).automatic);
  EXPECT_EQ(parseStyleChoice("ma.csv", "--ma", 1, true).file, "ma.csv");
  EXPECT_FALSE(parseStyleChoice("ma.csv", "--ma", 1, true).constant);
  EXPECT_THROW(parseStyleChoice("auto", "--ja", 2, false), InputError);
  for (const char* bad : {"-0.1", "1.1", "nan", "inf"})
    EXPECT_THROW(parseStyleChoice(bad, "--ma", 1, true), InputError);
}

TEST(PitchSensitivities, AreTheFormulaOfThePaper) {
  // VOCAL 4.2: Ps = 0.1 for v <= tau = 0.2 s, else min(1, 0.1 + v - tau).
  for (Seconds length = 0.01; length < 2; length += 0.013) {
    const double ps = pitchSensitivities(spokenPhones({{Phone::kAA, length}}))[1].value();
    EXPECT_NEAR(ps, length <= 0.2 ? 0.1 : std::min(1.0, 0.1 + length - 0.2), 1e-9) << length;
    EXPECT_FALSE(pitchSensitivities(spokenPhones({{Phone::kS, length}}))[1]) << "a consonant has none";
  }
}

TEST(MelodicAccents, AreTheThreeStepsOfThePaper) {
  // VOCAL 4.2: 0.2 up to mean - stdev, 0.8 from mean + stdev on, else 0.5; whatever the unit of energy.
  for (unsigned seed = 0; seed < 30; ++seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> share(0, 1);
    const std::size_t count = 3 + seed % 9;  // two lie exactly at mean -+ stdev
    const SpeechLabels labels = spokenPhones(std::vector<std::pair<Phone, Seconds>>(count, {Phone::kS, 0.1}));
    AudioTags tags, louder;
    double sum = 0, squares = 0;
    for (std::size_t i = 1; i <= count; ++i) {
      const double energy = 1e-3 + share(random) * share(random);
      tags.consonants.push_back({PhoneIndex(i), {}, energy});
      louder.consonants.push_back({PhoneIndex(i), {}, 1000 * energy});
      sum += std::log(energy);
      squares += std::log(energy) * std::log(energy);
    }
    const auto n = static_cast<double>(count);
    const double mean = sum / n, deviation = std::sqrt(squares / n - mean * mean);
    const PhoneValues accents = melodicAccents(labels, tags);
    EXPECT_EQ(accents, melodicAccents(labels, louder));
    for (std::size_t i = 1; i <= count; ++i) {
      const double energy = std::log(tags.consonants[i - 1].energy);
      if (std::abs(std::abs(energy - mean) - deviation) < 1e-9) continue;
      EXPECT_EQ(accents[i], energy < mean - deviation ? 0.2 : energy > mean + deviation ? 0.8 : 0.5);
    }
  }
}

TEST(MelodicAccents, SayNothingOfOneConsonantOrOfEqualOnes) {
  const SpeechLabels labels = spokenPhones({{Phone::kS, 0.1}, {Phone::kT, 0.1}});
  AudioTags one, equal, elsewhere;
  one.consonants = {{PhoneIndex(1), {}, 7}};
  equal.consonants = {{PhoneIndex(1), {}, 7}, {PhoneIndex(2), {}, 7}};
  elsewhere.consonants = {{PhoneIndex(99), {}, 7}, {PhoneIndex(1), {}, 1}, {PhoneIndex(2), {}, 1}};
  for (const AudioTags& tags : {AudioTags{}, one, equal, elsewhere})
    EXPECT_EQ(melodicAccents(labels, tags), (PhoneValues{std::nullopt, 0.5, 0.5, std::nullopt}));
}

TEST(SmoothedOverPhones, AveragesWhatHasAValueAndHoldsItOverTheRest) {
  const SpeechLabels labels = spokenPhones({{Phone::kS, 0.1}, {Phone::kAA, 0.3}, {Phone::kT, 0.1}, {Phone::kIY, 0.3}});
  const PhoneValues values{std::nullopt, std::nullopt, 0.2, std::nullopt, 0.8, std::nullopt};
  const StyleSignal signal = smoothedOverPhones(values, labels, 0.1);
  for (const StyleSignal::Point& point : signal.points) EXPECT_DOUBLE_EQ(point.value, 0.5) << "each other's neighbours";
  EXPECT_DOUBLE_EQ(signal.at(labels.phones[3].span.middle()), 0.5) << "held over the T between";
  EXPECT_DOUBLE_EQ(smoothedOverPhones(PhoneValues(6), labels, 0.1).at(1), 0.1) << "nobody has one";
  EXPECT_EQ(smoothedOverPhones({}, {}, 0.3).at(1), 0.3);
}

/// A vowel held for seconds between short ones is sung; the consonants beside it take nothing of that away.
TEST(SmoothedOverPhones, AHeldVowelEndsNearOne) {
  const SpeechLabels labels = spokenPhones({{Phone::kL, 0.08},
                                            {Phone::kAH, 0.1},
                                            {Phone::kM, 0.08},
                                            {Phone::kAA, 3.0},
                                            {Phone::kN, 0.08},
                                            {Phone::kIH, 0.1},
                                            {Phone::kT, 0.08}});
  const StyleSignal ps = smoothedOverPhones(pitchSensitivities(labels), labels, kSpokenSensitivity);
  const TimeSpan& held = labels.phones[4].span;
  for (const double share : {0.0, 0.5, 0.999}) EXPECT_GT(ps.at(std::lerp(held.start, held.end, share)), 0.9) << share;
  EXPECT_LT(
      smoothedOverPhones(pitchSensitivities(spokenPhones({{Phone::kAH, 0.1}, {Phone::kN, 0.1}, {Phone::kIH, 0.1}})),
                         spokenPhones({{Phone::kAH, 0.1}, {Phone::kN, 0.1}, {Phone::kIH, 0.1}}), 0)
          .at(0.3),
      0.11);
}

/// Two vowels in a row, as in "you are": neither jumps to the other's.
TEST(SmoothedOverPhones, NeighboursAreLedIntoEachOther) {
  const SpeechLabels labels =
      spokenPhones({{Phone::kUW, 0.3}, {Phone::kAA, 1.5}, {Phone::kIY, 0.04}, {Phone::kT, 0.1}});
  const StyleSignal ps = smoothedOverPhones(pitchSensitivities(labels), labels, kSpokenSensitivity);
  for (std::size_t i = 1; i < ps.points.size(); ++i)
    EXPECT_GT(ps.points[i].time, ps.points[i - 1].time + 0.015) << i << ": a step";
  for (const std::size_t border : {2U, 3U}) {
    const Seconds time = labels.phones[border].span.start;
    const double left = ps.at(labels.phones[border - 1].span.middle()),
                 right = ps.at(labels.phones[border].span.middle());
    EXPECT_NE(left, right);
    EXPECT_GT(ps.at(time), std::min(left, right)) << border;
    EXPECT_LT(ps.at(time), std::max(left, right)) << border;
  }
}

/// An aria: whispered consonants, then plain ones, then hammered ones, by a factor of ten thousand in energy.
TEST(SmoothedOverPhones, AnAriasConsonantsSpanTheWholeRange) {
  std::vector<std::pair<Phone, Seconds>> phones;
  AudioTags tags;
  for (std::size_t i = 0; i < 24; ++i) {
    phones.emplace_back(Phone::kT, 0.1);
    phones.emplace_back(Phone::kAA, 0.6);
    const double energy = i < 5 ? 1e-4 : i < 19 ? 1e-2 : 1;
    tags.consonants.push_back({PhoneIndex(1 + 2 * i), {}, energy * (1 + 0.1 * static_cast<double>(i % 3))});
  }
  const SpeechLabels labels = spokenPhones(phones);
  const StyleSignal ma = smoothedOverPhones(melodicAccents(labels, tags), labels, kUnknownAccent);
  double least = 1, most = 0;
  for (std::size_t i = 0; i < 24; ++i) {
    const double value = ma.at(labels.phones[1 + 2 * i].span.middle());
    least = std::min(least, value);
    most = std::max(most, value);
  }
  EXPECT_DOUBLE_EQ(least, 0.2);
  EXPECT_DOUBLE_EQ(most, 0.8);
  EXPECT_DOUBLE_EQ(ma.at(labels.phones[1 + 2 * 12].span.middle()), 0.5);
}

}  // namespace
}  // namespace mouthpiece
