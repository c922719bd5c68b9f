// A lexicon against a plain list of what was written into it.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "base/errors.h"
#include "phonetics/text/lexicon.h"

namespace mouthpiece {
namespace {

/// What is said, phones and stresses; -1 of what has none.
struct Way {
  std::vector<Phone> phones;
  std::vector<int> stress;
};

class Lexicons : public testing::TestWithParam<unsigned> {
 protected:
  std::size_t upTo(std::size_t most) { return random_() % (most + 1); }

  Way way() {
    Way said;
    for (std::size_t i = 1 + upTo(5); i > 0; --i) {
      auto phone = static_cast<Phone>(1 + upTo(kPhoneCount - 2));
      if (phone == Phone::kSil) phone = Phone::kAA;
      said.phones.push_back(phone);
      said.stress.push_back(isVowel(phone) ? static_cast<int>(upTo(3)) - 1 : -1);
    }
    return said;
  }

  /// Lines in any order of words, with blanks, comments and numbered variants strewn in; `lines`: of each, its number.
  std::string written(const std::vector<std::pair<std::string, Way>>& entries, std::vector<std::size_t>& lines) {
    constexpr std::array<const char*, 3> kBetween{" ", "\t", "  "};
    std::string text;
    std::size_t line = 0;
    std::map<std::string, int> seen;
    for (const auto& [word, said] : entries) {
      if (upTo(3) == 0) {
        text += upTo(1) == 0 ? "# word AA\n" : " \n";
        ++line;
      }
      const int variant = ++seen[word];
      text += variant > 1 && upTo(1) == 0 ? word + "(" + std::to_string(variant) + ")" : word;
      for (std::size_t i = 0; i < said.phones.size(); ++i) {
        std::string name(phoneName(said.phones[i]));
        if (upTo(1) == 0)
          std::transform(name.begin(), name.end(), name.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
        text += kBetween[upTo(2)] + name;
        if (said.stress[i] >= 0) text += std::to_string(said.stress[i]);
      }
      text += upTo(3) == 0 ? " # said so\r\n" : "\n";
      lines.push_back(++line);
    }
    return text;
  }

  std::vector<std::pair<std::string, Way>> entries() {
    constexpr std::array<const char*, 8> kWords{"again", "birch",       "don't", "B",
                                                "BBC",   "caf\xC3\xA9", "x(y",   "\xD0\xB4\xD0\xB0"};
    std::vector<std::pair<std::string, Way>> all;
    for (std::size_t i = 1 + upTo(12); i > 0; --i) all.emplace_back(kWords[upTo(kWords.size() - 1)], way());
    return all;
  }

  static std::map<std::string, std::vector<Way>> byWord(const std::vector<std::pair<std::string, Way>>& entries) {
    std::map<std::string, std::vector<Way>> words;
    for (const auto& [word, said] : entries) words[word].push_back(said);
    return words;
  }

  static void expectSame(const Lexicon& lexicon, const std::map<std::string, std::vector<Way>>& words) {
    EXPECT_EQ(lexicon.size(), words.size());
    for (const auto& [word, ways] : words) {
      const std::vector<Pronunciation>& found = lexicon.find(word);
      ASSERT_EQ(found.size(), ways.size()) << word;
      for (std::size_t i = 0; i < ways.size(); ++i) {
        EXPECT_EQ(found[i].phones, ways[i].phones) << word;
        EXPECT_EQ(found[i].stress, ways[i].stress) << word;
      }
    }
  }

  std::mt19937 random_{GetParam()};
};

TEST_P(Lexicons, HoldEveryWayInTheOrderOfTheFile) {
  const auto all = entries();
  std::vector<std::size_t> lines;
  const std::string text = written(all, lines);
  expectSame(Lexicon::parse(text, "random"), byWord(all));
  expectSame(Lexicon::parseAnySet("# phones: ARPAbet\n" + text, "random"), byWord(all));
}

/// Ways are put first one after the other, unknown ones too: the others keep their order.
TEST_P(Lexicons, PuttingFirstMovesOneWayAndNothingElse) {
  const auto all = entries();
  std::vector<std::size_t> lines;
  Lexicon lexicon = Lexicon::parse(written(all, lines), "random");
  auto words = byWord(all);
  for (int step = 0; step < 20; ++step) {
    const std::string& word = all[upTo(all.size() - 1)].first;
    const std::size_t which = upTo(3);
    lexicon.putFirst(word, which);
    lexicon.putFirst("nobody", which);
    std::vector<Way>& ways = words.at(word);
    if (which < ways.size()) {
      const Way chosen = ways[which];
      ways.erase(ways.begin() + static_cast<std::ptrdiff_t>(which));
      ways.insert(ways.begin(), chosen);
    }
    expectSame(lexicon, words);
  }
}

/// A phone that is none is told with its line, wherever it stands; nothing else is thrown.
TEST_P(Lexicons, TheLineOfAWrongPhoneIsTold) {
  const auto all = entries();
  std::vector<std::size_t> lines;
  const std::string text = written(all, lines);
  const std::size_t wrong = upTo(all.size() - 1);
  std::size_t at = 0;
  for (std::size_t line = 1; line < lines[wrong]; ++line) at = text.find('\n', at) + 1;
  const std::size_t end = text.find_first_of("#\r\n", at);
  std::string damaged = text;
  damaged.insert(end, " QQ ");
  try {
    Lexicon::parse(damaged, "random");
    ADD_FAILURE() << damaged;
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("random:" + std::to_string(lines[wrong]) + ": found phone 'QQ'"),
              std::string::npos)
        << error.what();
  }
}

TEST_P(Lexicons, AnyBytesAreReadOrRefused) {
  std::vector<std::size_t> lines;
  std::string text = written(entries(), lines);
  for (int i = 0; i < 4; ++i) text[upTo(text.size() - 1)] = static_cast<char>(upTo(255));
  try {
    const Lexicon lexicon = Lexicon::parseAnySet(text, "damaged");
    for (const auto& [word, ways] : lexicon.words()) {
      for (const Pronunciation& said : ways) {
        EXPECT_FALSE(said.phones.empty());
        EXPECT_EQ(said.stress.size(), said.phones.size());
      }
    }
  } catch (const InputError&) {
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, Lexicons, testing::Range(1U, 61U));

}  // namespace
}  // namespace mouthpiece
