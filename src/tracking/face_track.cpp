#include "tracking/face_track.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "base/errors.h"
#include "base/index.h"
#include "base/statistics.h"

namespace mouthpiece {
namespace {

constexpr Eigen::Index kRightCorner = 33, kLeftCorner = 263;
constexpr double kIrisMm = 11.7;

/// A usual rate where `rate_hz` is nearest to it; neighbours such as 29.97 and 30 are a thousandth apart.
double usualRate(double rate_hz) {
  for (const double usual : {24000.0 / 1001.0, 24.0, 25.0, 30000.0 / 1001.0, 30.0, 50.0, 60000.0 / 1001.0, 60.0}) {
    if (std::abs(rate_hz / usual - 1) < 4e-4) return usual;
  }
  return rate_hz;
}

double usualStep(std::span<const Seconds> times) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < times.size(); ++i) steps.push_back(times[i] - times[i - 1]);
  return median(std::move(steps));
}

/// Every image within a twentieth of a step of its place.
bool areEven(std::span<const Seconds> times, double rate_hz) {
  for (std::size_t i = 0; i < times.size(); ++i) {
    if (std::abs((times[i] - times[0]) * rate_hz - asReal(i)) > 0.05) return false;
  }
  return true;
}

double eyeDistance(const FaceLandmarks& face) { return (face.row(kLeftCorner) - face.row(kRightCorner)).norm(); }

/// Looking into the camera to about 15 degrees: the outer corners are about as far away as each other.
bool looksAhead(const FaceLandmarks& face) {
  return std::abs(face(kLeftCorner, 2) - face(kRightCorner, 2)) < 0.25 * eyeDistance(face);
}

double irisDiameter(const FaceLandmarks& face) {
  double sum = 0;
  for (const Eigen::Index iris : {kRightIris, kLeftIris}) {
    sum += (face.row(iris + 1) - face.row(iris + 3)).head<2>().norm();
    sum += (face.row(iris + 2) - face.row(iris + 4)).head<2>().norm();
  }
  return sum / 4;
}

}  // namespace

double FaceTrack::seenShare() const {
  const auto seen = std::count_if(frames.begin(), frames.end(), [](const auto& frame) { return frame.has_value(); });
  return frames.empty() ? 0 : asReal(seen) / asReal(frames.size());
}

double FaceTrack::lostShare() const { return images == 0 ? 0 : asReal(lost_images) / asReal(images + lost_images); }

FaceTrack evenTrack(std::span<const Seconds> times, std::vector<std::optional<FaceLandmarks>> landmarks) {
  MOUTHPIECE_EXPECT(times.size() >= 2 && times.size() == landmarks.size());
  FaceTrack track;
  track.images = times.size();
  const Seconds length = times.back() - times.front();
  track.frame_rate_hz = usualRate(asReal(times.size() - 1) / length);
  if (areEven(times, track.frame_rate_hz)) {
    track.frames = std::move(landmarks);
    return track;
  }
  track.had_even_steps = false;
  const double step = usualStep(times);
  track.frame_rate_hz = usualRate(1 / step);
  for (std::size_t i = 1; i < times.size(); ++i) {
    const double steps = std::round((times[i] - times[i - 1]) / step);
    if (steps > 1) track.lost_images += static_cast<std::size_t>(steps) - 1;
  }
  const auto count = static_cast<std::size_t>(std::floor(length * track.frame_rate_hz + 1e-6)) + 1;
  std::size_t after = 1;
  for (std::size_t frame = 0; frame < count; ++frame) {
    const Seconds time = times.front() + asReal(frame) / track.frame_rate_hz;
    while (after + 1 < times.size() && times[after] < time) ++after;
    const auto &left = landmarks[after - 1], &right = landmarks[after];
    const double share = std::clamp((time - times[after - 1]) / (times[after] - times[after - 1]), 0.0, 1.0);
    // Across a hole in the video nothing is known.
    const bool is_hole = times[after] - times[after - 1] > 2.5 * step;
    if (share < 0.05) {
      track.frames.push_back(left);
    } else if (share > 0.95) {
      track.frames.push_back(right);
    } else if (left && right && !is_hole) {
      track.frames.emplace_back(*left * (1 - share) + *right * share);
    } else {
      track.frames.emplace_back();
    }
  }
  return track;
}

FaceTrack trackFace(const std::filesystem::path& video, const VideoReading& options, FaceTracker& tracker) {
  tracker.reset();
  std::vector<std::optional<FaceLandmarks>> landmarks;
  VideoSound read =
      readVideo(video, options, [&](const VideoImage& image) { landmarks.push_back(tracker.track(image)); });
  if (landmarks.size() < 2) throw InputError(video.string(), "", "holds one image; expected a video");
  FaceTrack track = evenTrack(read.times, std::move(landmarks));
  track.sound = std::move(read.sound);
  return track;
}

double medianEyeDistancePx(const FaceTrack& track) {
  std::vector<double> distances;
  for (const auto& frame : track.frames) {
    if (frame) distances.push_back(eyeDistance(*frame));
  }
  return distances.empty() ? 0 : median(std::move(distances));
}

std::optional<double> eyeCornersFromIrises(std::span<const FaceTrack> tracks) {
  std::vector<double> ratios;
  for (const FaceTrack& track : tracks) {
    for (const auto& frame : track.frames) {
      if (frame && looksAhead(*frame)) ratios.push_back(eyeDistance(*frame) / irisDiameter(*frame));
    }
  }
  if (ratios.empty()) return std::nullopt;
  return kIrisMm * median(std::move(ratios));
}

MotionClip markersOf(const FaceTrack& track, const MarkerLayout& layout, double eye_corners_mm, std::string_view name) {
  std::vector<Eigen::Index> landmarks;
  MotionClip clip{track.frame_rate_hz, {}, {}};
  for (const LayoutMarker& marker : layout.markers) {
    if (marker.mediapipe_landmark < 0 || marker.mediapipe_landmark >= FaceLandmarks::RowsAtCompileTime) continue;
    clip.marker_names.push_back(marker.name);
    landmarks.push_back(marker.mediapipe_landmark);
  }
  if (landmarks.empty())
    throw InputError(layout.name, "", "has no marker with a \"mediapipe_landmark\"; expected a layout with some");
  const double distance_px = medianEyeDistancePx(track);
  if (!(distance_px > 0)) throw InputError(std::string(name), "", "shows no face in any image; expected one");
  const double scale = eye_corners_mm / distance_px;
  clip.positions_mm.setConstant(signedIndex(track.frames.size()), signedIndex(3 * landmarks.size()),
                                std::numeric_limits<double>::quiet_NaN());
  for (std::size_t frame = 0; frame < track.frames.size(); ++frame) {
    if (!track.frames[frame]) continue;
    for (std::size_t i = 0; i < landmarks.size(); ++i) {
      const auto point = track.frames[frame]->row(landmarks[i]);
      clip.positions_mm.block<1, 3>(signedIndex(frame), signedIndex(3 * i)) =
          scale * Eigen::RowVector3d(point.x(), -point.y(), -point.z());
    }
  }
  return clip;
}

}  // namespace mouthpiece
