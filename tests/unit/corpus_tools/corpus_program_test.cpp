// The real `corpus` program: what it prints, its exit codes, and bad input in one clear line.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>

#include "audio/audio_clip.h"
#include "motion/formats/motion_file.h"
#include "support/run_program.h"
#include "synthetic_takes.h"
#include "voices/voice.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;
using test::readAll;
using test::ScratchFolder;

test::ProgramResult corpus(const std::vector<std::string>& arguments) { return test::runProgram("corpus", arguments); }

bool holds(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

/// One line on stderr, exit 1, nothing on stdout.
void expectOneLine(const test::ProgramResult& result, const std::string& part) {
  EXPECT_EQ(result.exit_code, 1) << result.err;
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  EXPECT_TRUE(result.err.starts_with("corpus: ")) << result.err;
  EXPECT_TRUE(holds(result.err, part)) << result.err;
  EXPECT_EQ(result.out, "");
}

/// Two takes "one" and "two" in a folder with a blank in its name.
struct Takes {
  ScratchFolder scratch;
  fs::path folder = scratch.path() / "my takes";
  fs::path out = scratch.path() / "mine.corpus";

  Takes() {
    fs::create_directories(folder);
    SyntheticTake one, two;
    two.name = "two";
    two.seed = 2;
    two.phones = {"sil", "M", "AA", "N", "sil"};
    two.words = {"mahn"};
    one.write(folder);
    two.write(folder);
  }
  [[nodiscard]] test::ProgramResult build(std::vector<std::string> more = {}) const {
    std::vector<std::string> arguments = {"build", folder.string(), "--out", out.string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return corpus(arguments);
  }
  /// Replaces a file of take "one", then builds strictly: the complaint must name `part`.
  void expectRefused(const std::string& ending, const std::string& bytes, const std::string& part) const {
    EXPECT_TRUE(fs::exists(scratch.write("my takes/one" + ending, bytes)));
    const test::ProgramResult lenient = build();
    EXPECT_EQ(lenient.exit_code, 0) << lenient.err;
    EXPECT_TRUE(holds(lenient.err, "corpus: left out one: ") && holds(lenient.err, part)) << lenient.err;
    const std::string kept = readAll(out);
    expectOneLine(build({"--strict"}), part);
    EXPECT_EQ(readAll(out), kept) << "a failed build must leave the old corpus";
  }
};

std::string withU16(std::string bytes, std::size_t offset, std::uint16_t value) {
  bytes[offset] = static_cast<char>(value & 0xFFU);
  bytes[offset + 1] = static_cast<char>(value >> 8U);
  return bytes;
}

TEST(CorpusProgram, HelpIsComplete) {
  const test::ProgramResult help = corpus({"--help"});
  EXPECT_EQ(help.exit_code, 0);
  for (const char* name :
       {"build", "info", "check", "convert", "clean", "evaluate", "sample", "prompts", "align", "report"}) {
    EXPECT_TRUE(holds(help.out, name)) << name;
    const test::ProgramResult own = corpus({name, "--help"});
    EXPECT_EQ(own.exit_code, 0);
    EXPECT_TRUE(holds(own.out, "Example:\n  corpus " + std::string(name))) << own.out;
    EXPECT_TRUE(holds(own.out, "--quiet"));
  }
}

TEST(CorpusProgram, WrongUsageIsTwo) {
  EXPECT_EQ(corpus({}).exit_code, 2);
  EXPECT_EQ(corpus({"sing"}).exit_code, 2);
  EXPECT_EQ(corpus({"build", "folder"}).exit_code, 2);
  EXPECT_EQ(corpus({"info"}).exit_code, 2);
  EXPECT_EQ(corpus({"evaluate", "x.corpus"}).exit_code, 2);
  EXPECT_EQ(corpus({"evaluate", "x.corpus", "--takes", "a", "--hold-out", "0.1"}).exit_code, 2);
  EXPECT_EQ(corpus({"build", "folder", "--out", "x.corpus", "--jobs", "none"}).exit_code, 2);
}

/// Of the sample corpus' sentences about the clock, sound alone: four takes held out say 29 words, of 95 phones. When
/// this was written one word and two phones were heard wrongly.
TEST(CorpusProgram, TellsHowWellTakesAreHeard) {
  constexpr double kMostPhones = 6, kMostWords = 11;  // per cent
  const std::string row = "heard (nothing known)";
  const test::ProgramResult evaluated = corpus({"evaluate", MOUTHPIECE_BUILD_SHARE_DIR "/clock.corpus", "--hear",
                                                "--hold-out", "0.06", "--rows", row, "--quiet"});
  ASSERT_EQ(evaluated.exit_code, 0) << evaluated.err;
  const std::size_t table = evaluated.out.find("\nheard      ");
  ASSERT_NE(table, std::string::npos) << evaluated.out;
  std::istringstream head(evaluated.out.substr(table));
  std::string title, phones_title, visemes_title, words_title;
  head >> title >> phones_title >> visemes_title >> words_title;
  EXPECT_EQ(phones_title + " " + visemes_title + " " + words_title, "phones visemes words");
  const std::size_t at = evaluated.out.find(row, table);
  ASSERT_NE(at, std::string::npos) << evaluated.out;
  std::istringstream fields(evaluated.out.substr(at + row.size()));
  double phones = -1, visemes = -1, words = -1, unheard = -1;
  char per_cent = 0;
  fields >> phones >> per_cent >> visemes >> per_cent >> words >> per_cent >> unheard;
  ASSERT_FALSE(fields.fail()) << evaluated.out;
  EXPECT_LT(phones, kMostPhones);
  EXPECT_LE(visemes, phones);
  EXPECT_LT(words, kMostWords);
  EXPECT_EQ(unheard, 0);
}

TEST(CorpusProgram, BuildsInspectsChecksAndEvaluates) {
  const Takes takes;
  const test::ProgramResult built = takes.build();
  ASSERT_EQ(built.exit_code, 0) << built.err;
  EXPECT_TRUE(holds(built.out, "2 takes used, 0 left out"));
  EXPECT_EQ(built.err, "");
  const test::ProgramResult info = corpus({"info", takes.out.string(), "--json"});
  ASSERT_EQ(info.exit_code, 0) << info.err;
  const nlohmann::json facts = nlohmann::json::parse(info.out);
  EXPECT_EQ(facts["takes"], 2);
  EXPECT_EQ(facts["different_phone_pairs"], 7);
  EXPECT_EQ(facts["build_log"]["take_reports"][0]["head_by_jig"], 110);
  EXPECT_TRUE(holds(corpus({"info", takes.out.string()}).out, "66 of layout face66"));
  const test::ProgramResult checked = corpus({"check", takes.out.string()});
  EXPECT_EQ(checked.exit_code, 0) << checked.out << checked.err;
  const test::ProgramResult evaluated =
      corpus({"evaluate", takes.out.string(), "--takes", takes.folder.string(), "--json"});
  ASSERT_EQ(evaluated.exit_code, 0) << evaluated.err;
  const nlohmann::json evaluation = nlohmann::json::parse(evaluated.out);
  EXPECT_EQ(evaluation["takes"].size(), 2U);
  EXPECT_LT(evaluation["rows"][0]["lip_rms_mm"].get<double>(), 0.01);  // the takes are in the corpus
  EXPECT_EQ(takes.build({"--quiet"}).out, "");
}

TEST(CorpusProgram, ConvertsAndCleans) {
  const Takes takes;
  const fs::path csv = takes.scratch.path() / "deep" / "er" / "one.csv", trc = takes.scratch.path() / "one.trc",
                 back = takes.scratch.path() / "back.c3d", still = takes.scratch.path() / "still.csv";
  EXPECT_EQ(corpus({"convert", (takes.folder / "one.c3d").string(), csv.string()}).exit_code, 0);
  EXPECT_EQ(corpus({"convert", csv.string(), trc.string()}).exit_code, 0);
  EXPECT_EQ(corpus({"convert", trc.string(), back.string()}).exit_code, 0);
  const test::ProgramResult cleaned = corpus({"clean", (takes.folder / "one.c3d").string(), still.string()});
  EXPECT_EQ(cleaned.exit_code, 0) << cleaned.err;
  EXPECT_TRUE(holds(cleaned.err, "head by jig 110"));
  EXPECT_TRUE(fs::exists(still));
  expectOneLine(corpus({"convert", csv.string(), (takes.scratch.path() / "x.bvh").string()}), "x.bvh");
}

/// Poses need the middles of the lips.
TEST(CorpusProgram, ABuildWithoutVisemePosesSaysSo) {
  const Takes takes;
  EXPECT_FALSE(holds(takes.build().err, "no viseme poses"));
  EXPECT_TRUE(holds(corpus({"info", takes.out.string()}).out, "viseme poses"));
  auto layout = nlohmann::json::parse(readAll(fs::path(MOUTHPIECE_SOURCE_DIR) / "sample_data/layouts/face66.json"));
  nlohmann::json kept = nlohmann::json::array();
  for (const nlohmann::json& marker : layout["markers"]) {
    if (marker["name"] != "LIP_UP_MID" && marker["name"] != "LIP_LO_MID") kept.push_back(marker);
  }
  ASSERT_LT(kept.size(), layout["markers"].size());
  layout["markers"] = kept;
  const fs::path lipless = takes.scratch.write("lipless.json", layout.dump());
  const test::ProgramResult built = takes.build({"--layout", lipless.string()});
  ASSERT_EQ(built.exit_code, 0) << built.err;
  EXPECT_TRUE(holds(built.err, "no viseme poses: songs, --style")) << built.err;
  EXPECT_FALSE(holds(corpus({"info", takes.out.string()}).out, "viseme poses"));
}

TEST(CorpusProgram, EveryCleaningStepCanBeSwitchedOff) {
  const Takes takes;
  const std::string in = (takes.folder / "one.c3d").string(), out = (takes.scratch.path() / "out.csv").string();
  const auto cleaned = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"clean", in, out});
    const test::ProgramResult result = corpus(more);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.err;
  };
  EXPECT_TRUE(holds(cleaned({"--no-jig"}), "head by jig 0, by skin 110"));
  EXPECT_TRUE(holds(cleaned({"--no-smoothing"}), "smoothed by 0.000 mm"));
  const std::string nothing = cleaned({"--no-swaps", "--no-spikes", "--no-head", "--no-gaps", "--no-smoothing"});
  EXPECT_TRUE(holds(nothing, "0 swaps and 0 spikes repaired; head by jig 0, by skin 0, bridged 0; 0 samples filled"));
  // Nothing done: the motion as it was, in the layout's order.
  const MotionClip untouched = readMotion(out), raw = readMotion(in);
  ASSERT_EQ(untouched.frameCount(), raw.frameCount());
  ASSERT_EQ(untouched.markerCount(), defaultLayout().markers.size());
  for (std::size_t marker = 0; marker < untouched.markerCount(); ++marker) {
    const auto found = raw.findMarker(untouched.marker_names[marker]);
    ASSERT_TRUE(found) << untouched.marker_names[marker];
    const auto column = static_cast<Eigen::Index>(3 * marker), from = static_cast<Eigen::Index>(3 * found->value);
    constexpr double kWrittenTo = 1e-3;  // mm: CSV's and floats' rounding
    EXPECT_LT(
        (untouched.positions_mm.middleCols<3>(column) - raw.positions_mm.middleCols<3>(from)).cwiseAbs().maxCoeff(),
        kWrittenTo)
        << untouched.marker_names[marker];
  }
  cleaned({});
  EXPECT_GT((readMotion(out).positions_mm - untouched.positions_mm).cwiseAbs().maxCoeff(), 1.0) << "the head moves";
}

