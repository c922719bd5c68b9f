#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

#include "base/time.h"
#include "hearing/alignment/phone_ear.h"
#include "phonetics/labels/speech_labels.h"

namespace mouthpiece {

/// What an ear hears in a stretch of a sound, whatever is said, on the stretch's clock.
class StretchHearing {
 public:
  /// `posteriors`: PhoneEar's of the stretch; `likeness`: lipLikeness(), kept alive by the caller.
  StretchHearing(Eigen::MatrixXf posteriors, const Eigen::MatrixXf& likeness);

  [[nodiscard]] const Eigen::MatrixXf& posteriors() const { return posteriors_; }
  /// The phones that are heard without words, silences among them.
  [[nodiscard]] const std::vector<HeardPhone>& row() const { return row_; }
  /// How far a phone between `span`'s ends is what is heard there, or looks like it, 0 to 1; 0 outside of the stretch.
  [[nodiscard]] double fitOf(Phone phone, const TimeSpan& span) const;
  /// The same of the row's phones, in the mean over their time, which heardFor() is.
  [[nodiscard]] double fit() const { return fit_; }
  [[nodiscard]] Seconds heardFor() const { return heard_for_; }
  [[nodiscard]] Seconds duration() const { return asReal(posteriors_.cols()) * kEarStep; }
  /// How far the phones of words lie from the row: the fewest changes from one to the other, a phone of the longer one.
  [[nodiscard]] double apartFrom(const SpeechLabels& words) const;
  /// The frames in a span, first and behind the last; none where it lies outside.
  [[nodiscard]] std::pair<Eigen::Index, Eigen::Index> framesOf(const TimeSpan& span) const;

 private:
  Eigen::MatrixXf posteriors_;
  const Eigen::MatrixXf& likeness_;
  std::vector<HeardPhone> row_;
  double fit_ = 0;
  Seconds heard_for_ = 0;
};

/// When a phone of a row is heard.
inline TimeSpan spanOf(const HeardPhone& phone) {
  return {asReal(phone.first) * kEarStep + kEarShift, asReal(phone.end) * kEarStep + kEarShift};
}

}  // namespace mouthpiece
