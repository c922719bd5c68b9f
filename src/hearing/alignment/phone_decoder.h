#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <vector>

#include "hearing/alignment/acoustic_model.h"
#include "hearing/alignment/forced_alignment.h"

namespace mouthpiece {

/// The rate that the acoustic model was trained at.
inline constexpr int kDecoderSampleRateHz = 16000;

/// Ways to say each of a row of words: ways[w][v] are the phones of word w, way v. No way is empty or holds silence.
using WordWays = std::vector<std::vector<std::vector<Phone>>>;

/// A phone, or a silence between words, as the decoder found it.
struct DecodedPhone {
  Phone phone = Phone::kSil;
  bool opens_word = false;
  TimeSpan span;  ///< to 10 ms
  std::size_t first_frame = 0;
  int frames = 0;    ///< that it was heard in
  double score = 0;  ///< logarithm of its likelihood, base 1.0001^1024, against the best sounds of each frame
};

/// Which of a sound's frames to hear so that a song lasts as long as the same words spoken: about `wanted` frames,
/// taken from where the spectrum changes, few from held vowels and pauses. Rising, with the first and the last frame;
/// all of them where there are no more than `wanted`. `cepstra`: a row of cepstral coefficients a frame, energy first.
std::vector<std::size_t> thinFrames(const std::vector<std::vector<float>>& cepstra, std::size_t wanted);

/// Puts the spectral envelope in place of the spectrum in the decoder's cepstra, where the harmonics of a high voice
/// pass for formants: the spectrum of each voiced frame is averaged over one pitch to both sides before it goes through
/// the mel bands. Other frames stay. samples: at 16 kHz; cepstra: a row every 10 ms, as PocketSphinx' front end makes
/// them of these samples.
void useSpectralEnvelope(std::span<const std::int16_t> samples, std::vector<std::vector<float>>& cepstra);

/// The front end's own cepstra of the frame that begins at sample `start`: what useSpectralEnvelope() goes by.
std::vector<float> frontEndCepstra(std::span<const std::int16_t> samples, std::size_t start, std::size_t count);

/// cepstra x mel bands: what the front end makes of the logarithms of the bands' energies.
Eigen::MatrixXd frontEndCosines(std::size_t count);

/// PocketSphinx with a language's model, kept to a given row of words with optional silence around each.
/// Not thread-safe; several may live side by side.
class PhoneDecoder {
 public:
  /// `model`: folder of the acoustic model; empty: the language's, found when Mouthpiece was built. Throws InputError
  /// with the package's name when it is not there.
  PhoneDecoder(const std::filesystem::path& model, const Language& language);
  ~PhoneDecoder();
  PhoneDecoder(PhoneDecoder&&) noexcept;
  PhoneDecoder& operator=(PhoneDecoder&&) noexcept;

  /// The likeliest times and ways, in order, without gaps from the first frame to the last; empty when the sound
  /// cannot hold the words (too short for them). `heard`: HeardPhones' of the sound, not where it is sung. Throws
  /// InputError when there are more than 100,000 phones, or one that the language lacks.
  std::vector<DecodedPhone> decode(std::span<const std::int16_t> samples, const WordWays& words,
                                   SpeechKind kind = SpeechKind::kSpoken, const HeardPhones& heard = {});

  /// What the model weighs of a sound: a column every 10 ms, its mean taken off.
  Eigen::MatrixXf featuresOf(std::span<const std::int16_t> samples);
  /// The front end's cepstra of a whole sound, a column every 10 ms.
  Eigen::MatrixXd cepstraOf(std::span<const std::int16_t> samples);
  SenoneScorer& scorer();
  /// The front end's cepstra of a sound that goes on, a row every 10 ms; `begins`: with these samples.
  std::vector<std::vector<float>> cepstraOn(std::span<const std::int16_t> samples, bool begins);

  /// When the phones and silences that decode() found in spoken words give way to each other, as expected of all ways
  /// to hear this very row in the same `samples`: better times than decode()'s, between its steps. One border fewer
  /// than there are phones; none where the sound cannot hold them.
  std::vector<Seconds> hearAgain(std::span<const std::int16_t> samples, const std::vector<DecodedPhone>& phones,
                                 const HeardPhones& heard = {});

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace mouthpiece
