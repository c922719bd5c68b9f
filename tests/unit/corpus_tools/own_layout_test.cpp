// A marker set that is not ours, from its file to a fitted face.
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>

#include "base/errors.h"
#include "base/files.h"
#include "motion/c3d_file.h"
#include "motion/marker_labels.h"
#include "support/run_program.h"
#include "synthetic_takes.h"
#include "units/corpus.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::runProgram;

/// 30 of our markers under the names of another capture system.
const std::vector<std::string> kMarkers = {
    "LIP_CORNER_R", "LIP_CORNER_L", "LIP_UP_OUT_R", "LIP_UP_IN_R", "LIP_UP_MID",    "LIP_UP_IN_L",
    "LIP_UP_OUT_L", "LIP_LO_OUT_R", "LIP_LO_IN_R",  "LIP_LO_MID",  "LIP_LO_IN_L",   "LIP_LO_OUT_L",
    "CHIN_MID",     "CHIN_LOW",     "NOSE_TIP",     "NOSE_ROOT",   "NOSE_BRIDGE",   "FOREHEAD_MID",
    "BROW_IN_R",    "BROW_IN_L",    "BROW_OUT_R",   "BROW_OUT_L",  "CANTHUS_OUT_R", "CANTHUS_OUT_L",
    "JAW_MID_R",    "JAW_MID_L",    "JAW_BACK_R",   "JAW_BACK_L",  "TEMPLE_R",      "TEMPLE_L"};

std::string labelOf(std::size_t marker) { return "Subject" + std::to_string(marker + 101); }

std::string layoutJson() {
  const json ours = json::parse(layoutToJson(defaultLayout()));
  json layout{{"name", "studio30"}, {"markers", json::array()}, {"jig", ours["jig"]}};
  for (std::size_t i = 0; i < kMarkers.size(); ++i) {
    for (json marker : ours["markers"]) {
      if (marker["name"] != kMarkers[i]) continue;
      marker["label"] = labelOf(i);
      layout["markers"].push_back(marker);
    }
  }
  return layout.dump();
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
  const fs::path layout = folder.write("studio30.json", layoutJson());
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
  const fs::path face = folder.path() / "head.face";
  const auto fitted = runProgram("retarget", {"fit", "--mesh", head.string(), "--anchors", anchors_file.string(),
                                              "--corpus", corpus_file.string(), "--out", face.string(), "--json"});
  ASSERT_EQ(fitted.exit_code, 0) << fitted.err;
  const json facts = json::parse(fitted.out);
  EXPECT_EQ(facts["markers"], 30);
  EXPECT_EQ(facts["lip_side_errors"], 0);
  // Fold-overs are not judged: the synthetic actor is an ellipsoid.
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
  EXPECT_NE(complaint(layout("5", R"("y")")).find("no text"), std::string::npos);
}

}  // namespace
}  // namespace mouthpiece
