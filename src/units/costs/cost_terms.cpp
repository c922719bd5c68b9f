#include "units/costs/cost_terms.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "base/errors.h"
#include "units/costs/viseme_distance.h"

namespace mouthpiece {
namespace {

constexpr unsigned kWordEdges = kBeginsWord | kEndsWord;

double oneIf(bool holds) { return holds ? 1.0 : 0.0; }

double mismatch(Phone wanted, Phone found, PhonePart facing) {
  if (wanted == found) return 0;
  return visemeDistance(wanted, found, facing) <= kSameVisemeDistance ? 0.5 : 1.0;
}

/// Two to each side, the nearer counted twice.
double ofNeighbours(const OfferedEnds& ends) {
  const auto at = [&](std::size_t i) {
    return i < 2 ? mismatch(ends.wanted_first.phones[i], ends.found_first.phones[i], PhonePart::kEnd)
                 : mismatch(ends.wanted_last.phones[i], ends.found_last.phones[i], PhonePart::kBegin);
  };
  return (at(0) + 2 * at(1) + 2 * at(3) + at(4)) / 6;
}

/// A line that is part of another may end in speech: what lies beyond its ends is like no captured phone.
double ofContext(const OfferedEnds& ends) {
  const bool begins = ends.wanted_first.is_first, ends_it = ends.wanted_last.is_last;
  const double before = begins || ends.found_first.is_first
                            ? oneIf(begins != ends.found_first.is_first)
                            : mismatch(ends.wanted_first.phones[1], ends.found_first.phones[1], PhonePart::kEnd);
  const double after = ends_it || ends.found_last.is_last
                           ? oneIf(ends_it != ends.found_last.is_last)
                           : mismatch(ends.wanted_last.phones[3], ends.found_last.phones[3], PhonePart::kBegin);
  return before + after;
}

/// A silence is never stretched. Ten seconds cost no more than 150 times as long: labels of next to no time.
double ofDuration(const OfferedPhone& phone) {
  constexpr double kWorst = 5;
  if (phone.wanted.phone() == Phone::kSil) return 0;
  return std::min(kWorst, std::abs(std::log(phone.wanted.duration / phone.found.duration)));
}

double ofLogDuration(const OfferedPhone& phone) {
  if (phone.wanted.phone() == Phone::kSil) return 0;
  return std::abs(phone.wanted.log_duration - phone.found.log_duration);
}

double ofRate(const OfferedPhone& phone) {
  if (phone.wanted.phone() == Phone::kSil) return 0;
  return std::abs(phone.wanted.log_rate - phone.found.log_rate);
}

double ofEdges(const OfferedPhone& phone) { return std::popcount(phone.wanted.edges ^ phone.found.edges); }

double ofWordEdges(const OfferedPhone& phone) {
  return std::popcount((phone.wanted.edges ^ phone.found.edges) & kWordEdges);
}

double ofStress(const OfferedPhone& phone) { return oneIf(phone.wanted.is_stressed != phone.found.is_stressed); }

double ofClosure(const OfferedPhone& phone) { return phone.left_open_mm; }

double ofAdapted(const OfferedPhone& phone) { return oneIf(phone.is_adapted); }

double meanSquare(const PhoneShape::Row& a, std::span<const float> b) {
  const PhoneShape::Row line(b.data(), a.size());
  return (a - line).squaredNorm() / static_cast<float>(PhoneShapes::kPoints);
}

double ofPrediction(const OfferedPhone& phone) { return meanSquare(phone.shape->captured(), phone.predicted); }

double ofPredictedContext(const OfferedPhone& phone) { return meanSquare(phone.shape->predicted(), phone.predicted); }

double ofJoinPosition(const MetPoint& point) { return point.share * point.difference_mm.norm(); }

double ofJoinVelocity(const MetPoint& point) { return point.share * point.velocity_mm_s.norm(); }

double ofJoinOpening(const MetPoint& point) {
  return std::abs(point.difference_mm.dot(MetPoint::Row(point.opening.data(), point.difference_mm.size())));
}

// Each target term is the mean over the pair, each join term what is left when both sides' own prediction is taken off.
constexpr std::array<CostTerm, 14> kPairTerms{{
    {"prediction", "/ mm2", 0.3, "squared distance of the captured components to the line's prediction",
     "prediction as cost", ofPrediction},
    {"context", "/ mm2", 0.65, "squared distance of the prediction for the fragment's take to the line's",
     "prediction as cost", ofPredictedContext},
    {"duration", "", 1, "abs ln(target / source duration); not of silences", "duration", ofLogDuration},
    {"neighbours", "", 0.5, "two to each side, the nearer twice: 0 the same phone, 0.5 the same class, 1 another",
     "neighbours", ofNeighbours},
    {"position", "", 0.1, "each edge of syllable, word or phrase in only one of the two", "position, stress", ofEdges},
    {"stress", "", 0.1, "stressed in only one of the two", "position, stress", ofStress},
    {"rate", "", 0.1, "abs ln of the ratio of phones a second around; not of silences", "speaking rate", ofRate},
    {"closure", "/ mm", 0.5, "each B P M: opening beyond the speaker's usual closure", "closure as cost", ofClosure},
    {"join position", "/ mm", 0.2, "distance of the components, at the best of 5 points of the shared phone",
     "join position", ofJoinPosition},
    {"join velocity", "s/mm", 0.03, "the same of their velocities, in the line's time", "join velocity",
     ofJoinVelocity},
    {"join opening", "/ mm", 0.05, "the same of the lips' opening", "join position", ofJoinOpening},
    {"unit", "", 0.1, "each join; none where the pairs are neighbours in the capture", "cost of a unit", {}},
    {"stand-in", "", 10, "each pair that the corpus lacks, and its distance by viseme class on top", "", {}},
    {"adapted", "", 0.3, "from another speaker's take (`corpus adapt`)", "", ofAdapted},
}};

constexpr std::array<CostTerm, 9> kFragmentTerms{{
    {"duration", "", 1, "abs ln(target / source duration), at most 5; not of silences", "", ofDuration},
    {"context", "", 0.5, "each outer neighbour: 0 the same phone, 0.5 the same viseme class, 1 another", "", ofContext},
    {"word position", "", 0.1, "each phone that begins or ends a word in only one of the two", "", ofWordEdges},
    {"stress", "", 0.1, "each phone whose syllable is stressed in only one of the two", "", ofStress},
    {"closure", "/ mm", 0.5, "each B P M: how far the lips stay open at their tightest, beyond the neutral pose", "",
     ofClosure},
    {"join position", "/ mm", 0.3, "RMS over lip and chin markers of their distance, at the best of 8 points", "",
     ofJoinPosition},
    {"join velocity", "s/mm", 0.005, "the same of their velocities, in the line's time", "", ofJoinVelocity},
    {"unit", "", 2, "each unit (viterbi only): joins are worth avoiding", "", {}},
    {"stand-in", "", 10, "each pair that the corpus lacks", "", {}},
}};

}  // namespace

std::span<const CostTerm> pairTerms() { return kPairTerms; }

std::span<const CostTerm> fragmentTerms() { return kFragmentTerms; }

CostWeights::CostWeights(std::span<const CostTerm> terms) : terms_(terms) {
  for (const CostTerm& term : terms) values_.push_back(term.weight);
}

std::size_t CostWeights::placeOf(std::string_view name) const {
  const auto found =
      std::find_if(terms_.begin(), terms_.end(), [&](const CostTerm& term) { return term.name == name; });
  MOUTHPIECE_EXPECT(found != terms_.end());
  return unsignedIndex(found - terms_.begin());
}

}  // namespace mouthpiece
