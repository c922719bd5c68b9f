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

const fs::path kShare = MOUTHPIECE_BUILD_SHARE_DIR;
const fs::path kGrid = fs::path(MOUTHPIECE_SOURCE_DIR) / "../shared/capture/grid_s1";

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
    if (!fs::exists(kShare / "sample.corpus")) GTEST_SKIP() << "no sample corpus in " << kShare << ": run `make data`";
  }

  json speak(const std::vector<std::string>& arguments) {
    std::vector<std::string> all = arguments;
    all.insert(all.end(), {"--out", out().string(), "--quiet"});
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

// Of the default method on GRID's takes, the one half by a corpus of the other
// (docs/theory/corpus_tools/evaluation.md).
constexpr double kGuidedRmsMm = 1.35, kGuidedLveMm2 = 4.15, kGuidedOpeningR = 0.909, kGuidedWidthR = 0.736,
                 kGuidedProtrusionR = 0.873;

TEST_F(Speak, AllFilesAgree) {
  const json report = speak({"--text", "the time is now"});
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
  const json prompts = json::parse(runProgram("corpus", {"info", (kShare / "sample.corpus").string(), "--json"}).out);
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

/// The real capture, less every sixth take (ten hold only a dozen closures); see `corpus evaluate` for the measures.
class RealCapture : public testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(kGrid / "takes")) GTEST_SKIP() << "no real capture in " << kGrid;
  }
  ScratchFolder scratch_;
};

