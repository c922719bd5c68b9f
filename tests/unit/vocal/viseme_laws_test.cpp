// What holds for the curves of any line, on random ones (VOCAL 4.2).
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "support/spoken_phones.h"
#include "vocal/viseme_curves.h"
#include "vocal/viseme_events.h"

namespace mouthpiece {
namespace {

using samples::spokenPhones;

constexpr std::array<StyleExtreme, 4> kExtremes{{{false, false}, {true, false}, {false, true}, {true, true}}};

const std::vector<Phone> kPhones{Phone::kAA, Phone::kIY, Phone::kUW, Phone::kOW, Phone::kAY, Phone::kOY, Phone::kER,
                                 Phone::kM,  Phone::kB,  Phone::kP,  Phone::kF,  Phone::kV,  Phone::kS,  Phone::kZ,
                                 Phone::kSH, Phone::kT,  Phone::kD,  Phone::kN,  Phone::kL,  Phone::kR,  Phone::kW,
                                 Phone::kY,  Phone::kHH, Phone::kK,  Phone::kNG, Phone::kSil};

struct RandomLine {
  SpeechLabels labels;
  AudioTags tags;
};

/// Phones of 10 ms to 0.6 s, notes and vibrato wherever they fall.
RandomLine randomLine(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> share(0, 1);
  std::vector<std::pair<Phone, Seconds>> phones;
  for (std::size_t count = 1 + seed % 15; count > 0; --count)
    phones.emplace_back(kPhones[random() % kPhones.size()], 0.01 + 0.59 * std::pow(share(random), 3));
  RandomLine line{spokenPhones(phones), {}};
  Seconds time = 0.3;
  while (time < line.labels.duration() && seed % 4 != 0) {
    const Seconds end = time + 0.05 + 0.4 * share(random);
    line.tags.notes.push_back({{time, end}, 100 + 400 * share(random), false});
    if (share(random) < 0.4) line.tags.vibrato.push_back({{time, end}, 6, 0.5});
    time = end + 0.05 * share(random);
  }
  for (Seconds at = 0; at < line.labels.duration(); at += 0.01) {
    const double a = share(random), i = (1 - a) * share(random);
    line.tags.vowels.push_back({at, a, 0, i, 0, 1 - a - i, 0});
    line.tags.f0.push_back({at, 150 + 100 * share(random), true});
  }
  return line;
}

template <typename Check>
void forRandomLines(Check check) {
  for (unsigned seed = 0; seed < 120; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    check(randomLine(seed));
  }
}

TEST(VisemeLaws, KeysRiseAndVisemesAreReachedFromNotAtAllToWholly) {
  forRandomLines([](const RandomLine& line) {
    for (const StyleExtreme extreme : kExtremes) {
      for (const AnimationCurve& curve : visemeCurves(line.labels, line.tags, extreme)) {
        for (std::size_t i = 0; i < curve.keys.size(); ++i) {
          const CurveKey& key = curve.keys[i];
          ASSERT_TRUE(i == 0 || curve.keys[i - 1].time < key.time) << curve.name << " at " << key.time;
          ASSERT_GE(key.value, 0) << curve.name << " at " << key.time;
          ASSERT_LE(key.value, 1) << curve.name << " at " << key.time;
        }
        for (Seconds time = 0; time < line.labels.duration(); time += 0.011) {
          ASSERT_GE(curve.valueAt(time), -1e-12) << curve.name << " at " << time;
          ASSERT_LE(curve.valueAt(time), 1 + 1e-12) << curve.name << " at " << time;
        }
      }
    }
  });
}

TEST(VisemeLaws, NothingMovesLongBeforeOrAfterSpeech) {
  forRandomLines([](const RandomLine& line) {
    const Seconds begin = line.labels.phones.front().span.end, end = line.labels.phones.back().span.start;
    for (const StyleExtreme extreme : kExtremes) {
      for (const AnimationCurve& curve : visemeCurves(line.labels, line.tags, extreme)) {
        if (curve.keys.empty()) continue;
        EXPECT_GE(curve.keys.front().time, begin - vocal_numbers::kLipHeavyOnset - 1e-9) << curve.name;
        EXPECT_LE(curve.keys.back().time, end + vocal_numbers::kLipHeavyOnset + 0.06 + 1e-9)
            << curve.name << ": what lets go of a plosive comes 60 ms later";
        EXPECT_EQ(curve.keys.front().value, 0) << curve.name;
        EXPECT_EQ(curve.keys.back().value, 0) << curve.name;
      }
    }
  });
}

TEST(VisemeLaws, CurvesMoveAsTheLineIsMoved) {
  constexpr Seconds kLater = 0.25;
  forRandomLines([](const RandomLine& line) {
    RandomLine moved = line;
    const auto move = [](TimeSpan& span) { span = {span.start + kLater, span.end + kLater}; };
    for (LabelledPhone& phone : moved.labels.phones) move(phone.span);
    for (Note& note : moved.tags.notes) move(note.span);
    for (VibratoSpan& vibrato : moved.tags.vibrato) move(vibrato.span);
    const CurveSet here = visemeCurves(line.labels, line.tags, {true, true});
    const CurveSet there = visemeCurves(moved.labels, moved.tags, {true, true});
    ASSERT_EQ(here.size(), there.size());
    for (std::size_t c = 0; c < here.size(); ++c) {
      EXPECT_EQ(here[c].name, there[c].name);
      ASSERT_EQ(here[c].keys.size(), there[c].keys.size()) << here[c].name;
      for (std::size_t i = 0; i < here[c].keys.size(); ++i) {
        EXPECT_NEAR(here[c].keys[i].time + kLater, there[c].keys[i].time, 1e-9);
        EXPECT_NEAR(here[c].keys[i].value, there[c].keys[i].value, 1e-9);
      }
    }
  });
}

TEST(VisemeLaws, LipsCloseInEveryLabialOfEveryStyle) {
  forRandomLines([](const RandomLine& line) {
    for (const StyleExtreme extreme : kExtremes) {
      const CurveSet curves = visemeCurves(line.labels, line.tags, extreme);
      for (const LabelledPhone& phone : line.labels.phones) {
        if (!isBilabial(phone.phone)) continue;
        const AnimationCurve* closed = findCurve(curves, visemeName(Viseme::kMBP));
        ASSERT_NE(closed, nullptr);
        EXPECT_NEAR(closed->valueAt(phone.span.start), 1, 1e-9) << phoneName(phone.phone) << " at " << phone.span.start;
      }
    }
  });
}

TEST(VisemeLaws, CurvesAreSortedAndNamedOnce) {
  forRandomLines([](const RandomLine& line) {
    const CurveSet curves = vocalCurves(line.labels, line.tags, {});
    for (std::size_t i = 1; i < curves.size(); ++i) EXPECT_LT(curves[i - 1].name, curves[i].name);
  });
}

/// What blendExtremes promises of styles that change.
TEST(VisemeLaws, BlendsAreTheBilinearBlendOfTheExtremes) {
  for (unsigned seed = 1; seed < 40; ++seed) {
    SCOPED_TRACE(seed);
    const RandomLine line = randomLine(seed);
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> share(0, 1);
    const auto signal = [&] {
      StyleSignal made;
      for (Seconds time = 0; time < line.labels.duration(); time += 0.4 + share(random))
        made.points.push_back({time, share(random)});
      return made;
    };
    const StyleSignal ma = signal(), ps = signal();
    std::array<CurveSet, 4> corners;
    for (std::size_t i = 0; i < 4; ++i) corners[i] = visemeCurves(line.labels, line.tags, kExtremes[i]);
    for (const AnimationCurve& curve : blendExtremes(line.labels, line.tags, ma, ps)) {
      for (Seconds time = 0; time < line.labels.duration(); time += 0.013) {
        double wanted = 0;
        for (std::size_t i = 0; i < 4; ++i) {
          const AnimationCurve* corner = findCurve(corners[i], curve.name);
          const double weight = (kExtremes[i].melodic ? ma.at(time) : 1 - ma.at(time)) *
                                (kExtremes[i].pitch_sensitive ? ps.at(time) : 1 - ps.at(time));
          if (corner != nullptr) wanted += weight * corner->valueAt(time);
        }
        ASSERT_NEAR(curve.valueAt(time), wanted, 2e-3) << curve.name << " at " << time;
      }
    }
  }
}

TEST(VisemeLaws, LarynxStaysBetweenRestAndItsHighest) {
  forRandomLines([](const RandomLine& line) {
    for (const AnimationCurve& curve : larynxCurves(line.labels, line.tags)) {
      EXPECT_EQ(curve.name, "larynx");
      for (const CurveKey& key : curve.keys) {
        EXPECT_GE(key.value, 0);
        EXPECT_LE(key.value, 1);
      }
    }
  });
}

TEST(VisemeLaws, ModificationsAreOfSungVowelsOnlyAndNoMoreThanWhole) {
  forRandomLines([](const RandomLine& line) {
    const CurveSet curves = vowelModificationCurves(line.labels, line.tags);
    EXPECT_LE(curves.size(), 2U);
    for (const AnimationCurve& curve : curves) {
      EXPECT_TRUE(curve.name == "lipSpread" || curve.name == "lipRound") << curve.name;
      for (const CurveKey& key : curve.keys) EXPECT_LE(std::abs(key.value), kLargestModification);
      for (Seconds time = 0; time < line.labels.duration(); time += 0.01) {
        if (curve.valueAt(time) == 0) continue;
        const bool near_vowel =
            std::any_of(line.labels.phones.begin(), line.labels.phones.end(), [&](const LabelledPhone& phone) {
              return isVowel(phone.phone) && time > phone.span.start - 0.121 && time < phone.span.end + 0.001;
            });
        EXPECT_TRUE(near_vowel) << curve.name << " at " << time;
      }
    }
  });
}

TEST(VisemeEventLaws, PassesKeepTheirPromises) {
  forRandomLines([](const RandomLine& line) {
    const std::vector<VisemeEvent> events = fourKeyEvents(line.labels);
    for (const VisemeEvent& event : withSungInternalKeys(events, line.tags)) {
      ASSERT_FALSE(event.inner.empty());
      for (std::size_t i = 1; i < event.inner.size(); ++i) EXPECT_LE(event.inner[i - 1].time, event.inner[i].time);
      EXPECT_LE(event.onset, event.inner.front().time);
      EXPECT_GE(event.end, event.inner.back().time);
    }
    const std::vector<VisemeEvent> joined = coarticulated(events, line.labels);
    EXPECT_LE(joined.size(), 2 * events.size());
    for (const VisemeEvent& event : joined) {
      EXPECT_NE(event.viseme, Viseme::kH) << "an aspirate has the next vowel's shape";
      EXPECT_GE(event.lips, 0);
      EXPECT_LE(event.lips, 1);
    }
    const std::vector<VisemeEvent> sung = withSungBoundaryKeys(joined);
    ASSERT_EQ(sung.size(), joined.size());
    for (std::size_t i = 0; i < sung.size(); ++i) {
      EXPECT_LE(sung[i].onset, joined[i].onset) << "vowels reach further, never less far";
      EXPECT_GE(sung[i].end, joined[i].end);
      EXPECT_TRUE(!isLabial(sung[i].viseme) || sung[i].lips == joined[i].lips) << "lips that must close do";
    }
  });
}

}  // namespace
}  // namespace mouthpiece
