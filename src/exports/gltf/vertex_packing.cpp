// The vertex codec, version 0, of EXT_meshopt_compression ("Mode 0: attributes").
#include "exports/gltf/vertex_packing.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <utility>

#include "base/errors.h"

namespace mouthpiece {
namespace {

constexpr std::size_t kGroup = 16;  ///< bytes that are packed with one number of bits
constexpr std::size_t kBlockBytes = 8192, kBlockRows = 256;
constexpr std::size_t kLeastTail = 32;
constexpr char kHeader = '\xA0';

/// Differences with small absolute values as small numbers.
constexpr std::uint8_t zigzag(unsigned difference) {
  return static_cast<std::uint8_t>(difference << 1U ^ ((difference & 0x80U) != 0 ? 0xFFU : 0U));
}

/// Writes the group in kBits bits each, and what does not fit into them whole after that; returns the end.
template <unsigned kBits>
char* writeGroup(const std::array<std::uint8_t, kGroup>& group, char* to) {
  constexpr std::uint8_t kWhole = (1U << kBits) - 1;
  for (std::size_t i = 0; i < kGroup; i += 8 / kBits) {
    unsigned byte = 0;
    for (std::size_t k = 0; k < 8 / kBits; ++k) byte = byte << kBits | std::min(group[i + k], kWhole);
    *to++ = static_cast<char>(byte);
  }
  for (const std::uint8_t value : group) {
    *to = static_cast<char>(value);
    to += value >= kWhole ? 1 : 0;
  }
  return to;
}

struct Written {
  char* end;
  unsigned code;  ///< 1, 2, 3: in 2, 4, 8 bits; a group of zeros has 0 and takes no room
};

/// Writes a group with something in it in the fewest bytes.
Written writeShortest(const std::array<std::uint8_t, kGroup>& group, char* to) {
  std::uint8_t not_in_two = 0, not_in_four = 0;
  for (const std::uint8_t value : group) {
    not_in_two = static_cast<std::uint8_t>(not_in_two + (value >= 3));
    not_in_four = static_cast<std::uint8_t>(not_in_four + (value >= 15));
  }
  const std::size_t in_two = kGroup / 4 + not_in_two, in_four = kGroup / 2 + not_in_four;
  if (in_two < kGroup && in_two <= in_four) return {writeGroup<2>(group, to), 1};
  if (in_four < kGroup) return {writeGroup<4>(group, to), 2};
  return {std::copy(group.begin(), group.end(), to), 3};
}

/// Differences of a block's rows from those before them, and all those of a group of rows, column by column, as one.
struct Block {
  std::array<std::uint8_t, kBlockBytes> differences;
  std::array<std::uint8_t, kBlockBytes / kGroup> of_groups;
};

void takeBlock(const std::uint8_t* rows, const std::uint8_t* before, std::size_t count, std::size_t stride,
               Block& block) {
  const std::size_t size = count * stride, groups = (count + kGroup - 1) / kGroup;
  for (std::size_t i = 0; i < stride; ++i) block.differences[i] = zigzag(unsigned{rows[i]} - before[i]);
  for (std::size_t i = stride; i < size; ++i) block.differences[i] = zigzag(unsigned{rows[i]} - rows[i - stride]);
  std::fill(block.differences.begin() + static_cast<std::ptrdiff_t>(size),
            block.differences.begin() + static_cast<std::ptrdiff_t>(groups * kGroup * stride), std::uint8_t{0});
  for (std::size_t g = 0; g < groups; ++g) {
    for (std::size_t k = 0; k < stride; k += sizeof(std::uint32_t)) {
      std::uint32_t all = 0, next = 0;
      for (std::size_t i = 0; i < kGroup; ++i) {
        std::memcpy(&next, &block.differences[(g * kGroup + i) * stride + k], sizeof next);
        all |= next;
      }
      std::memcpy(&block.of_groups[g * stride + k], &all, sizeof all);
    }
  }
}

}  // namespace

VertexPacker::VertexPacker(std::size_t stride)
    : stride_(stride),
      block_bytes_(std::min(kBlockRows, kBlockBytes / stride / kGroup * kGroup) * stride),
      first_(stride, 0),
      before_(stride, 0),
      packed_(1, kHeader) {
  MOUTHPIECE_EXPECT(stride >= 4 && stride <= 256 && stride % 4 == 0);
  waiting_.reserve(block_bytes_);
}

void VertexPacker::append(const void* rows, std::size_t count) {
  const auto* next = static_cast<const std::uint8_t*>(rows);
  if (count_ == 0 && count > 0) {
    first_.assign(next, next + stride_);
    before_ = first_;
  }
  count_ += count;
  for (const std::uint8_t* const end = next + count * stride_; next != end;) {
    const std::size_t taken = std::min(block_bytes_ - waiting_.size(), static_cast<std::size_t>(end - next));
    waiting_.insert(waiting_.end(), next, next + taken);
    next += taken;
    if (waiting_.size() == block_bytes_) closeBlock();
  }
}

void VertexPacker::closeBlock() {
  const std::size_t rows = waiting_.size() / stride_, groups = (rows + kGroup - 1) / kGroup;
  Block block;
  takeBlock(waiting_.data(), before_.data(), rows, stride_, block);
  std::array<std::uint8_t, kGroup> group;
  std::array<char, 2 * kBlockRows> column;  // packed: codes of four groups a byte, then the groups
  for (std::size_t k = 0; k < stride_; ++k) {
    std::fill(column.begin(), column.begin() + kBlockRows / kGroup / 4, '\0');
    char* to = column.data() + (groups + 3) / 4;
    for (std::size_t g = 0; g < groups; ++g) {
      if (block.of_groups[g * stride_ + k] == 0) continue;
      for (std::size_t i = 0; i < kGroup; ++i) group[i] = block.differences[(g * kGroup + i) * stride_ + k];
      const auto [end, code] = writeShortest(group, to);
      to = end;
      column[g / 4] = static_cast<char>(static_cast<unsigned char>(column[g / 4]) | code << (2 * (g % 4)));
    }
    packed_.append(column.data(), to);
  }
  before_.assign(waiting_.end() - static_cast<std::ptrdiff_t>(stride_), waiting_.end());
  waiting_.clear();
}

std::string VertexPacker::packed() && {
  if (!waiting_.empty()) closeBlock();
  packed_.append(stride_ < kLeastTail ? kLeastTail - stride_ : 0, '\0');
  packed_.append(first_.begin(), first_.end());
  return std::move(packed_);
}

}  // namespace mouthpiece
