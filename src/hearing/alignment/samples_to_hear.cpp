#include "hearing/alignment/samples_to_hear.h"

#include <algorithm>

#include "audio/spectral_frames.h"
#include "base/errors.h"
#include "base/index.h"
#include "hearing/alignment/phone_ear.h"

namespace mouthpiece {
namespace {

/// Levels that lie as far apart are a street's, or a silent room's, dB (docs/theory/hearing/alignment.md).
constexpr double kNoisyRangeDb = 30.0, kCleanRangeDb = 38.0;

std::unique_ptr<UnnamedFile> fileOf(const AudioClip& audio) {
  if (audio.sample_rate_hz != SamplesToHear::kRateHz) return fileOf(resampleAudio(audio, SamplesToHear::kRateHz));
  constexpr std::size_t kAtOnce = 65536;
  auto file = std::make_unique<UnnamedFile>();
  AudioClip some{audio.sample_rate_hz, {}};
  for (std::size_t first = 0; first < audio.samples.size(); first += kAtOnce) {
    const auto begin = audio.samples.begin() + signedIndex(first);
    some.samples.assign(begin, begin + signedIndex(std::min(kAtOnce, audio.samples.size() - first)));
    const std::vector<std::int16_t> heard = samplesToHear(some);
    file->append(std::as_bytes(std::span(heard)));
  }
  return file;
}

}  // namespace

SamplesToHear::SamplesToHear(const AudioClip& audio) {
  if (audio.duration() > kInMemoryUntil) {
    try {
      file_ = fileOf(audio);
      const std::span<const std::byte> bytes = file_->bytes();
      all_ = {reinterpret_cast<const std::int16_t*>(bytes.data()), bytes.size() / sizeof(std::int16_t)};
      return;
    } catch (const InputError&) {  // a folder that is full or closed to us: they stay in memory
      file_.reset();
    }
  }
  samples_ = samplesToHear(audio);
  all_ = samples_;
}

double levelRangeDb(std::span<const std::int16_t> samples) {
  constexpr double kQuiet = 0.05, kLoud = 0.95;
  std::vector<double> levels = speechLevelsDb(samples);  // of the first difference: rumble lies below speech
  if (levels.empty()) return kCleanRangeDb;
  std::sort(levels.begin(), levels.end());
  const auto at = [&](double share) { return levels[static_cast<std::size_t>(share * asReal(levels.size() - 1))]; };
  return at(kLoud) - at(kQuiet);
}

double noisinessOf(std::span<const std::int16_t> samples) {
  return std::clamp((kCleanRangeDb - levelRangeDb(samples)) / (kCleanRangeDb - kNoisyRangeDb), 0.0, 1.0);
}

}  // namespace mouthpiece
