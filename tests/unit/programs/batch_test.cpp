// synth batch as a game's build runs it: many lines, bad ones among them, killed, changed, spread over machines.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <nlohmann/json.hpp>

#include "support/run_program.h"

namespace mouthpiece::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using Arguments = std::vector<std::string>;

class Batch : public testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(fs::path(MOUTHPIECE_BUILD_SHARE_DIR) / "sample.corpus"))
      GTEST_SKIP() << "no sample corpus; make it with `make data`";
  }
  ProgramResult batch(const std::string& list, const std::string& out, Arguments more = {},
                      std::optional<std::chrono::microseconds> kill_after = {}) {
    Arguments arguments{
        "batch", folder_.write("lines.csv", list).string(), "--out", path(out), "--voice", "flite:slt", "--fps", "24"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return runProgram("synth", arguments, {}, kill_after);
  }
  std::string path(const std::string& name) { return (folder_.path() / name).string(); }
  json manifest(const std::string& name) { return json::parse(readAll(path(name))); }
  /// Every file of a folder by its name.
  std::map<std::string, std::string> bytesOf(const std::string& out) {
    std::map<std::string, std::string> bytes;
    for (const auto& entry : fs::recursive_directory_iterator(path(out))) {
      if (entry.is_regular_file())
        bytes[fs::relative(entry.path(), path(out)).generic_string()] = readAll(entry.path());
    }
    return bytes;
  }
  static std::string listOf(std::size_t lines) {
    std::string list = "text,id,mood\n";
    for (std::size_t i = 0; i < lines; ++i)
      list += "the time is now exactly " + std::to_string(1 + i % 11) + ",l" + std::to_string(i) + ",calm\n";
    return list;
  }
  ScratchFolder folder_;
};

TEST_F(Batch, MakesWhatItCanAndNamesTheRest) {
  const ProgramResult result =
      batch("id,text,mood\na,the time is now,calm\nb,one, two,x\nc,\"...\",x\nd,\"it is ten, now\",glad\nd,twice,x\n",
            "out", {"--format", "arkit.csv,wav"});
  EXPECT_EQ(result.exit_code, 1);
  for (const char* told : {"lines.csv:3: ", "lines.csv:6: ", "c: "})
    EXPECT_NE(result.err.find(told), std::string::npos) << told << result.err;
  EXPECT_NE(result.out.find("2 of 5 lines made"), std::string::npos) << result.out;
  for (const char* file : {"out/a.arkit.csv", "out/a.wav", "out/d.arkit.csv", "out/manifest.csv", "out/manifest.html"})
    EXPECT_TRUE(fs::exists(path(file))) << file;
  EXPECT_FALSE(fs::exists(path("out/a.glb")) || fs::exists(path("out/a")));
  EXPECT_TRUE(readAll(path("out/a.arkit.csv")).starts_with("Timecode,BlendShapeCount"));
  EXPECT_NE(readAll(path("out/manifest.html")).find("Content-Security-Policy\" content=\"default-src 'none'"),
            std::string::npos);
  const json lines = manifest("out/manifest.json")["lines"];
  ASSERT_EQ(lines.size(), 5U);
  std::string statuses;
  for (const json& line : lines) statuses += line["status"].get<std::string>() + " ";
  EXPECT_EQ(statuses, "made unusable failed made unusable ");
  EXPECT_EQ(lines[0]["others"], json({"calm"})) << "columns of others are passed through";
  EXPECT_GT(lines[0]["duration_s"], 0.5);
  EXPECT_EQ(lines[0]["files"][1]["bytes"], fs::file_size(path("out/a.wav")));
  EXPECT_GT(lines[0]["closures"], 0) << "the M of time";
  EXPECT_FALSE(fs::exists(path("out/manifest.journal"))) << "its work is done";
}

