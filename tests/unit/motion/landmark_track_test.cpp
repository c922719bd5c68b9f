#include "motion/formats/motion_file.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

#include "base/errors.h"

namespace mouthpiece {
namespace {

/// A face of `count` points, the eye corners 0.3 image widths apart, moved by `shift` image widths.
std::string points(std::size_t count, double shift, bool as_objects) {
  std::string text = "[";
  for (std::size_t i = 0; i < count; ++i) {
    double x = 0.001 * static_cast<double>(i), y = 0.25, z = 0.0;
    if (i == 33) x = 0.2;
    if (i == 263) x = 0.5;
    if (i == 10) y = 0.05, z = -0.1;
    const auto number = [](double value) { return std::to_string(value); };
    text += i == 0 ? "" : ",";
    text += as_objects ? R"({"x":)" + number(x + shift) + R"(,"y":)" + number(y) + R"(,"z":)" + number(z) + "}"
                       : "[" + number(x + shift) + "," + number(y) + "," + number(z) + "]";
  }
  return text + "]";
}

std::string trackErrorOf(const std::string& text) {
  try {
    parseLandmarkTrack(text, "t.json", defaultLayout());
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

TEST(LandmarkTrack, BecomesMillimetresWithTheCameraInFront) {
  for (const bool as_objects : {false, true}) {
    const std::string text = R"({"fps":25,"width":400,"height":200,"frames":[)" + points(468, 0, as_objects) + "," +
                             points(468, 0.01, as_objects) + ",null]}";
    const MotionClip clip = parseLandmarkTrack(text, "t.json", defaultLayout());
    ASSERT_EQ(clip.frameCount(), 3U);
    EXPECT_EQ(clip.frame_rate_hz, 25);
    // 0.3 of 400 pixels are 90 mm: 0.75 mm a pixel.
    const MarkerIndex forehead = *clip.findMarker("FOREHEAD_TOP");
    const Eigen::Vector3d top = clip.position(FrameIndex(0), forehead);
    EXPECT_NEAR(top.x(), 0.01 * 400 * 0.75, 1e-6);
    EXPECT_NEAR(top.y(), -0.05 * 200 * 0.75, 1e-6);
    EXPECT_NEAR(top.z(), 0.1 * 400 * 0.75, 1e-6);
    EXPECT_NEAR(clip.position(FrameIndex(1), forehead).x() - top.x(), 3.0, 1e-6);
    EXPECT_TRUE(std::isnan(clip.position(FrameIndex(2), forehead).x()));
  }
}

TEST(LandmarkTrack, TakesTheFormsThatTrackersWrite) {
  const std::string of_faces = R"([{"timestamp_ms":0,"faceLandmarks":[)" + points(478, 0, true) +
                               R"(]},{"timestamp_ms":40,"faceLandmarks":[)" + points(478, 0, true) + "]}]";
  const MotionClip clip = parseLandmarkTrack(of_faces, "t.json", defaultLayout());
  EXPECT_NEAR(clip.frame_rate_hz, 25, 1e-9);
  EXPECT_EQ(clip.markerCount(), 66U);
}

TEST(LandmarkTrack, NamesWhatIsWrong) {
  EXPECT_NE(trackErrorOf("{").find("valid JSON"), std::string::npos);
  EXPECT_NE(trackErrorOf("{}").find("holds no frames"), std::string::npos);
  EXPECT_NE(trackErrorOf(R"({"fps":25,"frames":[[],[]]})").find("no face"), std::string::npos);
  EXPECT_NE(trackErrorOf(R"({"fps":25,"frames":[[[0,0,0]],[[0,0,0]]]})").find("frames[0]"), std::string::npos);
  EXPECT_NE(trackErrorOf(R"({"fps":0,"frames":[[],[]]})").find("positive"), std::string::npos);
  EXPECT_NE(
      trackErrorOf(R"({"frames":[)" + points(468, 0, false) + "," + points(468, 0, false) + "]}").find("frame rate"),
      std::string::npos);
  EXPECT_NE(trackErrorOf(R"({"fps":25,"width":3,"frames":[[],[]]})").find("both"), std::string::npos);
  EXPECT_NE(trackErrorOf(R"({"fps":1e999,"frames":[[],[]]})").find("t.json"), std::string::npos);
}

/// A track whose JSON is damaged anywhere gives a clip of finite places or an InputError.
TEST(LandmarkTrack, DamageEndsInAClipOrAnInputError) {
  const std::string whole =
      R"({"fps":25,"width":400,"height":200,"frames":[)" + points(468, 0, true) + "," + points(468, 0.01, false) + "]}";
  std::mt19937 random(1);
  const std::string letters = "[]{},:\"0-.x5en";
  for (int round = 0; round < 300; ++round) {
    std::string text = whole;
    for (std::size_t n = 1 + random() % 3; n > 0; --n)
      text[random() % text.size()] = letters[random() % letters.size()];
    if (random() % 4 == 0) text.erase(random() % text.size(), random() % 20);
    try {
      const MotionClip clip = parseLandmarkTrack(text, "t.json", defaultLayout());
      EXPECT_EQ(clip.markerCount(), 66U);
      EXPECT_FALSE(clip.positions_mm.array().isInf().any());
    } catch (const InputError& error) {
      EXPECT_TRUE(std::string(error.what()).starts_with("t.json")) << error.what();
    }
  }
}

/// Where the face is in the picture, and how large the picture is, is no part of its shape.
TEST(LandmarkTrack, ThePicturesSizeIsNotTheFaces) {
  const auto trackOf = [&](double size) {
    const std::string text = R"({"fps":25,"width":)" + std::to_string(size) + R"(,"height":)" + std::to_string(size) +
                             R"(,"frames":[)" + points(478, 0, true) + "," + points(478, 0.02, true) + "]}";
    return parseLandmarkTrack(text, "t.json", defaultLayout()).positions_mm;
  };
  EXPECT_LT((trackOf(100) - trackOf(1920)).cwiseAbs().maxCoeff(), 1e-9);
}

}  // namespace
}  // namespace mouthpiece
