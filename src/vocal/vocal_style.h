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
StyleSignal readStyleSignal(const std::filesystem::path& path, double largest, double least = 0);
StyleSignal parseStyleSignal(std::string_view text, std::string_view name, double largest, double least = 0);

/// A value a phone; none where the phone has none of its own: a vowel has no Ma, a consonant no Ps.
using PhoneValues = std::vector<std::optional<double>>;

inline constexpr double kUnknownAccent = 0.5;      ///< Ma where the sound says nothing of it
inline constexpr double kSpokenSensitivity = 0.1;  ///< Ps of a vowel as short as spoken ones

/// The heuristic of VOCAL 4.2 for Ma, of fricatives and plosives: high-frequency energy against that of all of them,
/// both in logarithms, since it spans a factor of thousands; kUnknownAccent where the sound says nothing of it.
PhoneValues melodicAccents(const SpeechLabels& labels, const AudioTags& tags);
/// For Ps, of vowels: 0.1 up to 0.2 s, growing by 1 a second to 1.
PhoneValues pitchSensitivities(const SpeechLabels& labels);
/// Each value averaged with its neighbours among the phones that have one, before and after, each weighing as much as
/// it lasts; held over its phone, and carried over in a straight line where phones have none, or over 25 ms to both
/// sides of the border of neighbours that have one (a quarter of the phone at most). `otherwise` where none has.
StyleSignal smoothedOverPhones(const PhoneValues& values, const SpeechLabels& labels, double otherwise);

}  // namespace mouthpiece
