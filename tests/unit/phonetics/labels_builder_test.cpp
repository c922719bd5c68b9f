#include "phonetics/labels/labels_builder.h"

#include <gtest/gtest.h>

#include "base/errors.h"

namespace mouthpiece {
namespace {

std::string namesOf(const SpeechLabels& labels) {
  std::string names;
  for (const auto& phone : labels.phones) {
    if (!names.empty()) names += ' ';
    names += phoneName(phone.phone);
  }
  return names;
}

TEST(LabelsBuilder, FillsGapsAndMergesSilences) {
  const SpeechLabels labels = buildSpeechLabels({{.phone = Phone::kSil, .span = {0.1, 0.2}},
                                                 {.phone = Phone::kM, .span = {0.2, 0.3}},
                                                 {.phone = Phone::kAH, .span = {0.4, 0.5}},
                                                 {.phone = Phone::kSil, .span = {0.5, 0.6}}},
                                                std::vector<WordSegment>{}, 1.0);
  EXPECT_EQ(namesOf(labels), "sil M sil AH sil");
  EXPECT_EQ(labels.phones[0].span, (TimeSpan{0, 0.2}));
  EXPECT_EQ(labels.phones[2].span, (TimeSpan{0.3, 0.4}));
  EXPECT_EQ(labels.phones[4].span, (TimeSpan{0.5, 1.0}));
  EXPECT_EQ(labels.syllables.size(), 2U);
  EXPECT_FALSE(labels.phones[1].word);
}

TEST(LabelsBuilder, LendsSilenceToBareEnds) {
  const SpeechLabels labels =
      buildSpeechLabels({{.phone = Phone::kM, .span = {0, 0.2}}, {.phone = Phone::kAA, .span = {0.2, 0.24}}},
                        std::vector<WordSegment>{}, 0.24);
  EXPECT_EQ(namesOf(labels), "sil M AA sil");
  EXPECT_NEAR(labels.phones[0].span.end, 0.02, 1e-12);
  EXPECT_NEAR(labels.phones[3].span.start, 0.23, 1e-12);
  EXPECT_EQ(labels.duration(), 0.24);
}

TEST(LabelsBuilder, MakesSilenceOfNothing) {
  EXPECT_EQ(namesOf(buildSpeechLabels({}, std::vector<WordSegment>{}, 1.0)), "sil");
}

TEST(LabelsBuilder, GivesPhonesTheWordThatHoldsTheirMiddle) {
  const SpeechLabels labels = buildSpeechLabels(
      {{.phone = Phone::kN, .span = {0.2, 0.3}},
       {.phone = Phone::kAW, .span = {0.3, 0.5}},
       {.phone = Phone::kB, .span = {0.5, 0.6}},
       {.phone = Phone::kAY, .span = {0.6, 0.7}}},
      std::vector<WordSegment>{{"now", {0.19, 0.52}}, {"by", {0.52, 0.7}}, {"lost", {0.7, 0.8}}}, 1.0);
  ASSERT_EQ(labels.words.size(), 2U);
  EXPECT_EQ(labels.wordOf(PhoneIndex(2)), "now");
  EXPECT_EQ(labels.wordOf(PhoneIndex(3)), "by");
  EXPECT_EQ(labels.wordOf(PhoneIndex(0)), "");
  EXPECT_EQ(labels.words[1].phones, (PhoneRange{PhoneIndex(3), PhoneIndex(4)}));
}

TEST(LabelsBuilder, KeepsAWordWithAHesitationWhole) {
  const SpeechLabels labels = buildSpeechLabels({{.phone = Phone::kAH, .span = {0.2, 0.3}},
                                                 {.phone = Phone::kSil, .span = {0.3, 0.4}},
                                                 {.phone = Phone::kG, .span = {0.4, 0.5}},
                                                 {.phone = Phone::kEH, .span = {0.5, 0.6}}},
                                                std::vector<WordSegment>{{"again", {0.2, 0.6}}}, 1.0);
  ASSERT_EQ(labels.words.size(), 1U);
  EXPECT_EQ(labels.words[0].phones, (PhoneRange{PhoneIndex(1), PhoneIndex(4)}));
  EXPECT_FALSE(labels.phones[2].word);
  EXPECT_EQ(labels.syllables.size(), 2U);
}

TEST(LabelsBuilder, TakesStressFromItsVowel) {
  const SpeechLabels labels = buildSpeechLabels({{.phone = Phone::kAH, .span = {0.2, 0.3}, .stress = 0},
                                                 {.phone = Phone::kG, .span = {0.3, 0.4}},
                                                 {.phone = Phone::kEH, .span = {0.4, 0.5}, .stress = 2}},
                                                std::vector<WordSegment>{{"again", {0.2, 0.6}}}, 1.0);
  ASSERT_EQ(labels.syllables.size(), 2U);
  EXPECT_EQ(labels.syllables[0].stress, 0);
  EXPECT_EQ(labels.syllables[1].stress, 2);
}

TEST(LabelsBuilder, AppendsLinesThatMeetInOneSilence) {
  const auto line = [](Phone phone, const char* word) {
    return buildSpeechLabels({{.phone = phone, .span = {0.1, 0.3}}}, std::vector<WordSegment>{{word, {0.1, 0.3}}}, 0.5);
  };
  SpeechLabels labels = line(Phone::kAY, "I");
  appendSpeechLabels(labels, line(Phone::kOW, "owe"));
  appendSpeechLabels(labels, line(Phone::kAO, "awe"));
  EXPECT_NO_THROW(expectConsistent(labels));
  EXPECT_EQ(namesOf(labels), "sil AY sil OW sil AO sil");
  EXPECT_DOUBLE_EQ(labels.duration(), 1.5);
  EXPECT_NEAR(labels.phones[3].span.start, 0.6, 1e-12);
  EXPECT_EQ(labels.wordOf(PhoneIndex(5)), "awe");
  EXPECT_EQ(labels.syllables[2].phones.first.value, 5U);
}

TEST(SpeechLabels, ConsistencyIsChecked) {
  const SpeechLabels good =
      buildSpeechLabels({{.phone = Phone::kAY, .span = {0.1, 0.3}}}, std::vector<WordSegment>{{"I", {0.1, 0.3}}}, 0.5);
  EXPECT_NO_THROW(expectConsistent(good));
  EXPECT_THROW(expectConsistent({}), InternalError);
  const auto broken = [&](auto change) {
    SpeechLabels labels = good;
    change(labels);
    return labels;
  };
  EXPECT_THROW(expectConsistent(broken([](SpeechLabels& l) { l.phones.pop_back(); })), InternalError);
  EXPECT_THROW(expectConsistent(broken([](SpeechLabels& l) { l.phones[1].span.end = 0.05; })), InternalError);
  EXPECT_THROW(expectConsistent(broken([](SpeechLabels& l) { l.phones[1].span.start = 0.15; })), InternalError);
  EXPECT_THROW(expectConsistent(broken([](SpeechLabels& l) { l.phones[1].word = 7; })), InternalError);
  EXPECT_THROW(expectConsistent(broken([](SpeechLabels& l) { l.words[0].phones.last = PhoneIndex(9); })),
               InternalError);
  EXPECT_THROW(expectConsistent(broken([](SpeechLabels& l) { l.phones[1].phone = Phone::kSil; })), InternalError);
}

}  // namespace
}  // namespace mouthpiece
