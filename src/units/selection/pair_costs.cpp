#include "units/selection/pair_costs.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "base/index.h"
#include "units/selection/unit_costs.h"
#include "units/selection/viseme_distance.h"

namespace mouthpiece {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

float neighbourMismatch(Phone wanted, Phone found, PhonePart facing) {
  if (wanted == found) return 0;
  return visemeDistance(wanted, found, facing) <= kSameVisemeDistance ? 0.5F : 1.0F;
}

bool isSilent(const SpeechLabels& labels, std::size_t phone) { return labels.phones[phone].phone == Phone::kSil; }

/// Phones a second over up to three phones to each side, not beyond a pause.
double phoneRate(const SpeechLabels& labels, std::size_t phone) {
  constexpr std::size_t kReach = 3;
  std::size_t first = phone, last = phone;
  while (first > 0 && phone - first < kReach && !isSilent(labels, first - 1)) --first;
  while (last + 1 < labels.phones.size() && last - phone < kReach && !isSilent(labels, last + 1)) ++last;
  const Seconds length = labels.phones[last].span.end - labels.phones[first].span.start;
  return static_cast<double>(last - first + 1) / std::max(length, 1e-3);
}

template <typename Tier>
unsigned edgesOf(const Tier& tier, std::optional<std::size_t> entry, std::size_t phone) {
  if (!entry) return 0;
  const PhoneRange& range = tier[*entry].phones;
  return (range.first.value == phone ? 1U : 0U) | (range.last.value == phone ? 2U : 0U);
}

}  // namespace

PairCosts::PairCosts(const SpeechLabels& target, const UnitDatabase& database, const LatticeWeights& weights)
    : target_(target),
      database_(database),
      weights_(weights),
      components_(shapeComponents(*database.corpus().trajectory_model)),
      predicted_(predictedShapes(*database.corpus().trajectory_model, target)),
      openings_(static_cast<std::size_t>(components_), 0.0F),
      closed_mm_(static_cast<float>(database.corpus().trajectory_model->closed_opening_mm)),
      found_(database.corpus().takes.size()) {
  for (std::size_t i = 0; i < target.phones.size(); ++i) wanted_.push_back(factsOf(target, i));
  if (!database.lips().hasLips()) return;
  const Eigen::VectorXd openings = database.lips().verticalOpenings(database.corpus().trajectory_model->shapes);
  for (std::size_t i = 0; i < openings_.size(); ++i) openings_[i] = asFloat(openings[signedIndex(i)]);
}

PairCosts::Facts PairCosts::factsOf(const SpeechLabels& labels, std::size_t phone) {
  Facts facts;
  for (std::size_t i = 0; i < facts.phones.size(); ++i) {
    const std::size_t at = phone + i - 2;  // below zero it wraps and is beyond the end
    facts.phones[i] = at < labels.phones.size() ? labels.phones[at].phone : Phone::kSil;
  }
  const LabelledPhone& own = labels.phones[phone];
  facts.edges = edgesOf(labels.syllables, own.syllable, phone) | edgesOf(labels.words, own.word, phone) << 2U;
  if (own.phone != Phone::kSil) {
    facts.edges |= (isSilent(labels, phone - 1) ? 16U : 0U) | (isSilent(labels, phone + 1) ? 32U : 0U);
  }
  if (own.syllable) facts.stressed = labels.syllables[*own.syllable].stress > 0;
  facts.log_duration = static_cast<float>(std::log(std::max(1e-3, own.span.duration())));
  facts.log_rate = static_cast<float>(std::log(phoneRate(labels, phone)));
  return facts;
}

const std::vector<PairCosts::Facts>& PairCosts::takeFacts(TakeIndex take) const {
  std::vector<Facts>& facts = found_[take.value];
  if (facts.empty()) {
    const SpeechLabels& labels = database_.corpus().takes[take.value].labels;
    facts.reserve(labels.phones.size());
    for (std::size_t i = 0; i < labels.phones.size(); ++i) facts.push_back(factsOf(labels, i));
  }
  return facts;
}

