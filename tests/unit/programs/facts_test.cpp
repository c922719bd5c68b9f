// What programs print: --json is JSON and nothing else, --quiet is quiet, and both write the same files; shards part a
// batch without gap or overlap.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "support/run_program.h"
#include "support/tiny_corpus.h"

namespace mouthpiece::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using Arguments = std::vector<std::string>;

const fs::path kShare = MOUTHPIECE_BUILD_SHARE_DIR;

ProgramResult runWell(const std::string& program, const Arguments& arguments) {
  ProgramResult result = runProgram(program, arguments);
  EXPECT_EQ(result.exit_code, 0) << program << " " << arguments.front() << ": " << result.err;
  return result;
}

Arguments with(Arguments arguments, const Arguments& more) {
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

/// Every file under `folder` by its name, read.
std::map<std::string, std::string> filesIn(const fs::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) files[fs::relative(entry.path(), folder).string()] = readAll(entry.path());
  }
  return files;
}

class TinyCorpus : public ::testing::Test {
 protected:
  void SetUp() override { writeCorpus(corpus(), mouthpiece::samples::tinyCorpus()); }
  [[nodiscard]] fs::path corpus() const { return folder_.path() / "tiny.corpus"; }
  ScratchFolder folder_;
};

TEST_F(TinyCorpus, InfoTellsTheSameInBothForms) {
  const json facts = json::parse(runWell("corpus", {"info", corpus().string(), "--json"}).out);
  EXPECT_TRUE(facts.is_object());
  EXPECT_GE(facts.size(), 5U) << facts.dump();
  std::istringstream text(runWell("corpus", {"info", corpus().string()}).out);
  std::map<std::string, std::size_t> told;
  std::string name;
  std::size_t number = 0;
  for (std::string line; std::getline(text, line);) {
    if (std::istringstream(line) >> name >> number) told[name] = number;
  }
  const Corpus made = mouthpiece::samples::tinyCorpus();
  std::size_t phones = 0, words = 0;
  for (const CorpusTake& take : made.takes) {
    phones += take.labels.phones.size();
    words += take.labels.words.size();
  }
  EXPECT_EQ(told["takes"], made.takes.size());
  EXPECT_EQ(told["phones"], phones);
  EXPECT_EQ(told["words"], words);
  EXPECT_EQ(told["markers"], made.layout.markerNames().size());
}

TEST_F(TinyCorpus, CheckPassesAndFindsFlippedBits) {
  EXPECT_EQ(runProgram("corpus", {"check", corpus().string()}).exit_code, 0);
  const std::string whole = readAll(corpus());
  std::size_t found = 0;
  constexpr std::size_t kTrials = 12;
  for (std::size_t trial = 0; trial < kTrials; ++trial) {
    std::string bytes = whole;
    char& flipped = bytes[(2 * trial + 1) * bytes.size() / (2 * kTrials)];
    flipped = static_cast<char>(flipped ^ 0x10);
    const ProgramResult result = runProgram("corpus", {"check", folder_.write("flipped.corpus", bytes).string()});
    EXPECT_TRUE(result.exit_code == 0 || result.exit_code == 1) << result.exit_code << result.err;
    EXPECT_EQ(result.err.find("internal error"), std::string::npos) << result.err;
    found += result.exit_code == 1 ? 1U : 0U;
  }
  // What lies between the rows of a database belongs to nobody.
  EXPECT_GE(found, kTrials / 2);
}

TEST_F(TinyCorpus, TheReportIsWrittenAlikeWhateverIsPrinted) {
  const auto pageWith = [&](const Arguments& options) {
    const fs::path page = folder_.path() / "report.html";
    fs::remove(page);
    const ProgramResult result =
        runWell("corpus", with({"report", corpus().string(), "--out", page.string()}, options));
    if (options == Arguments{"--json"}) {
      EXPECT_TRUE(json::parse(result.out).is_object());
    } else if (options == Arguments{"--quiet"}) {
      EXPECT_EQ(result.out + result.err, "");
    }
    return readAll(page);
  };
  const std::string page = pageWith({});
  EXPECT_NE(page.find("</html>"), std::string::npos);
  EXPECT_TRUE(pageWith({"--json"}) == page);
  EXPECT_TRUE(pageWith({"--quiet"}) == page);
}

TEST_F(TinyCorpus, ReadingLeavesTheFileAlone) {
  const std::string before = readAll(corpus());
  runWell("corpus", {"info", corpus().string()});
  runWell("corpus", {"check", corpus().string()});
  runWell("corpus", {"report", corpus().string(), "--out", (folder_.path() / "r.html").string()});
  EXPECT_TRUE(readAll(corpus()) == before);
  EXPECT_EQ(filesIn(folder_.path()).size(), 2U) << "a journal or the like was left";
}

