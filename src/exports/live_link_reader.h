#pragma once

#include <string_view>

#include "exports/arkit.h"

namespace mouthpiece {

/// Weights of ARKit's shapes over time, as an app recorded them.
struct ArkitTrack {
  double frame_rate_hz = 0;
  RowMajorMatrixF weights;      ///< frames x 52, zero or more; a frame without a face is NaN throughout
  std::vector<bool> has_shape;  ///< 52: the file has a column for it
  bool turns_head = false;      ///< HeadYaw, HeadPitch or HeadRoll are not zero throughout
};

/// Reads Live Link Face's CSV (docs/formats/arkit.md). Frames that the app dropped are put in between their neighbours,
/// or NaN where more than kLongestDrop are missing. `frame_rate_hz` 0: as the frame numbers of the time code count.
/// Of the head's and the eyes' columns only turns_head is read. Throws InputError with the line for what is no such
/// file.
ArkitTrack parseLiveLinkCsv(std::string_view text, std::string_view file, double frame_rate_hz = 0);

/// True when the first line is one of Live Link Face's.
bool isLiveLinkCsv(std::string_view text);

/// Dropped frames in a row that are still interpolated.
inline constexpr int kLongestDrop = 3;

}  // namespace mouthpiece
