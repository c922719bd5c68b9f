#include <algorithm>
#include <cmath>
#include <limits>

#include "units/costs/viseme_distance.h"
#include "units/selection/lattice.h"

namespace mouthpiece {

SelectionCosts::SelectionCosts(const SpeechLabels& target, const UnitDatabase& database, const CostWeights& weights,
                               bool of_pairs)
    : target_(target), database_(database), of_pairs_(of_pairs) {
  for (std::size_t i = 0; i < weights.terms().size(); ++i) {
    const double weight = weights.values()[i];
    const auto& value = weights.terms()[i].value;
    if (const auto* phone = std::get_if<CostTerm::OfPhone>(&value)) phone_terms_.push_back({weight, *phone});
    if (const auto* ends = std::get_if<CostTerm::OfEnds>(&value)) end_terms_.push_back({weight, *ends});
    if (const auto* join = std::get_if<CostTerm::OfJoin>(&value)) join_terms_.push_back({weight, *join});
  }
  PhoneColumns line;
  line.add(target, false);
  for (std::size_t i = 0; i < target.phones.size(); ++i)
    wanted_.push_back(line.factsOf({TakeIndex(0), PhoneIndex(i)}, of_pairs));
}

SelectionCosts::SelectionCosts(const SpeechLabels& target, const UnitDatabase& database,
                               const SelectionWeights& weights)
    : SelectionCosts(target, database, weights, false) {}

SelectionCosts::SelectionCosts(const SpeechLabels& target, const UnitDatabase& database, const LatticeWeights& weights,
                               const PredictedLine* predicted)
    : SelectionCosts(target, database, weights, true) {
  const Corpus& corpus = database.corpus();
  const TrajectoryModel& model = *corpus.trajectory_model;
  duration_weight_ = weights["duration"];
  neighbour_weight_ = weights["neighbours"];
  closed_mm_ = model.closed_opening_mm;
  predicted_ = predicted != nullptr ? predicted->shapes : predictedShapes(model, target);
  openings_.assign(unsignedIndex(shapeComponents(model)), 0.0F);
  if (!database.lips().hasLips()) return;
  const Eigen::VectorXd openings = database.lips().verticalOpenings(model.shapes);
  for (std::size_t i = 0; i < openings_.size(); ++i) openings_[i] = asFloat(openings[signedIndex(i)]);
}

PhoneFacts SelectionCosts::found(const PhonePlace& place) const {
  return database_.columns().factsOf(place, of_pairs_);
}

double SelectionCosts::phoneCost(std::size_t phone, const PhonePlace& place, const PhoneFacts& found, bool look) const {
  OfferedPhone offered{wanted_[phone], found, 0, nullptr, {}, false};
  const bool closes = look && isBilabial(target_.phones[phone].phone);
  PhoneShape shape;
  if (of_pairs_) {
    shape = database_.shapeOf(place);
    offered.shape = &shape;
    offered.is_adapted = database_.columns().isAdapted(place.take);
    offered.predicted = {predicted_.row(signedIndex(phone)).data(), unsignedIndex(predicted_.cols())};
    // Where the lips were not seen the difference is NaN, which is not taken.
    if (closes && closed_mm_ > 0) offered.left_open_mm = std::max(0.0, database_.tightestMm(place) - closed_mm_);
  } else if (closes) {
    offered.left_open_mm = std::max(0.0, database_.openingLeft(place));
  }
  double cost = 0;
  for (const auto& [weight, value] : phone_terms_) cost += weight * value(offered);
  return cost;
}

double SelectionCosts::sum(const PhoneRange& range, const PhonePlace& place, bool look_at_motion) const {
  const std::size_t count = range.last.value - range.first.value;
  const PhoneFacts first = found(place), last = found(advance(place, count));
  double cost = 0;
  for (const auto& [weight, value] : end_terms_)
    cost += weight * value({wanted_[range.first.value], first, wanted_[range.last.value], last});
  for (std::size_t i = 0; i <= count; ++i) {
    const PhonePlace own = advance(place, i);
    const bool is_shared = i == 0 || i == count;  // half of it belongs to the neighbour
    const PhoneFacts facts = i == 0 ? first : i == count ? last : found(own);
    cost += (is_shared ? 0.5 : 1.0) * phoneCost(range.first.value + i, own, facts, look_at_motion);
  }
  return std::isnan(cost) ? std::numeric_limits<double>::infinity() : cost;
}

double SelectionCosts::targetCost(const PhoneRange& range, const PhonePlace& place) const {
  return sum(range, place, true);
}

double SelectionCosts::labelCost(const PhoneRange& range, const PhonePlace& place) const {
  return sum(range, place, false);
}

double SelectionCosts::roughCost(std::size_t first, const PhonePlace& place) const {
  const PhoneColumns& columns = database_.columns();
  const std::size_t at = columns.positionOf(place);
  double cost = 0;
  for (std::size_t i = 0; i < 2; ++i) {
    const PhoneFacts& wanted = wanted_[first + i];
    if (wanted.phone() == Phone::kSil) continue;
    const float length = asFloat(std::max(1e-3, columns.durations[at + i]));
    cost += 0.5 * duration_weight_ * std::abs(wanted.log_duration - std::log(length));
  }
  const auto neighbour = [&](Phone wanted, Phone found, PhonePart facing) {
    if (wanted == found) return 0.0;
    return visemeDistance(wanted, found, facing) <= kSameVisemeDistance ? 0.5 : 1.0;
  };
  const Phone before = place.phone.value > 0 ? columns.phones[at - 1] : Phone::kSil;
  const Phone after = at + 2 < columns.endOf(place.take) ? columns.phones[at + 2] : Phone::kSil;
  return cost + neighbour_weight_ / 3 *
                    (neighbour(wanted_[first].phones[1], before, PhonePart::kEnd) +
                     neighbour(wanted_[first + 1].phones[3], after, PhonePart::kBegin));
}

/// What is left of the difference when each is moved from its own context into the line's.
void SelectionCosts::comparePairs(PhoneIndex shared, const PhonePlace& before, const PhonePlace& after) const {
  constexpr Eigen::Index kPoints = PhoneShapes::kPoints;
  const PhoneShape a = database_.shapeOf(before), b = database_.shapeOf(after);
  const Eigen::Index components = std::ssize(openings_);
  differences_.resize(kPoints, components);
  velocities_.resize(kPoints, components);
  Eigen::Map<Eigen::RowVectorXf>(differences_.data(), differences_.size()) =
      a.captured() - a.predicted() - b.captured() + b.predicted();
  const Seconds spacing = target_.phones[shared.value].span.duration() / asReal(kPoints);
  for (Eigen::Index point = 0; point < kPoints; ++point) {
    const Eigen::Index next = std::min(point + 1, kPoints - 1), last = std::max<Eigen::Index>(point - 1, 0);
    velocities_.row(point) = (differences_.row(next) - differences_.row(last)) / asFloat(spacing * asReal(next - last));
  }
}

void SelectionCosts::compareLips(PhoneIndex shared, const PhonePlace& before, const PhonePlace& after) const {
  const PhoneLips &a = database_.lipsOf(before), &b = database_.lipsOf(after);
  differences_ = a.positions_mm - b.positions_mm;
  velocities_ = (a.steps_mm - b.steps_mm) / asFloat(target_.phones[shared.value].span.duration());
}

double SelectionCosts::joinCost(PhoneIndex shared, const PhonePlace& before, const PhonePlace& after) const {
  constexpr double kUnknown = 100;  // of lips, when no point compares: a marker beside the phone is not seen
  of_pairs_ ? comparePairs(shared, before, after) : compareLips(shared, before, after);
  const double markers = std::max(1.0, asReal(differences_.cols()) / 3);
  double best = of_pairs_ ? std::numeric_limits<double>::infinity() : kUnknown;
  for (Eigen::Index point = 0; point < differences_.rows(); ++point) {
    const MetPoint met{{differences_.row(point).data(), differences_.cols()},
                       {velocities_.row(point).data(), velocities_.cols()},
                       of_pairs_ ? 1.0 : 1 / std::sqrt(markers),
                       openings_};
    double cost = 0;
    for (const auto& [weight, value] : join_terms_) cost += weight * value(met);
    if (cost < best) best = cost;  // NaN is not
  }
  return best;
}

}  // namespace mouthpiece
