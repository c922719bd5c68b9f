#include "synthesis/line_edits.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "base/errors.h"
#include "support/tiny_corpus.h"
#include "synthesis/synthesis.h"

namespace mouthpiece {
namespace {

using samples::lipOpening;
using samples::tinyCorpus;
using samples::tinyLabels;
using Warnings = std::vector<std::string>;

bool tells(const Warnings& warnings, std::string_view part) {
  return std::any_of(warnings.begin(), warnings.end(),
                     [&](const std::string& warning) { return warning.find(part) != std::string::npos; });
}

SynthesisRequest editedRequest(const SpeechLabels& labels) {
  SynthesisRequest request;
  request.labels = labels;
  request.options.curves.fill_gaps = true;
  return request;
}

UtteranceAnimation madeWith(const char* edits, const SpeechLabels& labels, const Corpus& corpus) {
  SynthesisRequest request = editedRequest(labels);
  request.options.edits = parseLineEdits(edits, "edits.json");
  return synthesise(request, corpus);
}

TEST(LineEdits, ReadsEveryKind) {
  const LineEdits edits = parseLineEdits(
      R"([{"kind":"dial","dial":"lead","start_s":0,"end_s":1,"value":-50},
          {"kind":"dial","dial":"ma","start_s":0,"end_s":1,"keys":[{"time_s":0.2,"value":0.5}]},
          {"kind":"border","before":"T","after":"AY","at_s":0.3,"to_s":0.35},
          {"kind":"word","word":"now","to":"here"},
          {"kind":"unit","phones":["T","AY"],"start_s":0.3,"take":"take0","source_start_s":0.1},
          {"kind":"curves","phones":["T","AY"],"start_s":0.3},
          {"curve":"Ah","kind":"mute","start_s":0,"end_s":1},
          {"name":"Oo","keys":[{"time_s":0,"value":0,"in":0,"out":0}]}])",
      "edits.json");
  EXPECT_EQ(edits.dials.size(), 2U);
  EXPECT_EQ(edits.borders.size(), 1U);
  EXPECT_EQ(edits.words.size(), 1U);
  EXPECT_EQ(edits.units.size(), 2U);
  EXPECT_EQ(edits.curves.size(), 2U);
}

TEST(LineEdits, RefusesInOneLineWhatIsNone) {
  for (const char* bad :
       {"{}", "[1]", R"([{"kind":"twist"}])", R"([{"kind":"dial","dial":"loud","start_s":0,"end_s":1,"value":1}])",
        R"([{"kind":"dial","dial":"strength","start_s":0,"end_s":1,"value":5}])",
        R"([{"kind":"dial","dial":"strength","start_s":1,"end_s":1,"value":1}])",
        R"([{"kind":"dial","dial":"jaw","start_s":0,"end_s":1,"keys":[{"time_s":2,"value":1}]}])",
        R"([{"kind":"unit","phones":["T"],"start_s":0,"take":"a","source_start_s":0}])",
        R"([{"kind":"border","before":"T","after":"AY","at_s":"x","to_s":1}])"}) {
    EXPECT_THROW(parseLineEdits(bad, "edits.json"), InputError) << bad;
  }
}

TEST(LineEdits, RetypesWholeWords) {
  Warnings warnings;
  EXPECT_EQ(withWords("Now and now, nowhere", {{"now", 1, "then"}}, warnings), "Now and then, nowhere");
  EXPECT_TRUE(warnings.empty());
  EXPECT_EQ(withWords("nowhere", {{"now", 0, "then"}}, warnings), "nowhere");
  EXPECT_TRUE(tells(warnings, "\"now\""));
}

TEST(LineEdits, MovesBordersAndKeepsEveryPhone) {
  const SpeechLabels labels = tinyLabels("T-AY-M", 0);  // 100 ms each from 0.2 s on
  Warnings warnings;
  const SpeechLabels moved = withBorders(labels, {{"T", "AY", 0.31, 0.34}}, warnings);
  EXPECT_DOUBLE_EQ(moved.phones[1].span.end, 0.34);
  EXPECT_DOUBLE_EQ(moved.phones[2].span.start, 0.34);
  EXPECT_TRUE(warnings.empty());
  const SpeechLabels far = withBorders(labels, {{"T", "AY", 0.31, 0.9}}, warnings);
  EXPECT_DOUBLE_EQ(far.phones[2].span.start, 0.39);
  EXPECT_TRUE(tells(warnings, "10 ms"));
  warnings.clear();
  withBorders(labels, {{"B", "AY", 0.31, 0.34}, {"T", "AY", 3, 3.1}}, warnings);
  EXPECT_EQ(warnings.size(), 2U);
}