TEST(CorpusProgram, RenamesMarkersThatTheFilesCallOtherwise) {
  const Takes takes;
  const std::string in = (takes.folder / "one.c3d").string(), out = (takes.scratch.path() / "mine.csv").string();
  EXPECT_EQ(corpus({"convert", in, out, "--map", "LIP_UP_MID=upper", "--map", "LIP_LO_MID=lower"}).exit_code, 0);
  EXPECT_TRUE(holds(readAll(out), "upper.x") && !holds(readAll(out), "LIP_UP_MID"));
  expectOneLine(corpus({"convert", in, out, "--map", "LIP_UP_MID"}), "expected OLD=NEW");
  const std::string again = (takes.scratch.path() / "again.csv").string();
  EXPECT_EQ(corpus({"convert", out, again, "--map", "upper=LIP_UP_MID", "--map", "lower=LIP_LO_MID"}).exit_code, 0);
  EXPECT_TRUE(holds(readAll(again), "LIP_UP_MID.x"));
}

TEST(CorpusProgram, ConvertsLabels) {
  const Takes takes;
  const fs::path lab = takes.scratch.path() / "one.lab", ctm = takes.scratch.path() / "one.ctm";
  EXPECT_EQ(corpus({"convert", (takes.folder / "one.TextGrid").string(), lab.string()}).exit_code, 0);
  EXPECT_TRUE(readAll(lab).starts_with("0 4000000 sil\n4000000 5000000 B\n")) << readAll(lab);
  EXPECT_EQ(corpus({"convert", lab.string(), ctm.string()}).exit_code, 0);
  EXPECT_TRUE(readAll(ctm).starts_with("one 1 0.000000 0.400000 sil\n")) << readAll(ctm);
}

