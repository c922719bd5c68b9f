// Live Link Face's CSV, as the app writes it and damaged.
#include "exports/arkit.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <sstream>

#include "base/errors.h"

namespace mouthpiece {
namespace {

constexpr float kSixDigits = 1e-6F;  ///< of the CSV

/// The app's header, 52 shapes and nine angles.
std::string header() {
  std::string line = "Timecode,BlendShapeCount";
  for (const std::string_view name : kArkitNames) line += fmt::format(",{}", name);
  return line +
         ",HeadYaw,HeadPitch,HeadRoll,LeftEyeYaw,LeftEyePitch,LeftEyeRoll,RightEyeYaw,RightEyePitch,"
         "RightEyeRoll\n";
}

/// A row with `jaw` as JawOpen, the other shapes at rest, the head turned.
std::string row(const std::string& time_code, const std::string& jaw) {
  std::string line = time_code + ",61";
  for (const std::string_view name : kArkitNames) line += name == "JawOpen" ? "," + jaw : ",0.0";
  return line + ",0.31,-0.12,0.05,0,0,0,0,0,0\n";
}

ArkitTrack parse(const std::string& text, double rate_hz = 0) { return parseLiveLinkCsv(text, "x.csv", rate_hz); }

float jawAt(const ArkitTrack& track, Eigen::Index frame) { return track.weights(frame, arkitIndex("jawOpen")); }

TEST(LiveLinkReader, ReadsWhatOurExportWrites) {
  ArkitCurves curves{.frame_rate_hz = 30, .weights = RowMajorMatrixF(95, 52), .has_shape = {}};
  for (Eigen::Index i = 0; i < curves.weights.size(); ++i)
    curves.weights.data()[i] = 0.5F + 0.5F * std::sin(0.37F * static_cast<float>(i));
  const ArkitTrack track = parse(liveLinkCsv(curves));
  EXPECT_EQ(track.frame_rate_hz, 30);
  ASSERT_EQ(track.weights.rows(), 95);
  EXPECT_LT((track.weights - curves.weights).cwiseAbs().maxCoeff(), kSixDigits);
  EXPECT_FALSE(track.turns_head);
}

TEST(LiveLinkReader, TellsThatTheHeadTurns) {
  EXPECT_TRUE(parse(header() + row("01:02:03:04.000", "0.1") + row("01:02:03:05.000", "0.2")).turns_head);
}

TEST(LiveLinkReader, TimeCodesOfTheAppSetTheFrames) {
  // 60 frames a second, one dropped, parts of a frame behind the point.
  std::string text = header();
  for (int frame = 0; frame < 80; ++frame) {
    if (frame == 40) continue;
    text += row(fmt::format("15:59:{:02}:{:02}.250", 58 + (frame + 10) / 60, (frame + 10) % 60),
                fmt::format("{}", 0.01 * frame));
  }
  const ArkitTrack track = parse(text);
  EXPECT_EQ(track.frame_rate_hz, 60);
  ASSERT_EQ(track.weights.rows(), 80);
  for (const Eigen::Index frame : {0, 39, 40, 41, 79})
    EXPECT_NEAR(jawAt(track, frame), 0.01 * static_cast<double>(frame), 1e-5) << frame;
}

TEST(LiveLinkReader, AFrameWithoutAFaceIsMissing) {
  std::string text = header();
  for (int frame = 0; frame < 70; ++frame) {
    const std::string time_code = fmt::format("00:00:{:02}:{:02}.0", frame / 60, frame % 60);
    text += frame == 20 || frame == 21 ? time_code + ",0\n" : row(time_code, "0.5");
  }
  const ArkitTrack track = parse(text);
  EXPECT_TRUE(std::isnan(jawAt(track, 20)) && std::isnan(jawAt(track, 21)));
  EXPECT_EQ(jawAt(track, 19), 0.5F);
  EXPECT_EQ(jawAt(track, 22), 0.5F);
}

TEST(LiveLinkReader, ALongBreakIsMissingAndMidnightIsNone) {
  std::string text = header();
  for (int frame = 0; frame < 60; ++frame) text += row(fmt::format("23:59:59:{:02}.0", frame), "0.1");
  for (int frame = 30; frame < 60; ++frame) text += row(fmt::format("00:00:00:{:02}.0", frame), "0.3");
  const ArkitTrack track = parse(text);
  ASSERT_EQ(track.weights.rows(), 120);
  EXPECT_EQ(jawAt(track, 59), 0.1F);
  EXPECT_TRUE(std::isnan(jawAt(track, 75)));
  EXPECT_EQ(jawAt(track, 90), 0.3F);
}

TEST(LiveLinkReader, AWantedRateGoesBeforeTheTimeCode) {
  const std::string text = header() + row("00:00:00:00.0", "0") + row("00:00:00:01.0", "0.2");
  EXPECT_EQ(parse(text).frame_rate_hz, 60) << "too short to tell";
  EXPECT_EQ(parse(text, 29.97).frame_rate_hz, 29.97);
  EXPECT_EQ(parse(text, 29.97).weights.rows(), 2);
}

TEST(LiveLinkReader, ShapesThatAreNotThereRest) {
  const ArkitTrack track = parse("timecode,BlendshapeCount,jawOpen,Other\n1:2:3:4.0,2,0.5,7\n1:2:3:5.0,2,0.25,x\n");
  EXPECT_EQ(jawAt(track, 1), 0.25F);
  EXPECT_EQ(std::count(track.has_shape.begin(), track.has_shape.end(), true), 1);
  EXPECT_EQ(track.weights.col(arkitIndex("mouthPucker")).maxCoeff(), 0);
}

TEST(LiveLinkReader, BadFilesAreRefusedWithTheirLine) {
  const auto message = [](const std::string& text) -> std::string {
    try {
      parse(text);
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  };
  const std::string good = header() + row("00:00:00:00.0", "0") + row("00:00:00:01.0", "0.2");
  const auto refused = [&](const std::string& text, const std::string& part) {
    EXPECT_NE(message(text).find(part), std::string::npos) << message(text);
  };
  refused("", "is empty");
  refused("time_s,A.x\n", "expected Timecode");
  refused("Timecode,BlendShapeCount,Foo\n", "no shape of ARKit");
  refused("Timecode,BlendShapeCount,JawOpen,jaw_open\n", "twice");
  refused(header() + row("00:00:00:00.0", "0"), "holds 1 frames");
  for (const char* bad : {"-0.1", "nan", "inf", "abc", "", "1e9"})
    refused(good + row("00:00:00:02.0", bad), "x.csv:4: found");
  for (const char* bad : {"00:00:61:00.0", "00:00:00", "a:b:c:d", "00:00:00:-1.0", "00:00:nan:00.0", ""})
    refused(good + row(bad, "0"), "x.csv:4: found time code");
  refused(good + row("00:00:00:01.0", "0"), "x.csv:4: found a time code that is not behind");
  refused(good + row("11:00:00:00.0", "0"), "without long breaks");
  refused(good + "00:00:00:02.0,61,0.1,0.2\n", "x.csv:4: found 4 cells");
}

/// What is written reads back at every rate; single rows that are lost come back as their neighbours' mean.
TEST(LiveLinkReader, RandomCurvesReadBackAndLostRowsAreFilled) {
  std::mt19937 random(52);
  std::uniform_real_distribution<float> weight(0, 1);
  for (const double rate_hz : {24.0, 25.0, 30.0, 60.0, 120.0}) {
    ArkitCurves curves{.frame_rate_hz = rate_hz, .weights = RowMajorMatrixF(150, 52), .has_shape = {}};
    for (Eigen::Index i = 0; i < curves.weights.size(); ++i) curves.weights.data()[i] = weight(random);
    const std::string csv = liveLinkCsv(curves);
    const ArkitTrack whole = parseLiveLinkCsv(csv, "a.csv", rate_hz);
    EXPECT_EQ(whole.frame_rate_hz, rate_hz);
    ASSERT_EQ(whole.weights.rows(), curves.weights.rows());
    EXPECT_LT((whole.weights - curves.weights).cwiseAbs().maxCoeff(), kSixDigits);
    EXPECT_FALSE(whole.turns_head);

    // Of every four rows after the first one may go, never two neighbours.
    std::string thinned;
    std::vector<Eigen::Index> lost;
    std::istringstream lines(csv);
    Eigen::Index row = -1;
    for (std::string line; std::getline(lines, line); ++row) {
      if (row > 0 && row + 1 < curves.weights.rows() && row % 4 == 2 && random() % 2 == 0) {
        lost.push_back(row);
      } else {
        thinned += line + "\n";
      }
    }
    const ArkitTrack filled = parseLiveLinkCsv(thinned, "a.csv", rate_hz);
    ASSERT_EQ(filled.weights.rows(), curves.weights.rows());
    RowMajorMatrixF expected = curves.weights;
    for (const Eigen::Index at : lost)
      expected.row(at) = 0.5F * (curves.weights.row(at - 1) + curves.weights.row(at + 1));
    EXPECT_LT((filled.weights - expected).cwiseAbs().maxCoeff(), 2 * kSixDigits) << lost.size() << " rows lost";
  }
}

}  // namespace
}  // namespace mouthpiece
