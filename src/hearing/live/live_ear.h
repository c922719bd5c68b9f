#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "hearing/alignment/phone_ear.h"
#include "hearing/live/live_phones.h"
#include "hearing/live/live_words.h"
#include "phonetics/labels/labels_builder.h"
#include "phonetics/language/language.h"

namespace mouthpiece {

/// Hears the phones of a sound that goes on, of any language (docs/theory/hearing/live_hearing.md). Time and memory do
/// not grow with the sound. Not thread-safe.
class LiveEar {
 public:
  static constexpr int kRateHz = 16000;
  /// Samples that are heard at once: 40 ms.
  static constexpr std::size_t kHop = LiveWords::kHop;

  /// `speaker`: sounds of the person who will speak (PhoneEar::learn). `look_ahead`: so long phones may wait until they
  /// are settled. `words`: what they say counts with what is heard without them.
  /// `phones`: count with the ear's own; where they are there, it does not hear what is open again. Throws InputError
  /// without an acoustic model.
  explicit LiveEar(const Language& language = english(), std::span<const LabelledSound> speaker = {},
                   Seconds look_ahead = 0, std::optional<LiveWords> words = std::nullopt,
                   std::optional<LivePhones> phones = std::nullopt);
  ~LiveEar();
  LiveEar(LiveEar&&) noexcept;
  LiveEar& operator=(LiveEar&&) noexcept;

  /// The next kHop samples. Returns the phones that they settle, silences among them: in order, without gaps, from the
  /// sound's start. `waits`: LiveWords::hear()'s.
  std::vector<PhoneSegment> hear(std::span<const std::int16_t> samples, const std::function<bool()>& waits = {});
  /// What has likely been said since the last settled one, up to about 60 ms ago.
  [[nodiscard]] const std::vector<PhoneSegment>& guess() const;
  /// LiveWords::missed(), where there are words.
  [[nodiscard]] std::size_t missedWords() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace mouthpiece