TEST(LineEdits, TakesAUnitFromWhereItIsTold) {
  const Corpus corpus = tinyCorpus();
  const SpeechLabels labels = tinyLabels("T-AY-M IH-Z", 42);
  const UtteranceAnimation plain = synthesise(editedRequest(labels), corpus);
  const UnitDatabase database(corpus);
  const SelectedUnit played{{PhoneIndex(1), PhoneIndex(2)}, {TakeIndex(0), PhoneIndex(9999)}, 0, 0, false, {}};
  const std::vector<SelectedUnit> others = otherUnits(labels, database, {&played, 1}, 3).at(0);
  ASSERT_FALSE(others.empty());
  const CorpusTake& take = database.takeOf(others[0].source);
  Warnings warnings;
  SynthesisPlan plan = planLine(labels, database, editedRequest(labels).options);
  const UnitEdit edit{
      {"T", "AY"}, labels.phones[1].span.start, take.name, take.labels.phones[others[0].source.phone.value].span.start};
  plan = withUnits(std::move(plan), labels, database, {edit}, warnings);
  EXPECT_TRUE(warnings.empty());
  const auto laid = std::find_if(plan.segments.begin(), plan.segments.end(), [](const Segment& segment) {
    return segment.phones == PhoneRange{PhoneIndex(1), PhoneIndex(2)};
  });
  ASSERT_NE(laid, plan.segments.end());
  EXPECT_EQ(laid->unit->source, others[0].source);
  withUnits(plan, labels, database, {{{"T", "AY"}, 0.3, "no such take", 0}, {{"B", "B"}, 0.3, take.name, 0}}, warnings);
  EXPECT_EQ(warnings.size(), 2U);
}

TEST(LineEdits, DrawsAStretchWithCurves) {
  const Corpus corpus = tinyCorpus();
  const SpeechLabels labels = tinyLabels("T-AY-M IH-Z", 42);
  const UtteranceAnimation made = madeWith(R"([{"kind":"curves","phones":["T","AY"],"start_s":0.2}])", labels, corpus);
  EXPECT_TRUE(std::any_of(made.units.begin(), made.units.end(), [](const PlacedUnit& unit) {
    return unit.scale == "curves" && unit.phones == PhoneRange{PhoneIndex(1), PhoneIndex(2)};
  }));
}

TEST(LineEdits, NamesWhatDoesNotApplyAndHoldsWhatAFaceCannotDo) {
  const Corpus corpus = tinyCorpus();
  const SpeechLabels labels = tinyLabels("T-AY-M IH-Z", 42);
  const UtteranceAnimation plain = synthesise(editedRequest(labels), corpus);
  const UtteranceAnimation beyond = madeWith(
      R"([{"curve":"Ah","kind":"offset","start_s":9,"end_s":10,"value":0.5},
          {"curve":"Foo","kind":"offset","start_s":0.1,"end_s":0.4,"value":0.5},
          {"kind":"dial","dial":"jaw","start_s":9,"end_s":10,"value":2}])",
      labels, corpus);
  EXPECT_TRUE(tells(beyond.warnings, "Ah from 9.00 s"));
  EXPECT_TRUE(tells(beyond.warnings, "Foo"));
  EXPECT_TRUE(tells(beyond.warnings, "jaw from 9.00 s"));
  EXPECT_EQ(beyond.motion.positions_mm, plain.motion.positions_mm);

  const UtteranceAnimation five =
      madeWith(R"([{"curve":"Ah","kind":"offset","start_s":0.2,"end_s":0.5,"value":5}])", labels, corpus);
  EXPECT_TRUE(tells(five.warnings, "held"));
  const UtteranceAnimation one =
      madeWith(R"([{"curve":"Ah","kind":"offset","start_s":0.2,"end_s":0.5,"value":1.25}])", labels, corpus);
  const auto widest = [](const UtteranceAnimation& made) {
    const std::vector<double> opening = lipOpening(made.motion);
    return *std::max_element(opening.begin(), opening.end());
  };
  EXPECT_LT(widest(five), 1.1 * widest(one));
}

TEST(LineEdits, CurvesHandedBackChangeNothing) {
  const Corpus corpus = tinyCorpus();
  const SpeechLabels labels = tinyLabels("T-AY-M IH-Z", 42);
  const UtteranceAnimation plain = synthesise(editedRequest(labels), corpus);
  const UtteranceAnimation again = madeWith(curvesToJson(plain.curves).c_str(), labels, corpus);
  EXPECT_EQ(again.motion.positions_mm, plain.motion.positions_mm);
  EXPECT_TRUE(again.warnings.empty());
}

}  // namespace
}  // namespace mouthpiece