float PairCosts::phoneCost(std::size_t phone, const PhonePlace& place, const Facts& found) const {
  const Facts& wanted = wanted_[phone];
  const PhoneShape shape = database_.shapeOf(place);
  const auto line = predicted_.row(static_cast<Eigen::Index>(phone));
  const float points = static_cast<float>(PhoneShapes::kPoints);
  float cost = static_cast<float>(weights_.prediction_per_mm2) * (shape.captured() - line).squaredNorm() / points +
               static_cast<float>(weights_.context_per_mm2) * (shape.predicted() - line).squaredNorm() / points;
  if (wanted.phones[2] != Phone::kSil) {
    cost += static_cast<float>(weights_.duration) * std::abs(wanted.log_duration - found.log_duration);
    cost += static_cast<float>(weights_.rate) * std::abs(wanted.log_rate - found.log_rate);
  }
  const int edges = std::popcount(wanted.edges ^ found.edges);
  cost += static_cast<float>(weights_.position * edges + weights_.stress * int{wanted.stressed != found.stressed});
  if (isBilabial(wanted.phones[2]) && closed_mm_ > 0) {
    const float open = database_.tightestMm(place) - closed_mm_;
    if (open > 0) cost += static_cast<float>(weights_.closure_per_mm) * open;  // NaN is not
  }
  return std::isnan(cost) ? kInfinity : cost;
}

float PairCosts::roughCost(std::size_t first, const PhonePlace& place) const {
  const std::vector<LabelledPhone>& take = database_.corpus().takes[place.take.value].labels.phones;
  const std::size_t at = place.phone.value;
  float cost = 0;
  for (std::size_t i = 0; i < 2; ++i) {
    const Facts& wanted = wanted_[first + i];
    if (wanted.phones[2] == Phone::kSil) continue;
    const auto length = static_cast<float>(std::max(1e-3, take[at + i].span.duration()));
    cost += 0.5F * static_cast<float>(weights_.duration) * std::abs(wanted.log_duration - std::log(length));
  }
  const Phone before = at > 0 ? take[at - 1].phone : Phone::kSil;
  const Phone after = at + 2 < take.size() ? take[at + 2].phone : Phone::kSil;
  const float neighbours = neighbourMismatch(wanted_[first].phones[1], before, PhonePart::kEnd) +
                           neighbourMismatch(wanted_[first + 1].phones[3], after, PhonePart::kBegin);
  return cost + static_cast<float>(weights_.neighbours) * neighbours / 3;
}

float PairCosts::targetCost(std::size_t first, const PhonePlace& place) const {
  const std::vector<Facts>& take = takeFacts(place.take);
  const Facts& a = take[place.phone.value];
  const Facts& b = take[place.phone.value + 1];
  const Facts& wanted_a = wanted_[first];
  const Facts& wanted_b = wanted_[first + 1];
  // The nearer neighbours count twice.
  const float neighbours = neighbourMismatch(wanted_a.phones[0], a.phones[0], PhonePart::kEnd) +
                           2 * neighbourMismatch(wanted_a.phones[1], a.phones[1], PhonePart::kEnd) +
                           2 * neighbourMismatch(wanted_b.phones[3], b.phones[3], PhonePart::kBegin) +
                           neighbourMismatch(wanted_b.phones[4], b.phones[4], PhonePart::kBegin);
  return 0.5F * (phoneCost(first, place, a) + phoneCost(first + 1, advance(place, 1), b)) +
         static_cast<float>(weights_.neighbours) * neighbours / 6;
}

float PairCosts::joinCost(std::size_t shared, const PhonePlace& before, const PhonePlace& after) const {
  const PhoneShape a = database_.shapeOf(before);
  const PhoneShape b = database_.shapeOf(after);
  // What is left of the difference when each is moved from its own context into the line's.
  std::array<float, PhoneShapes::kPoints * PhoneShapes::kMostComponents> left{};
  const Eigen::Index size = PhoneShapes::kPoints * components_;
  Eigen::Map<Eigen::Array<float, 1, Eigen::Dynamic>> difference(left.data(), size);
  difference = (a.captured() - a.predicted() - b.captured() + b.predicted()).array();
  const auto spacing = static_cast<float>(target_.phones[shared].span.duration() / PhoneShapes::kPoints);
  float best = kInfinity;
  for (Eigen::Index point = 0; point < PhoneShapes::kPoints; ++point) {
    const Eigen::Index next = std::min<Eigen::Index>(point + 1, PhoneShapes::kPoints - 1);
    const Eigen::Index last = std::max<Eigen::Index>(point - 1, 0);
    const auto at = difference.segment(point * components_, components_);
    const auto change =
        difference.segment(next * components_, components_) - difference.segment(last * components_, components_);
    float opening = 0;
    for (Eigen::Index i = 0; i < components_; ++i) opening += at(i) * openings_[static_cast<std::size_t>(i)];
    const float cost = static_cast<float>(weights_.join_position_per_mm) * at.matrix().norm() +
                       static_cast<float>(weights_.join_velocity_per_mm_s) * change.matrix().norm() /
                           (spacing * static_cast<float>(next - last)) +
                       static_cast<float>(weights_.join_opening_per_mm) * std::abs(opening);
    if (cost < best) best = cost;  // NaN is not
  }
  return best + static_cast<float>(weights_.unit);
}

}  // namespace mouthpiece
