// What holds for tags of any sound, and for those of sounds whose truth is known (VOCAL 4.1).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>

#include "hearing/tags/hear_tags.h"
#include "hearing/tags/pitch_contour.h"

namespace mouthpiece {
namespace {

std::vector<double> randomPitch(unsigned seed, std::size_t count) {
  std::mt19937 random(seed);
  std::normal_distribution<double> step(0, 3);
  std::vector<double> pitch;
  double hz = 150 + 20 * (seed % 11);
  for (std::size_t i = 0; i < count; ++i) {
    if (i % 25 == 0) hz *= std::exp2(static_cast<double>(random() % 9) / 12.0 - 4.0 / 12);
    pitch.push_back(std::max(60.0, hz + step(random)));
  }
  return pitch;
}

TEST(NoteFitLaws, PiecesMeetCoverAndHoldTheirMedian) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    const std::vector<double> pitch = randomPitch(seed, 2 + 7 * seed);
    const std::vector<PitchPiece> pieces = fitPitchPieces(pitch);
    ASSERT_FALSE(pieces.empty());
    EXPECT_EQ(pieces.front().first, 0U);
    EXPECT_EQ(pieces.back().last, pitch.size() - 1);
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      EXPECT_EQ(pieces[i].first, i == 0 ? 0 : pieces[i - 1].last);
      EXPECT_LT(pieces[i].first, pieces[i].last);
      const auto [low, high] = std::minmax_element(pitch.begin() + static_cast<std::ptrdiff_t>(pieces[i].first),
                                                   pitch.begin() + static_cast<std::ptrdiff_t>(pieces[i].last) + 1);
      EXPECT_GE(pieces[i].median_hz, *low);
      EXPECT_LE(pieces[i].median_hz, *high);
    }
  }
}

/// Eq. (1) and (2) have pitch in every term: a song sung higher falls into the same notes.
TEST(NoteFitLaws, ATransposedMelodyHasTheSamePieces) {
  for (unsigned seed = 0; seed < 12; ++seed) {
    std::vector<double> pitch = randomPitch(seed, 90);
    const std::vector<PitchPiece> plain = fitPitchPieces(pitch);
    for (double& hz : pitch) hz *= 2;
    const std::vector<PitchPiece> octave = fitPitchPieces(pitch);
    ASSERT_EQ(plain.size(), octave.size()) << "seed " << seed;
    for (std::size_t i = 0; i < plain.size(); ++i) {
      EXPECT_EQ(plain[i].last, octave[i].last);
      EXPECT_NEAR(2 * plain[i].slope_hz_s, octave[i].slope_hz_s, 1e-6);
      EXPECT_NEAR(2 * plain[i].median_hz, octave[i].median_hz, 1e-9);
    }
  }
}

TEST(NoteFitLaws, FiftyHertzASecondPartNotesFromGlides) {
  for (const double slope : {-80.0, -51.0, -49.0, 0.0, 30.0, 49.0, 51.0, 200.0})
    EXPECT_EQ(isNote({0, 10, slope, 200}), std::abs(slope) < 50) << slope << " Hz/s, VOCAL 4.1";
}

std::vector<double> sungTone(double hz, double rate_hz, double depth_semitones, double phase, std::size_t count) {
  std::vector<double> pitch;
  for (std::size_t i = 0; i < count; ++i) {
    const double t = 0.01 * static_cast<double>(i);
    pitch.push_back(hz * std::exp2(depth_semitones / 12 * std::sin(2 * std::numbers::pi * rate_hz * t + phase)));
  }
  return pitch;
}

TEST(VibratoLaws, RateAndDepthAreFoundWhateverThePitchAndPhase) {
  for (unsigned seed = 0; seed < 40; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> share(0, 1);
    const double rate = 5.3 + 2.3 * share(random), depth = 0.3 + 0.7 * share(random);
    const std::vector<double> pitch = sungTone(100 + 600 * share(random), rate, depth, 6.28 * share(random), 160);
    const std::vector<VibratoRun> runs = findVibrato(pitch);
    ASSERT_EQ(runs.size(), 1U) << rate << " Hz, " << depth << " semitones";
    EXPECT_NEAR(runs[0].rate_hz, rate, 0.15);
    EXPECT_NEAR(runs[0].depth_semitones, depth, 0.1 * depth + 0.02);
    EXPECT_GT(runs[0].last - runs[0].first, 110U);
  }
}