TEST_F(Batch, TellsWhatWasHeardWhereTheListHasNoWords) {
  ASSERT_EQ(batch("id,text\na,the time is now\n", "said", {"--format", "wav"}).exit_code, 0);
  const std::string recordings = "id,audio,text\nalone,said/a.wav,\ntold,said/a.wav,the time is now\n";
  for (const char* again : {"made", "as it was"}) {
    ASSERT_EQ(batch(recordings, "out", {"--format", "TextGrid"}).exit_code, 0);
    const json lines = manifest("out/manifest.json")["lines"];
    EXPECT_NE(lines[0]["heard"].get<std::string>().find("time is now"), std::string::npos) << again << lines[0];
    EXPECT_EQ(lines[0]["text"], "") << again;
    EXPECT_EQ(lines[1]["heard"], "") << again;
    EXPECT_NE(readAll(path("out/manifest.csv")).find(",heard\n"), std::string::npos) << again;
  }
}

TEST_F(Batch, GivesTheSameBytesForAnyNumberOfJobs) {
  const std::string list = listOf(7);
  EXPECT_EQ(batch(list, "one", {"--jobs", "1", "-o", "{id}.json", "-o", "{id}.arkit.csv"}).exit_code, 0);
  EXPECT_EQ(batch(list, "four", {"--jobs", "4", "-o", "{id}.json", "-o", "{id}.arkit.csv"}).exit_code, 0);
  const auto one = bytesOf("one"), four = bytesOf("four");
  EXPECT_EQ(one.size(), 7U * 2 + 4);
  EXPECT_TRUE(one == four);
}

TEST_F(Batch, MakesOnlyWhatHasChanged) {
  const Arguments wav{"--format", "wav"};
  EXPECT_EQ(batch("id,text\na,the time is now\nb,it is ten\n", "out", wav).exit_code, 0);
  const auto timesOf = [&] {
    return std::pair(fs::last_write_time(path("out/a.wav")), fs::last_write_time(path("out/b.wav")));
  };
  const auto before = timesOf();
  const ProgramResult again = batch("id,text\na,the time is now\nb,it is ten\n", "out", wav);
  EXPECT_NE(again.out.find("2 of 2 lines made"), std::string::npos);
  EXPECT_NE(again.out.find("2 of them before"), std::string::npos);
  EXPECT_EQ(timesOf(), before);
  EXPECT_NE(batch("id,text\na,the time is now\nb,it is nine\n", "out", wav).out.find("1 of them before"),
            std::string::npos);
  EXPECT_EQ(timesOf().first, before.first);
  EXPECT_NE(timesOf().second, before.second);
  fs::remove(path("out/a.wav"));
  batch("id,text\na,the time is now\nb,it is nine\n", "out", wav);
  EXPECT_TRUE(fs::exists(path("out/a.wav"))) << "what was deleted comes back";
  const ProgramResult other =
      batch("id,text\na,the time is now\nb,it is nine\n", "out", {"--format", "wav", "--fps", "30"});
  EXPECT_EQ(other.out.find("before"), std::string::npos) << "another setting makes all again";
}

/// Lines over a minute are made piece by piece, when a file asks for them; their quality is told all the same.
TEST_F(Batch, MakesLinesOfOverAMinute) {
  std::string text;
  for (int i = 0; i < 40; ++i) text += "A mother buys a map of the moor. ";
  EXPECT_EQ(batch("id,text\na," + text + "\n", "out", {"--format", "wav"}).exit_code, 0);
  const json line = manifest("out/manifest.json")["lines"][0];
  EXPECT_GT(line["duration_s"], 62);
  EXPECT_GT(line["closures"], 100);
  EXPECT_GT(line["closures_made"], 90);
}

