#pragma once

#include <Eigen/Core>
#include <array>
#include <string_view>
#include <vector>

#include "audio/audio_tags.h"
#include "base/byte_reader.h"
#include "hearing/tags/vowel_spectra.h"

namespace mouthpiece {

/// The classes of the network, in the order of its outputs.
enum class SungVowel { kA, kE, kI, kO, kU, kSilence };
inline constexpr int kSungVowelCount = 6;

/// What the perceptrons hear of each frame: the mel bands of `features`, and `envelopes` less half of their loud
/// frames' mean. Frames x 52.
VowelFeatures perceptronColumns(const VowelFeatures& features, const VowelEnvelopes& envelopes);

/// A small network that tells the sung vowel of a frame from it and four frames around it, with two hidden layers of
/// rectified units (docs/theory/hearing/vowel_network.md). Immutable: may be shared by threads.
class VowelPerceptron {
 public:
  /// Of that many units in the hidden layers. Throws InputError for sizes that do not fit the bytes and numbers that
  /// are not finite.
  static VowelPerceptron read(ByteReader& reader, const std::array<std::uint32_t, 2>& hidden);

  static constexpr std::array<int, 5> kOffsets{-9, -4, 0, 4, 9};
  static constexpr int kColumns = 2 * kMelBandCount;
  static constexpr int kInputs = kColumns * static_cast<int>(kOffsets.size());

  /// Frames x 6, every row sums to 1.
  [[nodiscard]] Eigen::MatrixXf probabilities(const VowelFeatures& columns) const;

 private:
  struct Layer {
    Eigen::MatrixXf weights;
    Eigen::VectorXf bias;
  };
  Eigen::RowVectorXf mean_, inverse_deviation_;
  std::array<Layer, 3> layers_;
};

/// How the vowels of voices lie, learnt from many of them, and with it how those of one recording lie: what is E for
/// one singer is I for another, but seldom both are in one recording (docs/theory/hearing/vowel_network.md, "The voice
/// of a recording"). Immutable: may be shared by threads.
class VowelAdaptation {
 public:
  /// The last part of the weights' file. Throws InputError for sizes that do not fit the bytes, numbers that are not
  /// finite and a covariance that is none.
  static VowelAdaptation read(ByteReader& reader);

  /// The network's shares (frames x 6) as this voice's vowels have it; the share of silence stays, and so do frames
  /// without a pitch.
  [[nodiscard]] Eigen::MatrixXf adapt(const VowelEnvelopes& envelopes, const Eigen::MatrixXf& shares) const;

 private:
  struct Frames;
  struct Fit;
  [[nodiscard]] Eigen::MatrixXd densities(const Eigen::MatrixXd& places, const Eigen::VectorXd& mean,
                                          const Eigen::MatrixXd& covariance, double scatter) const;
  [[nodiscard]] double scattered(const Eigen::MatrixXd& places, const Eigen::MatrixXd& counts,
                                 const Eigen::VectorXd& mean, const Eigen::MatrixXd& covariance) const;
  [[nodiscard]] Fit fit(const Frames& frames, Eigen::MatrixXd shares) const;
  [[nodiscard]] Eigen::MatrixXd byVoices(const Frames& frames) const;

  Eigen::MatrixXd directions_;  ///< bands x directions in which vowels lie apart; a vowel's frames scatter by 1 there
  Eigen::VectorXd mean_;        ///< of a voice's five means, one after the other
  Eigen::MatrixXd precision_;   ///< inverse of their covariance
  Eigen::MatrixXd starts_;      ///< a voice a column, from which to look for the one heard
};

/// Tells the sung vowel of every frame (VOCAL 4.3): 12 frames before and after side by side, three LSTM layers, ReLU, a
/// fully connected layer, softmax; of networks that began differently the mean, and with it that of small networks of
/// a few frames. Trained by tools/train_vowels.py.
/// Immutable: may be shared by threads.
class VowelNetwork {
 public:
  /// Reads the weights (docs/theory/hearing/vowel_network.md, "The weights' file"). Throws InputError for sizes that do
  /// not fit the bytes or each other, and numbers that are not finite.
  static VowelNetwork parse(std::string_view bytes, std::string_view name);
  /// The weights that are built in.
  static const VowelNetwork& shipped();

  /// Frames x 6, every row sums to 1. Both of the same sound.
  [[nodiscard]] Eigen::MatrixXf probabilities(const VowelFeatures& features, const VowelEnvelopes& envelopes) const;
  /// What takes these to the voice of a recording.
  [[nodiscard]] const VowelAdaptation& adaptation() const { return adaptation_; }

 private:
  struct Layer {
    Eigen::MatrixXf from_input;  ///< 4 * units x inputs; gates in the order input, forget, cell, output
    Eigen::MatrixXf from_state;  ///< 4 * units x units
    Eigen::VectorXf bias;
  };
  struct Member {
    Eigen::RowVectorXf mean, inverse_deviation;
    std::vector<Layer> layers;
    Eigen::MatrixXf output;
    Eigen::VectorXf output_bias;

    [[nodiscard]] Eigen::MatrixXf probabilities(const VowelFeatures& features) const;
  };
  void readPerceptrons(ByteReader& reader);

  std::vector<Member> members_;
  std::vector<VowelPerceptron> perceptrons_;
  float recurrent_share_ = 1;
  VowelAdaptation adaptation_;
};

/// The vowels of a whole sound of one voice at 100 frames a second, adapted to that voice.
std::vector<VowelLikelihood> hearVowels(const AudioClip& clip);

}  // namespace mouthpiece
