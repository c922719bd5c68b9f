#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "base/errors.h"
#include "motion/formats/motion_csv.h"
#include "support/error_of.h"
#include "synthetic_motion.h"

namespace mouthpiece {
namespace {

std::string csvFailure(const std::string& text) {
  try {
    readMotionCsvText(text, "bad.csv");
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

std::string trcFailure(const std::string& text) {
  try {
    readTrcText(text, "bad.trc");
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(MotionCsv, WritesTheTableOfTheDesignPage) {
  MotionClip clip{25.0, {"LIP", "CHIN"}, PositionMatrix(2, 6)};
  clip.positions_mm << 1.0, -2.5, 0.00004, 1e3, 0.0, -0.00001, 7.0, 8.0, 9.0, NAN, NAN, NAN;
  EXPECT_EQ(writeMotionCsvText(clip),
            "time_s,LIP.x,LIP.y,LIP.z,CHIN.x,CHIN.y,CHIN.z\n"
            "0.000000,1.0000,-2.5000,0.0000,1000.0000,0.0000,0.0000\n"
            "0.040000,7.0000,8.0000,9.0000,,,\n");
}

TEST(MotionCsv, WriteReadWriteIsByteIdentical) {
  for (const double rate_hz : {24.0, 25.0, 29.97, 30000.0 / 1001.0, 60.0, 119.88, 120.0, 240.0, 12.5}) {
    MotionClip clip = SyntheticMotion(31, 5).clip(rate_hz, 500);
    clip.positions_mm.block(3, 6, 4, 3).setConstant(std::numeric_limits<double>::quiet_NaN());
    const std::string once = writeMotionCsvText(clip);
    const MotionClip back = readMotionCsvText(once, "once.csv");
    EXPECT_EQ(writeMotionCsvText(back), once) << rate_hz;
    EXPECT_NEAR(back.frame_rate_hz, rate_hz, rate_hz * 1e-6);
  }
}

TEST(MotionCsv, TakesCarriageReturnsBlankLinesAndNan) {
  const MotionClip clip =
      readMotionCsvText("\xEF\xBB\xBFtime_s,A.x,A.y,A.z\r\n0,1,2,3\r\n\r\n0.5, 4 ,nan,6\r\n", "t.csv");
  EXPECT_EQ(clip.frame_rate_hz, 2.0);
  EXPECT_EQ(clip.position(FrameIndex(0), MarkerIndex(0)), Eigen::Vector3d(1, 2, 3));
  EXPECT_TRUE(clip.position(FrameIndex(1), MarkerIndex(0)).array().isNaN().all()) << "half a position is none";
}

TEST(MotionCsv, APositionThatLacksACoordinateIsNone) {
  for (const char* row : {",2,3", "1,,3", "1,2,"}) {
    const MotionClip clip =
        readMotionCsvText("time_s,A.x,A.y,A.z,B.x,B.y,B.z\n0," + std::string(row) + ",4,5,6\n1,1,2,3,4,5,6\n", "t.csv");
    EXPECT_TRUE(clip.position(FrameIndex(0), MarkerIndex(0)).array().isNaN().all()) << row;
    EXPECT_EQ(clip.position(FrameIndex(0), MarkerIndex(1)), Eigen::Vector3d(4, 5, 6)) << row;
  }
}

TEST(MotionCsv, FindsTheRateThatWasMeantInAFewRoundedTimes) {
  for (const double rate_hz : {24 / 1.001, 25.0, 30 / 1.001, 60 / 1.001, 12.5, 33.33, 59.9}) {
    std::string text = "time_s,A.x,A.y,A.z\n";
    for (int row = 0; row < 3; ++row) text += fmt::format("{:.6f},1,2,3\n", row / rate_hz);
    EXPECT_DOUBLE_EQ(readMotionCsvText(text, "t.csv").frame_rate_hz, rate_hz);
  }
}

TEST(MotionCsv, NamesTheLineThatIsWrong) {
  const std::string head = "time_s,A.x,A.y,A.z\n0,1,2,3\n";
  EXPECT_EQ(csvFailure(head + "1,2,3,4\n"), "");
  EXPECT_EQ(csvFailure(head + "1,2,3\n"), "bad.csv:3: found 3 cells; expected 4");
  EXPECT_EQ(csvFailure(head + "1,2,3,4,5\n"), "bad.csv:3: found 5 cells; expected 4");
  EXPECT_EQ(csvFailure(head + "1,2,x,4\n"), "bad.csv:3: found \"x\"; expected a number");
  EXPECT_EQ(csvFailure(head + "zero,2,3,4\n"), "bad.csv:3: found time \"zero\"; expected seconds");
  EXPECT_NE(csvFailure(head + "1,inf,3,4\n").find("bad.csv:3: found a position of inf mm"), std::string::npos);
  EXPECT_NE(csvFailure(head + "0,2,3,4\n").find("expected it to rise"), std::string::npos);
  EXPECT_NE(csvFailure(head + "nan,2,3,4\n").find("not finite"), std::string::npos);
  EXPECT_NE(csvFailure(head + "1,2,3,4\n1.1,2,3,4\n").find("expected even times"), std::string::npos);
  EXPECT_NE(csvFailure(head).find("fewer than two rows"), std::string::npos);
  EXPECT_NE(csvFailure("").find("is empty"), std::string::npos);
  EXPECT_NE(csvFailure("t,A.x,A.y,A.z\n").find("expected time_s"), std::string::npos);
  EXPECT_NE(csvFailure("time_s\n").find("found 1 columns"), std::string::npos);
  EXPECT_NE(csvFailure("time_s,A.x,B.y,A.z\n").find("found column \"B.y\""), std::string::npos);
  EXPECT_NE(csvFailure("time_s,.x,.y,.z\n").find("found column \".x\""), std::string::npos);
  EXPECT_NE(csvFailure("time_s,A.x,A.y,A.z,A.x,A.y,A.z\n").find("found marker A twice"), std::string::npos);
}

TEST(MotionCsv, CutOffAnywhereItNeverCrashes) {
  const std::string whole = writeMotionCsvText(SyntheticMotion(32, 2).clip(25.0, 6));
  for (std::size_t length = 0; length < whole.size(); ++length) csvFailure(whole.substr(0, length));
  EXPECT_EQ(csvFailure(whole), "");
}

TEST(MotionCsv, RefusesNamesThatBreakTheTable) {
  for (const char* name : {"A,B", "A\"", "A\nB", "", " A"}) {
    EXPECT_THROW(writeMotionCsvText(MotionClip{25.0, {name}, PositionMatrix::Zero(2, 3)}), InputError) << name;
  }
}

TEST(MotionTrc, WriteReadWriteIsByteIdentical) {
  MotionClip clip = SyntheticMotion(33, 4).clip(29.97, 50);
  clip.positions_mm.block(3, 9, 4, 3).setConstant(std::numeric_limits<double>::quiet_NaN());
  const std::string once = writeTrcText(clip, "take.trc");
  const MotionClip back = readTrcText(once, "once.trc");
  EXPECT_EQ(back.frame_rate_hz, 29.97);
  EXPECT_EQ(back.marker_names, clip.marker_names);
  EXPECT_EQ(writeTrcText(back, "take.trc"), once);
}

TEST(MotionTrc, ReadsWhatOtherProgramsWrite) {
  const std::string text =
      "PathFileType\t4\t(X/Y/Z)\tjump.trc\n"
      "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames\n"
      "200.00\t200.00\t2\t2\tm\t200.00\t1\t2\n"
      "Frame#\tTime\tR.Eye\t\t\tL.Eye\t\t\t\n"
      "\t\tX1\tY1\tZ1\tX2\tY2\tZ2\t\n"
      "\n"
      "1\t0.000\t0.1\t0.2\t0.3\t\t\t\t\n"
      "2\t0.005\t0.1\t0.2\t0.3\t-1\t-2\t-3\t\n";
  const MotionClip clip = readTrcText(text, "jump.trc");
  EXPECT_EQ(clip.frame_rate_hz, 200.0);
  EXPECT_EQ(clip.marker_names, (std::vector<std::string>{"R.Eye", "L.Eye"}));
  EXPECT_FALSE(clip.isSeen(FrameIndex(0), MarkerIndex(1)));
  EXPECT_LT((clip.position(FrameIndex(1), MarkerIndex(1)) - Eigen::Vector3d(-1000, -2000, -3000)).norm(), 1e-9);
}

/// Rows left out would bring all that follows too early beside the sound.
TEST(MotionTrc, RefusesTimesThatItsRateDoesNotHave) {
  const auto errorAt = [](const std::vector<double>& times, const char* rate) {
    std::string text =
        std::string("PathFileType\t4\t(X/Y/Z)\ta.trc\nDataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\n") + rate +
        "\t60\t4\t1\tmm\nFrame#\tTime\tA\n\t\tX1\tY1\tZ1\n\n";
    for (const double time : times) text += "1\t" + std::to_string(time) + "\t1\t2\t3\n";
    return errorOf([&] { readTrcText(text, "a.trc"); });
  };
  EXPECT_EQ(errorAt({0, 0.017, 0.033, 0.05}, "60"), "no error");
  EXPECT_EQ(errorAt({7, 7.0167, 7.0333, 7.05}, "59.94"), "no error");
  EXPECT_NE(
      errorAt({0, 0.0167, 1.0333, 1.05}, "60").find("row 3: found time 1.0333 s after 0.0167 s; expected even times"),
      std::string::npos);
  EXPECT_NE(errorAt({0, 0.01, 0.02, 0.03}, "60").find("expected even times"), std::string::npos);
}

TEST(MotionTrc, NamesTheLineThatIsWrong) {
  const std::string whole = writeTrcText(SyntheticMotion(34, 2).clip(25.0, 3), "x.trc");
  EXPECT_EQ(trcFailure(whole), "");
  for (std::size_t length = 0; length < whole.size(); ++length) trcFailure(whole.substr(0, length));
  EXPECT_NE(trcFailure("hello\n").find("is no TRC file"), std::string::npos);
  EXPECT_NE(trcFailure(whole + "4\t0.12\t1\t2\n").find("found 2 cells of positions; expected 6"), std::string::npos);
  EXPECT_NE(trcFailure(whole + "4\n").find("found no time"), std::string::npos);
  std::string feet = whole;
  feet.replace(feet.find("\tmm\t"), 4, "\tft\t");
  EXPECT_NE(trcFailure(feet).find("found units \"ft\""), std::string::npos);
}

/// The rate that times tell is the one that was meant, wherever the clock began; of television, whole, or of a few
/// decimals.
TEST(MotionCsv, TellsTheRateWhereverTimeBegins) {
  for (const double rate : {24.0, 30000.0 / 1001, 60000.0 / 1001, 120000.0 / 1001, 120.5, 99.75, 0.5, 250.0, 1000.0}) {
    for (const double begin : {0.0, 3.25, 1200.0}) {
      std::string text = "time_s,A.x,A.y,A.z\n";
      for (int frame = 0; frame < 90; ++frame) text += fmt::format("{:.6f},1,2,3\n", begin + frame / rate);
      EXPECT_DOUBLE_EQ(readMotionCsvText(text, "a.csv").frame_rate_hz, rate) << begin;
    }
  }
}

/// Two rows tell a rate to some thousandths: the one of fewest decimals within that was meant.
TEST(MotionCsv, TheRoundestRateThatTimesAllowIsTaken) {
  const auto rateOf = [](const std::string& second, int frames) {
    std::string text = "time_s,A.x,A.y,A.z\n0,1,2,3\n";
    for (int frame = 1; frame < frames; ++frame) text += fmt::format("{:.6f},1,2,3\n", frame * std::stod(second));
    return readMotionCsvText(text, "a.csv").frame_rate_hz;
  };
  EXPECT_DOUBLE_EQ(rateOf("0.016658", 2), 60.03) << "60.0312, sure to 7 thousandths";
  EXPECT_DOUBLE_EQ(rateOf(fmt::format("{:.12f}", 1 / 47.953), 40), 47.953) << "sure to a ten thousandth";
  EXPECT_NE(rateOf(fmt::format("{:.12f}", 1 / 47.953), 40), 47.95);
}

/// A coordinate alone is no place: where one of three is missing the marker was not seen.
TEST(MotionCsv, APlaceIsThreeNumbersOrNone) {
  const std::string text =
      "time_s,A.x,A.y,A.z,B.x,B.y,B.z\n0,,2,3,1,2,3\n0.01,1,nan,3,1,2,3\n0.02,1,2,,1,2,3\n0.03,1,2,3,1,2,3\n";
  const MotionClip clip = readMotionCsvText(text, "a.csv");
  for (std::size_t frame = 0; frame < 4; ++frame) {
    EXPECT_EQ(clip.positions_mm.row(signedIndex(frame)).head<3>().array().isNaN().all(), frame < 3) << frame;
    EXPECT_EQ(clip.positions_mm.row(signedIndex(frame)).head<3>().allFinite(), frame == 3) << frame;
    EXPECT_TRUE(clip.isSeen(FrameIndex(frame), MarkerIndex(1)));
  }
}

/// Frames a quarter of a step from their place are even enough; further off the row is named.
TEST(MotionCsv, RowsOffTheirPlaceAreNamed) {
  const auto withRowOff = [](double frames) {
    std::string text = "time_s,A.x,A.y,A.z\n";
    for (int frame = 0; frame < 20; ++frame)
      text += fmt::format("{:.6f},1,2,3\n", 5 + 0.01 * (frame + (frame == 7 ? frames : 0)));
    return text;
  };
  for (const double off : {-0.24, 0.24})
    EXPECT_NEAR(readMotionCsvText(withRowOff(off), "a.csv").frame_rate_hz, 100, 1e-9);
  for (const double off : {-0.26, 0.26}) {
    try {
      (void)readMotionCsvText(withRowOff(off), "a.csv");
      ADD_FAILURE() << off;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find("row 8"), std::string::npos) << error.what();
    }
  }
}

}  // namespace
}  // namespace mouthpiece
