#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "hearing/network/word_network.h"
#include "phonetics/labels/labels_builder.h"
#include "phonetics/language/language.h"
#include "phonetics/text/lexicon.h"

namespace mouthpiece {

/// What a hearing found in a phrase, on the clock of the sound.
struct HeardPhrase {
  TimeSpan span = {};
  /// Of the words that likely are right and have ended, without silences.
  std::vector<PhoneSegment> phones = {};
  /// The mean of the logarithms of the odds of its words as a transcript's.
  double word_odds = 0;
};

/// Hears the words of a sound that goes on (docs/theory/hearing/live_hearing.md#words-while-they-are-said): a network
/// hears the phrase so far every now and then, in a thread of its own, and its words are aligned. What is heard depends
/// on the sound alone where it is waited for, unless the network takes too long. Memory does not grow with the
/// sound. Not thread-safe.
class LiveWords {
 public:
  /// So many samples are heard at once: 40 ms of 16 kHz.
  static constexpr std::size_t kHop = 640;

  /// Waits until the network has started, or failed to. `lexicon`, if any, is kept alive by the caller. `latest`: a
  /// hearing that is waited for may take so much longer than until it is due. Throws InputError without an acoustic
  /// model.
  LiveWords(std::shared_ptr<WordNetwork> network, const Lexicon* lexicon, const Language& language,
            std::chrono::milliseconds latest = std::chrono::seconds(1));
  ~LiveWords();
  LiveWords(LiveWords&&) noexcept;
  LiveWords& operator=(LiveWords&&) noexcept;

  /// The next kHop samples; `is_speech`: whether speech is around their end; `waits`: whether a hearing that is due is
  /// waited for, `latest` at most, asked again and again; empty: it is. Else it comes when it is there. Returns what a
  /// hearing found, if one is due, in place of all found before.
  std::optional<HeardPhrase> hear(std::span<const std::int16_t> samples, bool is_speech,
                                  const std::function<bool()>& waits = {});
  /// How many hearings failed, or came too late, by the sound and by the clock. After a few none is tried for a minute.
  [[nodiscard]] std::size_t missed() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace mouthpiece
