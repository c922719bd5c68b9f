// What holds for all curves and edits, on random ones.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "base/errors.h"
#include "vocal/animation_curve.h"

namespace mouthpiece {
namespace {

/// Keys 10 to 300 ms apart with values in [0, 1], some alike, some a step at one time.
std::vector<CurveKey> randomKeys(unsigned seed, bool may_step = false) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> share(0, 1);
  std::vector<CurveKey> keys;
  Seconds time = share(random) - 0.5;
  for (std::size_t count = 1 + seed % 12; count > 0; --count) {
    const bool repeats = !keys.empty() && share(random) < 0.3;
    keys.push_back({time, repeats ? keys.back().value : share(random), 0, 0});
    if (!(may_step && share(random) < 0.2)) time += 0.01 + 0.29 * share(random);
  }
  return keys;
}

AnimationCurve randomCurve(unsigned seed) { return {"c" + std::to_string(seed), withMonotoneSlopes(randomKeys(seed))}; }

std::vector<Seconds> timesOver(const AnimationCurve& curve) {
  std::vector<Seconds> times;
  for (Seconds time = curve.keys.front().time - 0.1; time < curve.keys.back().time + 0.1; time += 0.0037)
    times.push_back(time);
  return times;
}

TEST(CurveLaws, MonotoneSlopesStayBetweenNeighbouringKeys) {
  for (unsigned seed = 0; seed < 200; ++seed) {
    SCOPED_TRACE(seed);
    const AnimationCurve curve = randomCurve(seed);
    for (std::size_t i = 0; i + 1 < curve.keys.size(); ++i) {
      const CurveKey &a = curve.keys[i], &b = curve.keys[i + 1];
      const auto [low, high] = std::minmax(a.value, b.value);
      double before = a.value;
      for (double u = 0; u <= 1; u += 0.03125) {
        const double value = curve.valueAt(std::lerp(a.time, b.time, u));
        ASSERT_GE(value, low - 1e-12);
        ASSERT_LE(value, high + 1e-12);
        ASSERT_GE((value - before) * (b.value - a.value), -1e-12) << "all the way up, or all the way down";
        before = value;
      }
    }
  }
}

TEST(CurveLaws, SlopesAreContinuousAndThoseOfTheCurve) {
  constexpr Seconds kStep = 1e-7;
  for (unsigned seed = 0; seed < 100; ++seed) {
    const AnimationCurve curve = randomCurve(seed);
    for (const CurveKey& key : curve.keys) EXPECT_EQ(key.in, key.out) << "seed " << seed;
    for (const Seconds time : timesOver(curve)) {
      const auto [in, out] = curve.slopesAt(time);
      EXPECT_NEAR((curve.valueAt(time + kStep) - curve.valueAt(time - kStep)) / (2 * kStep), 0.5 * (in + out), 2e-3)
          << "seed " << seed << " at " << time;
    }
  }
}

TEST(CurveLaws, SlopesFollowTimeAndValueThatAreTurnedOrStretched) {
  for (unsigned seed = 0; seed < 100; ++seed) {
    SCOPED_TRACE(seed);
    const std::vector<CurveKey> plain = withMonotoneSlopes(randomKeys(seed));
    std::vector<CurveKey> stretched = plain, reversed(plain.rbegin(), plain.rend());
    for (CurveKey& key : stretched) key = {3 * key.time + 1, 2 - 5 * key.value, 0, 0};
    for (CurveKey& key : reversed) key = {-key.time, key.value, 0, 0};
    stretched = withMonotoneSlopes(stretched);
    reversed = withMonotoneSlopes(reversed);
    for (std::size_t i = 0; i < plain.size(); ++i) {
      EXPECT_NEAR(stretched[i].in, -5.0 / 3 * plain[i].in, 1e-9);
      EXPECT_NEAR(reversed[plain.size() - 1 - i].in, -plain[i].in, 1e-9);
    }
  }
}

TEST(CurveLaws, SamplesAreTheValues) {
  for (unsigned seed = 0; seed < 100; ++seed) {
    const AnimationCurve curve{"Ah", withMonotoneSlopes(randomKeys(seed, true))};
    const std::vector<Seconds> times = timesOver(curve);
    const std::vector<double> values = sampleCurve(curve, times);
    for (std::size_t i = 0; i < times.size(); ++i) ASSERT_EQ(values[i], curve.valueAt(times[i])) << "seed " << seed;
    EXPECT_EQ(values.front(), curve.keys.front().value) << "held before the first key";
    EXPECT_EQ(values.back(), curve.keys.back().value) << "and after the last";
  }
}

TEST(CurveLaws, TheLaterOfTwoKeysAtOneTimeTakesOver) {
  const AnimationCurve step{"Ah", {{0, 0, 0, 0}, {1, 0.2, 0, 0}, {1, 0.7, 0, 0}, {2, 1, 0, 0}}};
  EXPECT_EQ(step.valueAt(1), 0.7);
  EXPECT_NEAR(step.valueAt(1 - 1e-9), 0.2, 1e-6);
}

TEST(CurveLaws, JsonComesBackToTheBitForAnyCurves) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    CurveSet curves;
    for (unsigned k = 0; k < seed % 6; ++k) curves.push_back(randomCurve(10 * seed + k));
    const std::string json = curvesToJson(curves);
    EXPECT_EQ(parseCurves(json, "c.json"), curves);
    EXPECT_EQ(curvesToJson(parseCurves(json, "c.json")), json);
  }
}

