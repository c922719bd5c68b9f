// Defaults that a user has written down.
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "support/run_program.h"

namespace mouthpiece::test {
namespace {

class Config : public testing::Test {
 protected:
  ProgramResult with(const std::string& config, const std::vector<std::string>& arguments) {
    const std::string file = folder_.write("config", config).string();
    std::vector<std::string> all{"MOUTHPIECE_CONFIG=" + file, MOUTHPIECE_BIN_DIR "/synth"};
    all.insert(all.end(), arguments.begin(), arguments.end());
    return runProgram("/usr/bin/env", all);
  }
  std::string list(const std::string& text) { return folder_.write("lines.csv", text).string(); }
  ScratchFolder folder_;
};

TEST_F(Config, GivesWhatTheCommandLineDoesNot) {
  // "batch --check" makes nothing, so a wrong voice is seen by its option alone.
  const std::string lines = list("id,text\na,hello\n");
  EXPECT_EQ(with("[synth]\nshard = 9/2\n", {"batch", lines}).exit_code, 1) << "the default is taken";
  EXPECT_EQ(with("[synth]\nshard = 9/2\n", {"batch", lines, "--shard", "1/1", "--check"}).exit_code, 0);
  EXPECT_EQ(with("[synth]\nshard = 9/2\n", {"batch", lines, "--shard=1/1", "--check"}).exit_code, 0);
  EXPECT_EQ(with("[synth]\nshard = 9/2\n[synth batch]\nshard = 1/2\n", {"batch", lines, "--check"}).exit_code, 0)
      << "the command's own section goes before the program's";
  EXPECT_EQ(with("[corpus]\nshard = 9/2\n# nothing\n\n[retarget]\nx = y\n", {"batch", lines, "--check"}).exit_code, 0);
}

TEST_F(Config, IsOfTheCommandHoweverItIsWritten) {
  const std::string lines = list("id,text\na,hello\n");
  EXPECT_EQ(with("[synth batch]\njobs = 2\n", {"batch", lines, "-j1", "--check"}).exit_code, 0);
  EXPECT_EQ(with("[synth batch]\nshard = 9/2\n", {"-q", "batch", lines, "--check"}).exit_code, 1)
      << "an option before the command";
}

TEST_F(Config, RefusesWhatItDoesNotKnow) {
  const std::string lines = list("id,text\na,hello\n");
  const auto refused = [&](const std::string& config, const std::string& expected) {
    const ProgramResult result = with(config, {"batch", lines, "--check"});
    EXPECT_EQ(result.exit_code, 1) << config;
    EXPECT_NE(result.err.find(expected), std::string::npos) << config << result.err;
  };
  refused("[synth]\nvoise = flite:slt\n", "config:2: found 'voise'");
  refused("voice\n", "config:1: ");
  refused("[synth]\n\n[synht]\nvoice = flite:slt\n",
          "config:3: found '[synht]'; expected [synth], [corpus], [retarget]");
  refused("[synth bacth]\njobs = 2\n", "config:1: found '[synth bacth]'");
  refused("[synth]\nvoice =\n", "config:2: found no value for 'voice'");
  refused("[synth]\nvoice = \"\"\n", "config:2: found no value for 'voice'");
  refused("[synth]\nvoice = \"flite:slt\n", "config:2: ");
  refused("[synth]\nvoice = 'flite:slt' twice\n", "config:2: ");
}

TEST_F(Config, HasQuotesAndCommentsAsUsual) {
  const std::string lines = list("id,text\na,hello\n");
  for (const char* line :
       {"shard = '1/2'", "shard = \"1/2\"  # mine", "shard=1/2 # mine", "; mine\nshard = 1/2;", "shard = 1/2#"}) {
    const bool is_value = std::string(line).find_last_of(";#") != std::string(line).size() - 1;
    const ProgramResult result = with(std::string("[synth batch]\n") + line + "\n", {"batch", lines, "--check"});
    EXPECT_EQ(result.exit_code, is_value ? 0 : 1) << line << result.err;
  }
}

TEST_F(Config, IsNamedWhereItsValuesAreWrong) {
  const std::string lines = list("id,text\na,hello\n");
  const auto told = [&](const std::string& line, const std::string& expected) {
    const ProgramResult result = with("[synth batch]\n" + line + "\n", {"batch", lines});
    EXPECT_EQ(result.exit_code, 1) << line;
    EXPECT_NE(result.err.find(expected), std::string::npos) << line << result.err;
  };
  told("jobs = many", "config:2: --jobs: found 'many'; expected 1 to 1024");
  told("jobs = 5000", "config:2: --jobs: found '5000'; expected 1 to 1024");
  told("fps = fast", "config:2: --fps: found 'fast'; expected a number");
  told("method = best", "config:2: --method: found 'best'; expected curves|");
  told("ja = 3", "config:2: --ja: found 3; expected 0 to 2");
  told("shard = 3/2", "config:2: --shard: found '3/2'");
  told("face = nowhere.face", "(face of " + folder_.path().string() + "/config:2)");
  told("voice = nobody", "(voice of " + folder_.path().string() + "/config:2)");
  told("language = xx", "(language of " + folder_.path().string() + "/config:2)");
}

TEST_F(Config, LeavesHelpAlone) {
  for (const char* config : {"[synth]\nvoise = flite:slt\n", "nothing\n"}) {
    for (const std::vector<std::string>& asked : {std::vector<std::string>{"--help"}, {"--version"}, {"batch", "-h"}})
      EXPECT_EQ(with(config, asked).exit_code, 0) << config << asked.back();
  }
}

TEST_F(Config, LanguageIsOfSpokenLinesAndNotOfSongs) {
  const std::string song = MOUTHPIECE_SOURCE_DIR "/sample_data/songs/twinkle.json";
  const std::string out = (folder_.path() / "out").string();
  const auto made = with("[synth]\nlanguage = de\n",
                         {"batch", list("id,song\na," + song + "\n"), "--out", out, "--format", "TextGrid"});
  EXPECT_EQ(made.exit_code, 0) << made.err;
}

TEST_F(Config, IsThereWhereItIsNamed) {
  const std::string lines = list("id,text\na,hello\n");
  const auto named = [&](const std::string& file) {
    return runProgram("/usr/bin/env",
                      {"MOUTHPIECE_CONFIG=" + file, MOUTHPIECE_BIN_DIR "/synth", "batch", lines, "--check"});
  };
  const ProgramResult missing = named(folder_.path() / "cofnig"), folder = named(folder_.path());
  EXPECT_EQ(missing.exit_code, 1);
  EXPECT_NE(missing.err.find("cofnig: is not there; expected the file that MOUTHPIECE_CONFIG names"), std::string::npos)
      << missing.err;
  EXPECT_EQ(folder.exit_code, 1);
  EXPECT_NE(folder.err.find("is a folder; expected a file"), std::string::npos) << folder.err;
  EXPECT_EQ(named("/dev/null").exit_code, 0) << "no defaults at all";
  EXPECT_EQ(named("").exit_code, 0);
}

TEST_F(Config, IsOfNoCommandThatLacksWhatItNeeds) {
  // A default that needs another option counts beside that alone, and one of another command does not.
  const ProgramResult result = with("[synth]\nhint = Mouthpiece\njobs = 2\ntranscript = the time is now\n",
                                    {"--text", "", "-o", (folder_.path() / "a.wav").string()});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(result.err.find("--hint"), std::string::npos) << result.err;
  EXPECT_NE(result.err.find("text:"), std::string::npos) << result.err;
}

TEST_F(Config, GivesWayToAnotherLanguageAndAnotherVoice) {
  if (!std::filesystem::exists(std::filesystem::path(MOUTHPIECE_BUILD_SHARE_DIR) / "sample.corpus"))
    GTEST_SKIP() << "no sample corpus; make it with `make data`";
  const std::string report = (folder_.path() / "a.json").string();
  const auto voiceOf = [&](const std::string& config, std::vector<std::string> given) {
    given.insert(given.end(), {"--text", "an", "-o", report});
    const ProgramResult result = with("[synth]\n" + config, given);
    return result.exit_code != 0 ? result.err : nlohmann::json::parse(readAll(report))["voice"].get<std::string>();
  };
  const std::string slt = "voice = flite:slt\n", german = "language = de\n";
  EXPECT_EQ(voiceOf(slt, {}), "flite:slt");
  EXPECT_EQ(voiceOf(slt, {"--language", "de"}), "espeak:de");
  EXPECT_EQ(voiceOf(slt, {"--language", "en-GB"}), "flite:slt") << "it speaks English";
  EXPECT_EQ(voiceOf(slt + german, {}), "espeak:de");
  EXPECT_EQ(voiceOf(german, {"--voice", "flite:rms"}), "flite:rms");
  EXPECT_EQ(voiceOf(slt + german, {"--voice", "flite:rms"}), "flite:rms");
  for (const char* voice : {"flite:slt", "festival:cmu_us_slt_arctic_hts"})
    EXPECT_NE(voiceOf("", {"--voice", voice, "--language", "de"}).find("for text in German; expected espeak:de"),
              std::string::npos)
        << voice;
}

TEST(Version, TellsCommitAndFormats) {
  for (const char* program : {"synth", "corpus", "retarget"}) {
    const ProgramResult result = runProgram(program, {"--version"});
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_NE(result.out.find("corpus format 7"), std::string::npos) << result.out;
    EXPECT_NE(result.out.find("commit "), std::string::npos) << result.out;
  }
}

}  // namespace
}  // namespace mouthpiece::test
