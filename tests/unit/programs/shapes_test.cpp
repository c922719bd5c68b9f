// retarget shapes on the face that comes with Mouthpiece.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>

#include "support/glb_file.h"
#include "support/run_program.h"

namespace mouthpiece::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

class Shapes : public testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(face_)) GTEST_SKIP() << "no sample face; make it with `make data`";
  }
  json made(const std::string& set, const std::string& out) {
    const ProgramResult result = runProgram(
        "retarget", {"shapes", face_.string(), "--set", set, "--out", (folder_.path() / out).string(), "--json"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return json::parse(result.out);
  }
  /// The names of a GLB's morph targets.
  json targetsOf(const std::string& file) {
    const std::string glb = readAll(folder_.path() / file);
    const json root = json::parse(glb.substr(20, glb.find("BIN", 20) - 24));
    EXPECT_FALSE(root.contains("animations")) << "shapes alone";
    return root["meshes"][0]["extras"]["targetNames"];
  }
  /// How far down a morph target takes anything, metres.
  double lowestMove(const std::string& file, std::size_t target) {
    const GlbFile glb(readAll(folder_.path() / file));
    double lowest = 0;
    for (const json& primitive : glb.root["meshes"][0]["primitives"]) {
      const std::size_t accessor = primitive["targets"][target]["POSITION"];
      lowest = std::min(lowest, glb.root["accessors"][accessor]["min"][1].get<double>());
    }
    return lowest;
  }
  const fs::path face_ = fs::path(MOUTHPIECE_BUILD_SHARE_DIR) / "default.face";
  ScratchFolder folder_;
};

/// The columns of Live Link Face's CSV by name, but for the time code.
std::map<std::string, std::vector<double>> columnsOf(const std::string& csv) {
  std::istringstream lines(csv);
  std::string line, cell;
  std::vector<std::string> names;
  std::map<std::string, std::vector<double>> columns;
  while (std::getline(lines, line)) {
    std::istringstream cells(line);
    const bool is_head = names.empty();
    for (std::size_t i = 0; std::getline(cells, cell, ','); ++i) {
      if (is_head) {
        names.push_back(cell);
      } else if (i > 0) {
        columns[names.at(i)].push_back(std::stod(cell));
      }
    }
  }
  return columns;
}

TEST_F(Shapes, Of52OfArkitCloseAndKeepTheirSides) {
  const json facts = made("arkit", "a.glb");
  EXPECT_EQ(facts["shapes"].size(), 52U);
  EXPECT_EQ(facts["shapes"][17], "jawOpen");
  EXPECT_EQ(targetsOf("a.glb"), facts["shapes"]);
  EXPECT_LT(facts["closing_gap_mm"], 0.3) << "jawOpen with mouthClose";
  EXPECT_LT(facts["side_rms_mm"], 0.2);
  EXPECT_EQ(facts["strengths"].value("jawLeft", 1.0), facts["strengths"].value("jawRight", 1.0)) << "pairs are alike";
  EXPECT_GT(facts["share_mirrored"], 0.9);
  EXPECT_LE(facts["lips_overlap_mm"], 0.5);
  EXPECT_LE(facts["turned_over_mm2"], 4);
  EXPECT_EQ(facts["faults"], json::array());
  EXPECT_EQ(facts["strengths"], json::object()) << "all go as far as on the head that they were learnt from";
  EXPECT_LE(facts["edge_growth_mm"], 5);
  EXPECT_LE(facts["edge_ratio"], 3);
  // The lower lip of the head that jawOpen was learnt from goes 35 mm down.
  EXPECT_LT(lowestMove("a.glb", 17), -0.03);
}

/// Fitted by all of its markers ICT's head rolls a lower lip in that parts the mouth in its middle and meets the upper
/// lip beside: it went 72 % of the way.
TEST_F(Shapes, OfIctsHeadGoAllTheWay) {
  const fs::path head = fs::path(MOUTHPIECE_SOURCE_DIR) / "../shared/faces/ict_head.obj";
  const fs::path share(MOUTHPIECE_BUILD_SHARE_DIR), ict = folder_.path() / "ict.face";
  if (!fs::exists(head)) GTEST_SKIP() << "no " << head;
  ASSERT_EQ(
      runProgram("retarget", {"fit", "--mesh", head.string(), "--anchors",
                              (fs::path(MOUTHPIECE_SOURCE_DIR) / "sample_data/anchors/ict_head.anchors.json").string(),
                              "--corpus", (share / "clock.corpus").string(), "--out", ict.string(), "-q"})
          .exit_code,
      0);
  const ProgramResult result =
      runProgram("retarget", {"shapes", ict.string(), "--out", (folder_.path() / "ict.glb").string(), "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const json facts = json::parse(result.out);
  EXPECT_EQ(facts["strengths"], json::object()) << facts["weakened_by"];
  EXPECT_EQ(facts["faults"], json::array());
}

/// A head with ARKit's shapes of its own: where its weights are written, the report counts the lips that meet.
TEST_F(Shapes, OfAHeadsOwnKeepLipsTogetherAndTheReportCounts) {
  const fs::path head = fs::path(MOUTHPIECE_SOURCE_DIR) / "../shared/faces/ict_arkit.glb";
  if (!fs::exists(head)) GTEST_SKIP() << "no head with shapes in " << head;
  const auto at = [&](const char* name) { return (folder_.path() / name).string(); };
  const std::string corpus = (face_.parent_path() / "clock.corpus").string();
  for (const std::vector<std::string>& step :
       {std::vector<std::string>{"anchors", head.string(), "--out", at("a.anchors.json")},
        {"fit", "--mesh", head.string(), "--anchors", at("a.anchors.json"), "--corpus", corpus, "--out",
         at("a.face")}}) {
    const ProgramResult result = runProgram("retarget", step);
    ASSERT_EQ(result.exit_code, 0) << result.out << result.err;
  }
  const auto mouthOf = [&](const std::vector<std::string>& files) {
    std::vector<std::string> line{"--face", at("a.face"), "--text", "Bob put my mop by the big pump", "-q"};
    for (const std::string& file : files) line.insert(line.end(), {"-o", file});
    const ProgramResult spoken = runProgram("synth", line);
    EXPECT_EQ(spoken.exit_code, 0) << spoken.err;
    return json::parse(readAll(files.back()))["mouth"];
  };
  const json mouth = mouthOf({at("a.arkit.csv"), at("a.json")});
  ASSERT_TRUE(mouth.contains("shapes")) << mouth;
  const json& shapes = mouth["shapes"];
  EXPECT_GT(shapes["closed_frames"], 3);
  EXPECT_EQ(shapes["kept"], shapes["closed_frames"]);
  EXPECT_LT(shapes["rms_error_mm"], shapes["rms_motion_mm"]);
  EXPECT_FALSE(mouthOf({at("b.json")}).contains("shapes")) << "nobody asked for weights";

  // Of another line's motion, in which the weights left the lips apart in 13 of 20 frames.
  ASSERT_EQ(runProgram("synth", {"--text", "Bob put five pumpkins above my mother's wolf", "-o", at("m.c3d"), "-o",
                                 at("m.TextGrid"), "-o", at("m.json"), "-q"})
                .exit_code,
            0);
  const ProgramResult applied = runProgram("retarget", {"apply", "--face", at("a.face"), "--motion", at("m.c3d"),
                                                        "--phones", at("m.TextGrid"), "--out", at("m.csv")});
  ASSERT_EQ(applied.exit_code, 0) << applied.err;
  std::smatch counts;
  ASSERT_TRUE(std::regex_search(applied.out, counts, std::regex("meet in (\\d+) frames, with the shapes in (\\d+)")));
  EXPECT_GT(std::stoi(counts[1]), 10);
  EXPECT_EQ(counts[1], counts[2]) << applied.out;
  // F and V roll the lower lip in as no P, B or M does; these open nothing.
  const auto weights = columnsOf(readAll(at("m.csv")));
  double least_rolled = 1, most_rolled = 0;
  for (const json& phone : json::parse(readAll(at("m.json")))["phones"]) {
    const std::string name = phone["phone"];
    const double middle = 0.5 * (phone["start_s"].get<double>() + phone["end_s"].get<double>());
    const auto weightOf = [&](const std::string& shape) {
      const std::vector<double>& frames = weights.at(shape);
      return frames[std::min(static_cast<std::size_t>(60 * middle), frames.size() - 1)];
    };
    if (name == "F" || name == "V") least_rolled = std::min(least_rolled, weightOf("MouthRollLower"));
    if (name != "P" && name != "B" && name != "M") continue;
    most_rolled = std::max(most_rolled, weightOf("MouthRollLower"));
    for (const char* opener : {"MouthFunnel", "MouthLowerDownLeft", "MouthUpperUpLeft"})
      EXPECT_LT(weightOf(opener), 0.05) << name << " " << opener;
    EXPECT_LT(weightOf("JawOpen") - weightOf("MouthClose"), 0.2) << name;
  }
  EXPECT_GT(least_rolled, most_rolled);
}

TEST_F(Shapes, OfVisemesAreThoseAskedFor) {
  EXPECT_EQ(made("oculus", "o.glb")["shapes"].size(), 14U);
  EXPECT_EQ(targetsOf("o.glb")[0], "PP");
  EXPECT_LT(made("vrm", "v.glb")["closing_gap_mm"], 0.3);
  EXPECT_EQ(targetsOf("v.glb"), json({"aa", "ih", "ou", "ee", "oh", "blink", "blinkLeft", "blinkRight"}));
}

TEST_F(Shapes, AreObjFilesToo) {
  made("vrm", "folder");
  std::map<std::string, std::uintmax_t> files;
  for (const auto& entry : fs::directory_iterator(folder_.path() / "folder"))
    files[entry.path().filename().string()] = entry.file_size();
  EXPECT_EQ(files.size(), 9U);
  EXPECT_TRUE(files.contains("neutral.obj") && files.contains("aa.obj"));
}

TEST_F(Shapes, GoNowhereElse) {
  const ProgramResult result =
      runProgram("retarget", {"shapes", face_.string(), "--out", (folder_.path() / "a.avi").string()});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_NE(result.err.find("a.avi"), std::string::npos);
}

}  // namespace
}  // namespace mouthpiece::test
