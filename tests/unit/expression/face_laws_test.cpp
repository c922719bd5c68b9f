// Laws of beats, blinks, looks and shapes: on random words and seeds.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "base/errors.h"
#include "expression/beats.h"
#include "expression/expression.h"
#include "expression/live_face.h"
#include "expression/ruled_face.h"
#include "motion/arkit_shapes.h"
#include "motion/marker_layout.h"
#include "support/tiny_corpus.h"

namespace mouthpiece {
namespace {

using samples::tinyLabels;

/// Words of two or three phones, now and then a pause between them, 0.2 s or longer.
SpeechLabels randomLine(unsigned seed) {
  std::mt19937 random(seed);
  const std::vector<std::string> words{"DH-AH", "T-AY-M", "N-AW", "M-AE-N", "B-AY", "IY-T", "T-EH-N"};
  std::string line;
  const std::size_t count = 1 + random() % 7;
  for (std::size_t i = 0; i < count; ++i) {
    if (i > 0) line += ' ';
    for (std::size_t pauses = i > 0 && random() % 3 == 0 ? 1 + random() % 6 : 0; pauses > 0; --pauses) line += "| ";
    line += words[random() % words.size()];
  }
  return tinyLabels(line, 1 + random() % 1000);
}

TEST(Beats, AreTheWordsAndPausesFromEndToEnd) {
  for (unsigned seed = 1; seed <= 60; ++seed) {
    SCOPED_TRACE(seed);
    const SpeechLabels labels = randomLine(seed);
    const std::vector<Beat> beats = beatsOf(labels);
    ASSERT_FALSE(beats.empty());
    EXPECT_EQ(beats.front().span.start, 0);
    EXPECT_NEAR(beats.back().span.end, labels.duration(), 1e-12);
    std::size_t words = 0;
    for (std::size_t i = 0; i < beats.size(); ++i) {
      const Beat& beat = beats[i];
      EXPECT_GT(beat.span.duration(), 0);
      if (i > 0) {
        EXPECT_NEAR(beat.span.start, beats[i - 1].span.end, 1e-12);
      }
      const bool after_pause = i > 0 && beats[i - 1].is_silence,
                 before_pause = i + 1 < beats.size() && beats[i + 1].is_silence;
      if (beat.is_silence) {
        EXPECT_LE(beat.span.duration(), 0.8 + 1e-12) << "a long pause is several";
        EXPECT_EQ(beat.starts_phrase, i == 0);
        EXPECT_EQ(beat.ends_phrase, i + 1 == beats.size());
        EXPECT_FALSE(beat.is_accented);
        for (const LabelledPhone& phone : labels.phones) {
          if (phone.span.contains(beat.span.middle())) {
            EXPECT_EQ(phone.phone, Phone::kSil);
          }
        }
        continue;
      }
      ++words;
      EXPECT_EQ(beat.starts_phrase, i == 0 || after_pause);
      EXPECT_EQ(beat.ends_phrase, i + 1 == beats.size() || before_pause);
      EXPECT_TRUE(beat.span.contains(beat.accent));
      for (const LabelledPhone& phone : labels.phones) {
        if (beat.is_accented && phone.span.contains(beat.accent)) {
          EXPECT_TRUE(isVowel(phone.phone));
        }
      }
    }
    EXPECT_EQ(words, labels.words.size());
  }
}

/// Of words in a phrase's middle those bear an accent whose stressed vowel is longer than usual; the last one always.
TEST(Beats, AccentsAreOnLongVowelsAndAtThePhrasesEnd) {
  std::size_t long_ones = 0;
  for (unsigned seed = 1; seed <= 60; ++seed) {
    SCOPED_TRACE(seed);
    const SpeechLabels labels = randomLine(seed);
    std::vector<double> lengths;
    const auto vowelOf = [&](const TimeSpan& word) {
      double longest = 0;
      for (const LabelledPhone& phone : labels.phones) {
        if (!word.contains(phone.span.middle()) || !isVowel(phone.phone) || !phone.syllable) continue;
        if (labels.syllables[*phone.syllable].stress == 1) longest = std::max(longest, phone.span.duration());
      }
      return longest;
    };
    const std::vector<Beat> beats = beatsOf(labels);
    for (const Beat& beat : beats) {
      if (!beat.is_silence && vowelOf(beat.span) > 0) lengths.push_back(vowelOf(beat.span));
    }
    if (lengths.empty()) continue;
    std::sort(lengths.begin(), lengths.end());
    const double usual = lengths[lengths.size() / 2];  // of an even number the later of the two in the middle
    for (const Beat& beat : beats) {
      if (beat.is_silence) continue;
      const double vowel = vowelOf(beat.span);
      const bool is_long = vowel > 1.1 * usual;
      EXPECT_EQ(beat.is_accented, vowel > 0 && (beat.ends_phrase || is_long)) << beat.span.start;
      long_ones += is_long && !beat.ends_phrase ? 1U : 0U;
    }
  }
  EXPECT_GT(long_ones, 5U);
}

TEST(Blinks, CloseFastStayAndOpenSlowly) {
  EXPECT_EQ(lidsClosed(-0.01), 0);
  EXPECT_EQ(lidsClosed(0), 0);
  double before = 0;
  for (int ms = 1; ms <= 400; ++ms) {
    const double now = lidsClosed(0.001 * ms);
    EXPECT_LT(std::abs(now - before), 0.02) << "no jump, at " << ms << " ms";
    if (ms <= 90) {
      EXPECT_GE(now, before) << ms;
    } else if (ms >= 120) {
      EXPECT_LE(now, before) << ms;
    }
    if (ms >= 90 && ms <= 120) {
      EXPECT_NEAR(now, 1, 1e-9) << ms;
    }
    before = now;
  }
  EXPECT_NEAR(lidsClosed(0.045), 0.5, 1e-9);
  EXPECT_NEAR(lidsClosed(0.12 + 0.095), 0.5, 1e-9);
  EXPECT_EQ(lidsClosed(0.31), 0);
}

TEST(Saccades, LastLongerTheFurtherTheyGo) {
  EXPECT_NEAR(saccadeLasts(0, 0, 0, 0), 0.021, 1e-12);
  EXPECT_NEAR(saccadeLasts(0, 0, 10, 0), 0.043, 1e-12);
  EXPECT_NEAR(saccadeLasts(-3, 2, 0, -2), 0.021 + 0.0022 * 5, 1e-12);
  EXPECT_EQ(saccadeLasts(1, 2, 3, 4), saccadeLasts(3, 4, 1, 2));
}

/// The face of a stream in ten minutes: as often as people, never within 0.9 s, and the same at any frame rate.
TEST(LiveFaces, BlinkAsPeopleDoWhateverTheFrameRate) {
  const ExpressionOptions options{.upper_face = UpperFaceSource::kRules, .gaze = true, .seed = 7};
  LiveFace fine(options, 200), coarse(options, 50);
  EXPECT_TRUE(fine.blinks() && fine.looks());
  std::vector<Seconds> blinks;
  double before = 0;
  float most_yaw = 0, most_pitch = 0;
  std::size_t at_listener = 0, jumps = 0;
  GazeTurn last;
  constexpr int kFrames = 200 * 600;
  for (int k = 0; k < kFrames; ++k) {
    const LiveFace::Pose pose = fine.next();
    ASSERT_GE(pose.closed, 0);
    ASSERT_LE(pose.closed, 1);
    if (pose.closed > 0.5 && before <= 0.5) blinks.push_back(k / 200.0);
    before = pose.closed;
    most_yaw = std::max(most_yaw, std::abs(pose.gaze.yaw));
    most_pitch = std::max(most_pitch, std::abs(pose.gaze.pitch));
    at_listener += std::abs(pose.gaze.yaw) < 0.03F ? 1U : 0U;
    jumps += std::abs(pose.gaze.yaw - last.yaw) > 0.005F ? 1U : 0U;
    last = pose.gaze;
    if (k % 4 != 0) continue;
    const LiveFace::Pose same = coarse.next();
    ASSERT_EQ(pose.closed, same.closed) << k;
    ASSERT_EQ(pose.gaze.yaw, same.gaze.yaw) << k;
    ASSERT_EQ(pose.gaze.pitch, same.gaze.pitch) << k;
  }
  EXPECT_GT(blinks.size(), 120U) << "twelve a minute";
  EXPECT_LT(blinks.size(), 320U);
  for (std::size_t i = 1; i < blinks.size(); ++i) EXPECT_GT(blinks[i] - blinks[i - 1], 0.88) << i;
  const float degree = 3.14159265F / 180;
  EXPECT_GT(most_yaw, 5 * degree);
  EXPECT_LE(most_yaw, 11.001F * degree);
  EXPECT_LE(most_pitch, 5.001F * degree);
  EXPECT_GT(at_listener, static_cast<std::size_t>(0.7 * kFrames));
  EXPECT_GT(jumps, 200U) << "eyes are never still";
}

TEST(LiveFaces, AreTheirSeedsAndDoOnlyWhatIsAsked) {
  const auto posesOf = [](const ExpressionOptions& options) {
    LiveFace face(options, 60);
    std::vector<float> numbers;
    for (int k = 0; k < 1200; ++k) {
      const LiveFace::Pose pose = face.next();
      numbers.insert(numbers.end(), {static_cast<float>(pose.closed), pose.gaze.yaw, pose.gaze.pitch});
    }
    return numbers;
  };
  const ExpressionOptions both{.upper_face = UpperFaceSource::kRules, .gaze = true, .seed = 3};
  EXPECT_EQ(posesOf(both), posesOf(both));
  EXPECT_NE(posesOf(both), posesOf({.upper_face = UpperFaceSource::kRules, .gaze = true, .seed = 4}));
  const std::vector<float> all = posesOf(both), blinks = posesOf({.upper_face = UpperFaceSource::kBest, .seed = 3}),
                           looks = posesOf({.gaze = true, .seed = 3}), none = posesOf({.seed = 3});
  for (std::size_t i = 0; i < all.size(); ++i) {
    EXPECT_EQ(none[i], 0);
    EXPECT_EQ(blinks[i], i % 3 == 0 ? all[i] : 0) << "asking for one more leaves the other as it was";
    EXPECT_EQ(looks[i], i % 3 == 0 ? 0 : all[i]);
  }
  EXPECT_THROW(LiveFace({.upper_face = UpperFaceSource::kCaptured}, 60), InputError);
  EXPECT_THROW(LiveFace({.head = true}, 60), InputError);
  EXPECT_THROW(LiveFace({.mood = moodOf("joy")}, 60), InputError);
}

/// Shapes are added up by their weights; what has no marker of the default layout's names does not move.
TEST(ShapeDisplacements, AreLinearInTheirWeights) {
  std::mt19937 random(6);
  std::uniform_real_distribution<double> any(0, 1);
  const MarkerLayout& layout = defaultLayout();
  const auto rows = static_cast<Eigen::Index>(layout.markers.size());
  const MarkerPositions neutral =
      arkitMarkerMoves().neutral_mm.rows() == rows ? arkitMarkerMoves().neutral_mm : MarkerPositions::Random(rows, 3);
  const auto weights = [&] { return PositionMatrix::NullaryExpr(3, 52, [&] { return any(random); }).eval(); };
  const PositionMatrix a = weights(), b = weights();
  const auto moved = [&](const PositionMatrix& w) { return shapeDisplacements(w, layout, neutral); };
  EXPECT_LT((moved(2 * a + b) - 2 * moved(a) - moved(b)).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_EQ(moved(PositionMatrix::Zero(2, 52)), PositionMatrix::Zero(2, 3 * rows));
  PositionMatrix jaw = PositionMatrix::Zero(1, 52);
  jaw(0, arkitIndex("jawOpen")) = 1;
  const ArkitMarkerMoves& learnt = arkitMarkerMoves();
  for (std::size_t m = 0; m < layout.markers.size(); ++m) {
    const auto own = std::find(learnt.markers.begin(), learnt.markers.end(), layout.markers[m].name);
    const Eigen::RowVector3d move = moved(jaw).block<1, 3>(0, 3 * static_cast<Eigen::Index>(m));
    const Eigen::RowVector3d expected =
        own == learnt.markers.end()
            ? Eigen::RowVector3d::Zero().eval()
            : learnt.moves_mm[static_cast<std::size_t>(arkitIndex("jawOpen"))].row(own - learnt.markers.begin()).eval();
    EXPECT_EQ(move, expected) << layout.markers[m].name;
  }
  MarkerLayout foreign = layout;
  for (LayoutMarker& marker : foreign.markers) marker.name = "my " + marker.name;
  EXPECT_EQ(shapeDisplacements(a, foreign, neutral).norm(), 0);
}

}  // namespace
}  // namespace mouthpiece
