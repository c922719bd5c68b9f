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
constexpr int kLevelRounds = 3;
/// Variance within a phone over variance between takes, per coordinate: 1.2^2 / 0.6^2 in grid_s1.
constexpr double kLevelShrinkage = 4;

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
                                 layout.markers[static_cast<std::size_t>(marker)].name, layout.markers.size(), layout.name));
  }
}

/// One observation: all markers in the frame nearest to a phone's middle.
struct PhoneFrame {
  std::size_t take;
  Phone phone;
  Eigen::RowVectorXd positions;
};

std::vector<PhoneFrame> phoneFrames(const std::vector<CorpusTake>& takes) {
  std::vector<PhoneFrame> observed;
  for (std::size_t take = 0; take < takes.size(); ++take) {
    const MotionClip& motion = takes[take].motion;
    for (const LabelledPhone& phone : takes[take].labels.phones) {
      if (phone.phone == Phone::kSil) continue;  // breathing: says nothing about the take
      const auto frame = static_cast<Eigen::Index>(std::lround(phone.span.middle() * motion.frame_rate_hz));
      if (frame >= motion.positions_mm.rows()) continue;
      if (!motion.positions_mm.row(frame).allFinite()) continue;
      observed.push_back({take, phone.phone, motion.positions_mm.row(frame)});
    }
  }
  return observed;
}

using Rows = std::vector<Eigen::RowVectorXd>;

/// Mean over the observations of each group of what is left after `others`.
template <typename GroupOf, typename Others>
Rows groupMeans(const std::vector<PhoneFrame>& observed, std::size_t groups, Eigen::Index width, double shrinkage,
                const GroupOf& group_of, const Others& others) {
  Rows means(groups, Eigen::RowVectorXd::Zero(width));
  std::vector<double> counts(groups, 0.0);
  for (const PhoneFrame& observation : observed) {
    means[group_of(observation)] += observation.positions - others(observation);
    counts[group_of(observation)] += 1;
  }
  for (std::size_t group = 0; group < groups; ++group) {
    if (counts[group] > 0) means[group] /= counts[group] + shrinkage;
  }
  return means;
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

std::vector<double> levelTakes(std::vector<CorpusTake>& takes) {
  const std::vector<PhoneFrame> observed = phoneFrames(takes);
  std::vector<double> largest(takes.size(), 0.0);
  if (observed.empty()) return largest;
  const Eigen::Index width = observed.front().positions.cols();
  const auto take_of = [](const PhoneFrame& observation) { return observation.take; };
  const auto phone_of = [](const PhoneFrame& observation) { return static_cast<std::size_t>(observation.phone); };
  Rows offsets(takes.size(), Eigen::RowVectorXd::Zero(width));
  for (int round = 0; round < kLevelRounds; ++round) {
    const Rows phones = groupMeans(observed, kPhoneCount, width, 0.0, phone_of,
                                   [&](const PhoneFrame& observation) -> const auto& { return offsets[observation.take]; });
    offsets = groupMeans(observed, takes.size(), width, kLevelShrinkage, take_of,
                         [&](const PhoneFrame& observation) -> const auto& { return phones[phone_of(observation)]; });
  }
  for (std::size_t take = 0; take < takes.size(); ++take) {
    takes[take].motion.positions_mm.rowwise() -= offsets[take];
    for (Eigen::Index column = 0; column < width; column += 3) {
      largest[take] = std::max(largest[take], offsets[take].segment<3>(column).norm());
    }
  }
  return largest;
}

}  // namespace mouthpiece
