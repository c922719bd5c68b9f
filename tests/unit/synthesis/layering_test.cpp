// Consonants of the capture over vowels of the curves (VOCAL 3.3), as songs are made.
#include <gtest/gtest.h>

#include <algorithm>

#include "support/tiny_corpus.h"
#include "synthesis/stages.h"
#include "synthesis/synthesis.h"

namespace mouthpiece {
namespace {

using samples::lipOpening;
using samples::tinyCorpus;
using samples::tinyLabels;

constexpr double kLayerRateHz = 240;
/// The consonants' captured motion comes and goes over this beside them.
constexpr Seconds kFade = 0.060;

SynthesisRequest sungRequest(const SpeechLabels& labels, double ma, bool layered) {
  SynthesisRequest request;
  request.labels = labels;
  request.options.frame_rate_hz = kLayerRateHz;
  request.options.curves.alone = CurveStyle::kSing;
  request.options.curves.layered = layered;
  request.options.curves.ma.given = StyleSignal(ma);
  request.options.curves.ps.given = StyleSignal(0.0);
  return request;
}

PositionMatrix motionOf(const SynthesisRequest& request, const Corpus& corpus) {
  return synthesise(request, corpus).motion.positions_mm;
}

/// What the units alone do.
PositionMatrix captureOf(const SpeechLabels& labels, const Corpus& corpus) {
  SynthesisRequest request;
  request.labels = labels;
  request.options.frame_rate_hz = kLayerRateHz;
  return motionOf(request, corpus);
}

/// Without the columns of lids and brows: capture has them, consonants or not.
PositionMatrix ofTheMouth(const PositionMatrix& motion) {
  const std::vector<bool> is_upper = upperFaceColumns(tinyCorpus().layout);
  std::vector<Eigen::Index> columns;
  for (std::size_t i = 0; i < is_upper.size(); ++i) {
    if (!is_upper[i]) columns.push_back(signedIndex(i));
  }
  return motion(Eigen::all, columns);
}

double difference(const PositionMatrix& a, const PositionMatrix& b, Seconds time) {
  const auto row = static_cast<Eigen::Index>(time * kLayerRateHz);
  return ofTheMouth(a.row(row) - b.row(row)).cwiseAbs().maxCoeff();
}

/// Every phone 0.25 s: room for the middles of vowels beyond the fades.
SpeechLabels heldLabels() {
  SpeechLabels labels = tinyLabels("DH-AH M-AE-N AE-T N-UW-N", 0);
  for (LabelledPhone& phone : labels.phones) phone.span = {2.5 * phone.span.start, 2.5 * phone.span.end};
  return labels;
}

TEST(Layering, ConsonantsAreCapturedAndVowelsDrawnWhereMaIsLow) {
  const Corpus corpus = tinyCorpus();
  const SpeechLabels labels = heldLabels();
  const PositionMatrix layered = motionOf(sungRequest(labels, 0, true), corpus);
  const PositionMatrix curves = motionOf(sungRequest(labels, 0, false), corpus);
  const PositionMatrix capture = captureOf(labels, corpus);
  std::size_t consonants = 0, vowels = 0;
  double apart = 0;
  for (const LabelledPhone& phone : labels.phones) {
    if (phone.phone == Phone::kSil) continue;
    const Seconds middle = phone.span.middle();
    apart = std::max(apart, difference(capture, curves, middle));
    if (!isVowel(phone.phone)) {
      EXPECT_LT(difference(layered, capture, middle), 1e-9) << phoneName(phone.phone);
      ++consonants;
    } else if (phone.span.duration() > 2 * kFade + 0.02) {
      EXPECT_LT(difference(layered, curves, middle), 1e-9) << phoneName(phone.phone);
      ++vowels;
    }
  }
  EXPECT_GE(consonants, 5U);
  EXPECT_GE(vowels, 4U);
  EXPECT_GT(apart, 1) << "mm; else nothing was told apart";
}

TEST(Layering, NoConsonantIsCapturedWhereMaIsOne) {
  const Corpus corpus = tinyCorpus();
  const SpeechLabels labels = heldLabels();
  const PositionMatrix layered = motionOf(sungRequest(labels, 1, true), corpus);
  const PositionMatrix curves = motionOf(sungRequest(labels, 1, false), corpus);
  EXPECT_LT(ofTheMouth(layered - curves).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(Layering, InBetweenByOneLessMa) {
  const Corpus corpus = tinyCorpus();
  const SpeechLabels labels = heldLabels();
  constexpr double kMa = 0.3;
  const PositionMatrix layered = motionOf(sungRequest(labels, kMa, true), corpus);
  const PositionMatrix curves = motionOf(sungRequest(labels, kMa, false), corpus);
  const PositionMatrix capture = captureOf(labels, corpus);
  for (const LabelledPhone& phone : labels.phones) {
    if (phone.phone == Phone::kSil || isVowel(phone.phone)) continue;
    const auto row = static_cast<Eigen::Index>(phone.span.middle() * kLayerRateHz);
    const auto wanted = kMa * curves.row(row) + (1 - kMa) * capture.row(row);
    EXPECT_LT(ofTheMouth(layered.row(row) - wanted).cwiseAbs().maxCoeff(), 1e-9) << phoneName(phone.phone);
  }
}

TEST(Layering, ComesAndGoesWithoutAStep) {
  const Corpus corpus = tinyCorpus();
  const SpeechLabels labels = heldLabels();
  const auto largest_step = [](const PositionMatrix& motion) {
    return (motion.bottomRows(motion.rows() - 1) - motion.topRows(motion.rows() - 1)).cwiseAbs().maxCoeff();
  };
  // A step would not shrink with the frames.
  SynthesisRequest request = sungRequest(labels, 0, true);
  const double coarse = largest_step(motionOf(request, corpus));
  request.options.frame_rate_hz = 4 * kLayerRateHz;
  EXPECT_LT(largest_step(motionOf(request, corpus)), 0.4 * coarse);
}

TEST(Layering, LipsCloseForTheMInSong) {
  const Corpus corpus = tinyCorpus();
  const SpeechLabels labels = heldLabels();
  const auto m = std::find_if(labels.phones.begin(), labels.phones.end(),
                              [](const LabelledPhone& phone) { return phone.phone == Phone::kM; });
  for (const double ma : {0.0, 0.5, 1.0}) {
    const std::vector<double> opening = lipOpening(synthesise(sungRequest(labels, ma, true), corpus).motion);
    const auto first = opening.begin() + static_cast<std::ptrdiff_t>((m->span.start - 0.02) * kLayerRateHz);
    const auto end = opening.begin() + static_cast<std::ptrdiff_t>(m->span.end * kLayerRateHz);
    EXPECT_LT(*std::min_element(first, end), 1.6) << "mm; 1 apart at rest, Ma " << ma;
  }
}

}  // namespace
}  // namespace mouthpiece
