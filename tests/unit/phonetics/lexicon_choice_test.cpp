#include "phonetics/text/lexicon_choice.h"

#include <gtest/gtest.h>

#include "phonetics/labels/lab_file.h"

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

}  // namespace
}  // namespace mouthpiece
