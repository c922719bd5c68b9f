// The frames that wait to be shown, and those between a frame and rest.
#include "speaker/live_parts.h"

#include <gtest/gtest.h>

#include <deque>
#include <random>
#include <vector>

namespace mouthpiece {
namespace {

/// Any order of adding and taking, against a queue of numbers.
TEST(FrameRing, GivesFramesBackInTheirOrder) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    FrameRing ring;
    std::deque<double> expected;
    double next = 0;
    ShownFrame shown;
    for (int step = 0; step < 2000; ++step) {
      const bool adds = random() % 100 < (step / 500 % 2 == 0 ? 60U : 40U);
      if (adds) {
        ring.add().markers_mm = {next};
        expected.push_back(next++);
      } else if (!expected.empty()) {
        ring.take(shown);
        ASSERT_EQ(shown.markers_mm, std::vector<double>{expected.front()});
        expected.pop_front();
      }
      ASSERT_EQ(ring.size(), expected.size());
    }
  }
}

/// Every number that a frame has, told apart by what it is.
ShownFrame numbered(double first) {
  ShownFrame frame;
  double next = first;
  const auto number = [&] { return next += 0.25; };
  const auto real = [&] { return static_cast<float>(number()); };
  frame.markers_mm = {number(), number(), number()};
  for (float& weight : frame.arkit) weight = real();
  frame.lips = {real(), real(), real(), real()};
  frame.tongue = {real(), real(), real()};
  frame.face_markers = {number(), number()};
  frame.lip_gaps = {{number(), number(), number()}, {number(), number(), number()}};
  frame.gaze = {real(), real()};
  return frame;
}

std::vector<double> numbersOf(const ShownFrame& frame) {
  std::vector<double> all = frame.markers_mm;
  all.insert(all.end(), frame.arkit.begin(), frame.arkit.end());
  all.insert(all.end(), {frame.lips.seal, frame.lips.parting, frame.lips.tuck, frame.lips.rounding});
  all.insert(all.end(), {frame.tongue.tip_up, frame.tongue.tip_forward, frame.tongue.back_up});
  all.insert(all.end(), frame.face_markers.begin(), frame.face_markers.end());
  for (const LipGap& gap : frame.lip_gaps) all.insert(all.end(), {gap.opened, gap.least, gap.tuck});
  all.insert(all.end(), {frame.gaze.yaw, frame.gaze.pitch});
  return all;
}

TEST(LerpFrame, LeadsEveryNumberStraightToRest) {
  const ShownFrame from = numbered(0), rest = numbered(100);
  for (const double way : {0.0, 0.25, 0.5, 1.0}) {
    ShownFrame to = numbered(-7);
    lerpFrame(from, rest, way, to);
    const std::vector<double> a = numbersOf(from), b = numbersOf(rest), found = numbersOf(to);
    ASSERT_EQ(found.size(), a.size());
    for (std::size_t i = 0; i < a.size(); ++i) EXPECT_NEAR(found[i], a[i] + way * (b[i] - a[i]), 1e-4) << i;
  }
}

}  // namespace
}  // namespace mouthpiece
