#include "exports/shapes/stepped_frames.h"

#include <algorithm>
#include <bit>

#include "base/index.h"

namespace mouthpiece {

SteppedFrames::SteppedFrames(Eigen::Index frame_count, Eigen::Index width, float step)
    : frame_count_(frame_count),
      step_(step),
      steps_(unsignedIndex((width + kPanelWidth - 1) / kPanelWidth * frame_count * kPanelWidth)) {}

bool SteppedFrames::set(Eigen::Index frame, std::span<const float> displacements) {
  // Eigen's arrays: a loop of comparisons would be no vectors.
  using Panel = Eigen::Array<float, kPanelWidth, 1>;
  constexpr float kMost = 32'767;
  constexpr float kRounds = 0x1.8p23F;  // no room for fractions above it: the last bits are the whole number
  const float steps_a_unit = 1 / step_;
  std::int16_t* to = steps_.data() + frame * kPanelWidth;
  Panel farthest = Panel::Zero(), not_finite = Panel::Zero();  // a comparison would lose a NaN
  for (std::size_t first = 0; first < displacements.size();
       first += unsignedIndex(kPanelWidth), to += frame_count_ * kPanelWidth) {
    const auto own = displacements.subspan(first, std::min(displacements.size() - first, unsignedIndex(kPanelWidth)));
    Panel steps = Panel::Zero();
    std::copy(own.begin(), own.end(), steps.begin());
    steps *= steps_a_unit;
    farthest = farthest.max(steps.abs());
    not_finite += steps - steps;
    const Panel rounded = steps.max(-kMost).min(kMost) + kRounds;
    for (Eigen::Index i = 0; i < kPanelWidth; ++i)
      to[i] = static_cast<std::int16_t>(std::bit_cast<std::uint32_t>(rounded[i]));
  }
  return (farthest <= kMost).all() && (not_finite == 0).all();
}

std::optional<SteppedFrames> SteppedFrames::of(const FrameMaker& frames, std::span<const Eigen::Index> which,
                                               const Eigen::RowVectorXf& rest, float step) {
  SteppedFrames made(std::ssize(which), frames.width, step);
  Eigen::RowVectorXf places(frames.width);
  for (std::size_t row = 0; row < which.size(); ++row) {
    frames.make(which[row], {places.data(), unsignedIndex(places.size())});
    places -= rest;
    if (!made.set(signedIndex(row), {places.data(), unsignedIndex(places.size())})) return std::nullopt;
  }
  return made;
}

float SteppedFrames::at(Eigen::Index frame, Eigen::Index column) const {
  const Eigen::Index panel = column / kPanelWidth, within = column % kPanelWidth;
  return step_ * static_cast<float>(steps_[unsignedIndex((panel * frame_count_ + frame) * kPanelWidth + within)]);
}

void SteppedFrames::panel(Eigen::Index first, std::span<float> displacements) const {
  const std::int16_t* from = steps_.data() + first / kPanelVertices * frame_count_ * kPanelWidth;
  for (std::size_t i = 0; i < displacements.size(); ++i) displacements[i] = step_ * static_cast<float>(from[i]);
}

}  // namespace mouthpiece
