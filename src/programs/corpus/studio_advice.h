#pragma once

#include <optional>
#include <string>
#include <vector>

#include "programs/corpus/studio_session.h"

namespace mouthpiece {

/// What a person before the camera should change, in the order of weight; and what of the face is drawn.
StudioLook studioLook(const VideoImage& image, const std::optional<FaceLandmarks>& face);

/// Why a take should be said again: a lost face, lost images, clipped or missing sound. Plain words.
std::vector<std::string> takeFaults(const FaceTrack& track);

/// The aligner doubts so many words that others were said.
std::optional<std::string> wordFault(const TakeLabeller::Labels& found);

}  // namespace mouthpiece
