#include "voices/corpus_voice.h"

#include <cmath>
#include <random>

#include "support/tiny_corpus.h"
#include "support/voice_testing.h"

namespace mouthpiece {
namespace {

/// "Reads" texts that spell their phones: "DH-AH T-AY-M".
class SpellingReader : public Voice {
 public:
  explicit SpellingReader(std::uint64_t seed) : seed_(seed) {}
  SpokenLine speak(std::string_view text) override {
    SpokenLine line;
    line.labels = samples::tinyLabels(text, seed_);
    line.text = text;
    return line;
  }

 private:
  std::uint64_t seed_;
};

class CorpusVoiceTest : public ::testing::Test {
 protected:
  SpokenLine speak(std::string_view text, std::optional<double> rate = std::nullopt, std::uint64_t seed = 77) const {
    CorpusVoiceOptions options;
    options.rate = rate;
    return CorpusVoice(std::make_unique<SpellingReader>(seed), database_, options).speak(text);
  }

  Corpus corpus_ = samples::tinyCorpus();
  UnitDatabase database_{corpus_};
};

TEST_F(CorpusVoiceTest, SaysTheReadersPhonesOnItsOwnClock) {
  for (const char* text :
       {"DH-AH T-AY-M IH-Z N-AW", "M-AE-N IH-Z T-EH-N", "N-AW | AY M-EH-N", "T-IY", "AH-P M-UW-N T-EH-N"}) {
    const SpokenLine line = speak(text);
    const SpeechLabels read = samples::tinyLabels(text, 77);
    EXPECT_NO_THROW(expectConsistent(line.labels)) << text;
    EXPECT_EQ(namesOf(line.labels), namesOf(read));
    EXPECT_EQ(wordsOf(line.labels), wordsOf(read));
    EXPECT_EQ(line.voice, "corpus:tiny");
    EXPECT_NEAR(line.audio.duration(), line.labels.duration(), 1.5 / 8000) << text;
    EXPECT_EQ(line.audio.sample_rate_hz, 8000);
    for (const float sample : line.audio.samples) ASSERT_TRUE(std::isfinite(sample));
  }
}

TEST_F(CorpusVoiceTest, AUnitIsHeardWhereItsPhonesAre) {
  const SpokenLine line = speak("M-AE-N IH-Z T-EH-N");
  ASSERT_FALSE(line.units.empty());
  for (const SelectedUnit& unit : line.units) {
    if (unit.is_backoff || unit.sound.duration() <= 0) continue;
    const TimeSpan phones = line.labels.spanOf(unit.phones);
    EXPECT_GE(unit.sound.start, phones.start - 1e-9);
    EXPECT_LE(unit.sound.end, phones.end + 1e-9);
  }
}

TEST_F(CorpusVoiceTest, ALineOfTheCorpusKeepsItsOwnDurations) {
  const CorpusTake& take = corpus_.takes[0];
  const SpokenLine line = speak(take.text);
  ASSERT_EQ(namesOf(line.labels), namesOf(take.labels));
  for (std::size_t i = 1; i + 1 < line.labels.phones.size(); ++i)
    EXPECT_NEAR(line.labels.phones[i].span.duration(), take.labels.phones[i].span.duration(), 1e-6) << i;
}

TEST_F(CorpusVoiceTest, ARateIsTheReadersTimesThat) {
  const char* text = "M-AE-N IH-Z T-EH-N";
  const SpeechLabels read = samples::tinyLabels(text, 77);
  for (const double rate : {0.5, 1.0, 2.0}) {
    const SpokenLine line = speak(text, rate);
    for (std::size_t i = 1; i + 1 < line.labels.phones.size(); ++i) {
      const Seconds wanted = read.phones[i].span.duration() / rate;
      EXPECT_NEAR(line.labels.phones[i].span.duration(), wanted, 0.35 * wanted) << rate << ", " << i;  // cut and joined
    }
  }
}

TEST_F(CorpusVoiceTest, WhatCannotBeSaidIsNamed) {
  EXPECT_NE(errorOf([&] { speak("ZH-AH"); }).find("tiny"), std::string::npos);
  for (CorpusTake& take : corpus_.takes) take.audio = {};
  EXPECT_NE(errorOf([&] { speak("T-EH-N"); }).find("found no sound"), std::string::npos);
}

TEST_F(CorpusVoiceTest, CutsLieWithinBothPhonesAndTheirWeightsCount) {
  CorpusSounds sounds(database_);
  std::mt19937 random(20261122);
  const auto place = [&] {
    PhonePlace at;
    at.take.value = std::uniform_int_distribution<std::size_t>(0, corpus_.takes.size() - 1)(random);
    const std::size_t phones = corpus_.takes[at.take.value].labels.phones.size();
    at.phone.value = std::uniform_int_distribution<std::size_t>(1, phones - 2)(random);
    return at;
  };
  for (int round = 0; round < 60; ++round) {
    const PhonePlace left = place(), right = place();
    const SoundCut cut = sounds.cut(left, right);
    const TimeSpan a = database_.phoneAt(left).span, b = database_.phoneAt(right).span;
    EXPECT_TRUE(cut.left > a.start && cut.left < a.end && cut.right > b.start && cut.right < b.end);
    EXPECT_LE(std::abs((cut.left - a.start) / a.duration() - (cut.right - b.start) / b.duration()), 0.25 + 1e-9);
    EXPECT_TRUE(std::isfinite(cut.cost));
    EXPECT_EQ(sounds.cut(left, right).cost, cut.cost);
  }
  const PhonePlace here = place(), there = place();
  const double before = sounds.cut(here, there).cost;
  SoundCutWeights heavier = sounds.weights();
  heavier.spectral *= 10;
  sounds.setWeights(heavier);
  EXPECT_GE(sounds.cut(here, there).cost, before);
  EXPECT_EQ(sounds.sampleRateHz(), 8000);
}

}  // namespace
}  // namespace mouthpiece
