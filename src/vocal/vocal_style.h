#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "audio/audio_tags.h"
#include "phonetics/labels/speech_labels.h"

namespace mouthpiece {

/// A parameter of the style over time: straight lines between points in time order, held beyond them.
struct StyleSignal {
  struct Point {
    Seconds time = 0;
    double value = 0;
    bool operator==(const Point&) const = default;
  };
  std::vector<Point> points;

  StyleSignal() = default;
  explicit StyleSignal(double constant) : points{{0, constant}} {}
  [[nodiscard]] double at(Seconds time) const;
  [[nodiscard]] bool isConstant() const;
};

/// The four parameters of VOCAL 3: Ma and Ps, 0 to 1, say when and how far visemes are reached; Ja and Li scale the jaw
/// and lip parts of their poses, 1 as the actor speaks.
struct VocalStyle {
  StyleSignal ma{0.0}, ps{0.0}, ja{1.0}, li{1.0};
};

/// The largest Ja and Li that are taken.
inline constexpr double kLargestArticulation = 2;

/// What a user gave for one parameter: a number, "auto" (Ma and Ps only), or the name of a file.
struct StyleChoice {
  std::optional<double> constant;
  std::filesystem::path file;
  bool automatic = false;
};

/// Throws InputError named after `option` for a number out of [0, largest], or "auto" where `may_be_auto` is off.
StyleChoice parseStyleChoice(std::string_view text, std::string_view option, double largest, bool may_be_auto);

/// Reads `time_s,value` rows (a header is skipped), times rising. Throws InputError with file and line.
StyleSignal readStyleSignal(const std::filesystem::path& path, double largest);
StyleSignal parseStyleSignal(std::string_view text, std::string_view name, double largest);

/// The heuristic of VOCAL 4.2 for Ma, a value per phone: a consonant's high-frequency energy against that of all
/// consonants; 0.5 where the sound says nothing of it.
std::vector<double> melodicAccents(const SpeechLabels& labels, const AudioTags& tags);
/// For Ps: 0.1 for vowels up to 0.2 s, growing by 1 a second to 1.
std::vector<double> pitchSensitivities(const SpeechLabels& labels);
/// One value per phone averaged with its neighbours', as a signal through the phones' middles.
StyleSignal smoothedOverPhones(const std::vector<double>& values, const SpeechLabels& labels);

}  // namespace mouthpiece