/// A line that was made before is made again where it would come out otherwise.
TEST_F(Batch, MakesALineAgainForEverySettingThatMovesTheFace) {
  const std::string list = "id,text\na,now\n";
  std::vector<Arguments> settings{{"--format", "arkit.csv"}};
  EXPECT_EQ(batch(list, "out", settings.front()).exit_code, 0);
  for (const auto& [name, value] :
       {std::pair("--strength", "0.8"), std::pair("--jaw", "2"), std::pair("--lips", "0.5"), std::pair("--hold", "0.3"),
        std::pair("--lead-ms", "20"), std::pair("--smooth", "30"), std::pair("--upper-face", "rules"),
        std::pair("--mood", "joy"), std::pair("--seed", "7")}) {
    Arguments more = settings.back();
    more.insert(more.end(), {name, value});
    const ProgramResult made = batch(list, "out", more);
    EXPECT_EQ(made.exit_code, 0) << name << made.err;
    EXPECT_EQ(made.out.find("before"), std::string::npos) << name;
    settings.push_back(more);
  }
  for (const char* flag : {"--gaze", "--head-motion"}) {
    settings.back().emplace_back(flag);
    EXPECT_EQ(batch(list, "out", settings.back()).out.find("before"), std::string::npos) << flag;
  }
  EXPECT_NE(batch(list, "out", settings.back()).out.find("1 of them before"), std::string::npos);
}

TEST_F(Batch, GoesOnAfterAKill) {
  const std::string list = listOf(120);
  const Arguments wanted{"--format", "arkit.csv", "--quiet"};
  const ProgramResult killed = batch(list, "out", wanted, std::chrono::milliseconds(2500));
  if (killed.exit_code != 137) GTEST_SKIP() << "it was through before the kill";
  const std::string journal = readAll(path("out/manifest.journal"));
  const auto done = std::count(journal.begin(), journal.end(), '}');
  ASSERT_GT(done, 0);
  // A kill may tear the last line.
  static_cast<void>(folder_.write("out/manifest.journal", journal + "\n{\"key\": \"l119\", \"sta"));
  std::map<std::string, fs::file_time_type> before;
  for (const auto& entry : fs::directory_iterator(path("out"))) {
    if (entry.path().extension() == ".csv") before[entry.path()] = entry.last_write_time();
  }
  const ProgramResult resumed = batch(list, "out", {"--format", "arkit.csv"});
  EXPECT_EQ(resumed.exit_code, 0) << resumed.err;
  EXPECT_NE(resumed.out.find("of them before"), std::string::npos) << resumed.out;
  std::size_t kept = 0;
  for (const auto& [file, time] : before) kept += fs::last_write_time(file) == time ? 1U : 0U;
  EXPECT_GE(kept + 2, before.size()) << "at most what was being made";
  EXPECT_EQ(batch(list, "whole", wanted).exit_code, 0);
  auto pieces = bytesOf("out"), whole = bytesOf("whole");
  for (const char* page : {"manifest.html", "manifest.players.json"}) {
    pieces.erase(page);  // which lines have players depends on the kill
    whole.erase(page);
  }
  // What was being written at the kill is swept away once it is old enough to be nobody's.
  std::erase_if(pieces, [](const auto& file) { return file.first.ends_with(".tmp"); });
  for (const auto& [name, bytes] : pieces) EXPECT_TRUE(whole.contains(name) && whole[name] == bytes) << name;
  EXPECT_EQ(pieces.size(), whole.size());
}

TEST_F(Batch, ShardsMergeToOneManifest) {
  const std::string list = listOf(9);
  EXPECT_EQ(batch(list, "whole", {"--format", "wav"}).exit_code, 0);
  for (const char* shard : {"1/3", "3/3"}) batch(list, "out", {"--format", "wav", "--shard", shard});
  const ProgramResult early = runProgram("synth", {"merge", path("out")});
  EXPECT_EQ(early.exit_code, 1);
  EXPECT_NE(early.out.find("3 missing"), std::string::npos) << early.out;
  batch(list, "out", {"--format", "wav", "--shard", "2/3"});
  const ProgramResult merged = runProgram("synth", {"merge", path("out")});
  EXPECT_EQ(merged.exit_code, 0) << merged.out << merged.err;
  EXPECT_NE(merged.out.find("0 missing, 0 in two"), std::string::npos) << merged.out;
  for (const char* file : {"manifest.json", "manifest.csv", "manifest.html"})
    EXPECT_TRUE(readAll(path(std::string("out/") + file)) == readAll(path(std::string("whole/") + file))) << file;
}