/// Edges between words, against those that GRID publishes: every twelfth take, 250 edges. All takes have 14.25
/// and 51.75 ms (docs/theory/hearing/alignment.md), these 15.75 and 53.25; both clocks tick, so a worse median is worse
/// by 2.5 ms.
TEST_F(RealCapture, WordsAreHeardWhereTheyWerePublished) {
  constexpr double kMedianMs = 15.75 * 1.03, kMostMs = 53.25 * 1.03, kShareOverSixty = 0.04 * 1.03;
  std::istringstream table(readAll(kGrid / "alignment_check.csv"));
  std::string line;
  std::getline(table, line);
  std::vector<std::vector<std::string>> rows;
  while (std::getline(table, line)) {
    std::istringstream fields(line);
    std::vector<std::string>& row = rows.emplace_back();
    for (std::string field; std::getline(fields, field, ',');) row.push_back(field);
  }
  std::sort(rows.begin(), rows.end());
  std::vector<double> off_ms;
  for (std::size_t i = 3; i < rows.size(); i += 12) {
    const fs::path take = kGrid / "takes" / rows[i][0], found = scratch_.path() / "found.TextGrid";
    std::string words = readAll(take.string() + ".txt");
    words.erase(words.find_last_not_of("\r\n ") + 1);
    const ProgramResult result =
        runProgram("corpus", {"align", take.string() + ".wav", "--transcript", words, "--lexicon",
                              (kGrid / "lexicon.txt").string(), "--out", found.string(), "--quiet"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const SpeechLabels ours = readTextGrid(found), given = readTextGrid(take.string() + ".TextGrid");
    ASSERT_EQ(ours.words.size(), 6U) << rows[i][0];
    ASSERT_EQ(given.words.size(), 6U) << rows[i][0];
    constexpr std::size_t kFirstEdge = 4;  // columns: start1_ms, end1_ms, start2_ms, ...; given less published
    for (std::size_t edge = 1; edge < 11; ++edge) {
      const auto time_of = [&](const SpeechLabels& labels) {
        const TimeSpan span = labels.spanOf(labels.words[edge / 2].phones);
        return 1000 * (edge % 2 == 0 ? span.start : span.end);
      };
      off_ms.push_back(std::abs(time_of(ours) - time_of(given) + std::stod(rows[i][kFirstEdge + edge])));
    }
  }
  ASSERT_EQ(off_ms.size(), 250U);
  std::sort(off_ms.begin(), off_ms.end());
  EXPECT_LE(off_ms[off_ms.size() / 2], kMedianMs);
  EXPECT_LE(off_ms[off_ms.size() * 95 / 100], kMostMs);
  const auto over = std::count_if(off_ms.begin(), off_ms.end(), [](double off) { return off > 60; });
  EXPECT_LE(static_cast<double>(over), kShareOverSixty * 250);
}

TEST_F(RealCapture, HeldOutTakesComeNearTheirCapture) {
  fs::create_directories(scratch_.path() / "build");
  fs::create_directories(scratch_.path() / "test");
  std::vector<fs::path> takes;
  for (const auto& entry : fs::directory_iterator(kGrid / "takes")) {
    if (entry.path().extension() == ".c3d") takes.push_back(entry.path());
  }
  std::sort(takes.begin(), takes.end());
  ASSERT_GE(takes.size(), 290U);
  for (std::size_t i = 0; i < takes.size(); ++i) {
    const fs::path folder = scratch_.path() / (i % 6 == 3 ? "test" : "build");
    for (const char* ending : {".c3d", ".wav", ".txt", ".TextGrid"}) {
      fs::path from = takes[i];
      from.replace_extension(ending);
      fs::create_symlink(fs::absolute(from), folder / from.filename());
    }
  }
  const fs::path corpus = scratch_.path() / "s1.corpus";
  const ProgramResult built =
      runProgram("corpus", {"build", (scratch_.path() / "build").string(), "--out", corpus.string(), "--lexicon",
                            (kGrid / "lexicon.txt").string(), "--quiet"});
  ASSERT_EQ(built.exit_code, 0) << built.err;
  EXPECT_EQ(runProgram("corpus", {"check", corpus.string()}).exit_code, 0);
  const ProgramResult judged =
      runProgram("corpus", {"evaluate", corpus.string(), "--takes", (scratch_.path() / "test").string(), "--json"});
  ASSERT_EQ(judged.exit_code, 0) << judged.err;
  const json table = json::parse(judged.out);
  RecordProperty("evaluation", table.dump());
  const auto row = std::find_if(table.at("rows").begin(), table.at("rows").end(),
                                [](const json& each) { return each.at("method") == "greedy, any units"; });
  ASSERT_NE(row, table.at("rows").end()) << table.dump(1);
  // A numpy prototype of the greedy method reached 2.0 mm, 0.76 and 83 %. Which draw of takes is held out moves the
  // closures kept by some 10 %.
  EXPECT_LT(row->at("lip_rms_mm").get<double>(), 2.0);
  EXPECT_GT(row->at("opening_correlation").get<double>(), 0.80);
  EXPECT_GT(row->at("closure_recall").get<double>(), 0.70);
  // The default: 3 % round what a half of the takes came to by the other half; here more takes speak.
  const auto guided = std::find_if(table.at("rows").begin(), table.at("rows").end(),
                                   [](const json& each) { return each.at("method") == "guided (default)"; });
  ASSERT_NE(guided, table.at("rows").end()) << table.dump(1);
  const auto expectIn = [&](const char* measure, double low, double high) {
    EXPECT_GE(guided->at(measure).get<double>(), low) << measure;
    EXPECT_LE(guided->at(measure).get<double>(), high) << measure;
  };
  expectIn("lip_rms_mm", 1.0, kGuidedRmsMm * 1.03);
  expectIn("lve_mm2", 2.0, kGuidedLveMm2 * 1.03);
  expectIn("opening_correlation", kGuidedOpeningR * 0.97, 1);
  expectIn("width_correlation", kGuidedWidthR * 0.97, 1);
  expectIn("protrusion_correlation", kGuidedProtrusionR * 0.97, 1);
  expectIn("closure_recall", 0.97, 1);
  expectIn("variance_ratio", 0.82, 1.15);  // ten folds give 0.88, this draw 0.83
  expectIn("jerk_ratio", 0.82, 1.15);
  EXPECT_LE(guided->at("vowels_shut_share").get<double>(),
            guided->at("captured_vowels_shut_share").get<double>() * 1.03);  // 12.4 % for 12.1 in this draw

  const fs::path csv = scratch_.path() / "place.csv";
  const ProgramResult typed = runProgram("synth", {"--text", "place red at G nine again", "--corpus", corpus.string(),
                                                   "--lexicon", (kGrid / "lexicon.txt").string(), "-o", csv.string()});
  EXPECT_EQ(typed.exit_code, 0) << typed.err;
}

}  // namespace
}  // namespace mouthpiece::test
