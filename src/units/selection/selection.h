#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "base/errors.h"
#include "phonetics/labels/speech_labels.h"
#include "units/costs/cost_terms.h"
#include "units/phones/phone_span_index.h"
#include "units/prediction/phone_shapes.h"

namespace mouthpiece {

class UnitDatabase;

enum class SelectionMethod {
  kGreedy,   ///< EDGE 5.1.1: always the longest fragment that fits
  kViterbi,  ///< least sum of target and join costs over all fragments; pair by pair, with the prediction as a guide,
             ///< where the corpus has a trajectory model and units are of any kind
};

/// Which runs of phones may be a unit.
enum class UnitScales {
  kAny,    ///< every run
  kPaper,  ///< sentences, words, syllables, each with at most one phone of context on either side, and diphones
};

/// What to do where the corpus lacks a pair of phones.
enum class Backoff {
  kViseme,  ///< the nearest pair by viseme class stands in
  kNone,    ///< refuse
};

struct SelectionOptions {
  SelectionMethod method = SelectionMethod::kGreedy;
  UnitScales units = UnitScales::kAny;
  Backoff backoff = Backoff::kViseme;
  SelectionWeights weights = {};
  /// Added to the cost of going from one corpus phone into another, where the sound is joined too; may be empty.
  std::function<double(const PhonePlace& before, const PhonePlace& after)> sound_join_cost = {};
  std::size_t candidates_kept = 6;  ///< viterbi: fragments per run of phones, the cheapest ones by target cost
  std::optional<LatticeWeights> lattice = {};  ///< none: those of the corpus
  std::size_t pairs_kept = 40;                 ///< lattice: places per pair of phones, the cheapest ones by target cost
  std::size_t pairs_looked_at = 200;           ///< lattice: of more places of a pair than these the likeliest by label
  /// Lattice: by pair, the places of those that are chosen already; may be shorter than the line.
  std::vector<std::optional<PhonePlace>> settled = {};
  std::shared_ptr<const PredictedLine> predicted = {};  ///< lattice: of this line; null: it is made
};

/// The corpus lacks a pair of phones, and there is, or shall be, nothing in its stead.
class MissingPairError : public InputError {
 public:
  using InputError::InputError;
};

/// A fragment of the corpus chosen for phones [first, last] of the target. Neighbours share a phone.
struct SelectedUnit {
  PhoneRange phones;
  PhonePlace source;  ///< first phone of the fragment
  double target_cost = 0;
  double join_cost = 0;     ///< with the unit before
  bool is_backoff = false;  ///< the corpus lacks the pair: the nearest one by viseme class stands in
  TimeSpan sound = {};      ///< of the target: where the fragment's recording is heard; empty when another voice speaks
};

/// Covers the whole target. Only fragments whose motion is seen throughout are offered. Where the corpus has no such
/// fragment even for a pair of phones, the nearest pair by viseme class stands in; where there is none either (lips
/// that must close or touch would do so in neither phone), throws MissingPairError that names the pair. Never loops.
/// Empty when the target has fewer than two phones.
std::vector<SelectedUnit> selectUnits(const SpeechLabels& target, const UnitDatabase& database,
                                      const SelectionOptions& options);

/// For the phones of each of `units` other seen fragments than its own: for each phone of the longest runs of the
/// unit's phones with it that the corpus says elsewhere, too. Longest runs first; of a run at most `most`, the cheapest
/// by target cost first.
std::vector<std::vector<SelectedUnit>> otherUnits(const SpeechLabels& target, const UnitDatabase& database,
                                                  std::span<const SelectedUnit> units, std::size_t most);

/// Whether the corpus has a fragment or a stand-in for each pair of the target's phones; with a trajectory model only.
bool isCovered(const SpeechLabels& target, const UnitDatabase& database, const SelectionOptions& options);

/// What the fragment of `phone_count` phones at `first` is in its take: "sentence" (all of it), "phrase" (several whole
/// words), "word", "syllable" (at least one whole), "diphone" or "span".
std::string_view scaleOf(const SpeechLabels& take, PhoneIndex first, std::size_t phone_count);

}  // namespace mouthpiece
