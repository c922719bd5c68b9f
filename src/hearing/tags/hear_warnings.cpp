#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "base/index.h"
#include "base/statistics.h"
#include "hearing/tags/hear_tags.h"

namespace mouthpiece {
namespace {

constexpr double kSilentPeakDb = -50;
constexpr float kFullScale = 0.999F;
constexpr std::size_t kClippedRun = 3;    // samples in a row at full scale
constexpr double kClippedShare = 0.0005;  // of all samples
constexpr double kLeastDropDb = 12;       // from the vowels to the pauses of a voice alone
constexpr double kLeastPauses = 0.3;      // seconds of pauses that say something
constexpr double kLeastAgreement = 0.34;  // of vowels with their words: chance is a third of the merged classes
constexpr double kLeastVowels = 2.0;      // seconds of vowels that say something
constexpr Seconds kPiece = 0.02;
constexpr Seconds kEdge = 0.05;  // of a phone: its neighbours sound in it

double db(double mean_square) { return 10 * std::log10(mean_square + 1e-12); }

double clippedShare(const AudioClip& clip) {
  std::size_t clipped = 0, run = 0;
  for (const float sample : clip.samples) {
    run = std::abs(sample) >= kFullScale ? run + 1 : 0;
    if (run >= kClippedRun) clipped += run == kClippedRun ? kClippedRun : 1;
  }
  return asReal(clipped) / asReal(std::max<std::size_t>(1, clip.samples.size()));
}

/// How loud the phones that `wanted` takes are: the median over 20 ms pieces of their middles, for a label beside its
/// sound must not count much; and how long they are.
struct Loudness {
  double median_square = 0;
  Seconds duration = 0;
};

template <typename Wanted>
Loudness loudnessOf(const AudioClip& clip, const SpeechLabels& labels, Wanted wanted) {
  std::vector<double> pieces;
  const auto length = static_cast<std::size_t>(std::max(1.0, kPiece * clip.sample_rate_hz));
  for (const LabelledPhone& phone : labels.phones) {
    if (!wanted(phone.phone)) continue;
    const auto first = static_cast<std::size_t>(std::max(0.0, (phone.span.start + kEdge) * clip.sample_rate_hz));
    const auto end = static_cast<std::size_t>(std::max(0.0, (phone.span.end - kEdge) * clip.sample_rate_hz));
    for (std::size_t i = first; i + length <= std::min(clip.samples.size(), end); i += length) {
      double sum = 0;
      for (std::size_t k = i; k < i + length; ++k) sum += double{clip.samples[k]} * clip.samples[k];
      pieces.push_back(sum / asReal(length));
    }
  }
  return {median(pieces, 0), kPiece * asReal(pieces.size())};
}

/// The mean probability of the vowels that the labels promise, where a vowel is heard; nullopt where too little is.
std::optional<double> vowelAgreement(const SpeechLabels& labels, const AudioTags& tags) {
  double sum = 0, weight = 0;
  auto heard = tags.vowels.begin();
  for (const LabelledPhone& phone : labels.phones) {
    const auto wanted = rowOf(firstViseme(phone.phone)).vowels;
    if (!isVowel(phone.phone) || !wanted) continue;
    while (heard != tags.vowels.end() && heard->time < phone.span.start) ++heard;
    // The first half: diphthongs move on.
    for (; heard != tags.vowels.end() && heard->time < phone.span.middle(); ++heard) {
      const std::array<double, 3> merged{heard->a, heard->e + heard->i, heard->o + heard->u};
      sum += merged[static_cast<std::size_t>(*wanted)];
      weight += 1 - heard->silence;
    }
  }
  if (weight < kLeastVowels * kPitchRateHz / 2) return std::nullopt;
  return sum / weight;
}

}  // namespace

std::vector<std::string> soundWarnings(const AudioClip& clip, const SpeechLabels* labels, const AudioTags& tags) {
  std::vector<std::string> warnings;
  float peak = 0;
  for (const float sample : clip.samples) peak = std::max(peak, std::abs(sample));
  if (const double peak_db = db(double{peak} * peak); peak_db < kSilentPeakDb) {
    warnings.push_back(fmt::format("the sound is silent (peak {:.0f} dB)", peak_db));
    return warnings;
  }
  if (const double share = clippedShare(clip); share > kClippedShare) {
    warnings.push_back(
        fmt::format("the sound is clipped ({:.2f} % of its samples): vowels may be misheard", 100 * share));
  }
  const bool has_voice = std::any_of(tags.f0.begin(), tags.f0.end(), [](const PitchSample& s) { return s.voiced; });
  if (!has_voice) warnings.emplace_back("no voice is heard: there are no notes");
  if (labels == nullptr || !has_voice) return warnings;
  const Loudness pauses = loudnessOf(clip, *labels, [](Phone p) { return p == Phone::kSil; });
  const Loudness vowels = loudnessOf(clip, *labels, [](Phone p) { return isVowel(p); });
  const double drop_db = db(vowels.median_square) - db(pauses.median_square);
  if (pauses.duration > kLeastPauses && vowels.duration > 0 && drop_db < kLeastDropDb) {
    warnings.push_back(fmt::format(
        "pauses are only {:.0f} dB below the vowels: instruments in the sound, or labels beside it; a voice "
        "alone is needed",
        std::max(0.0, drop_db)));
  }
  if (const auto agreement = vowelAgreement(*labels, tags); agreement && *agreement < kLeastAgreement) {
    warnings.push_back(fmt::format("only {:.0f} % of the vowels that are heard fit the words: other words may be sung",
                                   100 * *agreement));
  }
  return warnings;
}

}  // namespace mouthpiece
