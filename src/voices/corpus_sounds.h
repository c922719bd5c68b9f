#pragma once

#include <map>
#include <memory>
#include <vector>

#include "audio/sound_joiner.h"
#include "units/selection/unit_database.h"

namespace mouthpiece {

/// Where two recordings of the same phone are best cut to go from one into the other.
struct SoundCut {
  Seconds left = 0;   ///< in the left recording: leave it here
  Seconds right = 0;  ///< and go on here
  double cost = 0;    ///< about 1 for neighbouring frames of steady speech that differ as such frames do
};

/// The recordings of a corpus, loaded, marked and measured when first needed. Not thread-safe.
class CorpusSounds {
 public:
  explicit CorpusSounds(const UnitDatabase& database);
  ~CorpusSounds();

  /// Throws InputError when the corpus has no sound for that take, its sound is damaged, or it has another sampling
  /// rate than the first take that was asked for.
  const MarkedSound& soundOf(TakeIndex take);
  /// Those of the corpus until others are set.
  [[nodiscard]] const SoundCutWeights& weights() const { return weights_; }
  void setWeights(const SoundCutWeights& weights);
  [[nodiscard]] int sampleRateHz() const { return sample_rate_hz_; }

  /// The best cut from phone `left` into phone `right`: alike in spectrum (MFCC), level, pitch and lips, at about the
  /// same place of the phone, and where it is quiet. Cached.
  SoundCut cut(const PhonePlace& left, const PhonePlace& right);

 private:
  struct Frames;
  struct Recording;
  Recording& recordingOf(TakeIndex take);

  const UnitDatabase& database_;
  SoundCutWeights weights_;
  int sample_rate_hz_ = 0;
  std::map<std::size_t, std::unique_ptr<Recording>> recordings_;
  std::map<std::pair<PhonePlace, PhonePlace>, SoundCut> cuts_;
};

}  // namespace mouthpiece
