#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "audio/audio_clip.h"
#include "base/unnamed_file.h"

namespace mouthpiece {

/// What is heard of a sound: samplesToHear(), 16 kHz. Of one that lasts longer than kInMemoryUntil they lie in a file
/// (UnnamedFile), where the system's temporary folder takes one: they take no memory while nobody looks at them.
class SamplesToHear {
 public:
  static constexpr int kRateHz = 16'000;
  static constexpr Seconds kInMemoryUntil = 300;

  explicit SamplesToHear(const AudioClip& audio);

  [[nodiscard]] std::span<const std::int16_t> all() const { return all_; }
  /// What was looked at takes no memory until it is looked at again.
  void letGo() const {
    if (file_) file_->letGo();
  }

 private:
  std::vector<std::int16_t> samples_;
  std::unique_ptr<UnnamedFile> file_;
  std::span<const std::int16_t> all_;
};

/// How far a sound's loud frames lie over its quiet ones, dB.
double levelRangeDb(std::span<const std::int16_t> samples);

/// How noisy a sound is: 0 where its loudest tenths stand over its quietest as in a silent room, 1 where they do as in
/// a street (docs/theory/hearing/alignment.md).
double noisinessOf(std::span<const std::int16_t> samples);

}  // namespace mouthpiece
