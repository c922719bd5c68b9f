#include "corpus_tools/takes/take_poses.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "corpus_tools/takes/pose_fit.h"

namespace mouthpiece {
namespace {

constexpr int kRounds = 3;
constexpr RigidFitOptions kAllAlike{0};  ///< plain least squares

/// What the two-way layout phone + take needs to know of the frames nearest to the phones' middles: counts and sums.
struct PhoneSums {
  using Counts = std::array<std::uint32_t, kPhoneCount>;
  std::vector<Counts> counts;               ///< by take
  std::vector<Eigen::RowVectorXd> of_take;  ///< sum of the positions of all markers
  std::vector<Eigen::RowVectorXd> of_phone;
  Eigen::RowVectorXd mean;
  double observations = 0;
};

PhoneSums phoneSums(const std::vector<CorpusTake>& takes, const MotionLoader& load) {
  PhoneSums sums;
  sums.counts.resize(takes.size());
  for (std::size_t take = 0; take < takes.size(); ++take) {
    const MotionClip motion = load(take);
    const Eigen::RowVectorXd none = Eigen::RowVectorXd::Zero(motion.positions_mm.cols());
    if (take == 0) {
      sums.of_phone.assign(kPhoneCount, none);
      sums.mean = none;
    }
    sums.of_take.push_back(none);
    for (const LabelledPhone& phone : takes[take].labels.phones) {
      if (phone.phone == Phone::kSil) continue;  // breathing: says nothing about the take
      const auto frame = static_cast<Eigen::Index>(std::lround(phone.span.middle() * motion.frame_rate_hz));
      if (frame >= motion.positions_mm.rows() || !motion.positions_mm.row(frame).allFinite()) continue;
      ++sums.counts[take][static_cast<std::size_t>(phone.phone)];
      sums.of_take[take] += motion.positions_mm.row(frame);
      sums.of_phone[static_cast<std::size_t>(phone.phone)] += motion.positions_mm.row(frame);
      sums.observations += 1;
    }
    sums.mean += sums.of_take[take];
  }
  if (sums.observations > 0) sums.mean /= sums.observations;
  return sums;
}

using Rows = std::vector<Eigen::RowVectorXd>;

/// Per take, how far each marker coordinate lies off what its phones let expect: alternating means of phones and takes.
Rows takeOffsets(const PhoneSums& sums) {
  const Eigen::RowVectorXd none = Eigen::RowVectorXd::Zero(sums.mean.size());
  Rows offsets(sums.of_take.size(), none);
  for (int round = 0; round < kRounds; ++round) {
    Rows phones = sums.of_phone;
    std::vector<double> phone_counts(kPhoneCount, 0.0);
    for (std::size_t take = 0; take < offsets.size(); ++take) {
      for (std::size_t phone = 0; phone < kPhoneCount; ++phone) {
        const auto count = asReal(sums.counts[take][phone]);
        if (count == 0) continue;
        phones[phone] -= count * offsets[take];
        phone_counts[phone] += count;
      }
    }
    for (std::size_t phone = 0; phone < kPhoneCount; ++phone) phones[phone] /= std::max(1.0, phone_counts[phone]);
    for (std::size_t take = 0; take < offsets.size(); ++take) {
      offsets[take] = sums.of_take[take];
      double frames = 0;
      for (std::size_t phone = 0; phone < kPhoneCount; ++phone) {
        const auto count = asReal(sums.counts[take][phone]);
        if (count > 0) offsets[take] -= count * phones[phone];
        frames += count;
      }
      offsets[take] /= std::max(1.0, frames);
    }
  }
  return offsets;
}

MarkerPositions asPose(const Eigen::RowVectorXd& row) {
  return Eigen::Map<const MarkerPositions>(row.data(), row.size() / 3, 3);
}

}  // namespace

std::vector<TakeMove> takeMovesByPhones(const std::vector<CorpusTake>& takes, const MotionLoader& load) {
  const PhoneSums sums = phoneSums(takes, load);
  std::vector<TakeMove> moves(takes.size());
  if (sums.observations == 0) return moves;
  const Rows offsets = takeOffsets(sums);
  const MarkerPositions mean_face = asPose(sums.mean);
  for (std::size_t take = 0; take < takes.size(); ++take) {
    moves[take].move = fitRigidMotion(asPose(sums.mean + offsets[take]), mean_face, kAllAlike);
    if (!moves[take].move) continue;
    MarkerPositions moved = mean_face;
    transform(moved, *moves[take].move);
    moves[take].largest_mm = (moved - mean_face).rowwise().norm().maxCoeff();
  }
  return moves;
}

std::vector<double> alignTakesByPhones(std::vector<CorpusTake>& takes) {
  const auto moves = takeMovesByPhones(takes, [&](std::size_t take) { return takes[take].motion; });
  std::vector<double> largest;
  for (std::size_t take = 0; take < takes.size(); ++take) {
    if (moves[take].move) transform(takes[take].motion, *moves[take].move);
    largest.push_back(moves[take].largest_mm);
  }
  return largest;
}

}  // namespace mouthpiece
