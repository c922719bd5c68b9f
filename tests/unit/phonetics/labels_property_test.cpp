// Laws that labels keep whatever they are made of, and what the readers do with files that were damaged.
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "base/errors.h"
#include "phonetics/labels/label_files.h"
#include "phonetics/labels/syllables.h"
#include "phonetics/labels/textgrid.h"
#include "random_labels.h"

namespace mouthpiece {
namespace {

constexpr unsigned kSeed = 20261122;
constexpr Seconds kRounding = 2e-7;           // half of HTK's unit, and doubles
constexpr Seconds kLent = 0.020 + kRounding;  // what an outer phone lends to silence

std::vector<PhoneSegment> segmentsOf(const SpeechLabels& labels) {
  std::vector<PhoneSegment> segments;
  for (const LabelledPhone& phone : labels.phones) {
    PhoneSegment segment{.phone = phone.phone, .span = phone.span, .word = phone.word, .syllable = phone.syllable};
    if (phone.syllable) segment.stress = labels.syllables[*phone.syllable].stress;
    segments.push_back(segment);
  }
  return segments;
}

std::vector<std::string> textsOf(const SpeechLabels& labels) {
  std::vector<std::string> texts;
  for (const LabelledWord& word : labels.words) texts.push_back(word.text);
  return texts;
}

std::vector<Phone> spokenPhones(const std::vector<PhoneSegment>& segments) {
  std::vector<Phone> phones;
  for (const PhoneSegment& segment : segments) {
    if (segment.phone != Phone::kSil) phones.push_back(segment.phone);
  }
  return phones;
}

void expectSame(const SpeechLabels& a, const SpeechLabels& b, Seconds tolerance) {
  ASSERT_EQ(a.phones.size(), b.phones.size());
  for (std::size_t i = 0; i < a.phones.size(); ++i) {
    EXPECT_EQ(a.phones[i].phone, b.phones[i].phone) << i;
    EXPECT_NEAR(a.phones[i].span.start, b.phones[i].span.start, tolerance) << i;
    EXPECT_NEAR(a.phones[i].span.end, b.phones[i].span.end, tolerance) << i;
    EXPECT_EQ(a.phones[i].word, b.phones[i].word) << i;
    EXPECT_EQ(a.phones[i].syllable, b.phones[i].syllable) << i;
  }
  EXPECT_EQ(textsOf(a), textsOf(b));
  ASSERT_EQ(a.syllables.size(), b.syllables.size());
  for (std::size_t s = 0; s < a.syllables.size(); ++s) EXPECT_EQ(a.syllables[s].stress, b.syllables[s].stress) << s;
}

/// Calls `check` with lines of many seeds.
void forManyLines(const std::function<void(const RandomLine&, std::mt19937&)>& check) {
  for (unsigned round = 0; round < 300; ++round) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed + round);
    std::mt19937 random(kSeed + round);
    check(randomLine(random), random);
    if (testing::Test::HasFatalFailure()) return;
  }
}

TEST(LabelLaws, NothingThatWasSaidIsLostOrMovedFurtherThanIsLent) {
  forManyLines([](const RandomLine& line, std::mt19937&) {
    const SpeechLabels labels = buildSpeechLabels(line.phones, line.words, line.duration);
    EXPECT_NO_THROW(expectConsistent(labels));
    EXPECT_NEAR(labels.duration(), std::max(line.duration, line.phones.back().span.end), kRounding);
    std::vector<LabelledPhone> spoken;
    std::copy_if(labels.phones.begin(), labels.phones.end(), std::back_inserter(spoken),
                 [](const LabelledPhone& phone) { return phone.phone != Phone::kSil; });
    ASSERT_EQ(spoken.size(), line.phones.size());
    for (std::size_t i = 0; i < spoken.size(); ++i) {
      EXPECT_EQ(spoken[i].phone, line.phones[i].phone);
      EXPECT_EQ(labels.words[spoken[i].word.value()].text, line.words[line.phones[i].word.value()]);
      const bool is_outer = i == 0 || i + 1 == spoken.size();
      EXPECT_NEAR(spoken[i].span.start, line.phones[i].span.start, is_outer ? kLent : kRounding);
      EXPECT_NEAR(spoken[i].span.end, line.phones[i].span.end, is_outer ? kLent : kRounding);
    }
  });
}

TEST(LabelLaws, WhatIsConsistentStaysAsItIs) {
  forManyLines([](const RandomLine& line, std::mt19937&) {
    const SpeechLabels once = buildSpeechLabels(line.phones, line.words, line.duration);
    const SpeechLabels again = buildSpeechLabels(segmentsOf(once), textsOf(once), once.duration());
    expectSame(once, again, kRounding);
  });
}

TEST(LabelLaws, EveryVowelIsTheOneOfItsSyllable) {
  forManyLines([](const RandomLine& line, std::mt19937&) {
    const SpeechLabels labels = buildSpeechLabels(line.phones, line.words, line.duration);
    for (const LabelledSyllable& syllable : labels.syllables) {
      int vowels = 0;
      for (std::size_t i = syllable.phones.first.value; i <= syllable.phones.last.value; ++i)
        vowels += isVowel(labels.phones[i].phone) ? 1 : 0;
      EXPECT_LE(vowels, 1);
    }
    for (const LabelledWord& word : labels.words) {
      int primary = 0;
      std::optional<std::size_t> last;
      for (std::size_t i = word.phones.first.value; i <= word.phones.last.value; ++i) {
        const auto& syllable = labels.phones[i].syllable;
        if (syllable && syllable != last) primary += labels.syllables[*syllable].stress == 1 ? 1 : 0;
        last = syllable;
      }
      EXPECT_GE(primary, 1) << word.text;
    }
  });
}

