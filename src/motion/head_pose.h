#pragma once

namespace mouthpiece {

/// Where the eyes look, the head still; radians, 0 straight ahead.
struct GazeTurn {
  float yaw = 0;    ///< to the subject's left
  float pitch = 0;  ///< up
};

/// How the head is turned from where it rests; radians, about the top of the neck, roll first, then pitch, then yaw.
struct HeadTurn {
  float yaw = 0;    ///< to the subject's left
  float pitch = 0;  ///< up
  float roll = 0;   ///< towards the subject's right shoulder
};

}  // namespace mouthpiece
