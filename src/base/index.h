#pragma once

#include <Eigen/Core>
#include <cassert>
#include <compare>
#include <concepts>
#include <cstddef>

namespace mouthpiece {

// Lists of the standard library count in std::size_t, Eigen in signed numbers. These four name the change from one kind
// of number to another, so that a cast in the code stands out as something else.

/// A count or place for Eigen.
constexpr Eigen::Index signedIndex(std::integral auto n) { return static_cast<Eigen::Index>(n); }
/// A count or place for the standard library; `n` is not negative.
constexpr std::size_t unsignedIndex(std::integral auto n) {
  assert(n >= 0);
  return static_cast<std::size_t>(n);
}
/// A count as a real number; exact up to 2^53.
constexpr double asReal(std::integral auto n) { return static_cast<double>(n); }
/// A real number in single precision, as meshes and sounds hold them.
constexpr float asFloat(std::floating_point auto x) { return static_cast<float>(x); }

/// An index into one kind of list; indices of different kinds do not mix.
template <typename Tag>
struct Index {
  std::size_t value = 0;

  constexpr Index() = default;
  constexpr explicit Index(std::size_t index) : value(index) {}
  /// The same place for Eigen.
  [[nodiscard]] constexpr Eigen::Index row() const { return signedIndex(value); }
  constexpr auto operator<=>(const Index&) const = default;
  constexpr Index& operator++() {
    ++value;
    return *this;
  }
};

using FrameIndex = Index<struct FrameTag>;    ///< a row of a MotionClip
using MarkerIndex = Index<struct MarkerTag>;  ///< a marker of a layout or clip
using PhoneIndex = Index<struct PhoneTag>;    ///< a phone within one SpeechLabels
using TakeIndex = Index<struct TakeTag>;      ///< a take of a corpus

}  // namespace mouthpiece
