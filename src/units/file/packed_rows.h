#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace mouthpiece {

/// The motion of a take as the file holds it: frames x (3 * markers) floats, NaN on all three axes where not seen.
using FloatMatrix = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Less than a hundredth of an optical system's noise. `corpus build` rounds to it, so that what it writes can be
/// packed.
inline constexpr double kPackedStepMm = 1.0 / 1024;

/// The bytes of `positions` without loss, packed (docs/formats/corpus.md, "Packed rows"); nullopt where they are no
/// multiples of kPackedStepMm, or would not become smaller than as floats.
std::optional<std::string> packedPositions(const FloatMatrix& positions);
/// What packedPositions() made; nullopt for anything else. Memory is reserved for no more than `packed` can hold.
std::optional<FloatMatrix> unpackedPositions(std::string_view packed, std::size_t frames, Eigen::Index columns);
/// Of each frame of the same, whether some marker was not seen in it: a look at the packed bytes' beginning.
std::optional<std::vector<bool>> unpackedUnseen(std::string_view packed, std::size_t frames, Eigen::Index columns);

/// A FLAC file of the samples; nullopt where it would not be smaller than the samples.
std::optional<std::string> packedSamples(const std::vector<std::int16_t>& samples);
/// What packedSamples() made; nullopt for anything else.
std::optional<std::vector<float>> unpackedSamples(std::string_view packed, std::size_t count);

}  // namespace mouthpiece