TEST(LabelLaws, AppendedLinesKeepTheirLengthsAndTheOrderOfJoiningDoesNotMatter) {
  forManyLines([](const RandomLine& line, std::mt19937& random) {
    const SpeechLabels a = buildSpeechLabels(line.phones, line.words, line.duration);
    const SpeechLabels b = randomLabels(random), c = randomLabels(random);
    SpeechLabels ab_c = a, bc = b, a_bc = a;
    appendSpeechLabels(ab_c, b);
    EXPECT_NEAR(ab_c.duration(), a.duration() + b.duration(), 1e-9);
    EXPECT_EQ(ab_c.phones.size(), a.phones.size() + b.phones.size() - 1);
    EXPECT_EQ(ab_c.words.size(), a.words.size() + b.words.size());
    appendSpeechLabels(ab_c, c);
    appendSpeechLabels(bc, c);
    appendSpeechLabels(a_bc, bc);
    EXPECT_NO_THROW(expectConsistent(ab_c));
    expectSame(ab_c, a_bc, 1e-9);
  });
}

TEST(LabelLaws, ALineIsSaidAlikeUntilOnePhoneMoves) {
  forManyLines([](const RandomLine& line, std::mt19937& random) {
    const SpeechLabels labels = buildSpeechLabels(line.phones, line.words, line.duration);
    SpeechLabels later = labels;
    later.phones.back().span.end += 1;
    EXPECT_TRUE(isSaidAlike(labels, later)) << "the last silence may differ";
    SpeechLabels other = labels;
    const auto at = std::uniform_int_distribution<std::size_t>(1, labels.phones.size() - 2)(random);
    if (other.phones[at].phone == Phone::kSil) return;
    other.phones[at].phone = other.phones[at].phone == Phone::kM ? Phone::kN : Phone::kM;
    EXPECT_FALSE(isSaidAlike(labels, other));
  });
}

TEST(LabelLaws, EveryFormatBringsBackWhatItHolds) {
  using enum LabelFormat;
  forManyLines([](const RandomLine& line, std::mt19937&) {
    const SpeechLabels labels = buildSpeechLabels(line.phones, line.words, line.duration);
    for (const LabelFormat format : {kTextGrid, kShortTextGrid, kEsps, kCtm, kSeconds}) {
      SCOPED_TRACE(static_cast<int>(format));
      const std::string text = formatLabels(labels, format);
      const bool is_grid = format == kTextGrid || format == kShortTextGrid;
      const SpeechLabels read = is_grid ? parseTextGrid(text, "written") : parseLabFile(text, "written");
      ASSERT_EQ(spokenPhones(segmentsOf(read)), spokenPhones(segmentsOf(labels)));
      if (is_grid) expectSame(read, labels, kRounding);
      EXPECT_EQ(formatLabels(read, format), text);
    }
  });
}

TEST(LabelLaws, ADamagedFileIsRefusedOrGivesGoodLabels) {
  using enum LabelFormat;
  std::size_t refused = 0, read = 0;
  forManyLines([&](const RandomLine& line, std::mt19937& random) {
    const SpeechLabels labels = buildSpeechLabels(line.phones, line.words, line.duration);
    for (const LabelFormat format : {kTextGrid, kShortTextGrid, kHtk, kEsps, kTimit, kCtm, kSeconds}) {
      const std::string bytes = damaged(formatLabels(labels, format), random);
      try {
        const bool is_grid = format == kTextGrid || format == kShortTextGrid;
        expectConsistent(is_grid ? parseTextGrid(bytes, "damaged") : parseLabFile(bytes, "damaged"));
        ++read;
      } catch (const InputError& error) {
        EXPECT_TRUE(std::string(error.what()).starts_with("damaged")) << error.what();
        ++refused;
      }
    }
  });
  EXPECT_GT(refused, 100U);
  EXPECT_GT(read, 100U);
}

TEST(SyllableLaws, EachOnsetIsTheLongestThatIsLegal) {
  std::mt19937 random(kSeed);
  for (int round = 0; round < 3000; ++round) {
    std::vector<Phone> word(std::uniform_int_distribution<std::size_t>(1, 9)(random));
    for (Phone& phone : word)
      phone = static_cast<Phone>(std::uniform_int_distribution<int>(1, static_cast<int>(kPhoneCount) - 1)(random));
    const auto syllables = syllabify(word);
    for (std::size_t s = 1; s < syllables.size(); ++s) {
      const std::size_t first = syllables[s].first;
      std::size_t vowel = first;
      while (!isVowel(word[vowel])) ++vowel;
      EXPECT_TRUE(isLegalOnset(std::span(word).subspan(first, vowel - first)));
      for (std::size_t earlier = first; earlier-- > 0 && !isVowel(word[earlier]);)
        EXPECT_FALSE(isLegalOnset(std::span(word).subspan(earlier, vowel - earlier))) << phoneName(word[earlier]);
    }
  }
}

TEST(SyllableLaws, EveryTailOfALegalOnsetIsLegal) {
  for (std::size_t a = 1; a < kPhoneCount; ++a) {
    for (std::size_t b = 1; b < kPhoneCount; ++b) {
      const std::array pair{static_cast<Phone>(a), static_cast<Phone>(b)};
      EXPECT_TRUE(!isLegalOnset(pair) || isLegalOnset(std::span(pair).subspan(1))) << phoneName(pair[0]);
      for (std::size_t c = 1; c < kPhoneCount; ++c) {
        const std::array triple{pair[0], pair[1], static_cast<Phone>(c)};
        EXPECT_TRUE(!isLegalOnset(triple) || isLegalOnset(std::span(triple).subspan(1))) << phoneName(pair[0]);
      }
    }
  }
}

}  // namespace
}  // namespace mouthpiece