TEST(Facts, PromptsAreDistinctAndAsManyAsAsked) {
  for (const std::size_t count : {1U, 5U, 20U}) {
    const ProgramResult result = runWell("corpus", {"prompts", "--count", std::to_string(count), "--quiet"});
    EXPECT_TRUE(result.err.empty()) << result.err;
    std::istringstream lines(result.out);
    std::set<std::string> sentences;
    std::size_t printed = 0;
    for (std::string line; std::getline(lines, line); ++printed) sentences.insert(line);
    EXPECT_EQ(printed, count);
    EXPECT_EQ(sentences.size(), count);
  }
}

/// Needs the corpus and face that `make data` makes.
class SampleData : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(kShare / "sample.corpus") || !fs::exists(kShare / "default.face"))
      GTEST_SKIP() << "no sample corpus or face in " << kShare << ": run `make data`";
  }
  [[nodiscard]] std::string path(const std::string& name) const { return (folder_.path() / name).string(); }
  ScratchFolder folder_;
};

TEST_F(SampleData, ACheckedFaceIsJsonOrTextOrSilent) {
  const std::string face = (kShare / "default.face").string();
  const json facts = json::parse(runWell("retarget", {"check", face, "--json"}).out);
  EXPECT_EQ(facts["name"], "default");
  EXPECT_TRUE(facts["faults"].empty());
  EXPECT_NE(runWell("retarget", {"check", face}).out.find(facts["vertices"].dump() + " vertices"), std::string::npos);
  const ProgramResult quiet = runWell("retarget", {"check", face, "--quiet"});
  EXPECT_EQ(quiet.out + quiet.err, "");
}

TEST_F(SampleData, ALineIsJsonOrTextOrSilent) {
  const Arguments line{"--text", "the time is now", "-o"};
  const json report = json::parse(runWell("synth", with(line, {path("a.csv"), "--json"})).out);
  EXPECT_EQ(report["text"], "the time is now");
  EXPECT_EQ(runWell("synth", with(line, {path("b.csv"), "--quiet"})).out, "");
  EXPECT_NE(runWell("synth", with(line, {path("c.csv")})).out.find(path("c.csv")), std::string::npos);
  EXPECT_TRUE(readAll(path("a.csv")) == readAll(path("b.csv")) && readAll(path("a.csv")) == readAll(path("c.csv")));
}

TEST_F(SampleData, AppliedMotionComesInEveryFormat) {
  const std::string face = (kShare / "default.face").string();
  runWell("synth", {"--text", "now", "-o", path("m.c3d"), "-o", path("m.TextGrid"), "--fps", "24", "--quiet"});
  for (const std::string name : {"a.glb", "a.pc2", "a.mdd"}) {
    const Arguments apply{"apply", "--face", face, "--motion", path("m.c3d"), "--phones", path("m.TextGrid"), "--out"};
    const ProgramResult told = runWell("retarget", with(apply, {path(name)}));
    EXPECT_NE(told.out.find("frames on 'default'"), std::string::npos) << told.out;
    const std::string bytes = readAll(path(name));
    EXPECT_EQ(runWell("retarget", with(apply, {path(name), "--quiet"})).out, "");
    EXPECT_TRUE(readAll(path(name)) == bytes) << name << " is not the same a second time";
  }
  // The weights and shapes that synth gives a head without shapes of its own.
  for (const std::string name : {"a.arkit.csv", "a.metahuman.csv", "a.visemes.glb", "a.arkit.glb"})
    runWell("retarget", {"apply", "--face", face, "--motion", path("m.c3d"), "--phones", path("m.TextGrid"), "--out",
                         path(name), "--quiet"});
  EXPECT_TRUE(readAll(path("a.arkit.csv")).starts_with("Timecode,BlendShapeCount,EyeBlinkLeft,"));
  EXPECT_TRUE(readAll(path("a.metahuman.csv")).starts_with("time_s,CTRL_expressions_eyeBlinkL,"));
  // Live Link Face's CSV by a plain name is that of the face's own shapes.
  const ProgramResult refused =
      runProgram("retarget", {"apply", "--face", face, "--motion", path("m.c3d"), "--out", path("a.csv")});
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_FALSE(fs::exists(path("a.csv")));
}

