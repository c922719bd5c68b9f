#include "corpus_tools/take_alignment.h"

#include <algorithm>
#include <cmath>

#include "corpus_tools/pose_fit.h"

namespace mouthpiece {
namespace {

constexpr int kRounds = 3;
constexpr RigidFitOptions kAllAlike{0};  ///< plain least squares

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
Rows groupMeans(const std::vector<PhoneFrame>& observed, std::size_t groups, Eigen::Index width,
                const GroupOf& group_of, const Others& others) {
  Rows means(groups, Eigen::RowVectorXd::Zero(width));
  std::vector<double> counts(groups, 0.0);
  for (const PhoneFrame& observation : observed) {
    means[group_of(observation)] += observation.positions - others(observation);
    counts[group_of(observation)] += 1;
  }
  for (std::size_t group = 0; group < groups; ++group) {
    if (counts[group] > 0) means[group] /= counts[group];
  }
  return means;
}

/// Per take, how far each marker coordinate lies off what its phones let expect.
Rows takeOffsets(const std::vector<PhoneFrame>& observed, std::size_t takes, Eigen::Index width) {
  const auto take_of = [](const PhoneFrame& observation) { return observation.take; };
  const auto phone_of = [](const PhoneFrame& observation) { return static_cast<std::size_t>(observation.phone); };
  Rows offsets(takes, Eigen::RowVectorXd::Zero(width));
  for (int round = 0; round < kRounds; ++round) {
    const Rows phones = groupMeans(
        observed, kPhoneCount, width,
        phone_of, [&](const PhoneFrame& observation) -> const auto& { return offsets[observation.take]; });
    offsets = groupMeans(
        observed, takes, width,
        take_of, [&](const PhoneFrame& observation) -> const auto& { return phones[phone_of(observation)]; });
  }
  return offsets;
}

MarkerPositions asPose(const Eigen::RowVectorXd& row) {
  return Eigen::Map<const MarkerPositions>(row.data(), row.size() / 3, 3);
}

}  // namespace

std::vector<double> alignTakesByPhones(std::vector<CorpusTake>& takes) {
  const std::vector<PhoneFrame> observed = phoneFrames(takes);
  std::vector<double> largest(takes.size(), 0.0);
  if (observed.empty()) return largest;
  const Eigen::Index width = observed.front().positions.cols();
  const Rows offsets = takeOffsets(observed, takes.size(), width);
  Eigen::RowVectorXd mean = Eigen::RowVectorXd::Zero(width);
  for (const PhoneFrame& observation : observed) mean += observation.positions / static_cast<double>(observed.size());
  const MarkerPositions mean_face = asPose(mean);
  for (std::size_t take = 0; take < takes.size(); ++take) {
    const auto fit = fitRigidMotion(asPose(mean + offsets[take]), mean_face, kAllAlike);
    if (!fit) continue;
    transform(takes[take].motion, *fit);
    MarkerPositions moved = mean_face;
    transform(moved, *fit);
    largest[take] = (moved - mean_face).rowwise().norm().maxCoeff();
  }
  return largest;
}

}  // namespace mouthpiece
