#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "hearing/recognition/recogniser.h"

namespace mouthpiece {

/// Leaves what lies next to another phone of their word, or of none, of closings that are held longer than anybody
/// holds one: noise is heard as the rest.
void shortenHeldPhones(std::vector<PhoneSegment>& segments);

/// Phones and words on the clock of a whole sound, as its stretches are heard one after the other, and what of them is
/// doubtful.
class CollectedSpeech {
 public:
  /// `confidence`: 0 to 1.
  void addPhone(const PhoneSegment& phone, double confidence);
  /// Returns its number, for PhoneSegment::word.
  std::size_t addWord(std::string text);
  /// A stretch, and the logarithm of the odds that much of it is heard wrongly. `heard_for`: how much of it is speech;
  /// a click counts, but is not named.
  void addStretch(const TimeSpan& stretch, double odds, Seconds heard_for);
  /// A stretch in which nobody says anything: noise.
  void passOver(const TimeSpan& stretch) { passed_over_.push_back(stretch); }
  /// What is to be named beside the stretches: a place, and a word.
  void doubt(const TimeSpan& place) { doubted_.push_back(place); }
  void doubtWord(std::string_view word, Seconds start);

  /// Labels, confidences, text and warnings of all that was added, into `heard`, whose stretches are kept, those that
  /// were passed over as noise, and whose warnings are.
  /// `words_wanted`: phones without words are told. `takes_hints`: a hint helps. Throws InputError, named `name`, where
  /// nothing was added.
  void finish(std::string_view name, Seconds duration, const Language& language, bool words_wanted, bool takes_hints,
              HeardSpeech& heard);

 private:
  void warn(bool words_wanted, bool takes_hints, HeardSpeech& heard) const;
  [[nodiscard]] std::string doubts() const;

  std::vector<PhoneSegment> segments_;
  std::vector<double> confidence_;  ///< of each segment
  std::vector<std::string> words_;
  std::vector<std::string> doubtful_;  ///< words with their times
  std::vector<TimeSpan> doubted_;      ///< places
  std::vector<TimeSpan> passed_over_;
  double stretch_s_ = 0, odds_s_ = 0;  ///< sums over stretches; the odds times how long each is
};

}  // namespace mouthpiece