TEST(CurveLaws, DamagedFilesAreRefusedOrAreCurves) {
  const std::string good = curvesToJson({randomCurve(5), randomCurve(9)});
  std::mt19937 random(3);
  for (int round = 0; round < 500; ++round) {
    std::string bad = good;
    bad[random() % bad.size()] = static_cast<char>(random() % 128);
    if (round % 2 == 0) bad.erase(random() % bad.size(), random() % 30);
    try {
      const CurveSet curves = parseCurves(bad, "bad.json");
      EXPECT_EQ(parseCurves(curvesToJson(curves), "again"), curves);
      for (const AnimationCurve& curve : curves) {
        for (std::size_t i = 1; i < curve.keys.size(); ++i) EXPECT_LT(curve.keys[i - 1].time, curve.keys[i].time);
      }
    } catch (const InputError& error) {
      EXPECT_EQ(std::string(error.what()).rfind("bad.json", 0), 0U) << error.what();
    }
  }
}

/// An edit of the curve within its keys.
CurveEdit randomEdit(unsigned seed, CurveEdit::Kind kind, const AnimationCurve& curve) {
  std::mt19937 random(1000 + seed);
  std::uniform_real_distribution<double> share(0, 1);
  const Seconds first = curve.keys.front().time, length = curve.keys.back().time - first;
  CurveEdit edit;
  edit.curve = curve.name;
  edit.kind = kind;
  edit.span.start = first + 0.6 * share(random) * length - 0.05;
  edit.span.end = edit.span.start + 0.05 + share(random) * length;
  edit.value = share(random) - 0.5;
  edit.fade = 0.2 * share(random);
  if (kind == CurveEdit::Kind::kReplace) {
    for (const double u : {0.2, 0.5, 0.9})
      edit.keys.push_back({std::lerp(edit.span.start, edit.span.end, u), share(random), 0, 0});
  }
  return edit;
}

/// Of a curve from 0 to 1: two keys that an edit would set closer than kLeastKeyGap become one.
constexpr double kMergedKeys = 5e-3;

constexpr std::array kKinds{CurveEdit::Kind::kOffset, CurveEdit::Kind::kReplace, CurveEdit::Kind::kMute};

/// Calls `check` with random curves and edits of each kind.
template <typename Check>
void forRandomEdits(Check check) {
  for (unsigned seed = 1; seed < 80; ++seed) {
    for (const CurveEdit::Kind kind : kKinds) {
      SCOPED_TRACE("seed " + std::to_string(seed) + ", kind " + std::to_string(static_cast<int>(kind)));
      const AnimationCurve curve = randomCurve(seed);
      if (curve.keys.size() < 3) continue;
      check(curve, randomEdit(seed, kind, curve));
    }
  }
}

TEST(EditLaws, CurvesStayAsTheyAreOutsideTheSpan) {
  forRandomEdits([](const AnimationCurve& curve, const CurveEdit& edit) {
    const AnimationCurve edited = withEdits({curve}, {edit})[0];
    for (std::size_t i = 1; i < edited.keys.size(); ++i) ASSERT_LT(edited.keys[i - 1].time, edited.keys[i].time);
    for (const Seconds time : timesOver(curve)) {
      if (edit.span.start < time && time < edit.span.end) continue;
      EXPECT_NEAR(edited.valueAt(time), curve.valueAt(time), 1e-9) << time;
    }
  });
}

TEST(EditLaws, InTheMiddleAnEditIsWholly) {
  forRandomEdits([](const AnimationCurve& curve, const CurveEdit& edit) {
    const AnimationCurve edited = withEdits({curve}, {edit})[0];
    const Seconds fade = std::min(edit.fade, 0.5 * edit.span.duration());
    for (const Seconds time : timesOver(curve)) {
      if (time < edit.span.start + fade + 1e-3 || time > edit.span.end - fade - 1e-3) continue;
      if (edit.kind == CurveEdit::Kind::kReplace) continue;
      const double wanted = edit.kind == CurveEdit::Kind::kMute ? 0 : curve.valueAt(time) + edit.value;
      EXPECT_NEAR(edited.valueAt(time), wanted, kMergedKeys) << time;
    }
    for (const CurveKey& key : edit.keys) EXPECT_NEAR(edited.valueAt(key.time), key.value, 1e-12);
  });
}

