// The main job on the real programs: lines in, consistent files out. Figures are in mm and ms, never bytes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "audio/audio_clip.h"
#include "motion/formats/c3d_file.h"
#include "motion/formats/motion_csv.h"
#include "phonetics/labels/textgrid.h"
#include "support/run_program.h"

namespace mouthpiece::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

const fs::path kSpokenShare = MOUTHPIECE_BUILD_SHARE_DIR;

/// Sentences of the time grammar that are not among the 55 of the sample corpus (checked below).
const std::vector<std::string> kNewTimeSentences = {
    "the time is now exactly five past one in the morning",
    "the time is now almost twenty five to eight in the afternoon",
    "the time is now just after half past eleven pm",
    "the time is now a little after quarter to twelve am",
    "the time is now exactly ten to three pm",
    "the time is now almost quarter past six in the morning",
    "the time is now a little after twenty past nine in the afternoon",
    "the time is now just after five to four am",
    "the time is now exactly twenty five past seven pm",
    "the time is now almost ten past two am",
};
const std::vector<std::string> kOtherSentences = {"good evening and welcome to the show",
                                                  "measure the garage with a yellow ruler"};

class Speak : public testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(kSpokenShare / "sample.corpus"))
      GTEST_SKIP() << "no sample corpus in " << kSpokenShare << ": run `make data`";
  }

  /// The report of a line whose motion, labels and sound are made as well.
  json speak(const std::vector<std::string>& arguments) {
    std::vector<std::string> all = arguments;
    all.emplace_back("--quiet");
    for (const char* name : {"report.json", "motion.c3d", "phones.TextGrid", "speech.wav"})
      all.insert(all.end(), {"-o", (out() / name).string()});
    const ProgramResult result = runProgram("synth", all);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.exit_code == 0 ? json::parse(readAll(out() / "report.json")) : json();
  }

  [[nodiscard]] fs::path out() const { return scratch_.path() / "out"; }

  ScratchFolder scratch_;
};

/// The promises of report.json for any line.
void expectConsistentReport(const json& report) {
  const auto& phones = report.at("phones");
  const auto& units = report.at("units");
  ASSERT_FALSE(phones.empty());
  EXPECT_NEAR(report.at("frames").get<double>(), report.at("duration_s").get<double>() * report.at("fps").get<double>(),
              1.0);
  for (std::size_t i = 1; i < phones.size(); ++i) {
    EXPECT_NEAR(phones[i].at("start_s").get<double>(), phones[i - 1].at("end_s").get<double>(), 1e-6);
  }
  EXPECT_EQ(units.front().at("first"), 0);
  EXPECT_EQ(units.back().at("last"), phones.size() - 1);
  for (std::size_t i = 1; i < units.size(); ++i)
    EXPECT_EQ(units[i].at("first"), units[i - 1].at("last")) << "neighbours share a phone";
  EXPECT_EQ(report.at("joins").size(), units.size() - 1);
}

double lipOpening(const MotionClip& clip, std::size_t frame) {
  return (clip.position(FrameIndex(frame), *clip.findMarker("LIP_UP_MID")) -
          clip.position(FrameIndex(frame), *clip.findMarker("LIP_LO_MID")))
      .norm();
}

