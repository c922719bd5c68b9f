// VOCAL 4.2, "Generating a singing curve", and the Ma-Ps field, number by number (docs/theory/vocal/vocal.md).
#include <gtest/gtest.h>

#include <cmath>

#include "support/spoken_phones.h"
#include "vocal/viseme_curves.h"
#include "vocal/viseme_events.h"

namespace mouthpiece {
namespace {

using samples::spokenPhones;

std::vector<CurveKey> keysOf(const CurveSet& curves, std::string_view name) {
  const AnimationCurve* curve = findCurve(curves, name);
  if (curve == nullptr) throw std::runtime_error("no curve " + std::string(name));
  return curve->keys;
}

constexpr StyleExtreme kSong{true, true}, kOnlyPitch{false, true}, kOnlyMelody{true, false}, kSpeech{};

TEST(SingingCurves, NotesSetTheAmplitudes) {
  const SpeechLabels labels = spokenPhones({{Phone::kAA, 1.0}, {Phone::kN, 0.1}, {Phone::kIY, 0.5}});
  AudioTags tags;
  tags.notes = {{{0.5, 0.9}, 200}, {{1.0, 1.5}, 300}, {{1.6, 2.1}, 400}};
  const auto& keys = keysOf(visemeCurves(labels, tags, kOnlyPitch), "Ah");
  ASSERT_EQ(keys.size(), 7U) << "onset, start, end, between, start, end, decay";
  EXPECT_NEAR(keys[1].value, 0.6, 1e-12) << "the lowest note: 0.4 * 0 + 0.6";
  EXPECT_NEAR(keys[2].value, 0.95 * 0.6, 1e-12) << "decays by its end";
  EXPECT_NEAR(keys[3].time, 0.5 * (0.9 + 1.0), 1e-12) << "midway between the notes";
  EXPECT_NEAR(keys[3].value, 0.9 * 0.95 * 0.6, 1e-12) << "0.9 of the lower";
  EXPECT_NEAR(keys[4].value, 0.4 * 0.5 + 0.6, 1e-12);
  EXPECT_NEAR(keys[5].value, 0.95 * 0.8, 1e-12);
  EXPECT_NEAR(keysOf(visemeCurves(labels, tags, kOnlyPitch), "Ee")[1].value, 1.0, 1e-12) << "the highest note";
}

TEST(SingingCurves, ConsonantsKeepTheirSpeechCurves) {
  const SpeechLabels labels = spokenPhones({{Phone::kAA, 0.6}, {Phone::kS, 0.2}, {Phone::kF, 0.1}, {Phone::kIY, 0.5}});
  AudioTags tags;
  tags.notes = {{{0.5, 0.8}, 200}, {{0.9, 1.1}, 300}, {{1.4, 1.9}, 400}};
  tags.vibrato = {{{1.1, 1.9}, 6, 0.5}};
  const CurveSet sung = visemeCurves(labels, tags, kOnlyPitch), spoken = visemeCurves(labels, {}, kSpeech);
  for (const char* name : {"S", "FV"}) EXPECT_EQ(*findCurve(sung, name), *findCurve(spoken, name)) << name;
  EXPECT_NE(*findCurve(sung, "Ah"), *findCurve(spoken, "Ah"));
}

TEST(SingingCurves, OneNoteApexesWhereItIsReachedAndDecaysAsSpeech) {
  AudioTags tags;
  tags.notes = {{{0.7, 1.5}, 200}};
  const auto& keys = keysOf(visemeCurves(spokenPhones({{Phone::kAA, 1.0}}), tags, kOnlyPitch), "Ah");
  ASSERT_EQ(keys.size(), 4U);
  EXPECT_NEAR(keys[1].time, 0.7, 1e-12);
  EXPECT_NEAR(keys[2].time, 0.5 + 0.75, 1e-12);
  EXPECT_NEAR(keys[2].value, keys[1].value, 1e-12);
}

TEST(SingingCurves, VibratoOscillatesAtSevenHertzAndGrows) {
  AudioTags tags;
  tags.vibrato = {{{0.6, 1.4}, 5.5, 0.5}};
  const auto& keys = keysOf(visemeCurves(spokenPhones({{Phone::kAA, 1.0}}), tags, kOnlyPitch), "Ah");
  std::vector<CurveKey> waves;
  for (const CurveKey& key : keys) {
    if (key.time > 0.6 + 1e-9 && key.time < 1.4 - 1e-9) waves.push_back(key);
  }
  ASSERT_GE(waves.size(), 10U);
  double last_depth = 0;
  for (std::size_t i = 1; i < waves.size(); ++i) {
    EXPECT_NEAR(waves[i].time - waves[i - 1].time, 0.5 / 7, 1e-9);
    const double depth = waves[i].value / 0.8 - 1;
    EXPECT_LT(depth * (waves[i - 1].value / 0.8 - 1), 0) << "up and down in turn";
    EXPECT_LE(std::abs(depth), 0.6);
    EXPECT_LE(waves[i].value, 1) << "alpha in [0, 1]";
    if (waves[i].value == 1) continue;  // no room for more
    EXPECT_GT(std::abs(depth), last_depth);
    last_depth = std::abs(depth);
  }
  EXPECT_GT(last_depth, 0.5);
}

TEST(SingingCurves, NoVisemeIsReachedByMoreThanWholly) {
  const SpeechLabels labels =
      spokenPhones({{Phone::kAA, 1.0}, {Phone::kM, 0.1}, {Phone::kAA, 1.0}, {Phone::kS, 0.1}, {Phone::kIY, 0.8}});
  AudioTags tags;
  tags.notes = {{{0.5, 1.4}, 200}, {{1.6, 2.6}, 400}, {{2.7, 3.5}, 300}};
  tags.vibrato = {{{0.6, 1.4}, 6, 0.5}, {{1.7, 2.6}, 6, 0.5}, {{2.8, 3.5}, 6, 0.5}};
  for (const StyleExtreme extreme : {kSpeech, kOnlyMelody, kOnlyPitch, kSong}) {
    for (const AnimationCurve& curve : visemeCurves(labels, tags, extreme)) {
      for (Seconds time = 0; time < 4; time += 0.005) {
        EXPECT_LE(curve.valueAt(time), 1 + 1e-9) << curve.name << " at " << time;
        EXPECT_GE(curve.valueAt(time), -1e-9) << curve.name << " at " << time;
      }
    }
  }
}

TEST(SingingCurves, CloseVowelsBlendAndConsonantsStepBack) {
  // 0.2 s between the vowels: less than 300 ms.
  const SpeechLabels labels = spokenPhones({{Phone::kAA, 0.4}, {Phone::kS, 0.2}, {Phone::kIY, 0.4}});
  const CurveSet song = visemeCurves(labels, {}, kOnlyMelody);
  EXPECT_NEAR(keysOf(song, "Ah").back().time, 1.1, 1e-12) << "falls until the next vowel's apex";
  EXPECT_NEAR(keysOf(song, "Ee").front().time, 0.5 + 0.75 * 0.4, 1e-12) << "rises from the end of the hold before";
  EXPECT_NEAR(keysOf(song, "S")[1].value, kConsonantInLegato, 1e-12);
  const CurveSet far =
      visemeCurves(spokenPhones({{Phone::kAA, 0.4}, {Phone::kS, 0.31}, {Phone::kIY, 0.4}}), {}, kOnlyMelody);
  EXPECT_NEAR(keysOf(far, "Ah").back().time, 0.9 + 0.120, 1e-12);
  EXPECT_NEAR(keysOf(far, "S")[1].value, 1.0, 1e-12);
}

TEST(SingingCurves, RepeatedVowelsHardlyPart) {
  const SpeechLabels labels = spokenPhones({{Phone::kIY, 0.3}, {Phone::kN, 0.18}, {Phone::kIY, 0.3}});
  const auto& keys = keysOf(visemeCurves(labels, {}, kOnlyMelody), "Ee");
  ASSERT_EQ(keys.size(), 7U);
  EXPECT_NEAR(keys[3].value, 0.95 * 0.8, 1e-12) << "VC = 0.95 in song";
}

TEST(MapsField, NothingSungIsSpeechExactly) {
  const SpeechLabels labels = spokenPhones({{Phone::kM, 0.1}, {Phone::kAA, 0.6}, {Phone::kT, 0.1}, {Phone::kUW, 0.4}});
  AudioTags tags;
  tags.notes = {{{0.6, 0.8}, 200}, {{0.9, 1.2}, 300}};
  tags.vibrato = {{{0.7, 1.1}, 6, 0.5}};
  EXPECT_EQ(blendExtremes(labels, tags, StyleSignal(0), StyleSignal(0)), visemeCurves(labels, {}, kSpeech));
  EXPECT_EQ(blendExtremes(labels, tags, StyleSignal(1), StyleSignal(1)), visemeCurves(labels, tags, kSong));
  EXPECT_EQ(blendExtremes(labels, tags, StyleSignal(1), StyleSignal(0)), visemeCurves(labels, tags, kOnlyMelody));
}

TEST(MapsField, InBetweenIsBilinear) {
  const SpeechLabels labels = spokenPhones({{Phone::kM, 0.1}, {Phone::kAA, 0.6}, {Phone::kT, 0.1}, {Phone::kUW, 0.4}});
  AudioTags tags;
  tags.notes = {{{0.6, 0.8}, 200}, {{0.9, 1.2}, 300}};
  constexpr double kMa = 0.3, kPs = 0.8;
  const CurveSet blended = blendExtremes(labels, tags, StyleSignal(kMa), StyleSignal(kPs));
  for (const AnimationCurve& curve : blended) {
    for (Seconds time = 0; time < 2.2; time += 0.007) {
      const auto value = [&](StyleExtreme extreme) {
        const CurveSet curves = visemeCurves(labels, tags, extreme);
        const AnimationCurve* found = findCurve(curves, curve.name);
        return found == nullptr ? 0.0 : found->valueAt(time);
      };
      const double wanted = (1 - kMa) * (1 - kPs) * value(kSpeech) + kMa * (1 - kPs) * value(kOnlyMelody) +
                            (1 - kMa) * kPs * value(kOnlyPitch) + kMa * kPs * value(kSong);
      ASSERT_NEAR(curve.valueAt(time), wanted, 1e-9) << curve.name << " at " << time;
    }
  }
}

TEST(MapsField, StyleMayChangeOverTime) {
  const SpeechLabels labels = spokenPhones({{Phone::kAA, 0.3}, {Phone::kS, 0.2}, {Phone::kIY, 0.3}});
  StyleSignal rising;
  rising.points = {{0.5, 0}, {1.3, 1}};
  const CurveSet changing = blendExtremes(labels, {}, rising, StyleSignal(0));
  const CurveSet speech = visemeCurves(labels, {}, kSpeech), song = visemeCurves(labels, {}, kOnlyMelody);
  for (Seconds time = 0.3; time < 1.6; time += 0.01) {
    const double ma = rising.at(time);
    const double wanted = (1 - ma) * findCurve(speech, "S")->valueAt(time) + ma * findCurve(song, "S")->valueAt(time);
    EXPECT_NEAR(findCurve(changing, "S")->valueAt(time), wanted, 0.002) << time;
  }
}

/// The slope of a step once went on for as long as no key came: -4.7 of Oo, and lips that shut for a frame.
TEST(MapsField, ASuddenTurnOfTheStyleIsAStepAndNoMore) {
  const SpeechLabels labels = spokenPhones({{Phone::kUW, 0.5}, {Phone::kAA, 1.2}, {Phone::kS, 0.1}});
  const Seconds border = labels.phones[2].span.start;
  for (const Seconds within : {1e-3, 1e-5, 1e-6, 5e-7, 1e-7}) {
    StyleSignal turning;
    turning.points = {{0, 0.2}, {border, 0.3}, {border + within, 0.9}, {3, 0.9}};
    const CurveSet before = visemeCurves(labels, {}, kSpeech), after = visemeCurves(labels, {}, kOnlyMelody);
    for (const AnimationCurve& curve : blendExtremes(labels, {}, turning, StyleSignal(0))) {
      const AnimationCurve *speech = findCurve(before, curve.name), *song = findCurve(after, curve.name);
      for (Seconds time = 0.1; time < 2; time += 0.0037) {
        const double ma = turning.at(time);
        const double wanted = (1 - ma) * (speech == nullptr ? 0 : speech->valueAt(time)) +
                              ma * (song == nullptr ? 0 : song->valueAt(time));
        ASSERT_NEAR(curve.valueAt(time), wanted, 0.01) << curve.name << " at " << time << ", turned in " << within;
      }
    }
  }
}

TEST(VocalStyle, HeuristicsOfThePaper) {
  const SpeechLabels labels = spokenPhones({{Phone::kS, 0.1},
                                            {Phone::kAA, 0.2},
                                            {Phone::kT, 0.1},
                                            {Phone::kAA, 0.7},
                                            {Phone::kK, 0.1},
                                            {Phone::kAA, 1.5},
                                            {Phone::kF, 0.1},
                                            {Phone::kP, 0.1}});
  AudioTags tags;
  // In powers of ten -4, -2, 0, -2: one clearly below the mean less the deviation of 1.4, one clearly above.
  tags.consonants = {
      {PhoneIndex(1), {}, 1e-4}, {PhoneIndex(3), {}, 1e-2}, {PhoneIndex(5), {}, 1}, {PhoneIndex(7), {}, 1e-2}};
  const PhoneValues ma = melodicAccents(labels, tags);
  EXPECT_EQ(ma[1], 0.2);
  EXPECT_EQ(ma[3], 0.5);
  EXPECT_EQ(ma[5], 0.8);
  EXPECT_FALSE(ma[2]) << "vowels have none of their own";
  const PhoneValues ps = pitchSensitivities(labels);
  EXPECT_DOUBLE_EQ(ps[2].value(), 0.1) << "0.2 s, as spoken";
  EXPECT_NEAR(ps[4].value(), 0.1 + 0.7 - 0.2, 1e-12);
  EXPECT_DOUBLE_EQ(ps[6].value(), 1.0) << "no more than 1";
  const StyleSignal smooth = smoothedOverPhones(ma, labels, kUnknownAccent);
  EXPECT_NEAR(smooth.at(labels.phones[3].span.middle()), (0.2 + 0.5 + 0.8) / 3, 1e-12);
}

/// VOCAL's figure 4: two vowels of one viseme are one curve that keeps the notes of both.
TEST(SingingCurves, VowelsOfOneVisemeKeepTheirNotesWhenTheyMeet) {
  const SpeechLabels labels = spokenPhones({{Phone::kAA, 0.8}, {Phone::kAA, 0.8}});
  const TimeSpan first = labels.phones[1].span, second = labels.phones[2].span;
  const auto noteIn = [](const TimeSpan& span, double from, double to, double hz) {
    return Note{{std::lerp(span.start, span.end, from), std::lerp(span.start, span.end, to)}, hz, false};
  };
  AudioTags tags;
  tags.notes = {noteIn(first, 0.0, 0.4, 220), noteIn(first, 0.5, 0.85, 440), noteIn(second, 0.15, 0.4, 330),
                noteIn(second, 0.5, 1.0, 220)};
  const auto events = coarticulated(withSungInternalKeys(fourKeyEvents(labels), tags), labels);
  const CurveSet curves = curvesFromEvents(events, kSongCoarticulation);
  const AnimationCurve* vowel = findCurve(curves, "Ah");
  ASSERT_NE(vowel, nullptr);
  // Each note's amplitude is reached where it begins: 0.6 at the lowest, 1 at the highest.
  EXPECT_NEAR(vowel->valueAt(tags.notes[1].span.start), 1.0, 0.01);
  EXPECT_NEAR(vowel->valueAt(tags.notes[2].span.start), 0.8, 0.05);
  EXPECT_NEAR(vowel->valueAt(tags.notes[3].span.start), 0.6, 0.01);
  // They meet without letting go of the vowel.
  for (Seconds time = first.start + 0.05; time < second.end; time += 0.01)
    EXPECT_GT(vowel->valueAt(time), 0.45) << time;
}

/// And their vibrato, the dips between notes, and what only one of the two has.
TEST(SingingCurves, VowelsOfOneVisemeKeepVibratoAndDipsWhenTheyMeet) {
  const SpeechLabels labels = spokenPhones({{Phone::kAA, 1.0}, {Phone::kAA, 1.0}});
  AudioTags tags;
  tags.notes = {{{0.5, 0.9}, 220, false}, {{1.0, 1.45}, 330, false}, {{1.55, 2.5}, 440, true}};
  tags.vibrato = {{{1.7, 2.5}, 6, 0.5}};
  const auto alone = withSungInternalKeys(fourKeyEvents(labels), tags);
  const auto events = coarticulated(alone, labels);
  ASSERT_EQ(events.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    ASSERT_EQ(events[i].inner.size(), alone[i].inner.size()) << "no inner key is lost";
    for (std::size_t k = 0; k < alone[i].inner.size(); ++k) {
      EXPECT_EQ(events[i].inner[k].time, alone[i].inner[k].time);
      EXPECT_EQ(events[i].inner[k].value, alone[i].inner[k].value);
    }
  }
  EXPECT_GT(events[1].inner.size(), 8U) << "the vibrato's keys";
  const CurveSet curves = curvesFromEvents(events, kSongCoarticulation);
  const AnimationCurve* vowel = findCurve(curves, "Ah");
  ASSERT_NE(vowel, nullptr);
  for (const auto& event : events) {
    for (const EventKey& key : event.inner) EXPECT_NEAR(vowel->valueAt(key.time), key.value, 0.02) << key.time;
  }
}

TEST(VocalStyle, OnlyFricativesAndPlosivesSetMa) {
  const std::vector<Phone> turbulent = {Phone::kS, Phone::kZ, Phone::kF, Phone::kV, Phone::kSH, Phone::kD,
                                        Phone::kT, Phone::kP, Phone::kB, Phone::kG, Phone::kK};
  const std::vector<Phone> others = {Phone::kM, Phone::kN, Phone::kL, Phone::kR, Phone::kW, Phone::kHH};
  const auto loud_among_quiet = [](Phone phone) {
    const SpeechLabels labels = spokenPhones({{phone, 0.1}, {Phone::kT, 0.1}, {Phone::kT, 0.1}, {Phone::kT, 0.1}});
    AudioTags tags;
    for (std::size_t i = 1; i <= 4; ++i) tags.consonants.push_back({PhoneIndex(i), {}, i == 1 ? 10. : 1.});
    return melodicAccents(labels, tags)[1];
  };
  for (const Phone phone : turbulent) EXPECT_EQ(loud_among_quiet(phone), 0.8) << phoneName(phone);
  for (const Phone phone : others) EXPECT_FALSE(loud_among_quiet(phone)) << phoneName(phone);
}

TEST(VowelModification, TheTableOfThePaper) {
  using enum VowelGroup;
  const auto is = [](VowelGroup transcribed, VowelGroup sung, int spread, int round) {
    EXPECT_EQ(modificationFor(transcribed, sung), (VowelModification{spread, round}));
  };
  is(kA, kA, 0, 0);
  is(kA, kEI, 1, 0);
  is(kA, kOU, 0, 1);
  is(kEI, kA, -1, 0);
  is(kEI, kEI, 0, 0);
  is(kEI, kOU, -1, 1);
  is(kOU, kA, 0, -1);
  is(kOU, kEI, 1, -1);
  is(kOU, kOU, 0, 0);
}

TEST(VowelModification, OnlyOverTheThresholdAndAsHighAsLikely) {
  const SpeechLabels labels = spokenPhones({{Phone::kAA, 0.5}});
  const auto heard = [&](double i) {
    AudioTags tags;
    for (int k = 0; k < 200; ++k) tags.vowels.push_back({k * 0.01, 1 - i, 0, i, 0, 0, 0});
    return vowelModificationCurves(labels, tags);
  };
  EXPECT_TRUE(heard(0.60).empty()) << "not over 60 %";
  const CurveSet curves = heard(0.75);
  ASSERT_EQ(curves.size(), 1U);
  EXPECT_EQ(curves[0].name, "lipSpread");
  ASSERT_EQ(curves[0].keys.size(), 4U);
  EXPECT_NEAR(curves[0].keys[1].value, 0.75, 1e-9) << "P times the largest";
  EXPECT_NEAR(curves[0].keys[0].time, 0.5 - 0.120, 1e-9) << "starts just before the vowel";
  EXPECT_NEAR(curves[0].keys[2].time, 0.5 + 0.75 * 0.5, 0.02) << "four keys, as a viseme";
  EXPECT_LE(curves[0].keys.back().time, 1.0 + 1e-9) << "ends with the vowel";
}

TEST(VowelModification, KeysRiseHoweverFarApartTheStretchesLie) {
  const SpeechLabels labels = spokenPhones({{Phone::kAA, 1.0}});
  for (int gap = 1; gap < 30; ++gap) {
    AudioTags tags;
    for (int k = 0; k < 200; ++k) {
      const bool is_i = (k >= 55 && k < 75) || (k >= 75 + gap && k < 95 + gap);
      tags.vowels.push_back({k * 0.01, is_i ? 0.1 : 0.9, 0, is_i ? 0.9 : 0.1, 0, 0, 0});
    }
    for (const AnimationCurve& curve : vowelModificationCurves(labels, tags)) {
      for (std::size_t i = 1; i < curve.keys.size(); ++i)
        EXPECT_GT(curve.keys[i].time, curve.keys[i - 1].time) << curve.name << ", " << gap << " frames";
    }
  }
}

TEST(Larynx, FollowsThePitchWhileVowelsSound) {
  const SpeechLabels labels = spokenPhones({{Phone::kAA, 0.5}, {Phone::kS, 0.4}, {Phone::kIY, 0.5}});
  AudioTags tags;
  tags.notes = {{{0.5, 1.0}, 200}, {{1.4, 1.9}, 400}};
  const CurveSet curves = larynxCurves(labels, tags);
  ASSERT_EQ(curves.size(), 1U);
  EXPECT_NEAR(curves[0].valueAt(0.8), kLowestLarynx, 1e-9);
  EXPECT_NEAR(curves[0].valueAt(1.6), 1, 1e-9) << "the highest note";
  EXPECT_NEAR(curves[0].valueAt(1.2), 0, 1e-9) << "down between";
  EXPECT_TRUE(larynxCurves(labels, {}).empty());
}

TEST(Larynx, HardlySinksBetweenCloseVowels) {
  const SpeechLabels labels = spokenPhones({{Phone::kAA, 0.5}, {Phone::kN, 0.1}, {Phone::kIY, 0.5}});
  AudioTags tags;
  tags.notes = {{{0.5, 1.0}, 300}, {{1.1, 1.6}, 300}, {{1.7, 1.8}, 200}};
  const CurveSet curves = larynxCurves(labels, tags);
  ASSERT_EQ(curves.size(), 1U);
  EXPECT_NEAR(curves[0].valueAt(1.05), 0.95, 0.01) << "VC = 0.95 of the song, its height 1";
}

}  // namespace
}  // namespace mouthpiece
