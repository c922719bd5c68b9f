#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <semaphore>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "base/child_process.h"
#include "base/time.h"

namespace mouthpiece {

/// A word as a network wrote it, and the natural logarithm of its probability after those before it.
struct NetworkWord {
  std::string text;
  double log_probability = 0;
};

/// How likely a network finds a word of a text where it stands, natural logarithms: of its probability, and of that
/// over the likeliest's in its place.
struct WordScore {
  double log_probability = 0, behind = 0;
};

/// How a network finds a text in a sound.
struct TextScore {
  std::vector<WordScore> words;    ///< of the text, and last, that nothing follows them
  double log_probability = 0;      ///< of the whole text
  std::vector<NetworkWord> heard;  ///< what it hears without the text
  double heard_log_probability = 0;
  std::size_t heard_tokens = 0;  ///< what it wrote that in, of which each has a probability
};

/// A network that hears English words: docs/theory/hearing/network_words.md#a-network. A program of its own runs it,
/// from when it is first asked until this ends; one more for each thread that asks at once, four at most. Thread-safe.
class WordNetwork {
 public:
  /// `folder`: with hear_words.mjs and its models, which Node runs.
  explicit WordNetwork(std::filesystem::path folder);
  WordNetwork(const WordNetwork&) = delete;
  WordNetwork& operator=(const WordNetwork&) = delete;
  ~WordNetwork();

  /// Whether there is what it needs.
  [[nodiscard]] bool isThere() const;

  /// The words of each of `sounds`, 16 kHz, a minute each at most; none for one of which it makes no words. Throws
  /// InputError where it cannot, or on `stop`.
  std::vector<std::vector<NetworkWord>> hear(std::span<const std::span<const std::int16_t>> sounds,
                                             const std::stop_token& stop = {});

  /// Of each of `sounds`, as above, its text, of whose words none is empty or has a blank in it; nothing where the
  /// sound is too short. Throws the same.
  std::vector<std::optional<TextScore>> score(std::span<const std::span<const std::int16_t>> sounds,
                                              std::span<const std::vector<std::string>> texts);

  /// What its encoder makes of a sound as above: kEncodedNumbers rows, a column every kEncodedStep, the first one's
  /// middle half of that after the sound's start; none where the sound is too short. Throws the same.
  Eigen::MatrixXf encode(std::span<const std::int16_t> sound, const std::stop_token& stop = {});
  static constexpr Eigen::Index kEncodedNumbers = 288;
  static constexpr Seconds kEncodedStep = 0.024;

  /// Ends the programs that nobody asks just now, which have 0.3 GB each; who asks next waits for a start.
  void endWaiting();
  /// A program grows with all that it has heard: who asks for more sounds than this ends it after so many.
  static constexpr std::size_t kAskedOfOneProgram = 15;

 private:
  class Asking;

  std::filesystem::path folder_;
  std::counting_semaphore<> turns_;
  std::mutex changing_;
  std::vector<std::unique_ptr<AnsweringChild>> waiting_;  ///< programs that nobody asks just now
};

}  // namespace mouthpiece
