#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/time.h"

namespace mouthpiece {

/// Mono sound; samples in [-1, 1].
struct AudioClip {
  int sample_rate_hz = 0;
  std::vector<float> samples;

  [[nodiscard]] Seconds duration() const {
    return sample_rate_hz > 0 ? static_cast<double>(samples.size()) / sample_rate_hz : 0.0;
  }
};

/// What is read of a sound.
struct AudioLimits {
  Seconds most = 4 * 3600.0;                                          ///< a longer one is refused
  Seconds own_rate_until = std::numeric_limits<Seconds>::infinity();  ///< a longer one comes at kLongSoundRateHz
};
/// What recognisers hear: an hour at this rate is 230 MB of samples, at 48 kHz 690.
inline constexpr int kLongSoundRateHz = 16'000;

/// Reads WAV, AIFF, FLAC, Ogg (Vorbis, Opus) or MP3 through libsndfile, MPEG-4 (M4A), WebM and AAC through the program
/// ffmpeg where it is on the PATH; several channels are averaged, the second of two turned over where it mirrors the
/// first. Throws InputError for what is no sound, is empty, claims more samples than the file holds, or is longer than
/// the limits allow.
AudioClip readAudio(const std::filesystem::path& path, const AudioLimits& limits = {});
/// The same from memory, what libsndfile reads; `name` stands for the file in messages.
AudioClip parseAudio(std::string_view bytes, std::string_view name, const AudioLimits& limits = {});

/// 16-bit PCM WAV; samples outside [-1, 1] are clipped.
std::string wavBytes(const AudioClip& clip);
/// A FLAC of one channel and 16 bits, without loss; the rate in it is any.
std::string flacBytes(const std::vector<std::int16_t>& samples);
/// What flacBytes() made of `count` samples; nullopt for anything else.
std::optional<std::vector<std::int16_t>> flacSamples(std::string_view bytes, std::size_t count);
/// A WAV into a file, atomically.
void writeWav(const std::filesystem::path& path, const AudioClip& clip);

/// The clip at another rate (windowed-sinc, band-limited).
AudioClip resampleAudio(const AudioClip& clip, int sample_rate_hz);
/// The clip lasting `factor` times as long at its own rate, as a clock that runs apart would have recorded it.
AudioClip stretchAudio(const AudioClip& clip, double factor);

/// resampleAudio() of a sound that goes on, in chunks of any size: the same samples, each as soon as what it is made of
/// is there (48 samples of the lower rate later).
class LiveResampler {
 public:
  LiveResampler(int from_hz, int to_hz);
  ~LiveResampler();
  LiveResampler(LiveResampler&&) noexcept;
  LiveResampler& operator=(LiveResampler&&) noexcept;

  /// Appends to `out` what `samples` complete.
  void push(std::span<const float> samples, std::vector<float>& out);
  /// Appends what the sound's end completes, so that `out` has outputCount() of all that was pushed.
  void finish(std::vector<float>& out);
  /// Of so many samples in all.
  [[nodiscard]] std::size_t outputCount(std::size_t inputs) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace mouthpiece
