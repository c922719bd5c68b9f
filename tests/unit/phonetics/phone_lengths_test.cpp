#include "phonetics/labels/phone_lengths.h"

#include <gtest/gtest.h>

#include "phonetics/labels/labels_builder.h"

namespace mouthpiece {
namespace {

/// `count` of the phone in a row, each `length` long, with silence around them.
SpeechLabels rowOf(Phone phone, std::size_t count, Seconds length) {
  constexpr Seconds kSilence = 0.5;
  std::vector<PhoneSegment> segments;
  for (std::size_t i = 0; i < count; ++i) {
    const Seconds start = kSilence + static_cast<double>(i) * length;
    segments.push_back({.phone = phone, .span = {start, start + length}});
  }
  const Seconds end = segments.back().span.end + kSilence;
  return buildSpeechLabels(segments, std::vector<std::string>{}, end);
}

TEST(PhoneLengths, AreThoseOfTheirKindUntilLinesTellOthers) {
  PhoneLengths lengths;
  EXPECT_NEAR(lengths.of(Phone::kT), 0.070, 1e-9);
  EXPECT_NEAR(lengths.of(Phone::kAE), 0.098, 1e-9);
  EXPECT_NEAR(lengths.of(Phone::kOY), 0.126, 1e-9);
  lengths.add(rowOf(Phone::kS, 500, 0.15));
  lengths.add(rowOf(Phone::kT, 5, 0.030));
  EXPECT_NEAR(lengths.of(Phone::kS), 0.15, 0.001) << "many phones count for more than their kind";
  EXPECT_NEAR(lengths.of(Phone::kT), 0.050, 1e-9) << "five count as much";
  EXPECT_NEAR(lengths.of(Phone::kZ), 0.070, 1e-9) << "of others nothing was told";
}

}  // namespace
}  // namespace mouthpiece
