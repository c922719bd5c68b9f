#include "hearing/alignment/score_stream.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <utility>

namespace mouthpiece {
namespace {

constexpr Eigen::Index kBlock = 64;

}  // namespace

ScoreStream::ScoreStream(SenoneScorer& scorer, const Eigen::MatrixXf& features, Weighing weighing,
                         const FleetingSounds& fleeting)
    : scorer_(scorer), features_(features), weighing_(std::move(weighing)), fleeting_(fleeting) {
  const std::uint32_t byte_order = 0x11223344;
  bytes_ = fmt::format("s3\nversion 0.1\nn_sen {}\nlogbase 1.0001\nendhdr\n", scorer.model().senone_count);
  bytes_.append(reinterpret_cast<const char*>(&byte_order), sizeof byte_order);
}

std::size_t ScoreStream::take(char* buffer, std::size_t size) {
  if (at_ == bytes_.size()) weighNext();
  const std::size_t count = std::min(size, bytes_.size() - at_);
  std::memcpy(buffer, bytes_.data() + at_, count);
  at_ += count;
  return count;
}

void ScoreStream::weighNext() {
  const Eigen::Index frames = std::min(kBlock, features_.cols() - next_);
  bytes_.clear();
  at_ = 0;
  if (frames == 0) return;
  SenoneScorer::Scores scores = scorer_.score(features_.middleCols(next_, frames), weighing_);
  fleeting_.weigh(scores, next_);
  const auto count = static_cast<std::int16_t>(scores.rows());
  for (Eigen::Index frame = 0; frame < frames; ++frame) {
    bytes_.append(reinterpret_cast<const char*>(&count), sizeof count);
    bytes_.append(reinterpret_cast<const char*>(scores.col(frame).data()), sizeof count * scores.rows());
  }
  next_ += frames;
}

}  // namespace mouthpiece
