#include "programs/synth/synth_options.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "base/errors.h"

namespace mouthpiece {
namespace {

TEST(SynthOptions, TheEndingTellsTheKind) {
  EXPECT_EQ(outputFileFor("a/motion.csv").kind, OutputKind::kMotionCsv);
  EXPECT_EQ(outputFileFor("a/my_curves.csv").kind, OutputKind::kCurveKeysCsv);
  EXPECT_EQ(outputFileFor("a/curve_frames.csv").kind, OutputKind::kCurveFramesCsv);
  EXPECT_EQ(outputFileFor("a/curves.json").kind, OutputKind::kCurves);
  EXPECT_EQ(outputFileFor("a/song_ablation.html").kind, OutputKind::kAblation);
  EXPECT_EQ(outputFileFor("a/song.html").kind, OutputKind::kPage);
  EXPECT_EQ(outputFileFor("a/report.json").kind, OutputKind::kReport);
  EXPECT_EQ(outputFileFor("x.TextGrid").kind, OutputKind::kPhones);
  EXPECT_THROW(outputFileFor("x.avi"), InputError);
}

TEST(SynthOptions, AFolderGetsEachUsualFileOnce) {
  const std::vector<OutputFile> files = allOutputFiles("out");
  std::vector<std::string> names;
  for (const OutputFile& file : files) names.push_back(file.path.filename().string());
  EXPECT_EQ(names, (std::vector<std::string>{"speech.wav", "motion.c3d", "motion.csv", "face.glb", "curves.json",
                                             "phones.TextGrid", "view.html", "report.json"}));
}

}  // namespace
}  // namespace mouthpiece
