#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>

#include "audio/audio_clip.h"
#include "base/index.h"
#include "base/page_data.h"
#include "programs/synth/batch_manifest.h"

namespace mouthpiece {

LinePlayer playerOf(const std::string& key, const Performance& performance) {
  constexpr Seconds kShown = 30;
  constexpr double kPlayerRateHz = 30;
  constexpr int kPlayerSoundHz = 16'000;
  LinePlayer player;
  player.key = key;
  AudioClip sound{performance.sound().sample_rate_hz, performance.sound().samples};
  const auto ofShown = [&](double rate_hz) { return static_cast<std::size_t>(kShown * rate_hz); };
  sound.samples.resize(std::min(sound.samples.size(), ofShown(sound.sample_rate_hz)));
  if (sound.sample_rate_hz > kPlayerSoundHz) sound = resampleAudio(sound, kPlayerSoundHz);
  appendBase64(player.wav, wavBytes(sound));
  const Motion& motion = performance.motion();
  const auto step = static_cast<std::size_t>(std::max(1.0, std::round(motion.frame_rate_hz / kPlayerRateHz)));
  player.frame_rate_hz = motion.frame_rate_hz / asReal(step);
  player.markers = motion.marker_names;
  std::string places;
  const std::size_t shown = std::min(motion.frameCount(), ofShown(motion.frame_rate_hz));
  for (std::size_t frame = 0; frame < shown; frame += step) {
    const std::span<const double> at = motion.frame(frame);
    for (std::size_t i = 0; i < at.size(); ++i) {
      if (i % 3 == 2) continue;
      const auto tenths = static_cast<std::int16_t>(std::clamp(std::round(10 * at[i]), -32'000.0, 32'000.0));
      const auto bits = static_cast<std::uint16_t>(tenths);
      places.push_back(static_cast<char>(bits & 0xFFU));
      places.push_back(static_cast<char>(bits >> 8U));
    }
  }
  appendBase64(player.places, places);
  return player;
}

}  // namespace mouthpiece
