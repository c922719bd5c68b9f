// Lists of lines: what spreadsheets and people write, and what they get wrong.
#include "programs/synth/batch_list.h"

#include <gtest/gtest.h>

#include <set>

#include "mouthpiece/errors.h"
#include "support/run_program.h"

namespace mouthpiece {
namespace {

class BatchList : public testing::Test {
 protected:
  std::vector<BatchLine> read(const std::string& text) {
    return readBatchList(scratch_.write("lines.csv", text));
  }
  std::string refusal(const std::string& text) {
    try {
      read(text);
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  }
  test::ScratchFolder scratch_;
};

TEST_F(BatchList, ReadsTypedLines) {
  const auto lines = read("id,text\r\na,hello\nb,\"one, two \"\"three\"\"\nfour\"\n");
  ASSERT_EQ(lines.size(), 2U);
  EXPECT_EQ(lines[0].id, "a");
  EXPECT_EQ(lines[0].line.text, "hello");
  EXPECT_EQ(lines[1].line.text, "one, two \"three\"\nfour");
}

TEST_F(BatchList, ReadsRecordings) {
  const auto spoken = read("id,audio,transcript\na,a.wav,hello\n");
  EXPECT_EQ(spoken.at(0).line.audio.filename(), "a.wav");
  EXPECT_TRUE(spoken.at(0).line.audio.is_absolute()) << "beside the list, wherever the program runs";
  EXPECT_EQ(spoken.at(0).line.text, "hello");
  EXPECT_EQ(read("id,audio,phones\na,a.wav,a.lab\n").at(0).line.phones.filename(), "a.lab");
}

TEST_F(BatchList, NamesTheLineOfWhatIsWrong) {
  EXPECT_NE(refusal("a,hello\na,again\n").find(":2:"), std::string::npos);
  EXPECT_NE(refusal("a,hello\n../b,out of the folder\n").find(":2:"), std::string::npos);
  EXPECT_NE(refusal("a,hello\nb\n").find(":2:"), std::string::npos);
  EXPECT_NE(refusal("a,\"never closed\n\n").find(":1:"), std::string::npos);
  EXPECT_NE(refusal("id,text\n").find("holds no lines"), std::string::npos);
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
