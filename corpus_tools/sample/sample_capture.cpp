
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <string_view>
#include <vector>

#include "corpus_tools/sample/actor_performance.h"
#include "corpus_tools/sample/sample_random.h"

namespace mouthpiece {
namespace {

enum CaptureStream : std::uint64_t { kNoiseStream = 40, kGapStream, kSeatStream, kNodStream, kTurnStream = 50 };

constexpr double kRadians = std::numbers::pi / 180;

// Heads of speakers stray some degrees about each axis, slowly, and nod on some stressed syllables (Hadar et al. 1983).
constexpr Seconds kTurnCorrelation = 0.45;
constexpr std::array kTurnDegrees = {1.1, 1.2, 0.6};  ///< deviation about X (nod), Y (turn), Z (tilt)
constexpr Seconds kSwayCorrelation = 0.8;
constexpr double kSwayMm = 2.0;
constexpr double kNodChance = 0.5, kLeastNodDegrees = 0.8, kLargestNodDegrees = 2.4;
constexpr Seconds kNodWidth = 0.13;  ///< deviation of its bell

const Eigen::Vector3d kNeckMm(0, -110, -95);            ///< in face axes: where the head turns
const Eigen::Vector3d kSeatMm(20, 1180, 150);           ///< the neck in the room
constexpr double kSeatSpreadMm = 12, kSeatDegrees = 4;  ///< how differently the actor sits from take to take

/// Markers that hands, lips and hair hide from the cameras most.
bool isOftenHidden(std::string_view name) {
  constexpr std::array<std::string_view, 6> kOften = {"LIP_", "CHIN_", "LID_", "NOSTRIL_", "JAW_", "CHEEK_MOUTH"};
  return std::any_of(kOften.begin(), kOften.end(), [&](std::string_view prefix) { return name.starts_with(prefix); });
}

/// Nods: degrees about X, down positive.
Eigen::VectorXd nods(const SpeechLabels& labels, double frame_rate_hz, Eigen::Index frames, std::uint64_t seed) {
  SampleRandom random(seed, kNodStream);
  Eigen::VectorXd degrees = Eigen::VectorXd::Zero(frames);
  for (const LabelledSyllable& syllable : labels.syllables) {
    if (syllable.stress != 1 || random.uniform() >= kNodChance) continue;
    const double size = random.uniform(kLeastNodDegrees, kLargestNodDegrees);
    const Seconds middle = labels.spanOf(syllable.phones).middle() + random.uniform(-0.05, 0.05);
    for (Eigen::Index frame = 0; frame < frames; ++frame) {
      const double z = (asReal(frame) / frame_rate_hz - middle) / kNodWidth;
      degrees(frame) += size * std::exp(-0.5 * z * z);
    }
  }
  return degrees;
}

Eigen::Quaterniond rotation(const Eigen::Vector3d& degrees) {
  return Eigen::AngleAxisd(degrees.y() * kRadians, Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(degrees.x() * kRadians, Eigen::Vector3d::UnitX()) *
         Eigen::AngleAxisd(degrees.z() * kRadians, Eigen::Vector3d::UnitZ());
}

std::vector<Eigen::Isometry3d> headMotion(const MotionClip& face, const SpeechLabels& labels, std::uint64_t seed) {
  SampleRandom random(seed, kSeatStream);
  const auto frames = signedIndex(face.frameCount());
  const auto spread = [&](double size) {
    Eigen::Vector3d vector;
    for (double& coordinate : vector) coordinate = size * random.normal();
    return vector;
  };
  const Eigen::Vector3d seat_mm = kSeatMm + spread(kSeatSpreadMm);
  const Eigen::Quaterniond seat = rotation(spread(kSeatDegrees));
  Eigen::MatrixXd degrees(frames, 3), sway_mm(frames, 3);
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const auto stream = kTurnStream + static_cast<std::uint64_t>(axis);
    degrees.col(axis) = kTurnDegrees[unsignedIndex(axis)] *
                        smoothNoise(seed, stream, kTurnCorrelation, face.frame_rate_hz, face.frameCount());
    sway_mm.col(axis) =
        kSwayMm * smoothNoise(seed, stream + 3, kSwayCorrelation, face.frame_rate_hz, face.frameCount());
  }
  degrees.col(0) += nods(labels, face.frame_rate_hz, frames, seed);
  std::vector<Eigen::Isometry3d> room_from_face;
  for (Eigen::Index frame = 0; frame < frames; ++frame) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translate(seat_mm + sway_mm.row(frame).transpose());
    pose.rotate(seat * rotation(degrees.row(frame).transpose()));
    pose.translate(-kNeckMm);
    room_from_face.push_back(pose);
  }
  return room_from_face;
}

/// Hides `marker` from `start` for `length`; returns the samples that were seen before.
std::size_t hide(MotionClip& clip, std::size_t marker, Seconds start, Seconds length) {
  const auto frames = signedIndex(clip.frameCount());
  const auto first = static_cast<Eigen::Index>(std::lround(start * clip.frame_rate_hz));
  const auto count = std::max<Eigen::Index>(1, static_cast<Eigen::Index>(std::lround(length * clip.frame_rate_hz)));
  std::size_t hidden = 0;
  for (Eigen::Index frame = first; frame < std::min(frames, first + count); ++frame) {
    auto sample = clip.positions_mm.block<1, 3>(frame, signedIndex(3 * marker));
    if (sample.allFinite()) ++hidden;
    sample.setConstant(std::numeric_limits<double>::quiet_NaN());
  }
  return hidden;
}

/// The marker nearest to `marker` in the first frame: what hides one may hide the other.
std::size_t nearestMarker(const MarkerPositions& pose, std::size_t marker) {
  const auto row = signedIndex(marker);
  Eigen::VectorXd squared = (pose.rowwise() - pose.row(row)).rowwise().squaredNorm();
  squared(row) = std::numeric_limits<double>::max();
  Eigen::Index nearest = 0;
  squared.minCoeff(&nearest);
  return unsignedIndex(nearest);
}

SampleGaps addGaps(MotionClip& clip, const SampleCaptureOptions& options) {
  SampleRandom random(options.seed, kGapStream);
  const MarkerPositions pose = clip.pose(FrameIndex(0));
  std::vector<std::size_t> often;
  for (std::size_t marker = 0; marker < clip.markerCount(); ++marker) {
    if (isOftenHidden(clip.marker_names[marker])) often.push_back(marker);
  }
  SampleGaps gaps;
  const auto hideSome = [&](Seconds start, Seconds length) {
    const bool is_often = random.uniform() < 0.7 && !often.empty();
    const std::size_t marker = is_often ? often[random.index(often.size())] : random.index(clip.markerCount());
    gaps.hidden_samples += hide(clip, marker, start, length);
    ++gaps.gaps;
    if (random.uniform() >= 0.15) return;
    gaps.hidden_samples += hide(clip, nearestMarker(pose, marker), start, length);
    ++gaps.gaps;
  };
  // A Poisson process along the take, so that longer takes have more gaps.
  const Seconds duration = clip.duration();
  if (options.gaps_per_take > 0) {
    const Seconds interval = duration / options.gaps_per_take;
    for (Seconds at = random.waiting(interval); at < duration; at += random.waiting(interval)) {
      hideSome(at, random.uniform(options.shortest_gap, options.longest_gap));
    }
  }
  if (random.uniform() < options.long_gap_chance) {
    const Seconds length = random.uniform(options.shortest_long_gap, options.longest_long_gap);
    hideSome(random.uniform(0, std::max(0.0, duration - length)), length);
  }
  return gaps;
}

}  // namespace

