#include "synthesis/speech_dials.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "support/tiny_corpus.h"
#include "synthesis/synthesis.h"

namespace mouthpiece {
namespace {

using samples::lipOpening;
using samples::tinyCorpus;
using samples::tinyLabels;

UtteranceAnimation madeWith(const SpeechDials& dials, const Corpus& corpus,
                            const std::string& words = "DH-AH T-AY-M IH-Z N-AW") {
  SynthesisRequest request;
  request.labels = tinyLabels(words, 42);
  request.options.curves.fill_gaps = true;
  request.options.dials = dials;
  return synthesise(request, corpus);
}

SpeechDials with(StyleSignal SpeechDials::*dial, double value) {
  SpeechDials dials;
  dials.*dial = StyleSignal(value);
  return dials;
}

double rangeOf(const UtteranceAnimation& made) {
  const std::vector<double> opening = lipOpening(made.motion);
  return *std::max_element(opening.begin(), opening.end()) - *std::min_element(opening.begin(), opening.end());
}

TEST(SpeechDials, AtRestChangeNothing) {
  const Corpus corpus = tinyCorpus();
  EXPECT_TRUE(areUsual(SpeechDials()));
  EXPECT_EQ(madeWith({}, corpus).motion.positions_mm,
            madeWith(with(&SpeechDials::strength, 1), corpus).motion.positions_mm);
}

TEST(SpeechDials, StrengthScalesTheMovementAndKeepsTheClosures) {
  const Corpus corpus = tinyCorpus();
  const UtteranceAnimation plain = madeWith({}, corpus);
  const UtteranceAnimation weak = madeWith(with(&SpeechDials::strength, 0.5), corpus);
  const UtteranceAnimation strong = madeWith(with(&SpeechDials::strength, 1.5), corpus);
  EXPECT_LT(rangeOf(weak), 0.75 * rangeOf(plain));
  EXPECT_GT(rangeOf(strong), 1.2 * rangeOf(plain));
  EXPECT_GT(plain.mouth.bilabials, 0U);
  for (const UtteranceAnimation* made : {&plain, &weak, &strong})
    EXPECT_EQ(made->mouth.closures, plain.mouth.closures) << "of " << made->mouth.bilabials;
}

TEST(SpeechDials, ATrackWorksWhereItIs) {
  const Corpus corpus = tinyCorpus();
  const UtteranceAnimation plain = madeWith({}, corpus);
  SpeechDials dials;
  dials.strength.points = {{0.40, 1}, {0.45, 1.8}, {0.60, 1.8}, {0.65, 1}};
  const UtteranceAnimation made = madeWith(dials, corpus);
  const double rate = made.motion.frame_rate_hz;
  double inside = 0;
  for (Eigen::Index frame = 0; frame < made.motion.positions_mm.rows(); ++frame) {
    const Seconds time = static_cast<double>(frame) / rate;
    const double change =
        (made.motion.positions_mm.row(frame) - plain.motion.positions_mm.row(frame)).cwiseAbs().maxCoeff();
    if (time < 0.39 || time > 0.66) {
      EXPECT_LT(change, 1e-9) << time;
    }
    inside = std::max(inside, change);
  }
  EXPECT_GT(inside, 0.5) << "mm";
}

/// F and V are kept where a lead has put them, and their neighbours are not.
TEST(SpeechDials, LeadAndStrengthDoTheSameInAnyOrder) {
  const Corpus corpus = tinyCorpus();
  const std::string words = "DH-AH F-AY-V IH-Z F-AW";
  SpeechDials weak = with(&SpeechDials::strength, 0.3), early = weak;
  constexpr Seconds kLead = 0.1;
  early.lead_ms = StyleSignal(1000 * kLead);
  const UtteranceAnimation made = madeWith(weak, corpus, words);
  const std::vector<double> opening = lipOpening(made.motion);
  const std::vector<double> shifted = lipOpening(madeWith(early, corpus, words).motion);
  const auto frames = static_cast<std::size_t>(std::lround(kLead * made.motion.frame_rate_hz));
  double worst = 0;
  for (std::size_t frame = 2 * frames; frame + 2 * frames < opening.size(); ++frame)
    worst = std::max(worst, std::abs(shifted[frame] - opening[frame + frames]));
  EXPECT_LT(worst, 0.3) << "mm";
}

TEST(SpeechDials, LeadMovesTheMouthEarlier) {
  const Corpus corpus = tinyCorpus();
  const std::vector<double> plain = lipOpening(madeWith({}, corpus).motion);
  const std::vector<double> early = lipOpening(madeWith(with(&SpeechDials::lead_ms, 100), corpus).motion);
  const auto widest = [](const std::vector<double>& opening) {
    return std::max_element(opening.begin(), opening.end()) - opening.begin();
  };
  EXPECT_NEAR(static_cast<double>(widest(plain) - widest(early)), 6, 1) << "frames of 60 a second";
}

TEST(SpeechDials, SmoothingTakesJitterAway) {
  const Corpus corpus = tinyCorpus();
  EXPECT_LT(madeWith(with(&SpeechDials::smooth_ms, 40), corpus).mouth.jitter_mm, madeWith({}, corpus).mouth.jitter_mm);
}

TEST(SpeechDials, TheLowerFaceAloneIsMoved) {
  const Corpus corpus = tinyCorpus();
  const UtteranceAnimation plain = madeWith({}, corpus), strong = madeWith(with(&SpeechDials::strength, 2), corpus);
  const auto brow = plain.motion.findMarker("BROW");
  const Eigen::Index column = brow ? 3 * brow->row() : 9;  // the last of the four markers
  EXPECT_EQ(plain.motion.positions_mm.middleCols<3>(column), strong.motion.positions_mm.middleCols<3>(column));
}

TEST(SpeechDials, AllTheWayUpStaysAFace) {
  const Corpus corpus = tinyCorpus();
  SpeechDials dials;
  dials.strength = dials.jaw = dials.lips = StyleSignal(2);
  const UtteranceAnimation made = madeWith(dials, corpus), plain = madeWith({}, corpus);
  EXPECT_TRUE(made.motion.positions_mm.allFinite());
  EXPECT_LT(rangeOf(made), 3 * rangeOf(plain));
}

}  // namespace
}  // namespace mouthpiece
