#include "phonetics/labels/likely_words.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>
#include <vector>

#include "phonetics/labels/labels_builder.h"

namespace mouthpiece {
namespace {

struct SaidWord {
  std::vector<Phone> phones;
  std::vector<int> stress;  ///< of its vowels
};

const SaidWord kThe{{Phone::kDH, Phone::kAH}, {0}};
const SaidWord kBest{{Phone::kB, Phone::kEH, Phone::kS, Phone::kT}, {1}};
const SaidWord kAgain{{Phone::kAH, Phone::kG, Phone::kEH, Phone::kN}, {0, 1}};
const SaidWord kBus{{Phone::kB, Phone::kAH, Phone::kS}, {1}};
const SaidWord kTime{{Phone::kT, Phone::kAY, Phone::kM}, {1}};

SpeechLabels lineOf(const std::vector<SaidWord>& said, bool with_words) {
  std::vector<PhoneSegment> segments;
  std::vector<std::string> words;
  Seconds time = 0.2;
  for (const SaidWord& word : said) {
    std::size_t vowel = 0;
    for (const Phone phone : word.phones) {
      PhoneSegment segment{.phone = phone, .span = {time, time + 0.1}};
      time += 0.1;
      if (with_words) segment.word = words.size();
      if (with_words && isVowel(phone)) segment.stress = word.stress[vowel++];
      segments.push_back(segment);
    }
    if (with_words) words.emplace_back("said");
  }
  return buildSpeechLabels(std::move(segments), words, time + 0.2);
}

LikelyWords knowing(const std::vector<std::vector<SaidWord>>& lines) {
  LikelyWords likely;
  for (const std::vector<SaidWord>& line : lines) likely.add(lineOf(line, true));
  return likely;
}

/// "DH AH0 | B EH1 S T"
std::string written(const SpeechLabels& labels) {
  std::string text;
  for (std::size_t i = 0; i < labels.phones.size(); ++i) {
    const LabelledPhone& phone = labels.phones[i];
    if (phone.phone == Phone::kSil) continue;
    if (!text.empty()) text += phone.word != labels.phones[i - 1].word ? " | " : " ";
    text += phoneName(phone.phone);
    if (isVowel(phone.phone)) text += std::to_string(labels.syllables[*phone.syllable].stress);
  }
  return text;
}

TEST(LikelyWords, CutsAndStressesAsTheLinesThatItKnows) {
  const LikelyWords likely = knowing({{kThe, kBest, kTime}, {kThe, kBus, kAgain}, {kAgain, kThe, kBus}});
  const SpeechLabels found = likely.complete(lineOf({kThe, kBus, kAgain, kThe, kBest, kTime}, false));
  EXPECT_EQ(written(found), "DH AH0 | B AH1 S | AH0 G EH1 N | DH AH0 | B EH1 S T | T AY1 M");
  EXPECT_TRUE(
      std::all_of(found.words.begin(), found.words.end(), [](const LabelledWord& word) { return word.text.empty(); }));
}

TEST(LikelyWords, KnowingNothingStressesFullVowels) {
  EXPECT_EQ(written(LikelyWords().complete(lineOf({kThe, kAgain, kTime}, false))), "DH AH0 AH0 G EH1 N T AY1 M");
}

TEST(LikelyWords, LeavesWhatHasWordsAsItIs) {
  const SpeechLabels whole = lineOf({kThe, kBest, kTime}, true);
  SpeechLabels part = lineOf({kThe, kBest, kTime}, false);
  // The first word is known.
  part.words.push_back({"the", {PhoneIndex(1), PhoneIndex(2)}});
  part.phones[1].word = part.phones[2].word = 0;
  const LikelyWords likely = knowing({{kThe, kBest, kTime}, {kThe, kBest}, {kBest, kTime}});
  EXPECT_EQ(written(likely.complete(whole)), written(whole));
  const SpeechLabels found = likely.complete(part);
  EXPECT_EQ(written(found), written(whole));
  EXPECT_EQ(found.wordOf(PhoneIndex(1)), "the");
  EXPECT_EQ(found.wordOf(PhoneIndex(3)), "");
}

TEST(LikelyWords, MovesNothingAndLeavesAVowelInEachWord) {
  const LikelyWords likely = knowing({{kThe, kBest, kTime}, {kThe, kBus, kAgain}, {kAgain, kThe, kBus}});
  constexpr unsigned kSeed = 4100;
  for (unsigned round = 0; round < 200; ++round) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed + round);
    std::mt19937 random(kSeed + round);
    std::vector<PhoneSegment> segments;
    Seconds time = 0.1;
    for (int i = 0; i < 30; ++i) {
      const auto phone = static_cast<Phone>(random() % kPhoneCount);
      segments.push_back({.phone = phone, .span = {time, time + 0.05}});
      time += 0.05;
    }
    const SpeechLabels before = buildSpeechLabels(segments, std::vector<std::string>{}, time + 0.1);
    const SpeechLabels found = likely.complete(before);
    expectConsistent(found);
    ASSERT_EQ(found.phones.size(), before.phones.size());
    for (std::size_t i = 0; i < found.phones.size(); ++i) {
      EXPECT_EQ(found.phones[i].phone, before.phones[i].phone);
      EXPECT_EQ(found.phones[i].span, before.phones[i].span);
      EXPECT_EQ(found.phones[i].word.has_value(), found.phones[i].phone != Phone::kSil);
    }
    for (const LabelledWord& word : found.words) {
      // A run between silences may have no vowel at all.
      const bool is_run = found.phones[word.phones.first.value - 1].phone == Phone::kSil &&
                          found.phones[word.phones.last.value + 1].phone == Phone::kSil;
      bool has_vowel = false;
      for (std::size_t i = word.phones.first.value; i <= word.phones.last.value; ++i)
        has_vowel = has_vowel || isVowel(found.phones[i].phone);
      EXPECT_TRUE(has_vowel || is_run);
    }
  }
}

}  // namespace
}  // namespace mouthpiece
