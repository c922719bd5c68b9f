#pragma once

#include <compare>
#include <cstddef>

namespace mouthpiece {

/// An index into one kind of list; indices of different kinds do not mix.
template <typename Tag>
struct Index {
  std::size_t value = 0;

  constexpr Index() = default;
  constexpr explicit Index(std::size_t index) : value(index) {}
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
