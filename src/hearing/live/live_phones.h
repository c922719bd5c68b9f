#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "hearing/network/word_network.h"
#include "phonetics/language/language.h"

namespace mouthpiece {

/// Hears the phones of a sound that goes on by the encoder of a network of words, which hears the last second again and
/// again, in a thread of its own (docs/theory/hearing/network_phones.md). What is heard
/// depends on the sound alone, unless that takes too long. Not thread-safe.
class LivePhones {
 public:
  /// So many samples are heard at once: 40 ms of 16 kHz.
  static constexpr std::size_t kHop = 640;

  /// How likely each phone is in some of an ear's frames (kEarStep, kEarShift).
  struct Heard {
    std::size_t first = 0;       ///< frame
    Eigen::MatrixXf posteriors;  ///< phones by their number x frames
  };

  /// `language`: that is spoken. Waits until the network has started, or failed to. With a short `look_ahead` less is
  /// heard, and less often.
  explicit LivePhones(std::shared_ptr<WordNetwork> network, Seconds look_ahead = 0,
                      const Language& language = english());
  ~LivePhones();
  LivePhones(LivePhones&&) noexcept;
  LivePhones& operator=(LivePhones&&) noexcept;

  /// The next kHop samples; `is_speech`: whether speech is around their end, else they are not heard. Waits for what it
  /// hears, a second at most. Returns what a hearing found, if one is there.
  std::optional<Heard> hear(std::span<const std::int16_t> samples, bool is_speech);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace mouthpiece
