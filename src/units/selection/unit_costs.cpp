#include "units/selection/unit_costs.h"

#include <algorithm>
#include <cmath>

#include "units/selection/viseme_distance.h"

namespace mouthpiece {
namespace {

double neighbourMismatch(std::optional<Phone> wanted, std::optional<Phone> found, PhonePart facing) {
  if (wanted == found) return 0;
  if (!wanted || !found) return 1;
  return visemeDistance(*wanted, *found, facing) <= kSameVisemeDistance ? 0.5 : 1.0;
}

std::optional<Phone> phoneBefore(const SpeechLabels& labels, std::size_t phone) {
  if (phone == 0) return std::nullopt;
  return labels.phones[phone - 1].phone;
}

std::optional<Phone> phoneAfter(const SpeechLabels& labels, std::size_t phone) {
  if (phone + 1 >= labels.phones.size()) return std::nullopt;
  return labels.phones[phone + 1].phone;
}

}  // namespace

UnitCosts::UnitCosts(const SpeechLabels& target, const UnitDatabase& database, const SelectionOptions& options)
    : target_(target), database_(database), weights_(options.weights), sound_join_cost_(options.sound_join_cost) {}

UnitCosts::Place UnitCosts::placeOf(const SpeechLabels& labels, std::size_t phone) {
  Place place;
  const LabelledPhone& labelled = labels.phones[phone];
  if (labelled.word) {
    const PhoneRange& word = labels.words[*labelled.word].phones;
    place.begins_word = word.first.value == phone;
    place.ends_word = word.last.value == phone;
  }
  if (labelled.syllable) place.stressed = labels.syllables[*labelled.syllable].stress > 0;
  return place;
}

double UnitCosts::contextCost(const PhoneRange& range, const PhonePlace& source) const {
  const SpeechLabels& take = database_.takeOf(source).labels;
  const std::size_t source_last = source.phone.value + range.last.value - range.first.value;
  return neighbourMismatch(phoneBefore(target_, range.first.value), phoneBefore(take, source.phone.value),
                           PhonePart::kEnd) +
         neighbourMismatch(phoneAfter(target_, range.last.value), phoneAfter(take, source_last), PhonePart::kBegin);
}

double UnitCosts::labelCost(const PhoneRange& range, const PhonePlace& source) const {
  const SpeechLabels& take = database_.takeOf(source).labels;
  double cost = weights_.context * contextCost(range, source);
  for (std::size_t i = range.first.value; i <= range.last.value; ++i) {
    const std::size_t at = source.phone.value + i - range.first.value;
    // Half of a shared phone belongs to the neighbour.
    const double share = i == range.first.value || i == range.last.value ? 0.5 : 1.0;
    if (target_.phones[i].phone != Phone::kSil) {  // a silence is never stretched
      const double ratio = target_.phones[i].span.duration() / take.phones[at].span.duration();
      constexpr double kWorst = 5;  // 150 times as long; keeps costs finite for labels of next to no time
      cost += share * weights_.duration * std::min(kWorst, std::abs(std::log(ratio)));
    }
    const Place wanted = placeOf(target_, i);
    const Place found = placeOf(take, at);
    const int edges = int{wanted.begins_word != found.begins_word} + int{wanted.ends_word != found.ends_word};
    cost += share * (weights_.word_position * edges + weights_.stress * int{wanted.stressed != found.stressed});
  }
  return cost;
}

double UnitCosts::targetCost(const PhoneRange& range, const PhonePlace& source) const {
  double cost = labelCost(range, source);
  for (std::size_t i = range.first.value; i <= range.last.value; ++i) {
    if (!isBilabial(target_.phones[i].phone)) continue;
    const double share = i == range.first.value || i == range.last.value ? 0.5 : 1.0;
    const PhonePlace own = advance(source, i - range.first.value);
    cost += share * weights_.closure_per_mm * std::max(0.0, database_.openingLeft(own));
  }
  return cost;
}

double UnitCosts::joinCost(PhoneIndex shared, const PhonePlace& before, const PhonePlace& after) const {
  const PhoneLips& a = database_.lipsOf(before);
  const PhoneLips& b = database_.lipsOf(after);
  const double markers = std::max(1.0, static_cast<double>(a.positions_mm.cols()) / 3);
  const Seconds duration = target_.phones[shared.value].span.duration();
  constexpr double kUnknown = 100;  // when no point compares: a marker beside the phone is not seen (NaN is never less)
  double best = kUnknown;
  const double sound = sound_join_cost_ ? sound_join_cost_(before, after) : 0;
  for (Eigen::Index k = 0; k < PhoneLips::kPoints; ++k) {
    const double distance_mm = std::sqrt((a.positions_mm.row(k) - b.positions_mm.row(k)).squaredNorm() / markers);
    const double velocity_mm_s = std::sqrt((a.steps_mm.row(k) - b.steps_mm.row(k)).squaredNorm() / markers) / duration;
    best =
        std::min(best, weights_.join_position_per_mm * distance_mm + weights_.join_velocity_per_mm_s * velocity_mm_s);
  }
  return best + sound;
}

}  // namespace mouthpiece