TEST(VibratoLaws, BackwardsItIsTheSameVibrato) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    std::vector<double> pitch = sungTone(220, 5.5 + 0.1 * seed, 0.5, 0.3 * seed, 100);
    pitch.insert(pitch.end(), 60, 220.0);
    const std::vector<VibratoRun> forth = findVibrato(pitch);
    std::reverse(pitch.begin(), pitch.end());
    const std::vector<VibratoRun> back = findVibrato(pitch);
    ASSERT_EQ(forth.size(), back.size()) << "seed " << seed;
    for (const VibratoRun& run : forth) {
      EXPECT_NEAR(run.rate_hz, back[0].rate_hz, 0.3);
      EXPECT_NEAR(static_cast<double>(run.first + back[0].last), static_cast<double>(pitch.size() - 1), 12);
    }
  }
}

TEST(VibratoLaws, RunsKeepThePapersConstraints) {
  const VibratoOptions options;
  for (unsigned seed = 0; seed < 60; ++seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> share(0, 1);
    std::vector<double> pitch;
    while (pitch.size() < 400) {
      const auto piece =
          sungTone(200, 3 + 8 * share(random), 1.5 * share(random), 6.28 * share(random), 20 + random() % 60);
      pitch.insert(pitch.end(), piece.begin(), piece.end());
    }
    std::size_t last = 0;
    for (const VibratoRun& run : findVibrato(pitch, options)) {
      EXPECT_GE(run.rate_hz, options.slowest_hz);
      EXPECT_LE(run.rate_hz, options.fastest_hz);
      EXPECT_GE(run.depth_semitones, options.least_depth_semitones);
      EXPECT_GE(run.first, last) << "runs follow each other";
      EXPECT_LT(run.first, run.last);
      EXPECT_LT(run.last, pitch.size());
      const double periods = static_cast<double>(run.last - run.first) / 100 * run.rate_hz;
      EXPECT_GT(periods, 0.9) << "more than one period, but for the samples at its ends";
      last = run.last;
    }
  }
}

AudioTags randomTags(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> share(0, 1);
  AudioTags tags;
  for (std::size_t i = 0; i < seed % 40; ++i) {
    const double time = 0.01 * static_cast<double>(i), hz = 60 + 900 * share(random);
    const bool voiced = share(random) < 0.5;
    tags.f0.push_back({time, voiced ? hz : 0, voiced});
    tags.vowels.push_back({time, share(random), share(random), 0, 1, share(random), share(random)});
    if (share(random) < 0.3) tags.notes.push_back({{time, time + share(random)}, hz, false});
    if (share(random) < 0.3) tags.vibrato.push_back({{time, time + share(random)}, 8 * share(random), share(random)});
    if (share(random) < 0.3) tags.consonants.push_back({PhoneIndex(i), {time, time + 0.1}, 0.01 * share(random)});
  }
  return tags;
}

