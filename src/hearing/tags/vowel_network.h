#pragma once

#include <Eigen/Core>
#include <string_view>
#include <vector>

#include "hearing/tags/vowel_features.h"
#include "audio/audio_tags.h"
#include "hearing/tags/vowel_adaptation.h"
#include "hearing/tags/vowel_perceptron.h"

namespace mouthpiece {

/// The classes of the network, in the order of its outputs.
enum class SungVowel { kA, kE, kI, kO, kU, kSilence };
inline constexpr int kSungVowelCount = 6;

/// Tells the sung vowel of every frame (VOCAL 4.3): 12 frames before and after side by side, three LSTM layers, ReLU, a
/// fully connected layer, softmax; of networks that began differently the mean, and with it that of small networks of
/// a few frames. Trained by tools/train_vowels.py.
/// Immutable: may be shared by threads.
class VowelNetwork {
 public:
  /// Reads the weights (docs/theory/vowel_network.md, "The weights' file"). Throws InputError for sizes that do not fit
  /// the bytes or each other, and numbers that are not finite.
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
  std::vector<Member> members_;
  std::vector<VowelPerceptron> perceptrons_;
  float recurrent_share_ = 1;
  VowelAdaptation adaptation_;
};

/// The vowels of a whole sound of one voice at 100 frames a second, adapted to that voice.
std::vector<VowelLikelihood> hearVowels(const AudioClip& clip);

}  // namespace mouthpiece
