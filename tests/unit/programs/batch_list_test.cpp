// Lists of lines: what spreadsheets and people write, and what they get wrong.
#include "programs/synth/batch_input.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "mouthpiece/errors.h"
#include "phonetics/text/speakable_text.h"
#include "support/run_program.h"

namespace mouthpiece {
namespace {

class ReadingBatchList : public testing::Test {
 protected:
  BatchList read(const std::string& text, const std::vector<std::string>& languages = {}) {
    return readBatchList(scratch_.write("lines.csv", text), languages);
  }
  std::string refusal(const std::string& text) {
    try {
      read(text);
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  }
  /// "row: what" of each fault.
  std::string faults(const std::string& text) {
    std::string all;
    for (const RowFault& fault : read(text).faults) all += std::to_string(fault.row) + ": " + fault.what + "\n";
    return all;
  }
  test::ScratchFolder scratch_;
};

TEST_F(ReadingBatchList, ReadsTypedLines) {
  const auto lines = read("id,text\r\na,hello\nb,\"one, two \"\"three\"\"\nfour\"\n").lines;
  ASSERT_EQ(lines.size(), 2U);
  EXPECT_EQ(lines[0].id, "a");
  EXPECT_EQ(lines[0].line.text, "hello");
  EXPECT_EQ(lines[1].line.text, "one, two \"three\"\nfour");
  EXPECT_EQ(lines[1].row, 3U);
}

TEST_F(ReadingBatchList, ReadsRecordings) {
  for (const char* file : {"a.wav", "a.lab"}) static_cast<void>(scratch_.write(file, ""));
  const auto spoken = read("id,audio,transcript\na,a.wav,hello\n").lines;
  EXPECT_EQ(spoken.at(0).line.audio.filename(), "a.wav");
  EXPECT_TRUE(spoken.at(0).line.audio.is_absolute()) << "beside the list, wherever the program runs";
  EXPECT_EQ(spoken.at(0).line.text, "hello");
  EXPECT_EQ(read("id,audio,phones\na,a.wav,a.lab\n").lines.at(0).line.phones.filename(), "a.lab");
  EXPECT_NE(faults("id,audio\na,nowhere.wav\n").find("2: names"), std::string::npos);
  EXPECT_NE(faults("id,audio\na," + std::string(300, 'x') + "\n").find("2: names"), std::string::npos)
      << "no file can have that name";
}

TEST_F(ReadingBatchList, ReadsSongsAndTheirSounds) {
  for (const char* file : {"a.wav", "a.json"}) static_cast<void>(scratch_.write(file, ""));
  const auto songs = read(
                         "id,text,song,audio,song_offset\na,,a.json,,\nb,,a.json,a.wav,\nc,,a.json,a.wav,-1.5\n"
                         "d,hello,,,\n")
                         .lines;
  ASSERT_EQ(songs.size(), 4U);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(songs[i].line.song.filename(), "a.json");
    EXPECT_TRUE(songs[i].line.is_sung);
    EXPECT_EQ(songs[i].line.audio.empty(), i == 0);
  }
  EXPECT_FALSE(songs[1].line.song_offset);
  EXPECT_EQ(songs[2].line.song_offset, -1.5);
  EXPECT_EQ(songs[3].line.text, "hello");
  EXPECT_EQ(read("song\na.json\n").lines.size(), 1U) << "a list of songs alone";
  const std::string all = faults(
      "id,song,text,audio,song offset\nb,no.json,,,\nc,a.json,,,1\nd,a.json,,a.wav,x\ne,,,a.wav,2\nf,a.json,hello,,\n");
  for (const char* told : {"6: found words beside a song", "2: names '", "3: found the song offset '1'",
                           "4: found the song offset 'x'", "5: tells where a song begins; expected a song, too"})
    EXPECT_NE(all.find(told), std::string::npos) << told << "\n" << all;
}

TEST_F(ReadingBatchList, FindsColumnsByTheirNames) {
  const BatchList list = read("Emotion,Character,Text,Line ID,level\nangry,Bob,hello,b1,3\n");
  ASSERT_EQ(list.lines.size(), 1U);
  EXPECT_EQ(list.lines[0].id, "b1");
  EXPECT_EQ(list.lines[0].speaker, "Bob");
  EXPECT_EQ(list.lines[0].line.text, "hello");
  EXPECT_EQ(list.other_columns, (std::vector<std::string>{"Emotion", "level"}));
  EXPECT_EQ(list.lines[0].others, (std::vector<std::string>{"angry", "3"}));
  const BatchList with_voice = read("id,text,Voice\na,hello,flite:rms\n");
  EXPECT_EQ(with_voice.other_columns, std::vector<std::string>{"Voice"});
  EXPECT_EQ(with_voice.notices,
            std::vector<std::string>{"keeps its column 'Voice' and does not obey it: --cast tells who speaks how"});
  EXPECT_EQ(read("text\nhello\n").lines.at(0).id, "00002") << "without ids the rows' numbers";
  EXPECT_EQ(read("id,line,text\na,17,hello\n").lines.at(0).line.text, "hello") << "the usual name goes before";
}

TEST_F(ReadingBatchList, FindsSeparatorAndEncoding) {
  const std::string utf16 = [] {
    std::string bytes = "\xFF\xFE";
    for (const char c : std::string("id;text\na;hello, you\n")) bytes += {c, '\0'};
    return bytes;
  }();
  for (const std::string& text :
       {std::string("id;text\na;hello, you\n"), std::string("\xEF\xBB\xBFid;text\r\na;hello, you\r\n"),
        std::string("id\ttext\na\thello, you\n"), std::string("sep=;\nid;text\na;hello, you\n"),
        std::string("id|text\na|hello, you\n"), std::string("id;text\ra;hello, you\r"), utf16}) {
    const BatchList list = read(text);
    ASSERT_EQ(list.lines.size(), 1U) << text;
    EXPECT_EQ(list.lines[0].id, "a");
    EXPECT_EQ(list.lines[0].line.text, "hello, you");
    EXPECT_TRUE(list.faults.empty() && list.notices.empty());
  }
  const BatchList windows = read("id,text\na,\"\x93 caf\xE9 \x80\"\n");
  EXPECT_EQ(windows.lines.at(0).line.text, "\xE2\x80\x9C caf\xC3\xA9 \xE2\x82\xAC");
  EXPECT_NE(windows.notices.at(0).find("Windows-1252"), std::string::npos);
}

TEST_F(ReadingBatchList, ReadsAColumnALanguage) {
  const std::string table = "id,note,de,pt-BR,text_fr\na,x,hallo,ola,salut\nb,y,,oi,\n";
  const BatchList list = read(table);
  std::vector<std::string> keys;
  for (const BatchLine& line : list.lines) keys.push_back(line.key + "=" + line.line.text);
  EXPECT_EQ(keys, (std::vector<std::string>{"de/a=hallo", "pt-BR/a=ola", "fr/a=salut", "pt-BR/b=oi"}));
  EXPECT_EQ(list.other_columns, std::vector<std::string>{"note"});
  EXPECT_EQ(list.notices.size(), 1U) << "empty cells are told";
  EXPECT_EQ(read(table, {"fr"}).lines.size(), 1U);
  EXPECT_THROW(read(table, {"pl"}), InputError);
  EXPECT_TRUE(read("id,text,de\na,hello,hallo\n").lines.at(0).language.empty())
      << "a column of notes, where there is a text";
}

TEST_F(ReadingBatchList, NamesEveryBadRowInOneGo) {
  const std::string all = faults(
      "id,text\na,hello\na,again\n../b,out of the folder\nc\nd,one, two\ne,\"quoted\" twice\nf,fine\n,no id\ng,\n");
  for (const char* row : {"3: ", "4: ", "5: ", "6: ", "7: ", "9: ", "10: "})
    EXPECT_NE(all.find(row), std::string::npos) << row << all;
  EXPECT_EQ(std::count(all.begin(), all.end(), '\n'), 7) << all;
  EXPECT_NE(all.find("quotes"), std::string::npos) << "what to do about a comma";
}

TEST_F(ReadingBatchList, NamesIdsThatAFileSystemWouldNotTake) {
  const std::string all =
      faults("id,text\nLine,one\nline,two\nCON,three\nlpt1.take,four\n-x,five\nend.,six\ncon2,fine\n");
  for (const char* row : {"3: ", "4: ", "5: ", "6: ", "7: "}) EXPECT_NE(all.find(row), std::string::npos) << row << all;
  EXPECT_EQ(std::count(all.begin(), all.end(), '\n'), 5) << all;
  EXPECT_NE(all.find("'line' a second time"), std::string::npos) << all;
}

TEST_F(ReadingBatchList, HoldsTextsToTheirLengths) {
  std::string longest;
  for (std::size_t i = 0; i < kMaxSpokenCharacters; ++i) longest += "\u00E9";
  EXPECT_EQ(faults("id,text\na," + longest + "\n"), "");
  EXPECT_NE(faults("id,text\na," + longest + "e\n").find("20001 characters"), std::string::npos);
}

TEST_F(ReadingBatchList, AQuoteThatNeverClosesCostsItsRowAlone) {
  const BatchList open = read("id,text\na,\"never closed\nb,fine\n");
  ASSERT_EQ(open.faults.size(), 1U);
  EXPECT_EQ(open.faults[0].row, 2U);
  EXPECT_EQ(open.lines.at(0).id, "b");
  const BatchList before_another = read("id,text\na,\"never closed\nb,\"fine, too\"\n");
  ASSERT_EQ(before_another.faults.size(), 1U);
  EXPECT_EQ(before_another.faults[0].row, 2U);
  EXPECT_EQ(before_another.lines.at(0).line.text, "fine, too");
}

TEST_F(ReadingBatchList, RefusesWhatIsNoList) {
  EXPECT_NE(refusal("id,text\n").find("holds no lines"), std::string::npos);
  EXPECT_NE(refusal("").find("holds no lines"), std::string::npos);
  EXPECT_NE(refusal("id,notes\na,b\n").find("no column of text"), std::string::npos);
  EXPECT_NE(refusal("a,b,c\n").find("without names"), std::string::npos);
  EXPECT_NE(refusal("id,dialog,line\na,b,c\n").find("mean the same"), std::string::npos);
  EXPECT_NE(refusal("id,text,text\na,b,c\n").find("mean the same"), std::string::npos);
  EXPECT_NE(refusal("id,de,de\na,b,c\n").find("mean the same"), std::string::npos);
}

TEST(Shards, PartitionEveryList) {
  for (std::size_t count = 1; count <= 9; ++count) {
    std::vector<BatchLine> lines(23);
    for (std::size_t i = 0; i < lines.size(); ++i) lines[i].id = std::to_string(i);
    std::multiset<std::string> seen;
    for (std::size_t index = 1; index <= count; ++index) {
      for (const BatchLine& line : linesOfShard(lines, parseShard(std::to_string(index) + "/" + std::to_string(count))))
        seen.insert(line.id);
    }
    EXPECT_EQ(seen.size(), lines.size());
    EXPECT_EQ(std::set<std::string>(seen.begin(), seen.end()).size(), lines.size());
  }
}

TEST(Shards, RefuseNonsense) {
  for (const char* text : {"", "1", "0/3", "4/3", "1/0", "1/2/3", "a/b", "-1/2", "1 / 2", "1/99999999999999999999999"})
    EXPECT_THROW(parseShard(text), InputError) << text;
}

}  // namespace
}  // namespace mouthpiece
