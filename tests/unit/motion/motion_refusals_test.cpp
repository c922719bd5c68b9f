// What is said of a motion file that is none: file, line, what was found and what was expected.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "motion/formats/motion_csv.h"
#include "motion/formats/motion_file.h"
#include "motion/marker_layout.h"
#include "support/error_of.h"

namespace mouthpiece {
namespace {

struct Refusal {
  std::string text, said;
};
class RefusedCsvs : public ::testing::TestWithParam<Refusal> {};
TEST_P(RefusedCsvs, AreToldWithTheirLine) {
  EXPECT_EQ(errorOf([&] { readMotionCsvText(GetParam().text, "a.csv"); }), GetParam().said);
}
constexpr const char* kHead = "time_s,A.x,A.y,A.z\n";
constexpr const char* kColumns = "; expected NAME.x,NAME.y,NAME.z for each marker";
INSTANTIATE_TEST_SUITE_P(
    All, RefusedCsvs,
    ::testing::Values(
        Refusal{"", "a.csv: is empty; expected a header time_s,NAME.x,NAME.y,NAME.z,..."},
        Refusal{"frame,A.x,A.y,A.z\n", "a.csv:1: found first column \"frame\"; expected time_s"},
        Refusal{"time_s\n", "a.csv:1: found 1 columns; expected time_s and three for each marker"},
        Refusal{"time_s,A.x,A.y,A.z,B.x\n", "a.csv:1: found 5 columns; expected time_s and three for each marker"},
        Refusal{"time_s,A.x,A.z,A.y\n", std::string("a.csv:1: found column \"A.z\"") + kColumns},
        Refusal{"time_s,A.x,A.y,B.z\n", std::string("a.csv:1: found column \"B.z\"") + kColumns},
        Refusal{"time_s,.x,.y,.z\n", std::string("a.csv:1: found column \".x\"") + kColumns},
        Refusal{"time_s,A.x,A.y,A.z,A.x,A.y,A.z\n", "a.csv:1: found marker A twice; expected each name once"},
        Refusal{kHead, "a.csv: found fewer than two rows; expected two to tell the frame rate"},
        Refusal{std::string(kHead) + "0,1,2,3\n",
                "a.csv: found fewer than two rows; expected two to tell the frame rate"},
        Refusal{std::string(kHead) + "soon,1,2,3\n", "a.csv:2: found time \"soon\"; expected seconds"},
        Refusal{std::string(kHead) + "inf,1,2,3\n", "a.csv:2: found a time that is not finite"},
        Refusal{std::string(kHead) + "1,1,2,3\n1,1,2,3\n", "a.csv:3: found time 1 s behind 1 s; expected it to rise"},
        Refusal{std::string(kHead) + "0,1,-10000001,3\n",
                "a.csv:2: found a position of -1e+07 mm; expected at most 1e+07"},
        Refusal{std::string(kHead) + "0,1,2,3\n1e-9,1,2,3\n",
                "a.csv: found frame rate 1e+09 Hz; expected more than 0, at most 1e+06"}));

TEST(RefusedTrcs, AreToldWithTheirLine) {
  const std::string names = "PathFileType\t4\nDataRate\tNumFrames\tUnits\n", markers = "Frame#\tTime\tA\t\t\n",
                    axes = "\t\tX1\tY1\tZ1\n", head = names + "100\t2\tmm\n" + markers + axes;
  const auto said = [](const std::string& text) { return errorOf([&] { readTrcText(text, "a.trc"); }); };
  ASSERT_EQ(said(head + "1\t0\t1\t2\t3\n"), "no error");
  EXPECT_EQ(said(""), "a.trc: ends in its header; expected PathFileType");
  EXPECT_EQ(said("PathFileType\t4\n"), "a.trc: ends in its header; expected the names DataRate, ...");
  EXPECT_EQ(said(names), "a.trc: ends in its header; expected the data rate");
  EXPECT_EQ(said(names + "100\t2\tmm\n"), "a.trc: ends in its header; expected the marker names");
  EXPECT_EQ(said(names + "100\t2\tmm\n" + markers), "a.trc: ends in its header; expected the axes X1, Y1, Z1, ...");
  EXPECT_EQ(said("C3D\n" + head), "a.trc:1: is no TRC file; expected PathFileType");
  EXPECT_EQ(said(names + "100\t2\tinch\n"), "a.trc:3: found units \"inch\"; expected mm, cm or m");
  for (const char* rate : {"0", "many", "-5"}) {
    EXPECT_EQ(said(names + rate + "\t2\tmm\n" + markers + axes).substr(0, 25), "a.trc:3: found frame rate") << rate;
  }
  EXPECT_EQ(said(names + "100\t2\tmm\nFrame\tTime\tA\n" + axes),
            "a.trc:4: expected the columns Frame#, Time and the marker names");
  EXPECT_EQ(said(names + "100\t2\tmm\nFrame#\tTime\t\t\t\n" + axes), "a.trc:4: found no marker; expected names");
  EXPECT_EQ(said(names + "100\t2\tmm\nFrame#\tTime\tA\t\t\tA\t\t\n" + axes),
            "a.trc:4: found marker A twice; expected each name once");
  EXPECT_EQ(said(head), "a.trc: found no frames; expected at least one");
  EXPECT_EQ(said(head + "1\n"), "a.trc:6: found no time; expected frame number, time and positions");
  EXPECT_EQ(said(head + "1\t0\t1\t2\n"), "a.trc:6: found 2 cells of positions; expected 3");
  EXPECT_EQ(said(head + "1\t0\t1\t2\tnear\n"), "a.trc:6: found \"near\"; expected a number");
  EXPECT_EQ(said(names + "100\t2\tm\n" + markers + axes + "1\t0\t10001\t2\t3\n"),
            "a.trc:6: found a position of 1.0001e+07 mm; expected at most 1e+07");
}

/// 468 landmarks in one place but for what is said; `frame` holds their list.
std::string track(const std::string& facts, const std::string& first, const std::string& second) {
  return "{" + facts + R"("frames":[)" + first + "," + second + "]}";
}
std::string landmarks(std::size_t count, double left_corner_x) {
  std::string text = "[";
  for (std::size_t i = 0; i < count; ++i)
    text += fmt::format("{}[{},0.5,0]", i == 0 ? "" : ",", i == 263 ? left_corner_x : i == 33 ? 0.4 : 0.5);
  return text + "]";
}

TEST(RefusedTracks, AreToldWithTheirPlace) {
  const std::string face = landmarks(468, 0.6), fps = R"("fps":25,)";
  const auto said = [](const std::string& text) {
    return errorOf([&] { parseLandmarkTrack(text, "t.json", defaultLayout()); });
  };
  ASSERT_EQ(said(track(fps, face, face)), "no error");
  EXPECT_EQ(said(track(R"("width":400,)" + fps, face, face)),
            R"(t.json: has one of "width" and "height"; expected both, or coordinates in pixels)");
  EXPECT_EQ(said(R"({"fps":25,"frames":[null]})"),
            "t.json: holds no frames; expected a list \"frames\" of at least two");
  EXPECT_EQ(said(track("", face, face)),
            "t.json: does not tell its frame rate; expected \"fps\", times, or a rate given with it");
  EXPECT_EQ(said(track(fps, "null", "[]")), "t.json: shows no face in any frame; expected one");
  EXPECT_EQ(said(track(fps, landmarks(468, 0.4), landmarks(468, 0.4))),
            "t.json: has both outer eye corners in one place; expected a face");
  EXPECT_EQ(said(track(fps, face, landmarks(467, 0.6))).substr(0, 17), "t.json:frames[1]:");
  EXPECT_NE(said(track(fps, face, landmarks(467, 0.6))).find("expected a list of 468 or 478 landmarks"),
            std::string::npos);
  const auto timed = [&](double time) { return fmt::format(R"({{"time_s":{},"landmarks":{}}})", time, face); };
  EXPECT_EQ(said("[" + timed(0) + "," + timed(0.07) + "," + timed(0.08) + "]"),
            "t.json:[1]: is at 0.070 s; expected even steps, 0.040 s");
  EXPECT_EQ(said("[" + timed(1) + "," + timed(1) + "]"),
            "t.json: does not tell its frame rate; expected \"fps\", times, or a rate given with it");
  MarkerLayout plain = defaultLayout();
  for (LayoutMarker& marker : plain.markers) marker.mediapipe_landmark = -1;
  plain.name = "plain";
  EXPECT_EQ(errorOf([&] { parseLandmarkTrack(track(fps, face, face), "t.json", plain); }),
            "plain: has no marker with a \"mediapipe_landmark\"; expected a layout with some");
}

TEST(MotionFiles, OfOtherEndingsAreRefused) {
  EXPECT_EQ(errorOf([] { readMotion("take.bvh"); }),
            "take.bvh: found the ending \".bvh\"; expected .c3d, .csv or .trc");
  EXPECT_EQ(errorOf([] {
              writeMotionCsvText({25, {"A,B"}, PositionMatrix::Zero(2, 3)});
            }),
            "CSV:time_s: found marker name \"A,B\"; expected no comma, quote, line end or outer blank");
  EXPECT_EQ(errorOf([] {
              writeTrcText({25, {"A "}, PositionMatrix::Zero(2, 3)}, "a.trc");
            }),
            "TRC:4: found marker name \"A \"; expected no tab, line end or outer blank");
}

}  // namespace
}  // namespace mouthpiece
