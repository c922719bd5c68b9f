#include "corpus_tools/takes/take_poses.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "base/errors.h"
#include "base/statistics.h"
#include "motion/lip_gauge.h"

namespace mouthpiece {
namespace {

constexpr double kClosedShare = 0.15;
/// The median of more says no more, and all of them are in memory at once.
constexpr std::size_t kMostFrames = 10'000;

struct FramePlace {
  std::size_t take;
  std::size_t frame;
};

bool isSilent(const SpeechLabels& labels, Seconds time) {
  return std::any_of(labels.phones.begin(), labels.phones.end(), [time](const LabelledPhone& phone) {
    return phone.phone == Phone::kSil && phone.span.contains(time);
  });
}

/// What choosing the frames needs to know of a take.
struct TakeFrames {
  std::vector<double> openings;  ///< of each frame; empty when the lips' markers are not there
  std::vector<bool> silent;
};

std::vector<TakeFrames> framesOf(const std::vector<CorpusTake>& takes, const LipGauge& lips, const MotionLoader& load) {
  std::vector<TakeFrames> frames;
  for (std::size_t take = 0; take < takes.size(); ++take) {
    const MotionClip motion = load(take);
    TakeFrames& own = frames.emplace_back();
    if (lips.hasLips()) own.openings = lips.overFrames(&LipGauge::opening, motion.positions_mm);
    for (std::size_t frame = 0; frame < motion.frameCount(); ++frame)
      own.silent.push_back(isSilent(takes[take].labels, motion.timeOf(FrameIndex(frame))));
  }
  return frames;
}

std::vector<FramePlace> placesOf(const std::vector<TakeFrames>& takes, bool in_silence) {
  std::vector<FramePlace> places;
  for (std::size_t take = 0; take < takes.size(); ++take) {
    for (std::size_t frame = 0; frame < takes[take].silent.size(); ++frame) {
      if (!in_silence || takes[take].silent[frame]) places.push_back({take, frame});
    }
  }
  return places;
}

/// Of `candidates` those with closed lips; all of them when openings cannot be told.
std::vector<FramePlace> closedFrames(const std::vector<TakeFrames>& takes, const std::vector<FramePlace>& candidates) {
  std::vector<double> seen;
  for (const TakeFrames& take : takes) {
    if (take.openings.empty() && !take.silent.empty()) return candidates;
    std::copy_if(take.openings.begin(), take.openings.end(), std::back_inserter(seen),
                 [](double opening) { return std::isfinite(opening); });
  }
  if (seen.empty()) return candidates;
  const double low = quantile(seen, 0.05), high = quantile(seen, 0.95);
  const double closed_below = low + kClosedShare * (high - low);
  std::vector<FramePlace> closed;
  std::copy_if(candidates.begin(), candidates.end(), std::back_inserter(closed),
               [&](const FramePlace& place) { return takes[place.take].openings[place.frame] <= closed_below; });
  return closed;
}

/// `places` lie take after take.
MarkerPositions medianPose(const std::vector<FramePlace>& places, std::size_t markers, const MotionLoader& load) {
  const std::size_t every = places.size() / kMostFrames + 1;
  // As exact as the database keeps positions.
  Eigen::MatrixXf rows(signedIndex((places.size() + every - 1) / every), signedIndex(3 * markers));
  MotionClip motion;
  std::optional<std::size_t> loaded;
  for (std::size_t i = 0; i < places.size(); i += every) {
    if (loaded != places[i].take) motion = load(places[i].take);
    loaded = places[i].take;
    rows.row(signedIndex(i / every)) = motion.positions_mm.row(signedIndex(places[i].frame)).cast<float>();
  }
  MarkerPositions pose = MarkerPositions::Constant(signedIndex(markers), 3, std::nan(""));
  for (Eigen::Index column = 0; column < rows.cols(); ++column) {
    std::vector<double> seen;
    for (Eigen::Index row = 0; row < rows.rows(); ++row) {
      if (std::isfinite(rows(row, column))) seen.push_back(static_cast<double>(rows(row, column)));
    }
    if (!seen.empty()) pose(column / 3, column % 3) = quantile(std::move(seen), 0.5);
  }
  return pose;
}

void expectComplete(const MarkerPositions& pose, const MarkerLayout& layout) {
  for (Eigen::Index marker = 0; marker < pose.rows(); ++marker) {
    if (pose.row(marker).allFinite()) continue;
    throw InputError(fmt::format("marker {} is seen in no take; expected all {} markers of layout {}",
                                 layout.markers[unsignedIndex(marker)].name, layout.markers.size(), layout.name));
  }
}

}  // namespace

NeutralPose neutralPose(const std::vector<CorpusTake>& takes, const MarkerLayout& layout) {
  return neutralPose(takes, layout, [&](std::size_t take) { return takes[take].motion; });
}

NeutralPose neutralPose(const std::vector<CorpusTake>& takes, const MarkerLayout& layout, const MotionLoader& load) {
  MOUTHPIECE_EXPECT(!takes.empty());
  const std::vector<TakeFrames> frames = framesOf(takes, LipGauge(layout), load);
  std::vector<FramePlace> places = closedFrames(frames, placesOf(frames, true));
  if (places.empty()) places = closedFrames(frames, placesOf(frames, false));
  NeutralPose neutral{medianPose(places, layout.markers.size(), load), places.size()};
  // A marker hidden whenever the mouth rests is better known from all frames than not at all.
  if (!neutral.pose_mm.allFinite()) {
    const MarkerPositions overall = medianPose(placesOf(frames, false), layout.markers.size(), load);
    neutral.pose_mm = neutral.pose_mm.array().isFinite().select(neutral.pose_mm, overall);
  }
  expectComplete(neutral.pose_mm, layout);
  return neutral;
}

}  // namespace mouthpiece
