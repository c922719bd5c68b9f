#include "hearing/alignment/untold_speech.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "hearing/alignment/speech_finder.h"

namespace mouthpiece {
namespace {

/// What counts in one pause, in all, and of the sound: breath, clicks and the like leave less in right texts. A pause
/// with as much as the last is told of in a sound of any length.
constexpr Seconds kLeastInPause = 0.8, kLeastInAll = 1.5, kLongAlone = 4;
constexpr double kLeastUntoldShare = 0.05;
/// What is found for speech goes on so far beyond it, and so far beside a word its own sound may be.
constexpr Seconds kAroundSpeech = 0.15, kBesideWord = 0.2;

struct Untold {
  TimeSpan span;
  Seconds speech = 0;
};

Untold untoldIn(const TimeSpan& pause, std::span<const SoundStretch> stretches) {
  Untold untold;
  if (pause.duration() < kLeastInPause) return untold;
  for (const SoundStretch& stretch : stretches) {
    const TimeSpan heard{std::max(pause.start, stretch.span.start + kAroundSpeech),
                         std::min(pause.end, stretch.span.end - kAroundSpeech)};
    if (stretch.kind != SoundKind::kSpeech || stretch.is_steady || heard.end <= heard.start) continue;
    if (untold.speech == 0) untold.span.start = heard.start;
    untold.span.end = heard.end;
    untold.speech += heard.duration();
  }
  return untold;
}

}  // namespace

std::string untoldSpeech(std::span<const std::int16_t> samples, const SpeechLabels& labels) {
  constexpr std::size_t kMostNamed = 5;
  const std::vector<SoundStretch> stretches = findSpeech(samples);
  std::string places;
  std::size_t count = 0;
  Seconds all = 0, longest = 0;
  const auto lookIn = [&](const TimeSpan& pause) {
    const Untold untold = untoldIn(pause, stretches);
    if (untold.speech < kLeastInPause) return;
    all += untold.speech;
    longest = std::max(longest, untold.speech);
    if (++count <= kMostNamed)
      places += fmt::format("{}{:.1f} to {:.1f} s", count > 1 ? ", " : "", untold.span.start, untold.span.end);
  };
  Seconds from = 0;
  for (const LabelledPhone& phone : labels.phones) {
    if (phone.phone == Phone::kSil) continue;
    lookIn({from, phone.span.start - kBesideWord});
    from = phone.span.end + kBesideWord;
  }
  lookIn({from, labels.duration()});
  if (longest < kLongAlone && (all < kLeastInAll || all < kLeastUntoldShare * labels.duration())) return "";
  return fmt::format("{:.1f} s that sound like speech have no words, {}{}: is the text all that is said?", all, places,
                     count > kMostNamed ? " and more" : "");
}

}  // namespace mouthpiece
