#include "phonetics/text/lexicon.h"

#include <gtest/gtest.h>

#include <array>
#include <random>

#include "base/index.h"
#include "phonetics/labels/label_files.h"

namespace mouthpiece {
namespace {

PhonePairs pairsOf(std::initializer_list<const char*> lines) {
  PhonePairs pairs;
  for (const char* line : lines) {
    std::string text, phones = line;
    double time = 0;
    for (std::size_t at = 0; at < phones.size();) {
      const std::size_t end = std::min(phones.find(' ', at), phones.size());
      text += std::to_string(time) + " " + std::to_string(time + 0.1) + " " + phones.substr(at, end - at) + "\n";
      time += 0.1;
      at = end + 1;
    }
    pairs.add(parseLabFile(text, "pairs.lab"));
  }
  return pairs;
}

std::string firstWay(const Lexicon& lexicon, std::string_view word) {
  std::string text;
  for (const Phone phone : lexicon.find(word).at(0).phones) text += std::string(phoneName(phone));
  return text;
}

TEST(LexiconForLine, SaysAWordAsTheCorpusCan) {
  // "red at G": the corpus holds D AH and AH T only, as GRID's labels do.
  const Lexicon lexicon = Lexicon::parse("red R EH D\nat AE T\nat(2) AH T\nG JH IY\n", "l");
  const PhonePairs pairs = pairsOf({"sil R EH D AH T JH IY sil", "sil AE T sil"});
  const Lexicon spoken = lexiconForLine(lexicon, "red at G", pairs);
  EXPECT_EQ(firstWay(spoken, "at"), "AHT");
  EXPECT_EQ(firstWay(spoken, "red"), "REHD");
  // By itself the usual way is there, and stays.
  EXPECT_EQ(firstWay(lexiconForLine(lexicon, "at", pairs), "at"), "AET");
}

TEST(LexiconForLine, KeepsTheUsualWayWhereNothingSpeaksAgainstIt) {
  const Lexicon lexicon = Lexicon::parse("the DH AH\nthe(2) DH IY\n", "l");
  EXPECT_EQ(firstWay(lexiconForLine(lexicon, "the unknown, the", PhonePairs()), "the"), "DHAH");
  EXPECT_EQ(firstWay(lexiconForLine(lexicon, "", PhonePairs()), "the"), "DHAH");
}

TEST(LexiconForLine, SaysAWordThatComesTwiceAlike) {
  const Lexicon lexicon = Lexicon::parse("at AE T\nat(2) AH T\nred R EH D\n", "l");
  const PhonePairs pairs = pairsOf({"sil R EH D AH T R EH D sil"});
  const Lexicon spoken = lexiconForLine(lexicon, "red at red at red", pairs);
  EXPECT_EQ(firstWay(spoken, "AT"), "AHT");
}

TEST(Lexicon, APronunciationCanBeMadeTheUsualOne) {
  Lexicon lexicon = Lexicon::parse("four F AO\nfour(2) F AO R\n", "l");
  lexicon.putFirst("Four", 1);
  EXPECT_EQ(firstWay(lexicon, "four"), "FAOR");
  EXPECT_EQ(lexicon.find("four").size(), 2U);
  lexicon.putFirst("four", 9);
  lexicon.putFirst("five", 1);
  EXPECT_EQ(firstWay(lexicon, "four"), "FAOR");
}

/// Missing pairs of a line whose words are said by these ways, with silence at both ends.
int missingPairs(const std::vector<std::vector<Phone>>& said, const PhonePairs& pairs) {
  std::vector<Phone> phones{Phone::kSil};
  for (const auto& word : said) phones.insert(phones.end(), word.begin(), word.end());
  phones.push_back(Phone::kSil);
  int missing = 0;
  for (std::size_t i = 1; i < phones.size(); ++i) missing += pairs.has(phones[i - 1], phones[i]) ? 0 : 1;
  return missing;
}

TEST(LexiconForLine, FindsTheBestOfAllWaysThereAre) {
  const unsigned seed = 20261122;
  for (unsigned round = 0; round < 200; ++round) {
    SCOPED_TRACE(testing::Message() << "seed " << seed + round);
    std::mt19937 random(seed + round);
    const auto draw = [&](int high) { return std::uniform_int_distribution<int>(0, high)(random); };
    const std::array<const char*, 5> names = {"AA", "IY", "S", "T", "M"};
    std::string text, line, corpus = "sil";
    std::vector<std::size_t> way_counts;
    for (char word = 'a'; word < 'e'; ++word) {  // two letters: one alone would be a letter's name
      way_counts.push_back(1 + unsignedIndex(draw(2)));
      for (std::size_t way = 0; way < way_counts.back(); ++way) {
        text += std::string("x") + word;
        const int phones = 1 + draw(2);
        for (int phone = 0; phone < phones; ++phone) text += std::string(" ") + names[unsignedIndex(draw(4))];
        text += "\n";
      }
      line += std::string(line.empty() ? "x" : " x") + word;
    }
    for (int i = 0; i < 14; ++i) corpus += std::string(" ") + names[unsignedIndex(draw(4))];
    const Lexicon lexicon = Lexicon::parse(text, "random");
    const PhonePairs pairs = pairsOf({(corpus + " sil").c_str()});
    const auto waysOf = [&](const Lexicon& from, std::size_t w) { return from.find(std::string("x") + "abcd"[w]); };
    int best = 1000;
    for (std::size_t code = 0; code < 81; ++code) {
      std::vector<std::vector<Phone>> said;
      std::size_t rest = code;
      for (std::size_t w = 0; w < 4; ++w, rest /= 3) {
        if (rest % 3 < way_counts[w]) said.push_back(waysOf(lexicon, w)[rest % 3].phones);
      }
      if (said.size() == 4) best = std::min(best, missingPairs(said, pairs));
    }
    const Lexicon spoken = lexiconForLine(lexicon, line, pairs);
    std::vector<std::vector<Phone>> chosen;
    for (std::size_t w = 0; w < 4; ++w) chosen.push_back(waysOf(spoken, w).front().phones);
    EXPECT_EQ(missingPairs(chosen, pairs), best);
    EXPECT_EQ(spoken.size(), lexicon.size());
  }
}

}  // namespace
}  // namespace mouthpiece
