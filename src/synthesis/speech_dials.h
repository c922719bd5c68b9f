#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "vocal/vocal_style.h"

namespace mouthpiece {

/// How the lips and the jaw of a line go, whatever moves them: over time, as VOCAL's parameters. Lids and brows are
/// left alone.
struct SpeechDials {
  StyleSignal strength{1.0};  ///< of all movement of the mouth
  StyleSignal jaw{1.0};       ///< of what goes with the jaw
  StyleSignal lips{1.0};      ///< of the rest
  StyleSignal hold{0.0};     ///< 0: as it was; 1: the poses in the middles of phones are held, quickly left and reached
  StyleSignal lead_ms{0.0};  ///< how much earlier than the sound the mouth moves
  StyleSignal smooth_ms{0.0};  ///< standard deviation of the Gaussian in time that smooths it
};

/// A dial: its name for people and files, its unit, what it takes, and what it is left at.
struct DialRow {
  std::string_view name, unit;
  double least, usual, most;
  StyleSignal SpeechDials::*signal;
};
inline constexpr std::array<DialRow, 6> kSpeechDials{{{"strength", "", 0, 1, 2, &SpeechDials::strength},
                                                      {"jaw", "", 0, 1, 2, &SpeechDials::jaw},
                                                      {"lips", "", 0, 1, 2, &SpeechDials::lips},
                                                      {"hold", "", 0, 0, 1, &SpeechDials::hold},
                                                      {"lead", "ms", -200, 0, 200, &SpeechDials::lead_ms},
                                                      {"smooth", "ms", 0, 0, 200, &SpeechDials::smooth_ms}}};

/// Whether a dial is where it is left at, all the time.
bool isUsual(const DialRow& dial, const SpeechDials& dials);
bool areUsual(const SpeechDials& dials);

}  // namespace mouthpiece
