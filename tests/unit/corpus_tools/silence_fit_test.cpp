#include "corpus_tools/building/prediction_parts.h"

#include <gtest/gtest.h>

namespace mouthpiece {
namespace {

constexpr double kRateHz = 25;

/// A corpus and the fit's takes: each is silent for a while, its mouth opens from 0 to 10 mm `opens` before it speaks
/// and is open 20 mm in speech.
struct Breathing {
  Corpus corpus;
  std::vector<FitTake> takes;

  void add(Seconds silence, Seconds opens, double breath_mm = 10) {
    CorpusTake take;
    take.labels.phones = {{Phone::kSil, {0, silence}, {}, {}},
                          {Phone::kAA, {silence, silence + 0.5}, {}, {}},
                          {Phone::kSil, {silence + 0.5, silence + 1}, {}, {}}};
    FitTake fit;
    fit.index = takes.size();
    const auto rows = static_cast<Eigen::Index>((silence + 1) * kRateHz);
    fit.seen = Eigen::VectorXd::Ones(rows);
    fit.openings = Eigen::VectorXd::Zero(rows);
    for (Eigen::Index row = 0; row < rows; ++row) {
      const Seconds time = static_cast<double>(row) / kRateHz;
      fit.times.push_back(time);
      if (time >= silence - opens) fit.openings(row) = breath_mm;
      if (time >= silence) fit.openings(row) = 20;
    }
    corpus.takes.push_back(std::move(take));
    takes.push_back(std::move(fit));
  }
  [[nodiscard]] SilenceTiming timing() const { return fitSilenceTiming(takes, corpus); }
};

TEST(SilenceFit, FindsHowLongBeforeSpeechTheMouthOpens) {
  Breathing breathing;
  for (int i = 0; i < 400; ++i) {
    const Seconds silence = 0.4 + 0.002 * i;
    breathing.add(silence, 0.5 * silence);
  }
  const SilenceTiming timing = breathing.timing();
  EXPECT_TRUE(timing.pauses_settle);
  // Within a frame, and drawn to the usual by 20 of 420.
  EXPECT_NEAR(timing.breathIn(0.6), 0.3, 0.03);
  EXPECT_NEAR(timing.breathIn(1.0), 0.5, 0.04);
  EXPECT_EQ(timing.breathIn(5), timing.breathIn(1.3)) << "no longer than was seen";
  EXPECT_EQ(timing.breathIn(0.05), timing.breathIn(0.3)) << "no shorter";
  EXPECT_GT(timing.breathIn(0.05), 0.15);
}

TEST(SilenceFit, TakesThatDoNotBreatheAndTooFewKeepTheUsual) {
  Breathing still, few, flat;
  for (int i = 0; i < 100; ++i) still.add(0.6, 0.5, 1.0);  // it hardly opens
  for (int i = 0; i < 7; ++i) few.add(0.6, 0.2);
  for (int i = 0; i < 100; ++i) flat.add(0.6, 0.6);  // open from the beginning: no moment is known
  for (const Breathing* breathing : {&still, &few, &flat}) EXPECT_EQ(breathing->timing(), SilenceTiming());
}

TEST(SilenceFit, AFewTakesAreHalfBelieved) {
  Breathing twenty;
  for (int i = 0; i < 20; ++i) twenty.add(0.6 + 1e-3 * i, 0.15);
  EXPECT_NEAR(twenty.timing().breathIn(0.61), 0.5 * 0.15 + 0.5 * 0.35, 0.02);
}

}  // namespace
}  // namespace mouthpiece
