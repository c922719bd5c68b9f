#pragma once

#include <Eigen/Core>
#include <array>

#include "motion/motion_clip.h"
#include "units/file/corpus.h"

namespace mouthpiece {

/// Cohen and Massaro's coarticulation (1993), the model that unit selection is compared with: each phone has a target
/// T and a dominance D = a exp(-theta |t - t_phone|^c), and the face is F(t) = sum D T / sum D.
class DominanceModel {
 public:
  /// Targets: the mean pose of each phone's middle frames. a (one per kind of phone), theta and c: a coarse grid, by
  /// the lip error over some takes of the corpus.
  static DominanceModel fit(const Corpus& corpus);

  /// `frames` frames of the layout's markers on the clock of `labels`.
  [[nodiscard]] MotionClip animate(const SpeechLabels& labels, double frame_rate_hz, std::size_t frames) const;

  /// Kinds of phones that share a magnitude a.
  enum class Kind : std::uint8_t { kSilence, kVowel, kRounded, kBilabial, kLabiodental, kSibilant, kOther };
  static constexpr std::size_t kKindCount = 7;
  static Kind kindOf(Phone phone);

  struct Parameters {
    std::array<double, kKindCount> magnitude{1, 1, 1, 1, 1, 1, 1};  ///< a
    double rate = 20;                                               ///< theta, 1 / s^c
    double power = 1;                                               ///< c
  };
  [[nodiscard]] const Parameters& parameters() const { return parameters_; }

 private:
  std::vector<std::string> marker_names_;
  std::array<Eigen::RowVectorXd, kPhoneCount> targets_;
  Parameters parameters_;
};

}  // namespace mouthpiece
