#pragma once

#include <string_view>

namespace mouthpiece {

/// Positions beyond ten kilometres are no capture but a misread file; frame rates likewise.
inline constexpr double kMaxPositionMm = 1e7;
inline constexpr double kMaxFrameRateHz = 1e6;

/// Throws InputError unless the rate is positive, finite and at most kMaxFrameRateHz.
void expectFrameRate(double frame_rate_hz, std::string_view file, std::string_view place);

}  // namespace mouthpiece
