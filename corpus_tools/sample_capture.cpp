#include "corpus_tools/sample_capture.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <numbers>
#include <vector>

#include "base/errors.h"
#include "corpus_tools/actor_performance.h"
#include "corpus_tools/sample_random.h"
#include "motion/marker_layout.h"

namespace mouthpiece {
namespace {

enum Stream : std::uint64_t { kHeadStream = 40, kNoiseStream = 60, kGapStream, kPlaceStream };

constexpr Seconds kHeadCorrelation = 0.8;
constexpr double kLongGapShortest = 0.2, kLongGapLongest = 0.4;
constexpr double kLipGapShare = 0.4;  ///< of the gaps hide a lip or chin marker, which move most and shadow each other

/// The top of the neck, about which heads turn, from the point between the eye corners (Zatsiorsky 2002, rounded).
const Eigen::Vector3d kNeckPivotMm(0, -90, -100);
/// Where the actor stands in the room.
const Eigen::Vector3d kRoomPlaceMm(120, 1560, 240);

/// A headband's markers, from the top of the forehead.
const std::vector<Eigen::Vector3d> kJigOffsetsMm = {{0, 52, -12},  {-48, 42, -26}, {48, 42, -26}, {-86, 18, -74},
                                                    {86, 18, -74}, {-58, 84, -82}, {58, 84, -82}};

std::vector<Eigen::Vector3d> jigPlaces(const MotionClip& performance) {
  const auto top = performance.findMarker("FOREHEAD_TOP");
  MOUTHPIECE_EXPECT(top.has_value());
  // The forehead moves by fractions of a millimetre with the brows; the band does not follow.
  const Eigen::Vector3d forehead =
      performance.positions_mm.middleCols<3>(static_cast<Eigen::Index>(3 * top->value)).colwise().mean().transpose();
  std::vector<Eigen::Vector3d> places;
  for (const Eigen::Vector3d& offset : kJigOffsetsMm) places.emplace_back(forehead + offset);
  return places;
}

/// Slow nods, turns, tilts and sway about a place and pose that differ a little from take to take.
std::vector<Eigen::Isometry3d> headPath(const MotionClip& performance, const SampleCaptureOptions& options,
                                        std::uint64_t seed) {
  const std::size_t frames = performance.frameCount();
  const auto drift = [&](std::uint64_t stream) {
    return smoothNoise(seed, kHeadStream + stream, kHeadCorrelation, performance.frame_rate_hz, frames);
  };
  const Eigen::VectorXd nod = drift(0), turn = drift(1), tilt = drift(2), x = drift(3), y = drift(4), z = drift(5);
  SampleRandom place(seed, kPlaceStream);
  const Eigen::Vector3d stand =
      kRoomPlaceMm + 15.0 * Eigen::Vector3d(place.normal(), 0.3 * place.normal(), place.normal());
  const double facing_deg = 3.0 * place.normal();
  constexpr double kDegree = std::numbers::pi / 180;

  std::vector<Eigen::Isometry3d> path;
  for (std::size_t i = 0; i < frames; ++i) {
    const auto frame = static_cast<Eigen::Index>(i);
    const Eigen::Matrix3d rotation =
        (Eigen::AngleAxisd((facing_deg + options.turn_deg * turn(frame)) * kDegree, Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(options.nod_deg * nod(frame) * kDegree, Eigen::Vector3d::UnitX()) *
         Eigen::AngleAxisd(options.tilt_deg * tilt(frame) * kDegree, Eigen::Vector3d::UnitZ()))
            .toRotationMatrix();
    Eigen::Isometry3d room_from_head = Eigen::Isometry3d::Identity();
    room_from_head.linear() = rotation;
    room_from_head.translation() = stand + kNeckPivotMm - rotation * kNeckPivotMm +
                                   options.sway_mm * Eigen::Vector3d(x(frame), 0.5 * y(frame), z(frame));
    path.push_back(room_from_head);
  }
  return path;
}

/// Markers that move most, and so are hidden most often.
std::vector<std::size_t> lipAndChinMarkers(const MotionClip& clip) {
  std::vector<std::size_t> markers;
  for (std::size_t i = 0; i < clip.markerCount(); ++i) {
    if (clip.marker_names[i].starts_with("LIP_") || clip.marker_names[i].starts_with("CHIN_")) markers.push_back(i);
  }
  return markers;
}

std::size_t hideMarkers(MotionClip& clip, const SampleCaptureOptions& options, std::uint64_t seed) {
  SampleRandom random(seed, kGapStream);
  const std::vector<std::size_t> lively = lipAndChinMarkers(clip);
  std::size_t gaps = 0;
  for (Seconds start = random.waiting(options.mean_between_gaps); start < clip.duration();
       start += random.waiting(options.mean_between_gaps)) {
    const bool is_lively = !lively.empty() && random.uniform() < kLipGapShare;
    const std::size_t marker = is_lively ? lively[random.index(lively.size())] : random.index(clip.markerCount());
    const bool is_long = random.uniform() < options.long_gap_share;
    const Seconds length = is_long ? random.uniform(kLongGapShortest, kLongGapLongest)
                                   : random.uniform(options.shortest_gap, options.longest_gap);
    const auto first = static_cast<Eigen::Index>(start * clip.frame_rate_hz);
    const auto count =
        std::min(static_cast<Eigen::Index>(length * clip.frame_rate_hz) + 1, clip.positions_mm.rows() - first);
    clip.positions_mm.block(first, static_cast<Eigen::Index>(3 * marker), count, 3)
        .setConstant(std::numeric_limits<double>::quiet_NaN());
    ++gaps;
  }
  return gaps;
}

}  // namespace

SampleCapture captureSample(const MotionClip& performance, const SampleCaptureOptions& options, std::uint64_t seed) {
  const std::vector<Eigen::Isometry3d> path = headPath(performance, options, seed);
  const std::vector<Eigen::Vector3d> jig = jigPlaces(performance);
  const std::vector<std::string>& jig_names = defaultLayout().jig_names;
  MOUTHPIECE_EXPECT(jig.size() == jig_names.size());

  SampleCapture capture{performance, 0};
  MotionClip& room = capture.motion;
  room.marker_names.insert(room.marker_names.end(), jig_names.begin(), jig_names.end());
  room.positions_mm.resize(performance.positions_mm.rows(), static_cast<Eigen::Index>(3 * room.markerCount()));
  SampleRandom noise(seed, kNoiseStream);
  for (std::size_t frame = 0; frame < performance.frameCount(); ++frame) {
    for (std::size_t marker = 0; marker < room.markerCount(); ++marker) {
      const Eigen::Vector3d on_head = marker < performance.markerCount()
                                          ? performance.position(FrameIndex(frame), MarkerIndex(marker))
                                          : jig[marker - performance.markerCount()];
      const Eigen::Vector3d error(noise.normal(), noise.normal(), noise.normal());
      room.positions_mm.block<1, 3>(static_cast<Eigen::Index>(frame), static_cast<Eigen::Index>(3 * marker)) =
          (path[frame] * on_head + options.noise_mm * error).transpose();
    }
  }
  capture.gaps = hideMarkers(room, options, seed);
  return capture;
}

}  // namespace mouthpiece
