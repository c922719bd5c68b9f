// Curves as an animator gets and edits them, from the real program.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "support/run_program.h"
#include "vocal/animation_curve.h"

namespace mouthpiece::test {
namespace {

namespace fs = std::filesystem;

constexpr const char* kEdits = R"([
  {"curve": "Ah", "kind": "offset", "start_s": 0.4, "end_s": 0.8, "value": 0.15},
  {"curve": "MBP", "kind": "mute", "start_s": 0.2, "end_s": 1.0, "fade_s": 0.02},
  {"curve": "Oo", "kind": "replace", "start_s": 0.5, "end_s": 0.9,
   "keys": [{"time_s": 0.6, "value": 0.7}, {"time_s": 0.8, "value": 0.7}]}])";

class Curves : public testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(fs::path(MOUTHPIECE_BUILD_SHARE_DIR) / "sample.corpus"))
      GTEST_SKIP() << "no sample corpus: run `make data`";
  }

  CurveSet draw(std::vector<std::string> options) {
    options.insert(options.end(), {"--text", "the time is now", "-o", path("curves.json"), "--quiet"});
    const ProgramResult result = runProgram("synth", options);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.exit_code == 0 ? readCurves(path("curves.json")) : CurveSet();
  }

  [[nodiscard]] std::string path(const std::string& name) const { return (scratch_.path() / name).string(); }

  ScratchFolder scratch_;
};

double valueOf(const CurveSet& curves, std::string_view name, Seconds time) {
  const AnimationCurve* curve = findCurve(curves, name);
  return curve == nullptr ? 0 : curve->valueAt(time);
}

TEST_F(Curves, EditsSurviveAnotherRun) {
  const std::string edits = scratch_.write("edits.json", kEdits).string();
  for (const std::vector<std::string>& style :
       {std::vector<std::string>{}, {"--ma", "0.6"}, {"--style", "sing"}, {"--select", "greedy", "--fps", "30"}}) {
    const CurveSet plain = draw(style);
    std::vector<std::string> with_edits = style;
    with_edits.insert(with_edits.end(), {"--edits", edits});
    const CurveSet edited = draw(with_edits);
    EXPECT_NEAR(valueOf(edited, "Ah", 0.6), valueOf(plain, "Ah", 0.6) + 0.15, 1e-6);
    EXPECT_NEAR(valueOf(edited, "MBP", 0.6), 0, 1e-9);
    EXPECT_NEAR(valueOf(edited, "Oo", 0.7), 0.7, 1e-9);
    for (const Seconds outside : {0.1, 1.1}) {
      for (const char* name : {"Ah", "MBP", "Oo"})
        EXPECT_NEAR(valueOf(edited, name, outside), valueOf(plain, name, outside), 1e-9) << name << outside;
    }
    EXPECT_EQ(draw(with_edits), edited) << "the same again";
  }
}

TEST_F(Curves, AreSparseAndTheSameAsCsv) {
  const CurveSet curves = draw({"-o", path("curves.csv"), "-o", path("curve_frames.csv")});
  std::size_t keys = 0;
  for (const AnimationCurve& curve : curves) keys += curve.keys.size();
  EXPECT_GT(keys, 20U);
  EXPECT_LT(keys, 16U * 12U) << "some keys a phone, not some a frame";
  EXPECT_EQ(readAll(path("curves.csv")), curveKeysToCsv(curves));
  const std::string frames = readAll(path("curve_frames.csv"));
  EXPECT_TRUE(frames.starts_with("time_s," + curves.front().name));
}

}  // namespace
}  // namespace mouthpiece::test