/// docs/formats/tags.md: every list, every field, to the decimals it names.
TEST(TagsJson, HoldsEveryTag) {
  for (unsigned seed = 0; seed < 60; ++seed) {
    SCOPED_TRACE(seed);
    const AudioTags tags = randomTags(seed);
    const auto json = nlohmann::json::parse(formatTagsJson(tags));
    EXPECT_EQ(json.size(), 5U);
    const auto expectSpan = [](const nlohmann::json& row, const TimeSpan& span) {
      EXPECT_NEAR(row.at("start_s").get<double>(), span.start, 0.6e-4);
      EXPECT_NEAR(row.at("end_s").get<double>(), span.end, 0.6e-4);
    };
    ASSERT_EQ(json.at("f0").size(), tags.f0.size());
    for (std::size_t i = 0; i < tags.f0.size(); ++i) {
      EXPECT_NEAR(json["f0"][i].at("time_s").get<double>(), tags.f0[i].time, 0.6e-2);
      EXPECT_NEAR(json["f0"][i].at("hz").get<double>(), tags.f0[i].hz, 0.6e-2);
      EXPECT_EQ(json["f0"][i].at("voiced").get<bool>(), tags.f0[i].voiced);
    }
    ASSERT_EQ(json.at("notes").size(), tags.notes.size());
    for (std::size_t i = 0; i < tags.notes.size(); ++i) {
      expectSpan(json["notes"][i], tags.notes[i].span);
      EXPECT_NEAR(json["notes"][i].at("hz").get<double>(), tags.notes[i].hz, 0.6e-2);
    }
    ASSERT_EQ(json.at("vibrato").size(), tags.vibrato.size());
    for (std::size_t i = 0; i < tags.vibrato.size(); ++i) {
      expectSpan(json["vibrato"][i], tags.vibrato[i].span);
      EXPECT_NEAR(json["vibrato"][i].at("rate_hz").get<double>(), tags.vibrato[i].rate_hz, 0.6e-3);
      EXPECT_NEAR(json["vibrato"][i].at("depth_semitones").get<double>(), tags.vibrato[i].depth_semitones, 0.6e-3);
    }
    ASSERT_EQ(json.at("vowels").size(), tags.vowels.size());
    for (std::size_t i = 0; i < tags.vowels.size(); ++i) {
      EXPECT_NEAR(json["vowels"][i].at("A").get<double>(), tags.vowels[i].a, 0.6e-4);
      EXPECT_NEAR(json["vowels"][i].at("E").get<double>(), tags.vowels[i].e, 0.6e-4);
      EXPECT_NEAR(json["vowels"][i].at("I").get<double>(), tags.vowels[i].i, 0.6e-4);
      EXPECT_NEAR(json["vowels"][i].at("O").get<double>(), tags.vowels[i].o, 0.6e-4);
      EXPECT_NEAR(json["vowels"][i].at("U").get<double>(), tags.vowels[i].u, 0.6e-4);
      EXPECT_NEAR(json["vowels"][i].at("silence").get<double>(), tags.vowels[i].silence, 0.6e-4);
    }
    ASSERT_EQ(json.at("consonants").size(), tags.consonants.size());
    for (std::size_t i = 0; i < tags.consonants.size(); ++i) {
      EXPECT_EQ(json["consonants"][i].at("phone").get<std::size_t>(), tags.consonants[i].phone.value);
      expectSpan(json["consonants"][i], tags.consonants[i].span);
      EXPECT_NEAR(json["consonants"][i].at("energy").get<double>(), tags.consonants[i].energy, 0.6e-9);
    }
  }
}

TEST(TagsJson, IsTheSameTextEveryTime) {
  EXPECT_EQ(formatTagsJson(randomTags(17)), formatTagsJson(randomTags(17)));
  EXPECT_EQ(formatTagsJson({}), "{\"f0\":[],\n\"notes\":[],\n\"vibrato\":[],\n\"vowels\":[],\n\"consonants\":[]}\n");
}

constexpr int kTagRateHz = 16000;

/// A melody of sung tones, silence between.
struct Melody {
  AudioClip sound{kTagRateHz, std::vector<float>(static_cast<std::size_t>(0.3 * kTagRateHz), 0.0F)};
  std::vector<Note> notes;

  explicit Melody(const std::vector<double>& pitches) {
    for (const double hz : pitches) {
      const Seconds start = sound.duration();
      double phase = 0;
      for (std::size_t i = 0; i < static_cast<std::size_t>(0.5 * kTagRateHz); ++i) {
        phase += 2 * std::numbers::pi * hz / kTagRateHz;
        double sample = 0;
        for (int h = 1; h <= 15 && h * hz < 7000; ++h)
          sample += std::sin(h * phase) / h / (1 + std::pow(h * hz / 1500, 2));
        const double swell =
            std::min({1.0, static_cast<double>(i) / 400, (0.5 * kTagRateHz - static_cast<double>(i)) / 400});
        sound.samples.push_back(static_cast<float>(0.15 * swell * sample));
      }
      notes.push_back({{start, sound.duration()}, hz, false});
      sound.samples.insert(sound.samples.end(), static_cast<std::size_t>(0.15 * kTagRateHz), 0.0F);
    }
  }
};

TEST(HearTagsLaws, AMelodyIsHeardNoteByNote) {
  const Melody melody({220, 277.18, 329.63, 196, 440, 146.83});
  const AudioTags tags = hearTags(melody.sound, nullptr);
  ASSERT_EQ(tags.notes.size(), melody.notes.size());
  for (std::size_t i = 0; i < tags.notes.size(); ++i) {
    EXPECT_NEAR(1200 * std::log2(tags.notes[i].hz / melody.notes[i].hz), 0, 10) << "cents of note " << i;
    EXPECT_NEAR(tags.notes[i].span.start, melody.notes[i].span.start, 0.05);
    EXPECT_NEAR(tags.notes[i].span.end, melody.notes[i].span.end, 0.05);
  }
  EXPECT_TRUE(tags.vibrato.empty());
}

