#include "units/file/packed_rows.h"

#include <algorithm>
#include <cmath>

#include "audio/audio_clip.h"
#include "base/deflate.h"
#include "base/errors.h"
#include "base/index.h"

namespace mouthpiece {
namespace {

/// Positions reach 10^7 mm: 2^34 steps, and a second difference four times that.
constexpr std::size_t kPlanes = 5;
constexpr std::uint64_t kMask = (std::uint64_t{1} << (8 * kPlanes)) - 1;
constexpr double kLargestStep = 0x1.0p36;
constexpr int kEffort = 4;

/// Small numbers of either sign become small numbers without one.
std::uint64_t folded(std::uint64_t difference) {
  const bool is_negative = (difference >> (8 * kPlanes - 1) & 1) != 0;
  return (is_negative ? ~(difference << 1) : difference << 1) & kMask;
}
/// The same back, but for what lies above the planes.
std::uint64_t unfolded(std::uint64_t number) { return number >> 1 ^ (~(number & 1) + 1); }

bool isZero(std::string_view bytes) {
  return bytes.empty() || (bytes[0] == 0 && bytes.substr(1) == bytes.substr(0, bytes.size() - 1));
}

/// Of one column the lowest plane, the others each `numbers` bytes behind the one before, and which frames were not
/// seen.
struct PackedColumn {
  const char* planes;
  std::size_t numbers;
  const char* unseen;
};

/// Positions of a column whose planes from kUsed on are empty; one `stride` floats behind the other.
template <std::size_t kUsed>
void unpackColumn(const PackedColumn& column, std::size_t frames, Eigen::Index stride, float* to) {
  // Sums modulo 2^64 are right modulo 2^40, too, which the last shifts leave.
  constexpr int kAbove = 64 - 8 * static_cast<int>(kPlanes);
  std::uint64_t position = 0, difference = 0;
  for (std::size_t frame = 0; frame < frames; ++frame, to += stride) {
    std::uint64_t number = 0;
    for (std::size_t plane = 0; plane < kUsed; ++plane)
      number |= std::uint64_t{static_cast<unsigned char>(column.planes[plane * column.numbers + frame])} << (8 * plane);
    difference += unfolded(number);
    position += difference;
    const std::int64_t step = static_cast<std::int64_t>(position << kAbove) >> kAbove;
    *to = column.unseen[frame] != 0 ? std::numeric_limits<float>::quiet_NaN() : asFloat(asReal(step) * kPackedStepMm);
  }
}

}  // namespace

std::optional<std::string> packedPositions(const FloatMatrix& positions) {
  const auto frames = unsignedIndex(positions.rows()), columns = unsignedIndex(positions.cols());
  const std::size_t markers = columns / 3, numbers = frames * columns;
  std::string bytes(frames * markers + kPlanes * numbers, '\0');
  char* const planes = bytes.data() + frames * markers;
  for (std::size_t column = 0; column < columns; ++column) {
    std::uint64_t before = 0, difference_before = 0;
    for (std::size_t frame = 0; frame < frames; ++frame) {
      const double step = positions(signedIndex(frame), signedIndex(column)) / kPackedStepMm;
      const bool is_seen = !std::isnan(step);
      if (is_seen && (step != std::floor(step) || std::abs(step) > kLargestStep)) return std::nullopt;
      if (!is_seen) bytes[column / 3 * frames + frame] = 1;
      // What was not seen stays where it was: a difference of nothing.
      const std::uint64_t here = is_seen ? static_cast<std::uint64_t>(static_cast<std::int64_t>(step)) : before;
      const std::uint64_t difference = here - before;
      std::uint64_t number = folded((difference - difference_before) & kMask);
      for (std::size_t plane = 0; plane < kPlanes; ++plane, number >>= 8U)
        planes[plane * numbers + column * frames + frame] = static_cast<char>(number & 0xFFU);
      before = here;
      difference_before = difference;
    }
  }
  std::string packed = deflated(bytes, kEffort);
  return packed.size() < numbers * sizeof(float) ? std::optional(std::move(packed)) : std::nullopt;
}

std::optional<FloatMatrix> unpackedPositions(std::string_view packed, std::size_t frames, Eigen::Index columns) {
  const std::size_t markers = unsignedIndex(columns) / 3, numbers = frames * unsignedIndex(columns);
  const std::optional<std::string> bytes = inflated(packed, frames * markers + kPlanes * numbers);
  if (!bytes) return std::nullopt;
  const char* const planes = bytes->data() + frames * markers;
  FloatMatrix positions(signedIndex(frames), columns);
  for (Eigen::Index column = 0; column < columns; ++column) {
    const std::size_t start = unsignedIndex(column) * frames;
    // The upper planes of what moves slowly are empty.
    std::size_t used = kPlanes;
    while (used > 1 && isZero({planes + (used - 1) * numbers + start, frames})) --used;
    const PackedColumn packed_column{planes + start, numbers, bytes->data() + unsignedIndex(column) / 3 * frames};
    float* const to = positions.data() + column;
    if (used == 1) {
      unpackColumn<1>(packed_column, frames, columns, to);
    } else if (used == 2) {
      unpackColumn<2>(packed_column, frames, columns, to);
    } else {
      unpackColumn<kPlanes>(packed_column, frames, columns, to);
    }
  }
  return positions;
}

std::optional<std::vector<bool>> unpackedUnseen(std::string_view packed, std::size_t frames, Eigen::Index columns) {
  const std::size_t markers = unsignedIndex(columns) / 3;
  const std::optional<std::string> bytes = inflatedStart(packed, frames * markers);
  if (!bytes) return std::nullopt;
  std::vector<bool> unseen(frames, false);
  if (isZero(*bytes)) return unseen;  // as most takes are
  for (std::size_t i = 0; i < bytes->size(); ++i) {
    if ((*bytes)[i] != 0) unseen[i % frames] = true;
  }
  return unseen;
}

std::optional<std::string> packedSamples(const std::vector<std::int16_t>& samples) {
  if (samples.empty()) return std::nullopt;
  std::string packed = flacBytes(samples);
  return packed.size() < samples.size() * sizeof(std::int16_t) ? std::optional(std::move(packed)) : std::nullopt;
}

std::optional<std::vector<float>> unpackedSamples(std::string_view packed, std::size_t count) {
  const std::optional<std::vector<std::int16_t>> samples = flacSamples(packed, count);
  if (!samples) return std::nullopt;
  std::vector<float> real(count);
  std::transform(samples->begin(), samples->end(), real.begin(),
                 [](std::int16_t s) { return static_cast<float>(s) / 32768.0F; });
  return real;
}

}  // namespace mouthpiece
