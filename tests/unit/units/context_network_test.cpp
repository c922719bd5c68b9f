#include "units/prediction/context_network.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "support/tiny_corpus.h"

namespace mouthpiece {
namespace {

using samples::tinyLabels;

using Shares = std::vector<std::pair<Eigen::Index, float>>;

TEST(ContextWindows, TogetherSeeEachMomentOnce) {
  const SpeechLabels labels = tinyLabels("M-AE-N", 5);
  const std::vector<ContextSegment> segments = contextSegments(labels);
  for (Seconds time = 0; time < labels.duration(); time += 0.013) {
    std::vector<double> windows(kContextWindows, 0.0);
    Shares shares;
    for (const ContextSegment& segment : segments) {
      windowShares(segment.span, time, shares);
      for (const auto& [window, share] : shares) windows[static_cast<std::size_t>(window)] += share;
    }
    for (const double share : windows) EXPECT_NEAR(share, 1, 1e-3) << time;
  }
}

TEST(ContextWindows, ChangeSmoothlyWithTime) {
  const TimeSpan segment{0.3, 0.4};
  constexpr Seconds kStep = 0.001;
  Shares before, after;
  for (Seconds time = 0; time < 0.8; time += kStep) {
    windowShares(segment, time, before);
    windowShares(segment, time + kStep, after);
    const auto shareOf = [](const Shares& shares, Eigen::Index window) {
      for (const auto& [own, share] : shares) {
        if (own == window) return share;
      }
      return 0.0F;
    };
    for (Eigen::Index window = 0; window < kContextWindows; ++window)
      EXPECT_NEAR(shareOf(before, window), shareOf(after, window), 0.05) << time << " " << window;
  }
}

std::vector<double> numbersOf(const ContextSegment& segment) {
  std::vector<double> numbers(contextFeatureNames().size(), 0.0);
  for (const auto& [feature, value] : segment.features) numbers[static_cast<std::size_t>(feature)] += value;
  return numbers;
}

TEST(ContextSegments, SoundsMadeAlikeHaveLikeNumbers) {
  const auto spoken = [](const char* phones) { return numbersOf(contextSegments(tinyLabels(phones, 5))[1]); };
  const auto apart = [](const std::vector<double>& a, const std::vector<double>& b) {
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
    return sum;
  };
  EXPECT_LT(apart(spoken("P-AE"), spoken("B-AE")), apart(spoken("P-AE"), spoken("S-AE")));
  EXPECT_LT(apart(spoken("T-AE"), spoken("D-AE")), apart(spoken("T-AE"), spoken("M-AE")));
  EXPECT_LT(apart(spoken("UW-N"), spoken("OW-N")), apart(spoken("UW-N"), spoken("AE-N")));
}

TEST(ContextSegments, EveryFeatureHasItsOwnNameAndPlace) {
  const auto names = contextFeatureNames();
  const std::vector<ContextSegment> segments = contextSegments(tinyLabels("M-AE-N-OW", 5));
  ASSERT_GE(segments.size(), 6U) << "a diphthong is two";
  for (const ContextSegment& segment : segments) {
    ASSERT_FALSE(segment.features.empty());
    std::set<Eigen::Index> seen;
    for (const auto& [feature, value] : segment.features) {
      EXPECT_TRUE(std::isfinite(value));
      ASSERT_LT(feature, std::ssize(names));
      EXPECT_TRUE(seen.insert(feature).second) << names[static_cast<std::size_t>(feature)];
    }
  }
}

TEST(ContextNetwork, IsItsFormula) {
  const std::vector<ContextSegment> segments = contextSegments(tinyLabels("M-AE", 5));
  const auto features = std::ssize(contextFeatureNames());
  ContextNetwork network;
  network.input = ContextNetwork::Matrix::Zero(features, kContextWindows * 2);
  network.input.setConstant(0.01F);
  network.bias = Eigen::RowVectorXf::Constant(2, 0.1F);
  network.output = ContextNetwork::Matrix::Identity(2, 2);
  const std::vector<Seconds> times{0.2};
  double sum = 0.1;
  Shares shares;
  for (const ContextSegment& segment : segments) {
    windowShares(segment.span, times[0], shares);
    for (const auto& [window, share] : shares) {
      for (const auto& [feature, value] : segment.features) sum += 0.01 * double{share} * double{value};
    }
  }
  const Eigen::MatrixXd values = network.at(contextView(segments, times), network.given(segments));
  EXPECT_NEAR(values(0, 0), std::tanh(sum), 1e-4);
  EXPECT_NEAR(values(0, 1), std::tanh(sum), 1e-4);
}

}  // namespace
}  // namespace mouthpiece
