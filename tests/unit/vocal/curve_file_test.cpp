#include "vocal/animation_curve.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/errors.h"
#include "base/json_fields.h"
#include "base/text_numbers.h"

namespace mouthpiece {
namespace {

CurveSet someCurves() {
  CurveSet curves{{"Ah", {{0.1 + 0.2, 1.0 / 3, -2.0 / 7, 1e-17}, {0.5, 0.8, 0, 0}}}, {"larynx", {}}};
  return curves;
}

AnimationCurve hill() {
  AnimationCurve curve{"Ah", {{0.0, 0}, {0.2, 0.8}, {0.6, 0.8}, {0.9, 0}}};
  curve.keys = withMonotoneSlopes(curve.keys);
  return curve;
}

CurveEdits curveEdits(std::string_view json, std::string_view file) {
  CurveEdits edits;
  for (const JsonField& entry : parseJson(json, file, "edits").list()) edits.push_back(curveEditFrom(entry));
  return edits;
}

void expectRefused(std::string_view json, std::string_view what) {
  try {
    parseCurves(json, "c.json");
    FAIL() << "took " << json;
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find(what), std::string::npos) << error.what();
  }
}

TEST(CurveFile, ComesBackToTheBit) {
  const CurveSet curves = someCurves();
  EXPECT_EQ(parseCurves(curvesToJson(curves), "c.json"), curves);
  EXPECT_EQ(curvesToJson(parseCurves(curvesToJson(curves), "c.json")), curvesToJson(curves));
}

TEST(CurveFile, RefusesWhatIsNoneInOneLine) {
  expectRefused("{}", "expected a list");
  expectRefused("[1]", "expected an object");
  expectRefused(R"([{"name":"Ah","keys":[{"time_s":0,"value":0,"in":0}]}])", "out");
  expectRefused(R"([{"name":"Ah","keys":[{"time_s":0,"value":1e99,"in":0,"out":0}]}])", "value");
  expectRefused(R"([{"name":"Ah","keys":[]},{"name":"Ah","keys":[]}])", "second time");
  expectRefused(
      R"([{"name":"Ah","keys":[{"time_s":1,"value":0,"in":0,"out":0},{"time_s":1,"value":0,"in":0,"out":0}]}])",
      "rising");
}

TEST(CurveFile, CsvHasARowAFrame) {
  const std::string text = curveFramesToCsv({hill()}, 10, 3);
  EXPECT_EQ(text, "time_s,Ah\n0.000000,0.00000\n0.100000,0.40000\n0.200000,0.80000\n");
}

TEST(CurveFile, TheKeysAsCsvAreTheSameToTheBit) {
  AnimationCurve curve = hill();
  curve.keys[1].value = 0.1 + 0.2;
  const std::string text = curveKeysToCsv({curve});
  LineReader lines(text);
  std::vector<std::string_view> fields;
  std::vector<CurveKey> keys;
  for (std::string_view line; lines.next(line);) {
    splitFields(line, ',', fields);
    ASSERT_EQ(fields.size(), 5U) << line;
    if (lines.lineNumber() == 1) continue;
    EXPECT_EQ(fields[0], "Ah");
    keys.push_back({parseNumber(fields[1]).value(), parseNumber(fields[2]).value(), parseNumber(fields[3]).value(),
                    parseNumber(fields[4]).value()});
  }
  EXPECT_EQ(keys, curve.keys);
}

TEST(CurveEdits, OffsetReplaceAndMuteStayInTheirSpans) {
  const CurveEdits edits = curveEdits(
      R"([{"curve":"Ah","kind":"offset","start_s":0.25,"end_s":0.45,"value":0.2},
          {"curve":"Ah","kind":"mute","start_s":0.5,"end_s":0.8,"fade_s":0.05},
          {"curve":"Ee","kind":"replace","start_s":1,"end_s":2,"keys":[{"time_s":1.2,"value":0.5},{"time_s":1.8,"value":0.5}]}])",
      "e.json");
  const CurveSet edited = withEdits({hill()}, edits);
  const AnimationCurve& ah = *findCurve(edited, "Ah");
  const AnimationCurve plain = hill();
  for (const Seconds time : {0.05, 0.1, 0.2, 0.249, 0.46, 0.49, 0.81, 0.85, 0.95})
    EXPECT_NEAR(ah.valueAt(time), plain.valueAt(time), 1e-12) << time;
  EXPECT_NEAR(ah.valueAt(0.35), 1.0, 1e-5);
  EXPECT_NEAR(ah.valueAt(0.65), 0.0, 1e-5);
  const AnimationCurve& ee = *findCurve(edited, "Ee");
  EXPECT_NEAR(ee.valueAt(1.5), 0.5, 1e-12);
  EXPECT_EQ(ee.valueAt(0.9), 0);
  EXPECT_EQ(ee.valueAt(2.1), 0);
}

TEST(CurveEdits, MakeTheSameOfTheSameCurvesEveryTime) {
  const CurveEdits edits =
      curveEdits(R"([{"curve":"Ah","kind":"offset","start_s":0.1,"end_s":0.7,"value":-0.3}])", "e.json");
  EXPECT_EQ(withEdits({hill()}, edits), withEdits({hill()}, edits));
  EXPECT_EQ(withEdits({hill()}, {}), CurveSet{hill()});
}

TEST(CurveEdits, HaveNoKinkWhereTheyBegin) {
  const CurveEdits edits =
      curveEdits(R"([{"curve":"Ah","kind":"offset","start_s":0.1,"end_s":0.7,"value":0.3}])", "e.json");
  const AnimationCurve curve = withEdits({hill()}, edits)[0];
  constexpr Seconds kStep = 1e-5;
  for (const Seconds at : {0.1, 0.7}) {
    const double before = (curve.valueAt(at) - curve.valueAt(at - kStep)) / kStep;
    const double after = (curve.valueAt(at + kStep) - curve.valueAt(at)) / kStep;
    EXPECT_NEAR(before, after, 0.05) << "of slopes of up to 6 a second";
  }
}

TEST(CurveEdits, RefusedInOneLine) {
  for (const char* bad :
       {"{}", "[1]", R"([{"curve":"Ah","kind":"twist","start_s":0,"end_s":1}])",
        R"([{"curve":"Ah","kind":"mute","start_s":1,"end_s":1}])", R"([{"kind":"mute","start_s":0,"end_s":1}])",
        R"([{"curve":7,"kind":[],"start_s":0,"end_s":1}])", R"([{"curve":"Ah","kind":"offset","start_s":0,"end_s":1}])",
        R"([{"curve":"Ah","kind":"replace","start_s":0,"end_s":1,"keys":[{"time_s":2,"value":1}]}])"}) {
    EXPECT_THROW(curveEdits(bad, "e.json"), InputError) << bad;
  }
}

}  // namespace
}  // namespace mouthpiece