TEST_F(Batch, ARowThatCannotBeUsedIsOneShards) {
  const std::string list = "id,text\na,now\na,twice\nb,now\n";
  const ProgramResult first = batch(list, "out", {"--format", "wav", "--shard", "1/2"});
  EXPECT_EQ(first.exit_code, 1);
  EXPECT_NE(first.out.find("1 of 2 lines made"), std::string::npos) << first.out;
  const ProgramResult second = batch(list, "out", {"--format", "wav", "--shard", "2/2"});
  EXPECT_EQ(second.exit_code, 0) << second.err;
  EXPECT_NE(second.out.find("1 of 1 line made"), std::string::npos) << second.out;
}

TEST_F(Batch, SpeakersHaveTheirVoices) {
  const std::string cast = folder_.write("cast.csv", "speaker,voice\nBob,flite:rms\n").string();
  EXPECT_EQ(batch("id,speaker,text\na,Bob,it is ten\nb,Ann,it is ten\nc,Bob,it is ten\n", "out",
                  {"-o", "{speaker}/{id}.json", "--cast", cast})
                .exit_code,
            0);
  EXPECT_EQ(manifest("out/Bob/a.json")["voice"], "flite:rms");
  EXPECT_EQ(manifest("out/Ann/b.json")["voice"], "flite:slt");
  EXPECT_TRUE(readAll(path("out/Bob/a.json")) == readAll(path("out/Bob/c.json")));
}

TEST_F(Batch, VoicesGiveWayToALinesLanguage) {
  const std::string list = "id,speaker,text,language\na,Bob,now,\nb,Bob,nun,de\nc,Ann,nun,de\n";
  const std::string cast = folder_.write("cast.csv", "speaker,voice\nBob,flite:rms\n").string();
  const ProgramResult result = batch(list, "out", {"-o", "{id}.json", "--cast", cast});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(manifest("out/a.json")["voice"], "flite:rms");
  EXPECT_EQ(manifest("out/b.json")["voice"], "espeak:de");
  EXPECT_EQ(manifest("out/c.json")["voice"], "espeak:de");
  EXPECT_NE(result.err.find("flite:rms speaks no German: espeak:de does"), std::string::npos) << result.err;

  const ProgramResult mute = batch("id,text,language\na,now,\nb,いま,ja\n", "mute", {"-o", "{id}.json"});
  EXPECT_NE(mute.out.find("1 of 2 lines made"), std::string::npos) << mute.out << mute.err;

  const std::string both = folder_.write("both.csv", "speaker,voice,language\nBob,flite:rms,de\n").string();
  const ProgramResult odd = batch(list, "odd", {"-o", "{id}.json", "--cast", both});
  EXPECT_EQ(odd.exit_code, 1);
  EXPECT_NE(odd.err.find("both.csv:Bob: found the voice flite:rms for text in German; expected espeak:de"),
            std::string::npos)
      << odd.err;
  EXPECT_EQ(batch(list, "odd", {"-o", "{id}.json", "--language", "de"}).exit_code, 1) << "of the command line, both";
  EXPECT_FALSE(fs::exists(path("odd")));
}

TEST_F(Batch, CountsOneAsOne) {
  EXPECT_EQ(batch("id,text\na,now\nb,\n", "out", {"--check"}).out, "1 line, 1 row that cannot be used\n");
}

