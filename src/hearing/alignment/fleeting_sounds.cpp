#include "hearing/alignment/fleeting_sounds.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <string_view>

namespace mouthpiece {
namespace {

/// A frame stands for no more than this: 0.3 s are too long for any of them.
constexpr double kMostFrames = 30;
constexpr double kWorstScore = std::numeric_limits<std::int16_t>::max();

bool isFleeting(std::string_view phone) { return rowOf(phoneFromName(phone).value_or(Phone::kSil)).fleeting; }

}  // namespace

FleetingSounds::FleetingSounds(const TiedModel& model, const std::vector<std::size_t>& kept) {
  for (const TiedModel::Codebook& codebook : model.codebooks) {
    if (isFleeting(codebook.phone)) senones_.insert(senones_.end(), codebook.senones.begin(), codebook.senones.end());
  }
  for (std::size_t i = 0; i < kept.size(); ++i) {
    const std::size_t before = kept[i > 0 ? i - 1 : i], after = kept[i + 1 < kept.size() ? i + 1 : i];
    frame_counts_.push_back(std::clamp(0.5 * static_cast<double>(after - before), 1.0, kMostFrames));
  }
}

void FleetingSounds::weigh(SenoneScorer::Scores& scores, Eigen::Index first) const {
  if (frame_counts_.empty()) return;
  for (Eigen::Index frame = 0; frame < scores.cols(); ++frame) {
    const double count = frame_counts_[static_cast<std::size_t>(first + frame)];
    for (const int senone : senones_)
      scores(senone, frame) = static_cast<std::int16_t>(std::min(count * scores(senone, frame), kWorstScore));
  }
}

double FleetingSounds::timesWeighed(Phone phone, std::size_t first, std::size_t last) const {
  if (last >= frame_counts_.size() || !rowOf(phone).fleeting) return 1;
  const auto begin = frame_counts_.begin() + static_cast<std::ptrdiff_t>(first);
  const auto end = frame_counts_.begin() + static_cast<std::ptrdiff_t>(last + 1);
  return std::accumulate(begin, end, 0.0) / static_cast<double>(last + 1 - first);
}

}  // namespace mouthpiece
