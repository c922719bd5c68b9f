#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <vector>

#include "base/time.h"
#include "phonetics/language/phone.h"

namespace mouthpiece {

/// The rate that the acoustic model was trained at.
inline constexpr int kDecoderSampleRateHz = 16000;

/// Ways to say each of a row of words: ways[w][v] are the phones of word w, way v. No way is empty or holds silence.
using WordWays = std::vector<std::vector<std::vector<Phone>>>;

/// A phone, or a silence between words, as the decoder found it.
struct DecodedPhone {
  Phone phone = Phone::kSil;
  bool opens_word = false;
  TimeSpan span;     ///< to 10 ms
  int frames = 0;    ///< that it was heard in
  double score = 0;  ///< logarithm of its likelihood, base 1.0001^1024, against the best sounds of each frame
};

/// How words are said. Sung ones are heard with less of their held vowels and pauses, so that these do not outweigh the
/// consonants (docs/theory/alignment.md).
enum class SpeechKind { kSpoken, kSung };

/// PocketSphinx with its US English model, kept to a given row of words with optional silence around each.
/// Not thread-safe; several may live side by side.
class PhoneDecoder {
 public:
  /// `model`: folder of the acoustic model; empty: the one found when Mouthpiece was built. Throws InputError with the
  /// package's name when it is not there.
  explicit PhoneDecoder(const std::filesystem::path& model = {});
  ~PhoneDecoder();
  PhoneDecoder(PhoneDecoder&&) noexcept;
  PhoneDecoder& operator=(PhoneDecoder&&) noexcept;

  /// The likeliest times and ways, in order, without gaps from the first frame to the last; empty when the sound
  /// cannot hold the words (too short for them). Throws InputError when there are more than 100,000 phones.
  std::vector<DecodedPhone> decode(std::span<const std::int16_t> samples, const WordWays& words,
                                   SpeechKind kind = SpeechKind::kSpoken);

  /// When the phones and silences that decode() found in spoken words are heard in `samples`, the same sound or one a
  /// little shorter; better times than decode()'s, and in less time. Empty when the sound cannot hold them.
  std::vector<TimeSpan> hearAgain(std::span<const std::int16_t> samples, const std::vector<DecodedPhone>& phones);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace mouthpiece