TEST_F(Speak, AllFilesAgree) {
  const ProgramResult result = runProgram("synth", {"--text", "the time is now", "--out", out().string(), "--quiet"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const json report = json::parse(readAll(out() / "report.json"));
  expectConsistentReport(report);
  EXPECT_TRUE(report.at("backoff").empty());
  for (const char* name :
       {"speech.wav", "motion.c3d", "motion.csv", "face.glb", "phones.TextGrid", "view.html", "report.json"}) {
    EXPECT_TRUE(fs::exists(out() / name)) << name;
  }
  const MotionClip c3d = readC3d(out() / "motion.c3d");
  const MotionClip csv = readMotionCsv(out() / "motion.csv");
  ASSERT_EQ(c3d.markerCount(), 66U);
  ASSERT_EQ(c3d.frameCount(), report.at("frames").get<std::size_t>());
  ASSERT_EQ(c3d.positions_mm.rows(), csv.positions_mm.rows());
  EXPECT_TRUE(c3d.positions_mm.allFinite());
  EXPECT_LT((c3d.positions_mm - csv.positions_mm).cwiseAbs().maxCoeff(), 1e-3)
      << "mm; both round, C3D to a float, CSV to 0.1 um";
  EXPECT_NEAR(readAudio(out() / "speech.wav").duration(), report.at("duration_s").get<double>(), 0.05);
  const SpeechLabels labels = readTextGrid(out() / "phones.TextGrid");
  EXPECT_EQ(labels.phones.size(), report.at("phones").size());
  ASSERT_EQ(labels.words.size(), 4U);
  EXPECT_EQ(labels.words[1].text, "time");
}

TEST_F(Speak, LipsCloseForTheMOfTimeAndOpenForItsVowel) {
  speak({"--text", "the time is now", "--fps", "120"});
  const MotionClip clip = readC3d(out() / "motion.c3d");
  const SpeechLabels labels = readTextGrid(out() / "phones.TextGrid");
  const auto openings = [&](Phone phone) {
    std::vector<double> values;
    for (const LabelledPhone& each : labels.phones) {
      if (each.phone != phone) continue;
      for (double t = each.span.start - 0.02; t < each.span.end; t += 1.0 / 120)
        values.push_back(lipOpening(clip, static_cast<std::size_t>(t * 120)));
    }
    return values;
  };
  const std::vector<double> closed = openings(Phone::kM);
  const std::vector<double> open = openings(Phone::kAY);
  ASSERT_FALSE(closed.empty());
  ASSERT_FALSE(open.empty());
  EXPECT_GT(*std::max_element(open.begin(), open.end()), *std::min_element(closed.begin(), closed.end()) + 4.0) << "mm";
}

TEST_F(Speak, FrameRateAndDurationFollowTheOptions) {
  for (const std::string fps : {"24", "25", "60", "240"}) {
    const json report = speak({"--text", "the time is now", "--fps", fps});
    EXPECT_DOUBLE_EQ(report.at("fps").get<double>(), std::stod(fps));
    expectConsistentReport(report);
    EXPECT_DOUBLE_EQ(readC3d(out() / "motion.c3d").frame_rate_hz, std::stod(fps));
  }
}

TEST_F(Speak, TenNewSentencesOfTheGrammarNeedNoBackoff) {
  const json prompts =
      json::parse(runProgram("corpus", {"info", (kSpokenShare / "sample.corpus").string(), "--json"}).out);
  for (const std::string& text : kNewTimeSentences) {
    EXPECT_EQ(prompts.dump().find("\"" + text + "\""), std::string::npos) << text << " is one of the 55";
    const json report = speak({"--text", text});
    expectConsistentReport(report);
    EXPECT_TRUE(report.at("backoff").empty()) << text << ": " << report.at("backoff").dump();
  }
}

/// Fifty lines of everyday talk that were written before the corpus' sentences were chosen, and not looked at then.
TEST_F(Speak, EverydayLinesNeedNextToNoStandIns) {
  std::istringstream lines(readAll(fs::path(MOUTHPIECE_SOURCE_DIR) / "tests/data/everyday.txt"));
  const auto pairs_of = [](const json& span) { return span.at("last").get<int>() - span.at("first").get<int>(); };
  int lines_said = 0, pairs = 0, stand_ins = 0;
  for (std::string text; std::getline(lines, text); ++lines_said) {
    const fs::path file = scratch_.path() / "line.json";
    const ProgramResult result = runProgram("synth", {"--text", text, "-o", file.string(), "--quiet"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const json report = json::parse(readAll(file));
    pairs += static_cast<int>(report.at("phones").size()) - 1;
    for (const json& span : report.at("backoff")) stand_ins += pairs_of(span);
  }
  EXPECT_GE(lines_said, 40);
  EXPECT_LT(stand_ins, 0.02 * pairs) << stand_ins << " of " << pairs;
}

TEST_F(Speak, SentencesOutsideTheGrammarComeOutWholeWithTheirBackoff) {
  for (const std::string& text : kOtherSentences) {
    const json report = speak({"--text", text, "--corpus", "clock"});
    expectConsistentReport(report);
    EXPECT_FALSE(report.at("backoff").empty()) << text;
    EXPECT_TRUE(readC3d(out() / "motion.c3d").positions_mm.allFinite());
  }
}

TEST_F(Speak, EverySelectionUnitAndBlendWorks) {
  for (const char* select : {"greedy", "viterbi"}) {
    for (const char* units : {"any", "paper"}) {
      expectConsistentReport(speak({"--text", kNewTimeSentences[0], "--select", select, "--units", units}));
    }
  }
  for (const char* method : {"guided", "greedy", "edge"}) {
    const json report = speak({"--text", kNewTimeSentences[0], "--method", method});
    expectConsistentReport(report);
    EXPECT_EQ(report.at("method"), method);
  }
  EXPECT_EQ(speak({"--text", kNewTimeSentences[0], "--method", "curves"}).at("method"), "curves");
  EXPECT_EQ(speak({"--text", kNewTimeSentences[0], "--select", "viterbi"}).at("method"), "guided") << "an earlier name";
  for (const char* blend : {"smooth", "linear", "cosine", "exponential"}) {
    expectConsistentReport(speak({"--text", kNewTimeSentences[1], "--blend", blend}));
  }
}

/// Whose movement the lips' is, by method: what README says of each.
TEST_F(Speak, TheReportSaysWhatMovedTheLips) {
  const auto movedBy = [&](const char* method) {
    const json report = speak({"--text", kNewTimeSentences[0], "--method", method});
    EXPECT_GE(report.at("moved_by").at("seconds").size(), report.at("duration_s").get<std::size_t>());
    for (const json& second : report.at("moved_by").at("seconds")) {
      double sum = 0;
      for (const char* part : {"capture", "prediction", "curves", "contact"}) sum += second.at(part).get<double>();
      EXPECT_TRUE(std::abs(sum - 1) < 2.01e-4 || sum == 0) << second;  // four shares of four digits
    }
    return report.at("moved_by").at("line");
  };
  const json guided = movedBy("guided");
  EXPECT_GT(guided.at("prediction").get<double>(), 0.5);
  EXPECT_GT(guided.at("capture").get<double>(), 0);
  for (const char* method : {"edge", "greedy"}) EXPECT_NEAR(movedBy(method).at("capture").get<double>(), 1, 1e-6);
  EXPECT_NEAR(movedBy("curves").at("curves").get<double>(), 1, 1e-6);
}

TEST_F(Speak, AFileIsReadAsText) {
  const fs::path text = scratch_.write("line.txt", "the time is now\n");
  EXPECT_EQ(speak({"--text-file", text.string()}).at("phones"), speak({"--text", "the time is now"}).at("phones"));
}

TEST_F(Speak, SingleOutputsAndMissingFoldersAreMade) {
  const fs::path csv = scratch_.path() / "a/b/motion.csv";
  const ProgramResult result = runProgram("synth", {"--text", "the time is now", "-o", csv.string()});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_TRUE(fs::exists(csv));
  const auto files = fs::directory_iterator(csv.parent_path());
  EXPECT_EQ(std::distance(begin(files), end(files)), 1);
}

TEST_F(Speak, WorksFromAnyDirectory) {
  const ProgramResult result = runProgram("synth", {"--text", "the time is now", "-o", "x.csv"}, scratch_.path());
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_TRUE(fs::exists(scratch_.path() / "x.csv"));
}

TEST_F(Speak, FindsItsCorpusAndFaceAfterInstall) {
  const fs::path prefix = scratch_.path() / "prefix";
  const ProgramResult installed =
      runProgram(MOUTHPIECE_CMAKE, {"--install", MOUTHPIECE_BUILD_DIR, "--prefix", prefix.string()});
  ASSERT_EQ(installed.exit_code, 0) << installed.err;
  for (const char* program : {"synth", "corpus", "retarget"})
    EXPECT_TRUE(fs::exists(prefix / "bin" / program)) << program;
  const ProgramResult result = runProgram(
      (prefix / "bin/synth").string(), {"--text", "the time is now", "-o", "x.glb", "-o", "x.html"}, scratch_.path());
  EXPECT_EQ(result.exit_code, 0) << result.err;
}

TEST_F(Speak, AMissingCorpusIsNamedWithTheCommandThatMakesIt) {
  const fs::path synth = scratch_.path() / "alone/bin/synth";
  fs::create_directories(synth.parent_path());
  fs::copy_file(fs::path(MOUTHPIECE_BIN_DIR) / "synth", synth);
  const ProgramResult result =
      runProgram(synth.string(), {"--text", "the time is now", "-o", "x.csv"}, scratch_.path());
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_NE(result.err.find("sample.corpus"), std::string::npos) << result.err;
  EXPECT_NE(result.err.find("make data"), std::string::npos) << result.err;
}

TEST_F(Speak, BatchMakesAFolderALineAndShardsPartTheWork) {
  const fs::path list =
      scratch_.write("lines.csv", "id,text\none,the time is now\ntwo,\"exactly one, am\"\nthree,almost ten past two\n");
  for (const char* shard : {"1/2", "2/2"}) {
    const ProgramResult result =
        runProgram("synth", {"batch", list.string(), "--out", out().string(), "--shard", shard, "--quiet"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
  }
  for (const char* id : {"one", "two", "three"}) EXPECT_TRUE(fs::exists(out() / id / "report.json")) << id;
}

TEST_F(Speak, RecordedLineIsAnimatedFromItsLabels) {
  speak({"--text", "the time is now"});
  const fs::path wav = scratch_.path() / "line.wav";
  const fs::path grid = scratch_.path() / "line.TextGrid";
  fs::copy_file(out() / "speech.wav", wav);
  fs::copy_file(out() / "phones.TextGrid", grid);
  const json report = speak({"--audio", wav.string(), "--phones", grid.string()});
  expectConsistentReport(report);
  EXPECT_EQ(report.at("text"), "the time is now");
}

}  // namespace
}  // namespace mouthpiece::test
