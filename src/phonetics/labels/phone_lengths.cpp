#include "phonetics/labels/phone_lengths.h"

#include "base/index.h"

namespace mouthpiece {
namespace {

/// What is taken of a phone's kind counts for as many phones.
constexpr double kOfKind = 5;
constexpr Seconds kConsonant = 0.070;

double lengthOfKind(Phone phone) {
  if (isDiphthong(phone)) return 1.8;
  return isVowel(phone) ? 1.4 : 1.0;
}

}  // namespace

PhoneLengths::PhoneLengths() {
  for (std::size_t i = 0; i < sums_.size(); ++i)
    sums_[i] = {kOfKind * kConsonant * lengthOfKind(static_cast<Phone>(i)), kOfKind};
}

void PhoneLengths::add(const SpeechLabels& labels) {
  for (const LabelledPhone& phone : labels.phones) {
    Sum& sum = sums_[static_cast<std::size_t>(phone.phone)];
    sum.length += phone.span.duration();
    ++sum.count;
  }
}

Seconds PhoneLengths::of(Phone phone) const {
  const Sum& sum = sums_[static_cast<std::size_t>(phone)];
  return sum.length / sum.count;
}

}  // namespace mouthpiece
