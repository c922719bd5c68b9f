// Landmarks at a video's own times become frames at even steps, in millimetres.
#include "tracking/face_track.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "tracking/marker_refining.h"

namespace mouthpiece {
namespace {

constexpr Eigen::Index kUpperOuter = 0, kLowerOuter = 17;
constexpr double kEyesPx = 100;

/// A face of points in space, of which only those matter that are measured. `opening_px` parts the lips.
FaceLandmarks faceWith(double opening_px) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place(-60, 60);
  FaceLandmarks face;
  for (Eigen::Index i = 0; i < face.rows(); ++i) face.row(i) << place(random), place(random), 0.3 * place(random);
  face.row(33) << -kEyesPx / 2, -30, 0;
  face.row(263) << kEyesPx / 2, -30, 0;
  for (const Eigen::Index iris : {kRightIris, kLeftIris}) {
    const double x = iris == kRightIris ? -32 : 32;
    face.row(iris) << x, -30, 0;
    face.row(iris + 1) << x - 6.5, -30, 0;
    face.row(iris + 3) << x + 6.5, -30, 0;
    face.row(iris + 2) << x, -36.5, 0;
    face.row(iris + 4) << x, -23.5, 0;
  }
  for (const auto& [upper, lower] : {std::pair{13, 14}, {82, 87}, {312, 317}}) {
    face.row(upper) << 0, 40 - opening_px / 2, -10;
    face.row(lower) << 0, 40 + opening_px / 2, -10;
  }
  face.row(kUpperOuter) << 0, 30 - opening_px / 2, -12;
  face.row(kLowerOuter) << 0, 50 + opening_px / 2, -12;
  face.row(61) << -25, 40, 0;
  face.row(291) << 25, 40, 0;
  return face;
}

std::vector<Seconds> evenTimes(std::size_t count, double rate_hz, Seconds first) {
  std::vector<Seconds> times;
  for (std::size_t i = 0; i < count; ++i) times.push_back(first + asReal(i) / rate_hz);
  return times;
}

std::vector<std::optional<FaceLandmarks>> movingFaces(const std::vector<Seconds>& times) {
  std::vector<std::optional<FaceLandmarks>> faces;
  for (const Seconds time : times) faces.emplace_back(faceWith(10 * time));
  return faces;
}

TEST(EvenTrack, KeepsImagesThatComeInEvenSteps) {
  for (const double rate_hz : {24000.0 / 1001, 24.0, 25.0, 30000.0 / 1001, 30.0, 50.0, 60.0}) {
    // Containers round times to a millisecond.
    std::vector<Seconds> times = evenTimes(90, rate_hz, 0.3);
    for (Seconds& time : times) time = std::round(time * 1000) / 1000;
    const FaceTrack track = evenTrack(times, movingFaces(times));
    EXPECT_DOUBLE_EQ(track.frame_rate_hz, rate_hz);
    EXPECT_TRUE(track.had_even_steps);
    ASSERT_EQ(track.frames.size(), times.size());
    EXPECT_EQ(*track.frames[40], faceWith(10 * times[40]));
    EXPECT_EQ(track.lost_images, 0u);
  }
}

TEST(EvenTrack, LaysFramesBetweenImagesOfAVaryingRate) {
  std::vector<Seconds> times = evenTimes(100, 30, 1.0);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> late(0, 0.008);
  for (Seconds& time : times) time += late(random);
  const FaceTrack track = evenTrack(times, movingFaces(times));
  EXPECT_FALSE(track.had_even_steps);
  for (std::size_t frame = 0; frame < track.frames.size(); ++frame) {
    ASSERT_TRUE(track.frames[frame]);
    const double wanted = 10 * (times[0] + asReal(frame) / track.frame_rate_hz);
    const double opening = (*track.frames[frame])(14, 1) - (*track.frames[frame])(13, 1);
    // A twentieth of a step is taken for the image itself.
    EXPECT_NEAR(opening, wanted, 10 * 0.05 * 0.045 + 1e-9) << frame;
  }
}

TEST(EvenTrack, KnowsNothingInAHole) {
  std::vector<Seconds> times = evenTimes(60, 25, 0);
  times.erase(times.begin() + 20, times.begin() + 26);
  const FaceTrack track = evenTrack(times, movingFaces(times));
  EXPECT_EQ(track.lost_images, 6u);
  EXPECT_NEAR(track.lostShare(), 0.1, 1e-9);
  EXPECT_EQ(track.frames.size(), 60u);
  for (std::size_t frame = 20; frame < 26; ++frame) EXPECT_FALSE(track.frames[frame]) << frame;
  EXPECT_TRUE(track.frames[19] && track.frames[26]);
  EXPECT_NEAR(track.seenShare(), 0.9, 1e-9);
}

FaceTrack trackOf(const std::vector<double>& openings_px, double noise_px = 0) {
  FaceTrack track;
  track.frame_rate_hz = 25;
  std::mt19937 random(11);
  std::normal_distribution<double> noise(0, std::max(noise_px, 1e-12));
  for (const double opening : openings_px) {
    FaceLandmarks face = faceWith(opening);
    if (noise_px > 0) face = face.unaryExpr([&](double x) { return x + noise(random); });
    track.frames.emplace_back(face);
  }
  track.images = openings_px.size();
  return track;
}

TEST(EyeCorners, FollowFromTheIrises) {
  const std::vector<FaceTrack> tracks{trackOf(std::vector<double>(10, 3.0))};
  EXPECT_NEAR(*eyeCornersFromIrises(tracks), 11.7 * kEyesPx / 13, 1e-9);
  EXPECT_FALSE(eyeCornersFromIrises({}));
}

TEST(MarkersOf, AreInMillimetresUpAndTowardsTheCamera) {
  FaceTrack track = trackOf(std::vector<double>(5, 4.0));
  track.frames[2].reset();
  const MotionClip clip = markersOf(track, defaultLayout(), 90, "clip");
  const auto right = *clip.findMarker("LIP_CORNER_R"), left = *clip.findMarker("LIP_CORNER_L");
  const auto upper = *clip.findMarker("LIP_UP_MID"), lower = *clip.findMarker("LIP_LO_MID");
  EXPECT_NEAR(clip.position(FrameIndex(0), left).x() - clip.position(FrameIndex(0), right).x(), 50 * 90 / kEyesPx,
              1e-9);
  EXPECT_GT(clip.position(FrameIndex(0), upper).y(), clip.position(FrameIndex(0), lower).y());
  EXPECT_NEAR(clip.position(FrameIndex(0), upper).z(), 12 * 90 / kEyesPx, 1e-9);
  EXPECT_FALSE(clip.isSeen(FrameIndex(2), right));
}

/// Lips that open and close, each time to another depth as the tracker reads it.
std::vector<double> closings() {
  std::vector<double> openings;
  for (int i = 0; i < 100; ++i) openings.push_back(0.4 + 8 * std::pow(std::sin(i * 0.2), 2));
  return openings;
}

double outerGap(const MotionClip& clip, std::size_t frame) {
  return (clip.position(FrameIndex(frame), *clip.findMarker("LIP_UP_MID")) -
          clip.position(FrameIndex(frame), *clip.findMarker("LIP_LO_MID")))
      .norm();
}

TEST(RefineMarkers, GivesClosedLipsOneDepthAndLeavesOpenOnesApart) {
  const FaceTrack track = trackOf(closings(), 0.05);
  const auto person = measurePerson(std::vector{track}, defaultLayout(), 90);
  ASSERT_TRUE(person);
  const MotionClip plain = markersOf(track, defaultLayout(), person->eye_corners_mm, "clip");
  const MotionClip refined = refineMarkers(track, plain, defaultLayout(), *person);
  std::vector<double> before, after;
  const std::vector<double> openings = closings();
  for (std::size_t frame = 0; frame < openings.size(); ++frame) {
    if (openings[frame] < 0.45) {
      before.push_back(outerGap(plain, frame));
      after.push_back(outerGap(refined, frame));
    }
    if (openings[frame] > 4) {
      EXPECT_NEAR(outerGap(refined, frame), outerGap(plain, frame), 0.6) << frame;
    }
  }
  const auto spread = [](const std::vector<double>& values) {
    return *std::max_element(values.begin(), values.end()) - *std::min_element(values.begin(), values.end());
  };
  ASSERT_GT(before.size(), 4u);
  EXPECT_LT(spread(after), 0.7 * spread(before));
  for (const double gap : after) EXPECT_NEAR(gap, person->closed_lips_mm, 0.1);
}

TEST(RefineMarkers, ClosesTheLipsOfALayoutWithNamesOfItsOwn) {
  const FaceTrack track = trackOf(closings(), 0.05);
  MarkerLayout own = defaultLayout();
  for (const MarkerRole role :
       {MarkerRole::kUpperLip, MarkerRole::kLowerLip, MarkerRole::kRightLipCorner, MarkerRole::kLeftLipCorner})
    own.markers[own.findRole(role).value().value].role = role;
  for (LayoutMarker& marker : own.markers) marker.name = "own_" + std::to_string(&marker - own.markers.data());
  const auto refined = [&](const MarkerLayout& layout) {
    const auto person = measurePerson(std::vector{track}, layout, 90);
    return refineMarkers(track, markersOf(track, layout, person.value().eye_corners_mm, "clip"), layout, *person);
  };
  const Eigen::MatrixXd known = refined(defaultLayout()).positions_mm, named = refined(own).positions_mm;
  ASSERT_EQ(known.size(), named.size());
  EXPECT_LT((known - named).cwiseAbs().maxCoeff(), 1e-9);
}

/// The jaw turns about the joints; landmarks on the face's outline slide while it does.
TEST(RefineMarkers, LetsTheJawCarryItsMarkers) {
  constexpr std::array<Eigen::Index, 16> kChin{152, 199, 200, 175, 148, 377, 176, 400,
                                               208, 428, 201, 421, 171, 396, 149, 378};
  constexpr Eigen::Index kOutline = 172;
  constexpr double kJointY = -10, kJointZ = 60, kSlidePx = 6;
  FaceLandmarks rest = faceWith(0.4);
  rest.row(234) << -70, kJointY, kJointZ;
  rest.row(454) << 70, kJointY, kJointZ;
  for (std::size_t i = 0; i < kChin.size(); ++i) rest.row(kChin[i]) << 8 * (asReal(i) - 7.5), 85 + asReal(i % 3), -15;
  rest.row(kOutline) << -55, 60, 30;
  const auto turned = [&](Eigen::Index landmark, double angle) {
    const double y = rest(landmark, 1) - kJointY, z = rest(landmark, 2) - kJointZ;
    return Eigen::RowVector3d(rest(landmark, 0), kJointY + std::cos(angle) * y - std::sin(angle) * z,
                              kJointZ + std::sin(angle) * y + std::cos(angle) * z);
  };
  FaceTrack track;
  track.frame_rate_hz = 25;
  std::vector<double> angles;
  for (int frame = 0; frame < 100; ++frame) {
    angles.push_back(0.15 * std::pow(std::sin(0.2 * frame), 2));
    FaceLandmarks face = rest;
    for (const Eigen::Index landmark : kChin) face.row(landmark) = turned(landmark, angles.back());
    for (const Eigen::Index lip : {18, 83, 313, 17, 84, 314}) face.row(lip) = turned(lip, angles.back());
    face.row(kOutline) = turned(kOutline, angles.back());
    face(kOutline, 1) -= kSlidePx * angles.back() / 0.15;
    track.frames.emplace_back(face);
  }
  track.images = track.frames.size();
  FilmedPerson person;
  person.eye_corners_mm = kEyesPx;  // a pixel is a millimetre
  const MotionClip plain = markersOf(track, defaultLayout(), kEyesPx, "clip");
  const MotionClip refined = refineMarkers(track, plain, defaultLayout(), person);
  const MarkerIndex marker = *plain.findMarker("JAW_MID_R");
  double plain_error = 0, refined_error = 0;
  for (std::size_t frame = 10; frame < 90; ++frame) {
    const double moved = -(turned(kOutline, angles[frame]).y() - turned(kOutline, angles[55]).y());
    const auto off = [&](const MotionClip& clip) {
      return std::abs(clip.position(FrameIndex(frame), marker).y() - clip.position(FrameIndex(55), marker).y() - moved);
    };
    plain_error = std::max(plain_error, off(plain));
    refined_error = std::max(refined_error, off(refined));
  }
  EXPECT_GT(plain_error, 4);
  EXPECT_LT(refined_error, 1);
}

TEST(RefineMarkers, TakesNoiseOffAHeadAtRest) {
  const FaceTrack track = trackOf(std::vector<double>(80, 0.4), 0.15);
  const auto person = measurePerson(std::vector{track}, defaultLayout(), 90);
  const MotionClip plain = markersOf(track, defaultLayout(), 90, "clip");
  const MotionClip refined = refineMarkers(track, plain, defaultLayout(), *person);
  const auto roughness = [](const MotionClip& clip) {
    const auto& x = clip.positions_mm;
    const Eigen::Index n = x.rows() - 2;
    return (x.bottomRows(n) - 2 * x.middleRows(1, n) + x.topRows(n)).norm();
  };
  EXPECT_LT(roughness(refined), 0.6 * roughness(plain));
  EXPECT_NEAR(person->noise_mm, 0.15 * 90 / kEyesPx, 0.07);
}

}  // namespace
}  // namespace mouthpiece