TEST_F(Batch, WritesOverNothingThatItReads) {
  ASSERT_EQ(batch("id,text\nst,the time is now\n", "out", {"--format", "wav"}).exit_code, 0);
  const std::string sound = readAll(path("out/st.wav"));
  const std::string cast = folder_.write("cast.csv", "speaker,voice\nBob,flite:rms\n").string();
  const std::string words = folder_.write("words.csv", "mouthpiece M AW TH P IY S\n").string();
  const auto expectRefused = [&](const std::string& list, const std::string& out, const Arguments& more,
                                 const std::string& told) {
    const ProgramResult result = batch(list, out, more);
    EXPECT_EQ(result.exit_code, 1) << told << result.out;
    EXPECT_NE(result.err.find(told), std::string::npos) << told << result.err;
    EXPECT_EQ(readAll(path("lines.csv")), list);
  };
  expectRefused("id,audio,transcript\nst,out/st.wav,the time is now\n", "out", {"--format", "wav"},
                "st.wav:--format: is what row 2 of the list names, too; expected another");
  expectRefused("id,text,audio\na,now,\nst,now,out/st.wav\n", "out", {"-o", "{id}.wav"}, "is what row 3 of the list");
  EXPECT_EQ(readAll(path("out/st.wav")), sound);
  expectRefused("id,text\nlines,now\n", ".", {"-o", "{id}.csv"}, "lines.csv:-o: is what list names, too");
  expectRefused("id,text\ncast,now\n", ".", {"-o", "{id}.csv", "--cast", cast}, "is what --cast names, too");
  expectRefused("id,text\nwords,now\n", ".", {"-o", "{id}.csv", "--lexicon", words}, "is what --lexicon names, too");
  expectRefused("id,text\nmanifest,now\n", "out", {"-o", "{id}.json"}, "is the manifest's");
  const std::string list = "id,text\na,now\n";
  static_cast<void>(folder_.write("in/manifest.csv", list));
  const ProgramResult over_list = runProgram(
      "synth", {"batch", path("in/manifest.csv"), "--out", path("in"), "--voice", "flite:slt", "--format", "wav"});
  EXPECT_EQ(over_list.exit_code, 1);
  EXPECT_EQ(readAll(path("in/manifest.csv")), list);
}

TEST_F(Batch, ReplacesNoManifestOfOthers) {
  const std::string list = "id,text\na,now\n";
  const std::vector<std::pair<std::string, std::string>> foreign{
      {"manifest.json", "{\"name\": \"my web app\"}"}, {"manifest.csv", "mine,1\n"}, {"manifest.html", "<html>mine"}};
  for (const auto& [name, bytes] : foreign) {
    static_cast<void>(folder_.write("app/" + name, bytes));
    const ProgramResult result = batch(list, "app", {"--format", "wav"});
    EXPECT_EQ(result.exit_code, 1) << name;
    EXPECT_NE(result.err.find(name + ": is there and none of ours"), std::string::npos) << result.err;
    EXPECT_EQ(readAll(path("app/" + name)), bytes);
    EXPECT_FALSE(fs::exists(path("app/a.wav")));
    fs::remove(path("app/" + name));
  }
  // Those of a run that was killed before its first manifest.json are ours.
  ASSERT_EQ(batch(list, "app", {"--format", "wav"}).exit_code, 0);
  fs::remove(path("app/manifest.json"));
  EXPECT_EQ(batch(list, "app", {"--format", "wav"}).exit_code, 0);
  // One that is damaged is made again.
  static_cast<void>(folder_.write("app/manifest.json", readAll(path("app/manifest.json")).substr(0, 100)));
  EXPECT_EQ(batch(list, "app", {"--format", "wav"}).exit_code, 0);
  EXPECT_EQ(manifest("app/manifest.json")["lines"].size(), 1U);
}

