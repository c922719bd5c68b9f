#pragma once

#include <Eigen/Core>
#include <functional>
#include <span>
#include <vector>

#include "hearing/alignment/acoustic_model.h"

namespace mouthpiece {

/// One of a row of phones, each of which is said once, in this order.
struct RowPhone {
  std::span<const int> senones{};   ///< of its states: TiedModel::senonesOf()
  Eigen::Index first = 0, end = 0;  ///< frames that it may be heard in
};

/// Scores of frames [first, first + count), a column each. Valid until the next call.
using ScoresOf = std::function<const SenoneScorer::Scores&(Eigen::Index first, Eigen::Index count)>;

/// How many of `frames` frames lie before each phone but the first, as is expected of all paths through the row,
/// each as likely as it is: rising by a frame a state at least, not whole (L. R. Rabiner, Proceedings of the IEEE 77,
/// 1989, section III: forward and backward probabilities). Empty where no path leads through. Memory: 12 bytes for each
/// frame of each state.
std::vector<double> expectedBorders(std::span<const RowPhone> row, Eigen::Index frames, const ScoresOf& scores);

}  // namespace mouthpiece