TEST(EditLaws, ToReplaceOrMuteTwiceIsToDoItOnce) {
  forRandomEdits([](const AnimationCurve& curve, const CurveEdit& edit) {
    if (edit.kind == CurveEdit::Kind::kOffset) return;
    const AnimationCurve once = withEdits({curve}, {edit})[0], twice = withEdits({once}, {edit})[0];
    const Seconds fade = edit.kind == CurveEdit::Kind::kMute ? edit.fade : 0;
    for (const Seconds time : timesOver(curve)) {
      const bool is_fading = time < edit.span.start + fade + 1e-3 || time > edit.span.end - fade - 1e-3;
      if (is_fading) continue;
      EXPECT_NEAR(twice.valueAt(time), once.valueAt(time), kMergedKeys) << time;
    }
  });
}

TEST(EditLaws, AnOffsetCanBeTakenBack) {
  forRandomEdits([](const AnimationCurve& curve, CurveEdit edit) {
    if (edit.kind != CurveEdit::Kind::kOffset) return;
    CurveEdit back = edit;
    back.value = -edit.value;
    const AnimationCurve again = withEdits({curve}, {edit, back})[0];
    for (const Seconds time : timesOver(curve))
      EXPECT_NEAR(again.valueAt(time), curve.valueAt(time), kMergedKeys) << time;
  });
}

/// The point of edits: curves may be made anew, and an edit still does what the animator wanted.
TEST(EditLaws, AnOffsetAddsTheSameToWhateverCurveIsThere) {
  for (unsigned seed = 3; seed < 60; ++seed) {
    AnimationCurve first = randomCurve(seed), second = randomCurve(seed + 100);
    first.name = second.name = "Ah";
    if (first.keys.size() < 3) continue;
    CurveEdit edit = randomEdit(seed, CurveEdit::Kind::kOffset, first);
    const AnimationCurve one = withEdits({first}, {edit})[0], other = withEdits({second}, {edit})[0];
    for (const Seconds time : timesOver(first)) {
      EXPECT_NEAR(one.valueAt(time) - first.valueAt(time), other.valueAt(time) - second.valueAt(time), kMergedKeys)
          << "seed " << seed << " at " << time;
    }
  }
}

TEST(EditLaws, EditsOfDifferentStretchesComeInAnyOrder) {
  for (unsigned seed = 3; seed < 60; ++seed) {
    const AnimationCurve curve = randomCurve(seed);
    if (curve.keys.size() < 3) continue;
    const Seconds start = curve.keys.front().time, middle = start + 0.5 * (curve.keys.back().time - start);
    CurveEdit early = randomEdit(seed, kKinds[seed % 3], curve),
              late = randomEdit(seed + 1, kKinds[(seed + 1) % 3], curve);
    early.keys = late.keys = {};
    if (early.kind == CurveEdit::Kind::kReplace) early.keys = {{middle - 0.05, 0.4, 0, 0}};
    if (late.kind == CurveEdit::Kind::kReplace) late.keys = {{middle + 0.05, 0.6, 0, 0}};
    early.span = {middle - 0.1, middle};
    late.span = {middle + 0.01, middle + 0.1};
    const AnimationCurve one = withEdits({curve}, {early, late})[0], other = withEdits({curve}, {late, early})[0];
    for (const Seconds time : timesOver(curve))
      EXPECT_NEAR(one.valueAt(time), other.valueAt(time), 1e-9) << "seed " << seed;
  }
}

TEST(EditLaws, MakeCurvesThatWereNotThereAndKeepThemSorted) {
  const CurveEdit offset{"Ee", CurveEdit::Kind::kOffset, {1, 2}, 0.4, 0.05, {}};
  const CurveEdit mute{"Zz", CurveEdit::Kind::kMute, {1, 2}, 0, 0.05, {}};
  const CurveSet edited = withEdits({{"Ah", {}}, {"Oo", {}}}, {offset, mute});
  ASSERT_EQ(edited.size(), 3U) << "nothing is made to be muted";
  EXPECT_EQ(edited[0].name, "Ah");
  EXPECT_EQ(edited[1].name, "Ee");
  EXPECT_EQ(edited[2].name, "Oo");
  EXPECT_NEAR(edited[1].valueAt(1.5), 0.4, 1e-4);
  EXPECT_EQ(findCurve(edited, "Zz"), nullptr);
}

}  // namespace
}  // namespace mouthpiece
