#pragma once

#include <Eigen/Core>
#include <span>

namespace mouthpiece {

struct TiedModel;

/// A voice's features as a model's own voices would have them (constrained MLLR: M. Gales, "Maximum likelihood linear
/// transformations for HMM-based speech recognition", Computer Speech and Language 12, 1998). Cepstra and both their
/// differences go through one matrix, since differences of what is mapped are the differences mapped.
struct VoiceTransform {
  Eigen::MatrixXd matrix;  ///< of a stream's features; empty: all stays as it is
  Eigen::VectorXd shift;   ///< of the cepstra, whose mean is taken off

  [[nodiscard]] bool isNone() const { return matrix.size() == 0; }
  /// features: a column a frame, streams of equal size one under another, as many as there are.
  [[nodiscard]] Eigen::MatrixXf operator()(const Eigen::MatrixXf& features) const;
  /// What the logarithm of a stream's density gains where its features are stretched.
  [[nodiscard]] double logStretch() const;
};

/// What was heard of a stretch of sound.
struct HeardFrames {
  Eigen::MatrixXf features;    ///< a column a frame (PhoneDecoder::featuresOf)
  Eigen::MatrixXf posteriors;  ///< phones by their number x frames (PhoneLoop::posteriors)
};

/// The transform under which the model is likeliest to have made the phones that were heard; silence does not count.
/// 1.5 s of its own speech hold it back (docs/theory/hearing/phone_ear.md#the-voice-of-a-recording). None where
/// nothing was heard, and for a model of other features than cepstra and their differences.
VoiceTransform fitVoice(const TiedModel& model, std::span<const HeardFrames> heard);

}  // namespace mouthpiece
