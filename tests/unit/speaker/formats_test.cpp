// The one table of formats: names lead to kinds, and kinds to files.
#include <gtest/gtest.h>

#include <set>

#include "mouthpiece/errors.h"
#include "mouthpiece/save.h"
#include "support/error_of.h"

namespace mouthpiece {
namespace {

TEST(Formats, TheLongestEndingDecides) {
  const auto usual = [](const char* path) { return std::string(formatOf(path).usual_name); };
  EXPECT_EQ(usual("a/motion.csv"), "motion.csv");
  EXPECT_EQ(usual("a/my_curves.csv"), "curves.csv");
  EXPECT_EQ(usual("a/curve_frames.csv"), "curve_frames.csv");
  EXPECT_EQ(usual("a/line.arkit.csv"), "arkit.csv");
  EXPECT_EQ(usual("a/curves.json"), "curves.json");
  EXPECT_EQ(usual("a/song_ablation.html"), "ablation.html");
  EXPECT_EQ(usual("a/song.html"), "view.html");
  EXPECT_EQ(usual("a/report.json"), "report.json");
  EXPECT_EQ(usual("x.TextGrid"), "phones.TextGrid");
  EXPECT_EQ(usual("x.textgrid"), "phones.TextGrid");
  EXPECT_EQ(usual("LINE.ARKIT.CSV"), "arkit.csv");
  EXPECT_THROW(static_cast<void>(formatOf("x.avi")), InputError);
  EXPECT_THROW(static_cast<void>(formatOf("glb")), InputError);
}

TEST(Formats, EveryUsualNameLeadsToItsOwnRow) {
  std::set<std::string_view> names;
  for (const Format& format : formats()) {
    EXPECT_EQ(&formatOf(format.usual_name), &format) << format.usual_name;
    EXPECT_TRUE(names.insert(format.usual_name).second) << format.usual_name << " stands twice";
    EXPECT_FALSE(format.what.empty());
  }
}

TEST(Formats, AFolderHoldsWhatTheDesignNames) {
  std::set<std::string> names;
  for (const auto& path : usualFiles("out")) {
    EXPECT_EQ(path.parent_path(), "out");
    names.insert(path.filename().string());
  }
  EXPECT_EQ(names, (std::set<std::string>{"speech.wav", "motion.c3d", "motion.csv", "face.glb", "curves.json",
                                          "phones.TextGrid", "view.html", "report.json"}));
}

TEST(Formats, AFolderIsToldApartFromAnUnknownEnding) {
  for (const std::string& folder : {std::string("talks/"), std::string("./"), ::testing::TempDir()}) {
    const std::string error = errorOf([&] { static_cast<void>(formatOf(folder)); });
    EXPECT_NE(error.find("names a folder"), std::string::npos) << folder << ": " << error;
  }
}

TEST(Formats, AnUnknownEndingIsToldWithTheKnownOnes) {
  try {
    static_cast<void>(formatOf("talk.avi"));
    FAIL();
  } catch (const InputError& error) {
    for (const Format& format : formats())
      EXPECT_NE(std::string(error.what()).find(format.ending), std::string::npos) << format.ending;
  }
}

}  // namespace
}  // namespace mouthpiece
