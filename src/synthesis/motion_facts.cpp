#include "synthesis/motion_facts.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/index.h"

namespace mouthpiece {

MotionFacts::MotionFacts(std::vector<Seconds> joins, const LineToRender& line, std::size_t frame_count)
    : line_(line), frame_count_(signedIndex(frame_count)), times_(std::move(joins)) {
  std::sort(times_.begin(), times_.end());
  const LipGauge& lips = line.database.lips();
  if (!lips.hasLips()) return;
  constexpr double kClosedWithin = 0.5;  // mm beyond the speaker's usual closure
  const double usual = line.model.isPossible() ? line.model.poses().bilabial_mm : 0;
  closed_mm_ = lips.opening(line.rest()) + std::max(usual, 0.0) + kClosedWithin;
  for (const LabelledPhone& phone : line.labels.phones) {
    if (isBilabial(phone.phone)) bilabials_.push_back(phone.span);
  }
  mouth_.bilabials = bilabials_.size();
}

void MotionFacts::add(const PositionMatrix& rows) {
  const Eigen::Index first = next_ - tail_.rows();
  next_ += rows.rows();
  if (tail_.rows() == 0) {
    look(rows, first);
    tail_ = rows.bottomRows(next_ - stillNeeded());
  } else {
    PositionMatrix all(tail_.rows() + rows.rows(), rows.cols());
    all << tail_, rows;
    look(all, first);
    tail_ = all.bottomRows(next_ - stillNeeded());
  }
}

/// The first frame that a later row will be compared with.
Eigen::Index MotionFacts::stillNeeded() const {
  if (next_ == frame_count_) return next_;
  const double rate = line_.options.frame_rate_hz;
  Eigen::Index first = std::min(next_, bend_ - 1);
  if (joins_.size() < times_.size()) first = std::min(first, joinFrame(times_[joins_.size()], rate, frame_count_) - 1);
  if (looked_at_ < bilabials_.size())
    first = std::min(first, LipGauge::framesAround(bilabials_[looked_at_], rate, frame_count_).first);
  return std::max<Eigen::Index>(first, 0);
}

void MotionFacts::look(const PositionMatrix& rows, Eigen::Index first) {
  const double rate = line_.options.frame_rate_hz;
  const bool is_whole = next_ == frame_count_;
  while (joins_.size() < times_.size()) {
    constexpr Eigen::Index kLooksAhead = 2;
    if (!is_whole && joinFrame(times_[joins_.size()], rate, frame_count_) + kLooksAhead >= next_) break;
    joins_.push_back(measureJoin(rows, first, frame_count_, rate, times_[joins_.size()]));
  }
  const LipGauge& lips = line_.database.lips();
  for (; looked_at_ < bilabials_.size(); ++looked_at_) {
    const auto [from, to] = LipGauge::framesAround(bilabials_[looked_at_], rate, frame_count_);
    if (to >= next_) break;
    double least = std::numeric_limits<double>::infinity();
    for (Eigen::Index frame = from; frame <= to; ++frame)
      least = std::min(least, lips.opening(rows.row(frame - first)));
    if (least <= closed_mm_) ++mouth_.closures;
  }
  for (; bend_ + 1 < next_; ++bend_) {
    for (const Eigen::Index column : line_.database.lipColumns()) {
      const auto at = [&](Eigen::Index frame) { return rows(frame - first, column); };
      const double off = at(bend_) - 0.5 * (at(bend_ - 1) + at(bend_ + 1));
      squares_ += off * off;
    }
  }
}

MouthFacts MotionFacts::mouth() const {
  MouthFacts told = mouth_;
  const double marker_frames = asReal(std::max<Eigen::Index>(1, frame_count_ - 2)) *
                               std::max(1.0, asReal(std::ssize(line_.database.lipColumns())) / 3);
  told.jitter_mm = std::sqrt(squares_ / marker_frames);
  return told;
}

}  // namespace mouthpiece
