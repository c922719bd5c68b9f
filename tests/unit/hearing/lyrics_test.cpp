#include "hearing/alignment/lyrics.h"

#include <gtest/gtest.h>

#include "base/errors.h"
#include "base/files.h"
#include "hearing/alignment/pronouncer.h"

namespace mouthpiece {
namespace {

std::string wordsOf(std::string_view lyrics) {
  std::string words;
  for (const TranscriptWord& word : Pronouncer().wordsOf(sungText(lyrics))) words += word.text + " ";
  return words;
}

TEST(Lyrics, HeadingsAndTimesAreNotSung) {
  EXPECT_EQ(wordsOf("[Verse 1]\nTwinkle, twinkle,\r\nlittle star\n\n[Chorus]\nHow I wonder"),
            "Twinkle twinkle little star How I wonder ");
  EXPECT_EQ(wordsOf("[00:12.50] row row [00:14.00]row"), "row row row ");
}

TEST(Lyrics, RepeatedLinesAreSungAsOftenAsTheyStand) { EXPECT_EQ(wordsOf("row\nrow\nrow"), "row row row "); }

TEST(Lyrics, ABracketThatDoesNotCloseTakesNothing) {
  EXPECT_EQ(wordsOf("up [above\nthe world]"), "up above the world ");
  EXPECT_EQ(sungText("["), " ");
  EXPECT_EQ(sungText(""), "");
}

TEST(Lyrics, AFileWithoutWordsIsNamed) {
  const std::filesystem::path path = std::filesystem::path(testing::TempDir()) / "mouthpiece_lyrics.txt";
  for (const char* const text : {"", "[Chorus]\n", "...\n--\n"}) {
    writeFileAtomically(path, text);
    try {
      readLyrics(path);
      FAIL() << "'" << text << "'";
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find("mouthpiece_lyrics.txt: holds no words"), std::string::npos)
          << error.what();
    }
  }
  writeFileAtomically(path, "[Chorus]\nrow");
  EXPECT_EQ(readLyrics(path), " \nrow");
  std::filesystem::remove(path);
}

}  // namespace
}  // namespace mouthpiece
