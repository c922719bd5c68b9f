#include "speaker/live_parts.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/errors.h"
#include "base/index.h"

namespace mouthpiece {
namespace {

constexpr std::uint64_t kLongestGap = 10, kLongestLateness = 1;  ///< seconds
constexpr Seconds kLongestWait = 0.1;
constexpr std::size_t kMostStretches = 64;
constexpr std::uint64_t kLastSample = std::uint64_t{1} << 62;

}  // namespace

ChunkOrder::Place ChunkOrder::place(std::uint64_t at, std::size_t count, LiveCounts& counts) {
  const auto rate = static_cast<std::uint64_t>(rate_hz_);
  if (at > kLastSample || count > kLastSample)
    throw InputError(fmt::format("found a chunk of sound at sample {}; expected places that rise from 0", at));
  if (count == 0) return {};  // tells nothing; behind our clock it would move it back
  const auto shifted = static_cast<std::int64_t>(at) + shift_;
  std::uint64_t begin = static_cast<std::uint64_t>(std::max<std::int64_t>(0, shifted));
  std::uint64_t end = begin + count;
  if (begin > next_ + kLongestGap * rate) {
    throw InputError(fmt::format("found a chunk of sound {:.1f} s ahead of what came before; expected at most {} s",
                                 asReal(begin - next_) / rate_hz_, kLongestGap));
  }
  if (end <= next_ && count > 0) {
    const bool is_late = std::any_of(passed_over_.begin(), passed_over_.end(), [&](const Stretch& stretch) {
      return begin < stretch.end && stretch.begin < end;
    });
    ++(is_late ? counts.late : counts.doubled);
    late_in_a_row_ = is_late ? late_in_a_row_ + count : 0;
    if (late_in_a_row_ <= kLongestLateness * rate) return {0, count};
    // A sender whose clock stood still with it would be late for ever.
    ++counts.restarts;
    late_in_a_row_ = 0;
    shift_ += static_cast<std::int64_t>(next_ - begin);
    begin = next_;
    end = begin + count;
  }
  late_in_a_row_ = 0;
  if (begin > next_) {
    ++counts.dropped;
    counts.missing += asReal(begin - next_) / rate_hz_;
    const auto silence = static_cast<std::size_t>(begin - next_);
    passOver(silence);
    follow(count);
    return {silence, 0};
  }
  const auto skipped = static_cast<std::size_t>(next_ - begin);
  follow(count - skipped);
  return {0, skipped};
}

bool ChunkOrder::isAhead(std::uint64_t at) const {
  return at <= kLastSample && static_cast<std::int64_t>(at) + shift_ > static_cast<std::int64_t>(next_);
}

bool ChunkOrder::mayWait(std::uint64_t at, std::size_t count) const {
  if (!isAhead(at) || count > kLastSample) return false;
  const auto end = static_cast<std::uint64_t>(static_cast<std::int64_t>(at) + shift_) + count;
  return end - next_ <= static_cast<std::uint64_t>(kLongestWait * rate_hz_);
}

void ChunkOrder::passOver(std::size_t count) {
  if (count == 0) return;
  passed_over_.push_back({next_, next_ + count});
  if (passed_over_.size() > kMostStretches) passed_over_.pop_front();
  next_ += count;
}

}  // namespace mouthpiece
