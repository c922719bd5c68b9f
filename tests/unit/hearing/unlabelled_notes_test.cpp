#include "hearing/tags/unlabelled_notes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace mouthpiece {
namespace {

constexpr double kLoudDb = -20, kQuietDb = -40;

std::vector<double> together(const std::vector<std::pair<std::size_t, double>>& stretches) {
  std::vector<double> values;
  for (const auto& [samples, value] : stretches) values.insert(values.end(), samples, value);
  return values;
}

TEST(SyllableNuclei, DipsOfFiveDecibelsPartThem) {
  const std::vector<SampleSpan> parted = syllableNuclei(together({{30, kLoudDb}, {8, kLoudDb - 8}, {30, kLoudDb}}));
  ASSERT_EQ(parted.size(), 2U);
  EXPECT_EQ(parted[0].first, 0U);
  EXPECT_NEAR(static_cast<double>(parted[0].last), 29, 1);
  EXPECT_NEAR(static_cast<double>(parted[1].first), 38, 1);
  EXPECT_EQ(parted[1].last, 67U);
  EXPECT_EQ(syllableNuclei(together({{30, kLoudDb}, {8, kLoudDb - 4}, {30, kLoudDb}})).size(), 1U);
}

TEST(SyllableNuclei, WhatIsQuietAtTheEndsIsNoVowel) {
  const std::vector<SampleSpan> nuclei = syllableNuclei(together({{10, kQuietDb}, {30, kLoudDb}, {10, kQuietDb}}));
  ASSERT_EQ(nuclei.size(), 1U);
  EXPECT_NEAR(static_cast<double>(nuclei[0].first), 10, 1);
  EXPECT_NEAR(static_cast<double>(nuclei[0].last), 39, 1);
}

TEST(SyllableNuclei, LieApartAndInOrderWhateverTheLevels) {
  for (double pace = 0.05; pace < 1; pace *= 1.3) {
    std::vector<double> level;
    for (int i = 0; i < 200; ++i) level.push_back(20 * std::sin(pace * i) + 10 * std::sin(0.31 * pace * i));
    std::size_t next = 0;
    for (const SampleSpan& nucleus : syllableNuclei(level)) {
      EXPECT_GE(nucleus.first, next) << pace;
      EXPECT_GT(nucleus.last, nucleus.first) << pace;
      EXPECT_LT(nucleus.last, level.size()) << pace;
      next = nucleus.last;
    }
  }
  EXPECT_TRUE(syllableNuclei({}).empty());
}

std::vector<Note> notesOf(const std::vector<double>& pitch_hz, const std::vector<VibratoRun>& vibrato = {}) {
  return unlabelledNotes(pitch_hz, std::vector<double>(pitch_hz.size(), kLoudDb), 100, vibrato);
}

/// Notes of a sixth of a second a tone apart, led into each other over 50 ms.
TEST(UnlabelledNotes, AQuickMelismaHasANoteATone) {
  const std::vector<double> wanted{196, 220, 247, 220};
  std::vector<double> pitch;
  for (std::size_t note = 0; note < wanted.size(); ++note) {
    const double before = note > 0 ? wanted[note - 1] : wanted[0];
    for (int i = 0; i < 17; ++i) pitch.push_back(std::lerp(before, wanted[note], std::min(1.0, i / 5.0)));
  }
  const std::vector<Note> notes = notesOf(pitch);
  ASSERT_EQ(notes.size(), wanted.size());
  for (std::size_t i = 0; i < notes.size(); ++i) {
    EXPECT_NEAR(12 * std::log2(notes[i].hz / wanted[i]), 0, 0.2) << i;
    EXPECT_NEAR(notes[i].span.start, 1 + 0.17 * static_cast<double>(i), 0.05) << i;
    EXPECT_TRUE(i == 0 || notes[i].span.start == notes[i - 1].span.end) << "no gap";
  }
}

TEST(UnlabelledNotes, VibratoIsOneNote) {
  std::vector<double> pitch;
  for (int i = 0; i < 120; ++i) pitch.push_back(220 * std::exp2(0.9 * std::sin(2 * std::numbers::pi * 0.055 * i) / 12));
  const std::vector<VibratoRun> vibrato = findVibrato(pitch);
  ASSERT_EQ(vibrato.size(), 1U);
  const std::vector<Note> notes = notesOf(pitch, vibrato);
  ASSERT_EQ(notes.size(), 1U);
  EXPECT_NEAR(12 * std::log2(notes[0].hz / 220), 0, 0.2);
  EXPECT_NEAR(notes[0].span.duration(), 1.2, 0.02);
}

TEST(UnlabelledNotes, AScoopBelongsToItsNoteAndAGlideAloneIsOne) {
  std::vector<double> pitch;
  for (int i = 0; i < 12; ++i) pitch.push_back(190 + 2.5 * i);
  pitch.insert(pitch.end(), 40, 220.0);
  const std::vector<Note> scooped = notesOf(pitch);
  ASSERT_EQ(scooped.size(), 1U);
  EXPECT_NEAR(scooped[0].span.start, 1, 0.02);
  std::vector<double> glide;
  for (int i = 0; i < 30; ++i) glide.push_back(200 + 2 * i);
  EXPECT_EQ(notesOf(glide).size(), 1U);
}

}  // namespace
}  // namespace mouthpiece
