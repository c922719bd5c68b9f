#include "vocal/animation_curve.h"

#include <gtest/gtest.h>

#include <cmath>

namespace mouthpiece {
namespace {

AnimationCurve fourKeys() {
  AnimationCurve curve{"Ah", {{0.0, 0.0}, {0.12, 0.8}, {0.30, 0.8}, {0.42, 0.0}}};
  curve.keys = withMonotoneSlopes(curve.keys);
  return curve;
}

TEST(CurveKey, GoesThroughItsKeysAndHoldsBeyond) {
  const AnimationCurve curve = fourKeys();
  for (const CurveKey& key : curve.keys) EXPECT_DOUBLE_EQ(curve.valueAt(key.time), key.value);
  EXPECT_DOUBLE_EQ(curve.valueAt(-1), 0.0);
  EXPECT_DOUBLE_EQ(curve.valueAt(9), 0.0);
  EXPECT_NEAR(curve.valueAt(0.06), 0.4, 1e-12) << "half way up an ease-in-ease-out ramp";
  EXPECT_DOUBLE_EQ(AnimationCurve{}.valueAt(0.5), 0.0);
}

TEST(CurveKey, HoldsBetweenEqualKeysAndHasNoKink) {
  const AnimationCurve curve = fourKeys();
  constexpr double kStep = 1e-6;
  for (double t = 0.13; t < 0.29; t += 0.01) EXPECT_NEAR(curve.valueAt(t), 0.8, 1e-12);
  for (const CurveKey& key : curve.keys) {
    const double before = (curve.valueAt(key.time) - curve.valueAt(key.time - kStep)) / kStep;
    const double after = (curve.valueAt(key.time + kStep) - curve.valueAt(key.time)) / kStep;
    EXPECT_NEAR(before, after, 1e-3) << key.time;
  }
}

TEST(CurveKey, MonotoneSlopesNeverOvershoot) {
  AnimationCurve curve{"Ee", {{0, 0}, {0.1, 0.7}, {0.11, 0.75}, {0.4, 0.1}, {0.5, 0.1}, {0.6, 1.0}}};
  curve.keys = withMonotoneSlopes(curve.keys);
  for (std::size_t i = 0; i + 1 < curve.keys.size(); ++i) {
    const auto [low, high] = std::minmax(curve.keys[i].value, curve.keys[i + 1].value);
    for (double u = 0; u <= 1; u += 0.05) {
      const double value = curve.valueAt(std::lerp(curve.keys[i].time, curve.keys[i + 1].time, u));
      EXPECT_GE(value, low - 1e-12);
      EXPECT_LE(value, high + 1e-12);
    }
  }
}

TEST(CurveKey, SamplesAsItAnswers) {
  const AnimationCurve curve = fourKeys();
  std::vector<Seconds> times;
  for (int i = -5; i < 60; ++i) times.push_back(i * 0.01);
  const std::vector<double> values = sampleCurve(curve, times);
  for (std::size_t i = 0; i < times.size(); ++i) EXPECT_DOUBLE_EQ(values[i], curve.valueAt(times[i]));
}

}  // namespace
}  // namespace mouthpiece
