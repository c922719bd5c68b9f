#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "units/selection/selection.h"
#include "units/selection/unit_database.h"

namespace mouthpiece {

/// A captured pair of phones offered for a pair of the line.
struct PairCandidate {
  PhonePlace place;  ///< of the first phone
  float cost = 0;
};

/// Target and join costs of pairs of phones (docs/theory/selection.md), from PhoneShapes and labels alone.
class PairCosts {
 public:
  PairCosts(const SpeechLabels& target, const UnitDatabase& database, const LatticeWeights& weights);

  /// The parts of the same that the labels tell at once (durations and nearest neighbours): to leave the worst of very
  /// many places out before anything of their takes is looked at.
  [[nodiscard]] float roughCost(std::size_t first, const PhonePlace& place) const;

  /// For phones `first` and `first + 1` of the line; infinite where the capture was not seen.
  [[nodiscard]] float targetCost(std::size_t first, const PhonePlace& place) const;

  /// Of changing from a fragment in which `before` plays phone `shared` of the line to one in which `after` does: the
  /// least over the points of the phone of the mismatch that is left when both are moved into the line's context.
  [[nodiscard]] float joinCost(std::size_t shared, const PhonePlace& before, const PhonePlace& after) const;

 private:
  /// What the labels say of a phone; computed once for the line, for takes as they are asked.
  struct Facts {
    std::array<Phone, 5> phones{};  ///< two before, itself, two after; silence beyond the ends
    unsigned edges = 0;             ///< bits: begins, ends a syllable, word, phrase
    bool stressed = false;
    float log_duration = 0, log_rate = 0;
  };
  static Facts factsOf(const SpeechLabels& labels, std::size_t phone);
  [[nodiscard]] float phoneCost(std::size_t phone, const PhonePlace& place, const Facts& found) const;
  [[nodiscard]] const std::vector<Facts>& takeFacts(TakeIndex take) const;

  const SpeechLabels& target_;
  const UnitDatabase& database_;
  LatticeWeights weights_;
  Eigen::Index components_;
  PhoneShapes::Matrix predicted_;
  std::vector<float> openings_;  ///< lip opening in mm of one unit of each component
  float closed_mm_;
  std::vector<Facts> wanted_;
  mutable std::vector<std::vector<Facts>> found_;  ///< by take
};

}  // namespace mouthpiece