MarkerPositions sampleJig() {
  MarkerPositions jig(7, 3);
  // No two distances alike, so that a system can tell the markers apart.
  jig << 3, 104, 34,  //
      -48, 97, 14,    //
      52, 100, 10,    //
      -86, 78, -48,   //
      88, 83, -52,    //
      -31, 137, -22,  //
      38, 128, -46;
  return jig;
}

SampleCapture captureSample(const MotionClip& face, const SpeechLabels& labels, const SampleCaptureOptions& options) {
  const MarkerPositions jig = sampleJig();
  SampleCapture capture;
  MotionClip& motion = capture.motion;
  motion.frame_rate_hz = face.frame_rate_hz;
  motion.marker_names = face.marker_names;
  for (Eigen::Index i = 0; i < jig.rows(); ++i) motion.marker_names.push_back("JIG_" + std::to_string(i + 1));
  motion.positions_mm.resize(face.positions_mm.rows(), signedIndex(3 * motion.markerCount()));

  const std::vector<Eigen::Isometry3d> room_from_face = headMotion(face, labels, options.seed);
  SampleRandom noise(options.seed, kNoiseStream);
  const double noise_mm = options.noise_mm / std::numbers::sqrt3;  // a coordinate's
  for (std::size_t frame = 0; frame < face.frameCount(); ++frame) {
    MarkerPositions pose(signedIndex(motion.markerCount()), 3);
    pose << face.pose(FrameIndex(frame)), jig;
    for (Eigen::Index marker = 0; marker < pose.rows(); ++marker) {
      Eigen::Vector3d seen = room_from_face[frame] * Eigen::Vector3d(pose.row(marker).transpose());
      for (double& coordinate : seen) coordinate += noise_mm * noise.normal();
      motion.positions_mm.block<1, 3>(signedIndex(frame), 3 * marker) = seen.transpose();
    }
  }
  capture.hidden = addGaps(motion, options);
  return capture;
}

}  // namespace mouthpiece