TEST_F(Batch, TellsOfAnotherListInItsFolder) {
  ASSERT_EQ(batch("id,text\na,now\nb,it is ten\n", "out", {"--format", "wav"}).exit_code, 0);
  const std::string other = folder_.write("two.csv", "id,text\nb,it is ten\n").string();
  const ProgramResult result = runProgram(
      "synth", {"batch", other, "--out", path("out"), "--voice", "flite:slt", "--fps", "24", "--format", "wav"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.err.find("was made of lines.csv"), std::string::npos) << result.err;
  EXPECT_NE(result.err.find("1 of its lines is not in two.csv; its files stay"), std::string::npos) << result.err;
  EXPECT_TRUE(fs::exists(path("out/a.wav")));
}

TEST_F(Batch, BelievesNoManifestOfFilesElsewhere) {
  const std::string list = "id,text\na,now\n";
  ASSERT_EQ(batch(list, "out", {"--format", "wav"}).exit_code, 0);
  static_cast<void>(folder_.write("b.wav", readAll(path("out/a.wav"))));
  json changed = manifest("out/manifest.json");
  changed["lines"][0]["files"][0]["name"] = "../b.wav";
  static_cast<void>(folder_.write("out/manifest.json", changed.dump()));
  fs::remove(path("out/a.wav"));
  EXPECT_EQ(batch(list, "out", {"--format", "wav"}).exit_code, 0);
  EXPECT_TRUE(fs::exists(path("out/a.wav")));
}

/// What has no end, or more of it than can be read, is told and not read.
TEST_F(Batch, ReadsNothingWithoutEnd) {
  const std::string huge = folder_.write("huge.wav", "RIFF").string();
  fs::resize_file(huge, std::uintmax_t{30} << 30);
  ASSERT_EQ(::mkfifo(path("fifo").c_str(), 0600), 0);
  const ProgramResult lines =
      batch("id,audio,transcript\na,/dev/zero,x\nb,fifo,x\nc,huge.wav,x\n", "out", {"--format", "TextGrid"});
  EXPECT_EQ(lines.exit_code, 1) << lines.err;
  for (const char* told :
       {"lines.csv:2: names '/dev/zero', which is no", "lines.csv:3: ", "c: ", "huge.wav: is 32212254720 bytes"})
    EXPECT_NE(lines.err.find(told), std::string::npos) << told << lines.err;
  for (const char* option : {"--lexicon", "--edits", "--ja"}) {
    for (const std::string& file : {huge, path("fifo"), std::string("/dev/zero")}) {
      const ProgramResult result = batch("id,text\na,now\n", "out", {"--format", "wav", option, file});
      EXPECT_EQ(result.exit_code, 1) << option << file << result.err;
      EXPECT_NE(result.err.find(file + ": is "), std::string::npos) << result.err;
    }
  }
}

TEST_F(Batch, ReadsFormatsAsTheyAreTyped) {
  EXPECT_EQ(batch("id,text\na,now\n", "out", {"--format", "wav, TextGrid,wav"}).exit_code, 0);
  EXPECT_TRUE(fs::exists(path("out/a.wav")) && fs::exists(path("out/a.TextGrid")));
}

TEST_F(Batch, PrintsNamesWithoutTheirControlCharacters) {
  const ProgramResult result = batch("id,text\na,now\n", "o\x1B[31mred", {"--format", "wav"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ((result.out + result.err).find('\x1B'), std::string::npos) << result.out;
  const ProgramResult line = runProgram(
      "synth", {"--text", "now", "--voice", "flite:slt", "-o", path("o\x1B[31m.wav"), "-o", path("a\nb.TextGrid")});
  EXPECT_EQ(line.exit_code, 0) << line.err;
  EXPECT_EQ(line.out.find('\x1B'), std::string::npos) << line.out;
  EXPECT_EQ(std::count(line.out.begin(), line.out.end(), '\n'), 3) << line.out;
}

TEST_F(Batch, RefusesNamesThatLeaveTheFolder) {
  for (const char* name : {"../{id}.wav", "/tmp/{id}.wav", "same.wav", "{id}.xyz"}) {
    const ProgramResult result = batch("id,text\na,now\n", "out", {"-o", name});
    EXPECT_EQ(result.exit_code, 1) << name;
    EXPECT_FALSE(fs::exists(path("out"))) << name;
  }
}

}  // namespace
}  // namespace mouthpiece::test
