#include "corpus_tools/neutral_pose.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "base/errors.h"
#include "corpus_tools/lip_measures.h"

namespace mouthpiece {
namespace {

constexpr double kClosedShare = 0.15;

struct FramePlace {
  std::size_t take;
  std::size_t frame;
};

bool isSilent(const SpeechLabels& labels, Seconds time) {
  return std::any_of(labels.phones.begin(), labels.phones.end(), [time](const LabelledPhone& phone) {
    return phone.phone == Phone::kSil && phone.span.contains(time);
  });
}

std::vector<FramePlace> framesOf(const std::vector<CorpusTake>& takes, bool in_silence) {
  std::vector<FramePlace> places;
  for (std::size_t take = 0; take < takes.size(); ++take) {
    for (std::size_t frame = 0; frame < takes[take].motion.frameCount(); ++frame) {
      if (in_silence && !isSilent(takes[take].labels, takes[take].motion.timeOf(FrameIndex(frame)))) continue;
      places.push_back({take, frame});
    }
  }
  return places;
}

/// The value under which `share` of `values` lie; `values` is not empty.
double quantile(std::vector<double> values, double share) {
  const auto place = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

/// Of `candidates` those with closed lips; all of them when openings cannot be told.
std::vector<FramePlace> closedFrames(const std::vector<CorpusTake>& takes, const std::vector<FramePlace>& candidates) {
  std::vector<std::vector<double>> openings;
  std::vector<double> seen;
  for (const CorpusTake& take : takes) {
    const auto upper = take.motion.findMarker("LIP_UP_MID"), lower = take.motion.findMarker("LIP_LO_MID");
    if (!upper || !lower) return candidates;
    openings.push_back(markerDistances(take.motion, *upper, *lower));
    std::copy_if(openings.back().begin(), openings.back().end(), std::back_inserter(seen),
                 [](double opening) { return std::isfinite(opening); });
  }
  if (seen.empty()) return candidates;
  const double low = quantile(seen, 0.05), high = quantile(seen, 0.95);
  const double closed_below = low + kClosedShare * (high - low);
  std::vector<FramePlace> closed;
  std::copy_if(candidates.begin(), candidates.end(), std::back_inserter(closed),
               [&](const FramePlace& place) { return openings[place.take][place.frame] <= closed_below; });
  return closed;
}

MarkerPositions medianPose(const std::vector<CorpusTake>& takes, const std::vector<FramePlace>& places,
                           std::size_t markers) {
  MarkerPositions pose = MarkerPositions::Constant(static_cast<Eigen::Index>(markers), 3, std::nan(""));
  for (Eigen::Index column = 0; column < 3 * pose.rows(); ++column) {
    std::vector<double> seen;
    for (const FramePlace& place : places) {
      const double value = takes[place.take].motion.positions_mm(static_cast<Eigen::Index>(place.frame), column);
      if (std::isfinite(value)) seen.push_back(value);
    }
    if (!seen.empty()) pose(column / 3, column % 3) = quantile(std::move(seen), 0.5);
  }
  return pose;
}

void expectComplete(const MarkerPositions& pose, const MarkerLayout& layout) {
  for (Eigen::Index marker = 0; marker < pose.rows(); ++marker) {
    if (pose.row(marker).allFinite()) continue;
    throw InputError(fmt::format("marker {} is seen in no take; expected all {} markers of layout {}",
                                 layout.markers[static_cast<std::size_t>(marker)].name, layout.markers.size(),
                                 layout.name));
  }
}

}  // namespace

NeutralPose neutralPose(const std::vector<CorpusTake>& takes, const MarkerLayout& layout) {
  MOUTHPIECE_EXPECT(!takes.empty());
  const std::vector<FramePlace> all = framesOf(takes, false);
  std::vector<FramePlace> places = closedFrames(takes, framesOf(takes, true));
  if (places.empty()) places = closedFrames(takes, all);
  NeutralPose neutral{medianPose(takes, places, layout.markers.size()), places.size()};
  // A marker hidden whenever the mouth rests is better known from all frames than not at all.
  if (!neutral.pose_mm.allFinite()) {
    const MarkerPositions overall = medianPose(takes, all, layout.markers.size());
    neutral.pose_mm = neutral.pose_mm.array().isFinite().select(neutral.pose_mm, overall);
  }
  expectComplete(neutral.pose_mm, layout);
  return neutral;
}

}  // namespace mouthpiece
