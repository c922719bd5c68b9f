#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <string_view>
#include <variant>
#include <vector>

#include "units/phones/phone_columns.h"
#include "units/prediction/phone_shapes.h"

namespace mouthpiece {

/// A phone of the line and the captured one that is offered for it.
struct OfferedPhone {
  const PhoneFacts& wanted;
  const PhoneFacts& found;
  double left_open_mm = 0;            ///< B P M: how far the lips stay open at their tightest, beyond a closure
  const PhoneShape* shape = nullptr;  ///< of pairs only
  std::span<const float> predicted;   ///< for the line, as `shape` has it; of pairs only
  bool is_adapted = false;            ///< from another speaker's take (isAdapted()); of pairs only
};

/// The phones at the ends of a run, which face its neighbours.
struct OfferedEnds {
  const PhoneFacts &wanted_first, &found_first, &wanted_last, &found_last;
};

/// What two fragments differ by at one point of the phone that they share: marker coordinates, or components.
struct MetPoint {
  using Row = Eigen::Map<const Eigen::RowVectorXf>;
  Row difference_mm, velocity_mm_s;
  double share = 1;                ///< makes a norm a root mean square over markers; 1 of components
  std::span<const float> opening;  ///< of pairs: by how many mm the lips part for one unit of each component
};

/// One thing that is wrong with a unit, and what it costs. Costs are sums of weight times value. To add a term, add its
/// row in cost_terms.cpp: weights, the corpus file, `corpus tune`, the ablation and the search follow from the table.
struct CostTerm {
  using OfPhone = double (*)(const OfferedPhone&);  ///< the mean over a pair; over a fragment half at shared phones
  using OfEnds = double (*)(const OfferedEnds&);    ///< once a run
  using OfJoin = double (*)(const MetPoint&);       ///< a join costs the least sum over the points of the shared phone

  std::string_view name;
  std::string_view unit;  ///< of the weight; "" where the value has none
  double weight;          ///< the usual one
  std::string_view what;
  std::string_view ablation;  ///< the row of `corpus evaluate --ablation` that goes without; "": not ablated, not tuned
  std::variant<std::monostate, OfPhone, OfEnds, OfJoin> value;  ///< none: the search counts it; never negative
};

/// Viterbi in a corpus with a trajectory model: pairs of phones, compared with what is predicted for the line. The
/// order is that of the corpus file: a new term is the last one.
std::span<const CostTerm> pairTerms();
/// Greedy, and viterbi in any other corpus: fragments of every length, compared by labels and captured lips.
std::span<const CostTerm> fragmentTerms();

/// A weight for each term of a table.
class CostWeights {
 public:
  [[nodiscard]] std::span<const CostTerm> terms() const { return terms_; }
  /// Of the term of that name, which must be there.
  double& operator[](std::string_view name) { return values_[placeOf(name)]; }
  double operator[](std::string_view name) const { return values_[placeOf(name)]; }
  /// In the table's order.
  [[nodiscard]] std::span<double> values() { return values_; }
  [[nodiscard]] std::span<const double> values() const { return values_; }
  bool operator==(const CostWeights& other) const { return values_ == other.values_; }

 protected:
  explicit CostWeights(std::span<const CostTerm> terms);

 private:
  [[nodiscard]] std::size_t placeOf(std::string_view name) const;
  std::span<const CostTerm> terms_;
  std::vector<double> values_;
};

/// Of pairTerms(), the usual ones to begin with. Kept in the corpus; `corpus tune` learns others.
struct LatticeWeights : CostWeights {
  LatticeWeights() : CostWeights(pairTerms()) {}
};
/// Of fragmentTerms(), likewise.
struct SelectionWeights : CostWeights {
  SelectionWeights() : CostWeights(fragmentTerms()) {}
};

/// What a cut from one recording of a phone into another costs (docs/theory/voices/corpus_voice.md). Set by hand; kept
/// in the corpus where `corpus tune --voice` learnt others.
struct SoundCutWeights {
  double spectral = 1;         ///< per distance of neighbouring frames of steady speech, in MFCC
  double level_per_db = 0.08;  ///< difference of level
  double per_octave = 6;       ///< difference of pitch
  double voicing = 1.5;        ///< only one side is voiced
  double slip = 2;             ///< per phone length between the places of the two cuts
  double loud_per_db = 0.02;   ///< louder than the quietest place of the left phone
  double lip_per_mm = 0.3;     ///< of the lips, where both takes' own prediction is taken off
  double in_join = 0.5;        ///< of the sum, among the selection's join costs

  friend bool operator==(const SoundCutWeights&, const SoundCutWeights&) = default;
};

/// A weight of SoundCutWeights and its name for people, in the order of the corpus file.
struct SoundCutTerm {
  std::string_view name;
  double SoundCutWeights::*weight;
};
inline constexpr std::array<SoundCutTerm, 8> kSoundCutTerms{{{"spectral", &SoundCutWeights::spectral},
                                                             {"level", &SoundCutWeights::level_per_db},
                                                             {"octave", &SoundCutWeights::per_octave},
                                                             {"voicing", &SoundCutWeights::voicing},
                                                             {"slip", &SoundCutWeights::slip},
                                                             {"loud", &SoundCutWeights::loud_per_db},
                                                             {"lip", &SoundCutWeights::lip_per_mm},
                                                             {"in join", &SoundCutWeights::in_join}}};

}  // namespace mouthpiece
