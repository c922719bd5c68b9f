#include "synthesis/lip_seal.h"

#include <gtest/gtest.h>

#include <cmath>

namespace mouthpiece {
namespace {

constexpr Seconds kPhone = 0.3;
constexpr double kRateHz = 200;

/// sil, the phones, sil; each kPhone long.
SpeechLabels labelsOf(std::vector<Phone> phones) {
  phones.insert(phones.begin(), Phone::kSil);
  phones.push_back(Phone::kSil);
  SpeechLabels labels;
  for (std::size_t i = 0; i < phones.size(); ++i) {
    LabelledPhone& phone = labels.phones.emplace_back();
    phone.phone = phones[i];
    phone.span = {kPhone * static_cast<double>(i), kPhone * static_cast<double>(i + 1)};
  }
  return labels;
}

std::vector<Seconds> timesOf(const SpeechLabels& labels) {
  std::vector<Seconds> times;
  for (std::size_t i = 0; static_cast<double>(i) / kRateHz < labels.duration(); ++i)
    times.push_back(static_cast<double>(i) / kRateHz);
  return times;
}

std::size_t frameAt(double phone) { return static_cast<std::size_t>(std::lround(phone * kPhone * kRateHz)); }

TEST(LipSeal, HoldsInBilabialsAndSilenceAlone) {
  for (const Phone bilabial : {Phone::kP, Phone::kB, Phone::kM}) {
    const SpeechLabels labels = labelsOf({Phone::kTH, bilabial, Phone::kR});
    const std::vector<double> seal = lipSealFromPhones(labels, timesOf(labels));
    EXPECT_EQ(seal[frameAt(0.5)], 1);
    EXPECT_EQ(seal[frameAt(1.5)], 0);
    EXPECT_EQ(seal[frameAt(2.05)], 1);
    EXPECT_EQ(seal[frameAt(2.95)], 1);
    EXPECT_EQ(seal[frameAt(3.5)], 0);
  }
}

TEST(LipSeal, ComesAndGoesWithoutASkip) {
  const SpeechLabels labels = labelsOf({Phone::kAA, Phone::kM, Phone::kAA});
  const std::vector<double> seal = lipSealFromPhones(labels, timesOf(labels));
  // A cosine ramp of 50 ms rises by pi / 2 / 50 a millisecond at most.
  constexpr double kMostAFrame = 1.5708 / 50 * 1000 / kRateHz;
  for (std::size_t i = 1; i < seal.size(); ++i) EXPECT_LE(std::abs(seal[i] - seal[i - 1]), kMostAFrame + 1e-6) << i;
}

}  // namespace
}  // namespace mouthpiece
