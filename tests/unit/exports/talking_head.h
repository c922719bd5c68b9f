#pragma once

#include <string>
#include <vector>

#include "deform/kernel/face_animation.h"
#include "deform/mesh/face_mesh.h"
#include "synthesis/utterance_animation.h"

namespace mouthpiece::samples {

/// A made-up line on a made-up head, for the tests of the exports: an egg whose lower part, from the mouth down, swings
/// open about a hinge with the vowels. The sound is a hum as loud as the mouth is wide.
struct TalkingHead {
  FaceMesh mesh;  ///< mm; parts "upper head" (skin), "lower head" (lips), "eyes" (eye, never moves)
  FaceAnimation animation;
  UtteranceAnimation utterance;           ///< motion: the three control points
  std::vector<std::string> marker_names;  ///< LIP_UP_MID LIP_LO_MID CHIN
};

struct TalkingHeadOptions {
  std::size_t frames = 120;
  double frame_rate_hz = 60;
  std::size_t rings = 48;  ///< of each half; vertices grow with rings * segments
  std::size_t segments = 64;
  std::string word = "mama";  ///< put into words and names of takes
  double ripple_mm = 0;       ///< a wave that runs over the skin, which no few shapes can follow
};

TalkingHead makeTalkingHead(const TalkingHeadOptions& options = {});

}  // namespace mouthpiece::samples
