#include "exports/shapes/stepped_frames.h"

#include <sys/mman.h>

#include <algorithm>
#include <atomic>

#include "base/index.h"
#include "base/parallel_for.h"

namespace mouthpiece {
namespace {

/// Asks for pages of 2 MB where `memory` fills them: panels lie pages of 4 KB apart, and each frame writes to all.
void useLargePages([[maybe_unused]] std::span<std::int16_t> memory) {
#if defined(MADV_HUGEPAGE)
  constexpr std::size_t kLargePage = std::size_t{2} << 20;
  std::size_t bytes = memory.size_bytes();
  void* first = memory.data();
  if (std::align(kLargePage, kLargePage, first, bytes) != nullptr)
    ::madvise(first, bytes / kLargePage * kLargePage, MADV_HUGEPAGE);
#endif
}

}  // namespace

SteppedFrames::SteppedFrames(Eigen::Index frame_count, Eigen::Index width, float step)
    : frame_count_(frame_count), step_(step) {
  const auto size = unsignedIndex((width + kPanelWidth - 1) / kPanelWidth * frame_count * kPanelWidth);
  steps_ = std::make_unique_for_overwrite<std::int16_t[]>(size);
  useLargePages({steps_.get(), size});
}

bool SteppedFrames::set(Eigen::Index first, const RowMajorMatrixF& places, const Eigen::RowVectorXf& rest) {
  constexpr float kMost = 32'767;
  const PanelKernels& kernels = panelKernels();
  Eigen::Array<float, kPanelWidth, 1> farthest = Eigen::Array<float, kPanelWidth, 1>::Zero();
  const Eigen::Index whole = places.cols() / kPanelWidth * kPanelWidth, left = places.cols() - whole;
  std::int16_t* to = steps_.get() + first * kPanelWidth;
  for (Eigen::Index column = 0; column < whole; column += kPanelWidth, to += frame_count_ * kPanelWidth)
    kernels.store_steps(places.data() + column, places.cols(), places.rows(), rest.data() + column, 1 / step_, to,
                        farthest.data());
  if (left > 0) {
    RowMajorMatrixF padded = RowMajorMatrixF::Zero(places.rows() + 1, kPanelWidth);
    padded.topLeftCorner(places.rows(), left) = places.rightCols(left);
    padded.bottomLeftCorner(1, left) = rest.tail(left);
    kernels.store_steps(padded.data(), kPanelWidth, places.rows(), padded.row(places.rows()).data(), 1 / step_, to,
                        farthest.data());
  }
  return (farthest <= kMost).all();
}

std::optional<SteppedFrames> SteppedFrames::of(const FrameMaker& frames, std::span<const Eigen::Index> which,
                                               const Eigen::RowVectorXf& rest, float step) {
  // A panel's frames lie side by side: several are put there at once.
  constexpr Eigen::Index kFramesAtOnce = 8, kFramesAPart = 64;
  SteppedFrames made(std::ssize(which), frames.width, step);
  std::atomic<bool> is_held = true;
  parallelFor(unsignedIndex((made.frame_count_ + kFramesAPart - 1) / kFramesAPart), [&](std::size_t part) {
    const auto make = frames.make;  // it may keep what it works with
    const Eigen::Index begin = kFramesAPart * signedIndex(part),
                       end = std::min(begin + kFramesAPart, made.frame_count_);
    RowMajorMatrixF places;
    for (Eigen::Index first = begin; first < end && is_held; first += kFramesAtOnce) {
      places.resize(std::min(kFramesAtOnce, end - first), frames.width);
      for (Eigen::Index row = 0; row < places.rows(); ++row)
        make(which[unsignedIndex(first + row)], {places.row(row).data(), unsignedIndex(places.cols())});
      if (!made.set(first, places, rest)) is_held = false;
    }
  });
  return is_held ? std::optional(std::move(made)) : std::nullopt;
}

float SteppedFrames::at(Eigen::Index frame, Eigen::Index column) const {
  const Eigen::Index panel = column / kPanelWidth, within = column % kPanelWidth;
  const Eigen::Index place = within % 3 * kPanelVertices + within / 3;
  return step_ * static_cast<float>(steps_[unsignedIndex((panel * frame_count_ + frame) * kPanelWidth + place)]);
}

void SteppedFrames::panel(Eigen::Index first, float* displacements, float* largest_squared) const {
  const std::int16_t* from = steps_.get() + first / kPanelVertices * frame_count_ * kPanelWidth;
  panelKernels().load_steps(from, frame_count_, step_, displacements, largest_squared);
}

}  // namespace mouthpiece
