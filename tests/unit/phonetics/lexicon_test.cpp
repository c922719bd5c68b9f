#include "phonetics/text/lexicon.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "base/errors.h"

namespace mouthpiece {
namespace {

std::string said(const Lexicon& lexicon, std::string_view word, std::size_t which = 0) {
  const auto& all = lexicon.find(word);
  if (which >= all.size()) return "-";
  std::string out;
  for (const Phone phone : all[which].phones) {
    if (!out.empty()) out += ' ';
    out += phoneName(phone);
  }
  return out;
}

TEST(Lexicon, ReadsWordsVariantsAndComments) {
  const Lexicon lexicon = Lexicon::parse(
      "# heading\n;;; CMU heading\nagain\tAH0 G EH1 N  # note\nagain(2) AH G EY N\r\nA EY\na AH\n'bout B AW T\n", "l");
  EXPECT_EQ(said(lexicon, "again"), "AH G EH N");
  EXPECT_EQ(said(lexicon, "Again", 1), "AH G EY N");
  EXPECT_EQ(said(lexicon, "again", 2), "-");
  EXPECT_EQ(lexicon.find("again")[0].stress, (std::vector<int>{0, -1, 1, -1}));
  EXPECT_EQ(said(lexicon, "'bout"), "B AW T");
  EXPECT_EQ(said(Lexicon::parse("Nguyen: W IH N\n", "l"), "Nguyen"), "W IH N");
}

TEST(Lexicon, KnowsLettersFromWords) {
  const Lexicon lexicon = Lexicon::parse("A EY\na AH\nG JH IY\nBBC B IY B IY S IY\ni AY\n", "l");
  EXPECT_EQ(said(lexicon, "A"), "EY");
  EXPECT_EQ(said(lexicon, "a"), "AH");
  EXPECT_EQ(said(lexicon, "G"), "JH IY");
  EXPECT_EQ(said(lexicon, "g"), "-");
  EXPECT_EQ(said(lexicon, "I"), "AY");
  EXPECT_EQ(said(lexicon, "bbc"), "B IY B IY S IY");
}

TEST(Lexicon, AWordsCapitalIsAnyAlphabets) {
  const Lexicon lexicon = Lexicon::parse("\u00FCber M AA\n", "a.lex", PhoneSet::kArpabet, english());
  EXPECT_EQ(lexicon.find("\u00DCber").size(), 1U);
}

TEST(Lexicon, NamesTheLineOfWhatIsWrong) {
  const auto errorOf = [](std::string_view text) -> std::string {
    try {
      Lexicon::parse(text, "l.txt");
    } catch (const InputError& error) {
      return error.what();
    }
    return "no error";
  };
  EXPECT_EQ(errorOf(""), "l.txt: holds no words; expected lines of a word and its phones");
  EXPECT_EQ(errorOf("a AH\nbee\n"), "l.txt:2: found 'bee' alone; expected a word and its phones");
  EXPECT_EQ(errorOf("a AH\nbee B QQ\n"), "l.txt:2: found phone 'QQ' in 'bee'; expected ARPAbet (AA AE AH ... ZH)");
}

TEST(Lexicon, ReadsTheRealOne) {
  const std::filesystem::path path =
      std::filesystem::path(MOUTHPIECE_SOURCE_DIR) / "../shared/capture/grid_s1/lexicon.txt";
  if (!std::filesystem::exists(path))
    GTEST_SKIP() << "needs the capture in ../shared/capture/grid_s1, which is not here";
  const Lexicon lexicon = Lexicon::read(path);
  EXPECT_EQ(lexicon.size(), 51U);  // its README: 51 different words
  EXPECT_EQ(said(lexicon, "G"), "JH IY");
  EXPECT_EQ(said(lexicon, "Z"), "Z EH D");
  EXPECT_EQ(said(lexicon, "four", 1), "F AO R");
}

}  // namespace
}  // namespace mouthpiece