TEST(HearTagsLaws, TagsDoNotDependOnGain) {
  Melody melody({220, 277.18, 196});
  const AudioTags loud = hearTags(melody.sound, nullptr);
  for (float& sample : melody.sound.samples) sample *= 0.25F;
  const AudioTags quiet = hearTags(melody.sound, nullptr);
  ASSERT_EQ(loud.notes.size(), quiet.notes.size());
  for (std::size_t i = 0; i < loud.notes.size(); ++i) {
    EXPECT_NEAR(loud.notes[i].hz, quiet.notes[i].hz, 0.01);
    EXPECT_NEAR(loud.notes[i].span.start, quiet.notes[i].span.start, 1e-9);
  }
  ASSERT_EQ(loud.vowels.size(), quiet.vowels.size());
  for (std::size_t i = 0; i < loud.vowels.size(); ++i) EXPECT_NEAR(loud.vowels[i].a, quiet.vowels[i].a, 0.02) << i;
}

TEST(HearTagsLaws, ListsAreInTimeOrderAndSharesSumToOne) {
  const Melody melody({330, 247, 294});
  const AudioTags tags = hearTags(melody.sound, nullptr);
  for (std::size_t i = 1; i < tags.notes.size(); ++i) EXPECT_LE(tags.notes[i - 1].span.end, tags.notes[i].span.start);
  for (std::size_t i = 0; i < tags.f0.size(); ++i) {
    EXPECT_NEAR(tags.f0[i].time, static_cast<double>(i) / kPitchRateHz, 1e-9);
    EXPECT_EQ(tags.f0[i].voiced, tags.f0[i].hz > 0);
  }
  for (const VowelLikelihood& vowel : tags.vowels)
    EXPECT_NEAR(vowel.a + vowel.e + vowel.i + vowel.o + vowel.u + vowel.silence, 1, 1e-5);
}

/// Warnings are of sounds, labels and tags, so all three are made here.
TEST(SoundWarnings, NameOtherWordsThanThoseSung) {
  AudioClip clip{kTagRateHz, std::vector<float>(10 * kTagRateHz)};
  for (std::size_t i = 0; i < clip.samples.size(); ++i) {
    const bool is_pause = i % (2 * kTagRateHz) < kTagRateHz / 2;
    clip.samples[i] = is_pause ? 0.0F : 0.3F * static_cast<float>(std::sin(0.08 * static_cast<double>(i)));
  }
  SpeechLabels labels;
  AudioTags as_sung, other;
  for (int k = 0; k < 5; ++k) {
    labels.phones.push_back({Phone::kSil, {2.0 * k, 2.0 * k + 0.5}, {}, {}});
    labels.phones.push_back({Phone::kAA, {2.0 * k + 0.5, 2.0 * k + 2}, {}, {}});
  }
  for (int i = 0; i < 1000; ++i) {
    as_sung.f0.push_back({0.01 * i, 200, true});
    as_sung.vowels.push_back({0.01 * i, 0.9, 0, 0.1, 0, 0, 0});
    other.vowels.push_back({0.01 * i, 0.1, 0, 0.9, 0, 0, 0});
  }
  other.f0 = as_sung.f0;
  EXPECT_TRUE(soundWarnings(clip, &labels, as_sung).empty()) << soundWarnings(clip, &labels, as_sung)[0];
  const std::vector<std::string> warnings = soundWarnings(clip, &labels, other);
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_NE(warnings[0].find("10 % of the vowels"), std::string::npos) << warnings[0];
  other.f0.assign(1000, {});
  EXPECT_NE(soundWarnings(clip, &labels, other).at(0).find("no voice"), std::string::npos);
}

TEST(VowelSpans, AreThoseOfTheVowelsInOrder) {
  SpeechLabels labels;
  for (const Phone phone : {Phone::kSil, Phone::kM, Phone::kIY, Phone::kAA, Phone::kS, Phone::kER}) {
    const Seconds at = labels.phones.empty() ? 0 : labels.phones.back().span.end;
    labels.phones.push_back({phone, {at, at + 0.1}, {}, {}});
  }
  const std::vector<TimeSpan> spans = vowelSpans(labels);
  ASSERT_EQ(spans.size(), 3U);
  EXPECT_EQ(spans[0], labels.phones[2].span);
  EXPECT_EQ(spans[1], labels.phones[3].span);
  EXPECT_EQ(spans[2], labels.phones[5].span);
}

}  // namespace
}  // namespace mouthpiece