/// A page that has none of these needs nothing but itself, and its browser lets it have nothing else.
void expectNothingFromElsewhere(const std::string& html) {
  EXPECT_TRUE(holds(html, "Content-Security-Policy\" content=\"default-src 'none'"));
  for (const char* outside :
       {"src=", "href=\"http", "href='http", "url(", "@import", "fetch(", "XMLHttpRequest", "import(", "WebSocket"})
    EXPECT_FALSE(holds(html, outside)) << outside << ": nothing comes from elsewhere";
}

TEST(CorpusProgram, ReportsOnOnePageThatNeedsNothingElse) {
  const Takes takes;
  ASSERT_EQ(takes.build().exit_code, 0);
  const fs::path page = takes.scratch.path() / "report.html";
  const test::ProgramResult result = corpus({"report", takes.out.string(), "--out", page.string(), "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const nlohmann::json facts = nlohmann::json::parse(result.out);
  EXPECT_EQ(facts["takes"].size(), 2U);
  EXPECT_EQ(facts["words"].size(), 2U);
  EXPECT_EQ(facts["markers"].size(), 66U);
  const std::string html = readAll(page);
  EXPECT_TRUE(holds(html, "LIP_UP_MID"));
  expectNothingFromElsewhere(html);
  EXPECT_FALSE(holds(html, "/*REPORT*/null"));
}

TEST(CorpusProgram, EvaluatesOnOnePageThatNeedsNothingElse) {
  const Takes takes;
  ASSERT_EQ(takes.build().exit_code, 0);
  const fs::path page = takes.scratch.path() / "evaluation.html";
  const test::ProgramResult result =
      corpus({"evaluate", takes.out.string(), "--hold-out", "0.5", "--html", page.string(), "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(nlohmann::json::parse(result.out)["rows"].size(), 7U);
  const std::string html = readAll(page);
  EXPECT_TRUE(holds(html, "protrusion_mm"));
  expectNothingFromElsewhere(html);
  for (const char* place : {"/*REPORT*/null", "/*STYLE*/", "/*TOOLS*/"}) EXPECT_FALSE(holds(html, place));
  expectOneLine(corpus({"evaluate", takes.out.string(), "--hold-out", "0.5", "--truth", "nowhere"}), "nowhere");
}

TEST(CorpusProgram, ChoosesPromptsFromAText) {
  const ScratchFolder scratch;
  const fs::path text = scratch.write("text.txt", "the cat sat\nthe cat sat\n# not this\nbright vixens jump\n");
  const fs::path curve = scratch.path() / "curve.csv";
  const test::ProgramResult result =
      corpus({"prompts", "--text", text.string(), "--count", "2", "--curve", curve.string(), "--quiet"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(std::count(result.out.begin(), result.out.end(), '\n'), 2);
  EXPECT_TRUE(holds(result.out, "bright vixens jump\n") && holds(result.out, "the cat sat\n"));
  EXPECT_TRUE(readAll(curve).ends_with(",1.0000\n")) << readAll(curve);
}

TEST(CorpusProgram, PrintsNoEscapeCodesOfAText) {
  const ScratchFolder scratch;
  const fs::path text = scratch.write("text.txt", "the \x1B[31mcat\xC2\x9B sat\n");
  const test::ProgramResult result = corpus({"prompts", "--text", text.string(), "--count", "1", "--quiet"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.out, "the \\x1B[31mcat\\xC2\\x9B sat\n");
}

TEST(CorpusProgram, AlignsATakeWithItsWords) {
  const fs::path takes = fs::path(MOUTHPIECE_SOURCE_DIR) / "../shared/capture/grid_s1/takes";
  if (!fs::exists(takes)) GTEST_SKIP() << "no real capture in " << takes;
  const ScratchFolder scratch;
  const fs::path grid = scratch.path() / "a.TextGrid";
  const std::string wav = (takes / "bbaf2n.wav").string();
  const test::ProgramResult result =
      corpus({"align", wav, "--transcript", "bin blue at F two now", "--out", grid.string(), "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const nlohmann::json words = nlohmann::json::parse(result.out)["words"];
  ASSERT_EQ(words.size(), 6U);
  EXPECT_NEAR(words[1]["start_s"].get<double>(), 1.188, 0.03);
  EXPECT_TRUE(holds(readAll(grid), "\"blue\""));
  expectOneLine(corpus({"align", wav, "--transcript", "!?", "--out", grid.string()}), "nothing to say");
  EXPECT_EQ(corpus({"align", wav, "--out", grid.string()}).exit_code, 2);
}

TEST(CorpusProgram, HearsTheLanguageThatIsAskedFor) {
  const ScratchFolder scratch;
  const std::string sound = (scratch.path() / "a.wav").string(), grid = (scratch.path() / "a.TextGrid").string();
  writeWav(sound, makeVoice("espeak:de")->speak("schöne Bücher").audio);
  const test::ProgramResult aligned =
      corpus({"align", sound, "--language", "de", "--transcript", "schöne Bücher", "--out", grid});
  ASSERT_EQ(aligned.exit_code, 0) << aligned.err;
  EXPECT_TRUE(holds(readAll(grid), "\"øː\""));
  const fs::path text = scratch.path() / "text.txt";
  std::ofstream(text) << "schöne Bücher\nschöne Bücher\ngute Äpfel\n";
  const std::string pairs = (scratch.path() / "pairs.csv").string();
  const auto pairsIn = [&](const std::string& language) {
    const test::ProgramResult chosen = corpus(
        {"prompts", "--text", text.string(), "--running", text.string(), "--pairs", pairs, "--language", language});
    EXPECT_EQ(chosen.exit_code, 0) << chosen.err;
    return readAll(pairs);
  };
  EXPECT_NE(pairsIn("de"), pairsIn("en"));
  expectOneLine(corpus({"studio", scratch.path().string(), "--language", "de"}),
                "--language: German has no sentences here; expected some by --text or --grammar");
}

TEST(CorpusProgram, AnEmptyFolderIsNamed) {
  const ScratchFolder scratch;
  const std::string out = (scratch.path() / "x.corpus").string();
  expectOneLine(corpus({"build", scratch.path().string(), "--out", out}),
                "holds no take; expected files like NAME.c3d");
  expectOneLine(corpus({"build", (scratch.path() / "none").string(), "--out", out}), "no such folder");
  EXPECT_FALSE(fs::exists(out));
}

TEST(CorpusProgram, ACutOffC3dIsNamed) {
  const Takes takes;
  const std::string whole = readAll(takes.folder / "one.c3d");
  takes.expectRefused(".c3d", whole.substr(0, whole.size() / 2), "one.c3d:");
}

TEST(CorpusProgram, AC3dWithAbsurdCountsIsNamed) {
  const Takes takes;
  const std::string whole = readAll(takes.folder / "one.c3d");
  // The header's words 2 (points) and 5 (last frame).
  takes.expectRefused(".c3d", withU16(withU16(whole, 2, 65535), 8, 65535), "one.c3d:");
}

TEST(CorpusProgram, AC3dWithoutAKnownMarkerIsNamed) {
  const Takes takes;
  const fs::path csv = takes.scratch.path() / "one.csv";
  ASSERT_EQ(corpus({"convert", (takes.folder / "one.c3d").string(), csv.string()}).exit_code, 0);
  std::string text = readAll(csv);
  const std::string header = text.substr(0, text.find('\n'));
  std::string renamed;
  for (const char c : header) renamed += c == '_' ? std::string("x") : std::string(1, c);
  ASSERT_NE(renamed, header);
  renamed.replace(renamed.find("timexs"), 6, "time_s");
  const fs::path renamed_csv = takes.scratch.write("renamed.csv", renamed + text.substr(header.size()));
  const fs::path c3d = takes.scratch.path() / "renamed.c3d";
  ASSERT_EQ(corpus({"convert", renamed_csv.string(), c3d.string()}).exit_code, 0);
  takes.expectRefused(".c3d", readAll(c3d), "has no known marker: found 73");
}

std::string textGrid(const std::string& intervals, int count) {
  return "File type = \"ooTextFile\"\nObject class = \"TextGrid\"\n\nxmin = 0\nxmax = 1.1\ntiers? <exists>\nsize = "
         "1\nitem []:\n"
         "    item [1]:\n        class = \"IntervalTier\"\n        name = \"phones\"\n        xmin = 0\n        xmax = "
         "1.1\n"
         "        intervals: size = " +
         std::to_string(count) + "\n" + intervals;
}

std::string interval(int number, const std::string& from, const std::string& to, const std::string& text) {
  return "        intervals [" + std::to_string(number) + "]:\n            xmin = " + from +
         "\n            xmax = " + to + "\n            text = \"" + text + "\"\n";
}

TEST(CorpusProgram, ATextGridWithOverlapsIsNamed) {
  const Takes takes;
  takes.expectRefused(
      ".TextGrid",
      textGrid(interval(1, "0", "0.5", "sil") + interval(2, "0.3", "0.7", "AA") + interval(3, "0.7", "1.1", "sil"), 3),
      "one.TextGrid:");
}

TEST(CorpusProgram, ATextGridThatRunsBackwardsIsNamed) {
  const Takes takes;
  takes.expectRefused(
      ".TextGrid",
      textGrid(interval(1, "0", "0.5", "sil") + interval(2, "0.7", "0.5", "AA") + interval(3, "0.7", "1.1", "sil"), 3),
      "one.TextGrid:");
}

TEST(CorpusProgram, AWavThatLiesAboutItsLengthIsNamed) {
  const Takes takes;
  const std::string whole = readAll(takes.folder / "one.wav");
  takes.expectRefused(".wav", whole.substr(0, whole.size() / 2), "one.wav");
}

TEST(CorpusProgram, AnOutputThatCannotBeWrittenIsNamed) {
  const Takes takes;
  expectOneLine(corpus({"build", takes.folder.string(), "--out", "/proc/nowhere/x.corpus"}), "/proc/nowhere");
  expectOneLine(corpus({"build", takes.folder.string(), "--out", takes.folder.string()}), "my takes");
  if (::geteuid() == 0) return;  // root writes everywhere; /proc above refuses root too
  fs::permissions(takes.scratch.path(), fs::perms::owner_read | fs::perms::owner_exec);
  const test::ProgramResult refused = takes.build();
  fs::permissions(takes.scratch.path(), fs::perms::owner_all);
  expectOneLine(refused, "mine.corpus");
}

TEST(CorpusProgram, WhatIsNoCorpusIsNamed) {
  const Takes takes;
  for (const char* command : {"info", "check"}) {
    expectOneLine(corpus({command, (takes.folder / "one.wav").string()}), "one.wav");
    expectOneLine(corpus({command, (takes.folder / "none").string()}), "none");
  }
  expectOneLine(corpus({"evaluate", (takes.folder / "one.wav").string(), "--hold-out", "0.5"}), "one.wav");
  ASSERT_EQ(takes.build().exit_code, 0);
  expectOneLine(corpus({"evaluate", takes.out.string(), "--hold-out", "7"}), "expected a share between 0 and 1");
}

TEST(CorpusProgram, ALayoutThatIsNoneIsNamed) {
  const Takes takes;
  const fs::path layout = takes.scratch.write("layout.json", "{\"name\": 7}");
  expectOneLine(takes.build({"--layout", layout.string()}), "layout.json");
}

}  // namespace
}  // namespace mouthpiece
