// A marker set that is not ours, from its file to a fitted face.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>

#include "base/errors.h"
#include "base/files.h"
#include "motion/formats/c3d_file.h"
#include "motion/formats/motion_file.h"
#include "support/run_program.h"
#include "synthetic_takes.h"
#include "units/file/corpus.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::runProgram;

/// 30 of our markers.
const std::vector<std::string> kMarkers = {
    "LIP_CORNER_R", "LIP_CORNER_L", "LIP_UP_OUT_R", "LIP_UP_IN_R", "LIP_UP_MID",    "LIP_UP_IN_L",
    "LIP_UP_OUT_L", "LIP_LO_OUT_R", "LIP_LO_IN_R",  "LIP_LO_MID",  "LIP_LO_IN_L",   "LIP_LO_OUT_L",
    "CHIN_MID",     "CHIN_LOW",     "NOSE_TIP",     "NOSE_ROOT",   "NOSE_BRIDGE",   "FOREHEAD_MID",
    "BROW_IN_R",    "BROW_IN_L",    "BROW_OUT_R",   "BROW_OUT_L",  "CANTHUS_OUT_R", "CANTHUS_OUT_L",
    "JAW_MID_R",    "JAW_MID_L",    "JAW_BACK_R",   "JAW_BACK_L",  "TEMPLE_R",      "TEMPLE_L"};

/// Its name in the files of another capture system.
std::string labelOf(std::size_t marker) { return "Subject" + std::to_string(marker + 101); }

json layoutJson() {
  const json ours = json::parse(layoutToJson(defaultLayout()));
  json layout{{"name", "studio30"}, {"markers", json::array()}, {"jig", ours["jig"]}};
  for (std::size_t i = 0; i < kMarkers.size(); ++i) {
    for (json marker : ours["markers"]) {
      if (marker["name"] != kMarkers[i]) continue;
      marker["label"] = labelOf(i);
      layout["markers"].push_back(marker);
    }
  }
  return layout;
}

/// A take whose file has the 30 markers, and the jig's, under the system's names.
void writeTake(const fs::path& folder, unsigned seed) {
  SyntheticTake take;
  take.name = "take" + std::to_string(seed);
  take.seed = seed;
  take.write(folder);
  const fs::path path = folder / (take.name + ".c3d");
  std::vector<std::string> names = kMarkers;
  names.insert(names.end(), defaultLayout().jig_names.begin(), defaultLayout().jig_names.end());
  MotionClip motion = selectMarkers(readC3d(path), names);
  for (std::size_t i = 0; i < kMarkers.size(); ++i) motion.marker_names[i] = labelOf(i);
  writeC3d(path, motion);
}

TEST(OwnLayout, AMarkerSetInAFileGoesAllTheWay) {
  const test::ScratchFolder folder;
  const fs::path takes = folder.path() / "takes", corpus_file = folder.path() / "studio.corpus";
  fs::create_directories(takes);
  for (const unsigned seed : {1U, 2U}) writeTake(takes, seed);
  const fs::path layout = folder.write("studio30.json", layoutJson().dump());
  const auto built = runProgram("corpus", {"build", takes.string(), "--out", corpus_file.string(), "--layout",
                                           layout.string(), "--strict", "--quiet"});
  ASSERT_EQ(built.exit_code, 0) << built.err;
  const Corpus corpus = readCorpus(corpus_file);
  EXPECT_EQ(corpus.layout.name, "studio30");
  EXPECT_EQ(corpus.layout.markerNames(), kMarkers);
  ASSERT_EQ(corpus.takes.size(), 2U);
  EXPECT_EQ(corpus.takes[0].motion.positions_mm.cols(), 90);
  EXPECT_TRUE(corpus.takes[0].motion.positions_mm.allFinite());

  const fs::path head = fs::path(MOUTHPIECE_SOURCE_DIR) / "../shared/faces/ict_head.obj";
  if (!fs::exists(head)) GTEST_SKIP() << "no head at " << head << "; the corpus was built and read";
  json anchors = json::parse(readFile(fs::path(MOUTHPIECE_SOURCE_DIR) / "sample_data/anchors/ict_head.anchors.json"));
  const std::set<std::string> known(kMarkers.begin(), kMarkers.end());
  json markers = json::object();
  for (const auto& [name, vertex] : anchors["markers"].items()) {
    if (known.contains(name) || name.starts_with("RIM_")) markers[name] = vertex;
  }
  anchors["markers"] = markers;
  const fs::path anchors_file = folder.write("head.anchors.json", anchors.dump());
  const fs::path face = folder.path() / "head.face", unheard_file = folder.path() / "unheard.corpus";
  Corpus unheard = corpus;  // fitted without being judged: nothing would mend it
  unheard.takes.clear();
  writeCorpus(unheard_file, unheard);
  const auto fitted =
      runProgram("retarget", {"fit", "--mesh", head.string(), "--anchors", anchors_file.string(), "--corpus",
                              unheard_file.string(), "--out", face.string(), "--json", "--even-if-faulty"});
  ASSERT_EQ(fitted.exit_code, 1) << "the synthetic actor is an ellipsoid: its warp folds over";
  const json facts = json::parse(fitted.out);
  EXPECT_EQ(facts["markers"], 30);
  EXPECT_EQ(facts["lip_side_errors"], 0);
  // Fold-overs are not judged: the synthetic actor is an ellipsoid.
  const auto checked = runProgram("retarget", {"check", face.string(), "--corpus", corpus_file.string(), "--json"});
  ASSERT_EQ(checked.exit_code, 1) << checked.err;
  const json judged = json::parse(checked.out);
  EXPECT_EQ(judged["markers"], 30);
  EXPECT_GT(judged["faults"].size(), facts["faults"].size()) << "seen as it moves: " << checked.out;
}