/// Lips round in W and UW as they do in the line that the motion is of, whether its actor is named or not.
TEST_F(SampleData, AppliedMotionRoundsTheLipsAsTheLineDoes) {
  const std::string face = (kShare / "default.face").string(), corpus = (kShare / "clock.corpus").string();
  runWell("synth", {"--corpus", corpus, "--text", "who would wow you", "-o", path("m.c3d"), "-o", path("m.TextGrid"),
                    "-o", path("m.pc2"), "--fps", "24", "--quiet"});
  const Arguments apply{"apply", "--face", face, "--motion", path("m.c3d"), "--quiet", "--phones", path("m.TextGrid")};
  runWell("retarget", with(apply, {"-o", path("fitted.pc2")}));
  runWell("retarget", with(apply, {"-o", path("named.pc2"), "--corpus", corpus}));
  const auto places = [&](const std::string& name) {
    constexpr std::size_t kHeader = 32;
    const std::string bytes = readAll(path(name)).substr(kHeader);
    std::vector<float> numbers(bytes.size() / sizeof(float));
    std::memcpy(numbers.data(), bytes.data(), numbers.size() * sizeof(float));
    return numbers;
  };
  const std::vector<float> spoken = places("m.pc2");
  for (const char* name : {"fitted.pc2", "named.pc2"}) {
    const std::vector<float> applied = places(name);
    ASSERT_EQ(applied.size(), spoken.size());
    float most = 0;
    for (std::size_t i = 0; i < spoken.size(); ++i) most = std::max(most, std::abs(applied[i] - spoken[i]));
    EXPECT_LT(most, 0.01F) << name << ", mm: C3D keeps a marker to a few thousandths";
  }
}

TEST_F(SampleData, TheSharedFolderCanBeNamed) {
  const std::string synth = (fs::path(MOUTHPIECE_BIN_DIR) / "synth").string();
  fs::create_directories(folder_.path() / "share");
  fs::copy_file(kShare / "sample.corpus", folder_.path() / "share/sample.corpus");
  const auto speakFrom = [&](const std::string& share) {
    return runProgram("/usr/bin/env",
                      {"MOUTHPIECE_SHARE=" + share, synth, "--text", "now", "-o", path("a.csv"), "--json"});
  };
  for (const char* share : {"share", "nowhere"}) {  // a folder without the file: as if none were named
    const ProgramResult result = speakFrom(path(share));
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(json::parse(result.out)["corpus"], "sample");
  }
}

TEST_F(SampleData, ShardsPartABatch) {
  const std::vector<std::string> ids{"a", "b", "c", "d", "e"};
  std::string list = "id,text\n";
  for (const std::string& id : ids) list += id + ",the time is now\n";
  const std::string lines = folder_.write("lines.csv", list).string();
  std::map<std::string, std::string> together;
  for (const std::size_t count : {2U, 7U}) {
    std::vector<std::string> made;
    for (std::size_t index = 1; index <= count; ++index) {
      const fs::path out = folder_.path() / ("shard" + std::to_string(count) + "_" + std::to_string(index));
      runWell("synth", {"batch", lines, "--out", out.string(), "--fps", "24", "--quiet", "--voice", "flite:slt",
                        "--shard", std::to_string(index) + "/" + std::to_string(count)});
      if (!fs::exists(out)) continue;
      for (const auto& entry : fs::directory_iterator(out)) {
        if (!entry.is_directory()) continue;  // the shards' manifests
        made.push_back(entry.path().filename().string());
        const std::string motion = readAll(entry.path() / "motion.csv");
        EXPECT_FALSE(motion.empty());
        EXPECT_TRUE(together.try_emplace(made.back(), motion).first->second == motion) << "depends on its shard";
      }
    }
    std::sort(made.begin(), made.end());
    EXPECT_EQ(made, ids) << "each line once, " << count << " shards";
  }
}

TEST_F(SampleData, ABatchGoesOnAfterABadLine) {
  const std::string lines =
      folder_.write("lines.csv", "id,text\ngood,the time is now\nbad,\"...\"\nalso_good,now\n").string();
  const ProgramResult result = runProgram("synth", {"batch", lines, "--out", path("out"), "--fps", "24"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_NE(result.err.find("bad: "), std::string::npos) << result.err;
  EXPECT_NE(result.out.find("2 of 3 lines made"), std::string::npos) << result.out;
  EXPECT_TRUE(fs::exists(path("out/good/report.json")) && fs::exists(path("out/also_good/report.json")));
  EXPECT_FALSE(fs::exists(path("out/bad")));
}

}  // namespace
}  // namespace mouthpiece::test