/// About 40 of our markers onto a face that was fitted with all 66.
TEST(OwnLayout, FortyMarkersSpeakOnTheDefaultFace) {
  const fs::path face = fs::path(MOUTHPIECE_BUILD_SHARE_DIR) / "default.face";
  if (!fs::exists(face)) GTEST_SKIP() << "no default face: run `make data`";
  const test::ScratchFolder folder;
  const fs::path takes = folder.path() / "takes", corpus_file = folder.path() / "studio.corpus";
  fs::create_directories(takes);
  json layout = layoutJson();
  layout["name"] = "studio40";
  layout["triangles"] = {{"CHIN_MID", "CHIN_LOW", "JAW_MID_R"}};
  std::vector<std::string> names = kMarkers, labels;
  for (std::size_t i = 0; i < kMarkers.size(); ++i) labels.push_back(labelOf(i));
  const json ours = json::parse(layoutToJson(defaultLayout()));
  for (json marker : ours["markers"]) {
    const std::string name = marker["name"];
    if (names.size() == 40 || std::find(names.begin(), names.end(), name) != names.end()) continue;
    if (marker["side"] != "M") continue;
    names.push_back(name);
    labels.push_back(name);
    layout["markers"].push_back(marker);
  }
  for (json marker : ours["markers"]) {  // pairs
    const std::string name = marker["name"], mirror = marker["mirror"];
    if (names.size() >= 39 || marker["side"] != "R" || std::find(names.begin(), names.end(), name) != names.end())
      continue;
    for (json half : ours["markers"]) {
      if (half["name"] != name && half["name"] != mirror) continue;
      names.push_back(half["name"]);
      labels.push_back(half["name"]);
      layout["markers"].push_back(half);
    }
  }
  const std::size_t count = names.size();
  ASSERT_GE(count, 39U);
  for (const unsigned seed : {1U, 2U}) {
    SyntheticTake take;
    take.name = "take" + std::to_string(seed);
    take.seed = seed;
    take.write(takes);
    const fs::path path = takes / (take.name + ".c3d");
    std::vector<std::string> all = names;
    all.insert(all.end(), defaultLayout().jig_names.begin(), defaultLayout().jig_names.end());
    MotionClip motion = selectMarkers(readC3d(path), all);
    for (std::size_t i = 0; i < count; ++i) motion.marker_names[i] = labels[i];
    writeC3d(path, motion);
  }
  const fs::path layout_file = folder.write("studio40.json", layout.dump());
  const auto built = runProgram("corpus", {"build", takes.string(), "--out", corpus_file.string(), "--layout",
                                           layout_file.string(), "--strict", "--quiet"});
  ASSERT_EQ(built.exit_code, 0) << built.err;
  EXPECT_EQ(readCorpus(corpus_file).layout.triangles.size(), 1U);
  const fs::path out = folder.path() / "out";
  const auto spoken = runProgram("synth", {"--text", "bin", "--voice", "flite:slt", "--corpus", corpus_file.string(),
                                           "--face", face.string(), "--out", out.string(), "--quiet"});
  ASSERT_EQ(spoken.exit_code, 0) << spoken.err;
  EXPECT_GT(fs::file_size(out / "face.glb"), 100'000U);
  EXPECT_EQ(readC3d(out / "motion.c3d").marker_names.size(), count);
}

TEST(OwnLayout, LabelsMustTellMarkersApart) {
  const auto complaint = [](const std::string& text) -> std::string {
    try {
      markerLabels(text, "mine.json", parseLayout(text, "mine.json"));
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  };
  const auto layout = [](const std::string& a, const std::string& b) {
    const std::string marker = R"({"region": "lip", "side": "M", )";
    return R"({"name": "two", "markers": [)" + marker + R"("name": "A", "mirror": "A", "label": )" + a + "}, " +
           marker + R"("name": "B", "mirror": "B", "label": )" + b + "}]}";
  };
  EXPECT_EQ(complaint(layout(R"("x")", R"("y")")), "accepted");
  EXPECT_EQ(complaint(layout(R"("A")", R"("y")")), "accepted") << "a marker's own name";
  EXPECT_NE(complaint(layout(R"("x")", R"("x")")).find("mine.json:markers[1]"), std::string::npos);
  EXPECT_NE(complaint(layout(R"("B")", R"("y")")).find("another marker's"), std::string::npos);
  EXPECT_NE(complaint(layout("5", R"("y")")).find("markers[0].label: found 5"), std::string::npos);
}

}  // namespace
}  // namespace mouthpiece
