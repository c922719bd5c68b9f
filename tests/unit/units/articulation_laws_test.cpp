// Laws of what is said of sounds in numbers: place, manner, lips, vowels.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "base/index.h"
#include "units/prediction/context_network.h"
#include "units/prediction/sound_model.h"

namespace mouthpiece {
namespace {

std::vector<Phone> spokenPhones() {
  std::vector<Phone> phones;
  for (std::size_t p = 0; p < kPhoneCount; ++p) {
    if (static_cast<Phone>(p) != Phone::kSil) phones.push_back(static_cast<Phone>(p));
  }
  return phones;
}

std::size_t featureNamed(std::string_view name) {
  const auto names = contextFeatureNames();
  return static_cast<std::size_t>(std::find(names.begin(), names.end(), name) - names.begin());
}

float articulation(Phone phone, std::string_view name, bool second_half = false) {
  return articulationOf(phone, second_half)(signedIndex(featureNamed(name)));
}

bool isOneOf(Phone phone, std::initializer_list<Phone> phones) {
  return std::find(phones.begin(), phones.end(), phone) != phones.end();
}

/// What every book on English says of its consonants.
TEST(Articulation, PlacesAndMannersAreThoseOfPhonetics) {
  using enum Phone;
  for (const Phone phone : spokenPhones()) {
    SCOPED_TRACE(phoneName(phone));
    const auto has = [&](std::string_view name) { return articulation(phone, name) > 0; };
    EXPECT_EQ(has("lip to lip"), isOneOf(phone, {kP, kB, kM}));
    EXPECT_EQ(has("lip to teeth"), isOneOf(phone, {kF, kV}));
    EXPECT_EQ(has("dental"), isOneOf(phone, {kTH, kDH}));
    EXPECT_EQ(has("postalveolar"), isOneOf(phone, {kSH, kZH, kCH, kJH}));
    EXPECT_EQ(has("nasal"), isOneOf(phone, {kM, kN, kNG}));
    EXPECT_EQ(has("stop"), isOneOf(phone, {kP, kB, kT, kD, kK, kG, kCH, kJH}));
    EXPECT_EQ(has("fricative"), isOneOf(phone, {kF, kV, kTH, kDH, kS, kZ, kSH, kZH, kHH}));
    EXPECT_EQ(has("approximant"), isOneOf(phone, {kL, kR, kW, kY}));
    EXPECT_EQ(has("vowel"), isVowel(phone));
    if (isOneOf(phone, {kP, kB, kM})) {
      EXPECT_FALSE(has("open")) << "lips that are shut";
    }
    EXPECT_FALSE(has("round") && has("spread"));
    EXPECT_EQ(has("voiced"), !isOneOf(phone, {kP, kT, kK, kF, kTH, kS, kSH, kCH, kHH}));
    if (isOneOf(phone, {kT, kD, kN, kL})) {
      EXPECT_TRUE(has("alveolar"));
    }
    if (isOneOf(phone, {kK, kG, kNG})) {
      EXPECT_TRUE(has("velar"));
    }
    if (isOneOf(phone, {kP, kB, kM, kF, kV, kTH, kDH, kSH, kZH, kCH, kJH}) || isVowel(phone)) {
      EXPECT_FALSE(has("alveolar"));
    }
    if (!isOneOf(phone, {kK, kG, kNG, kW, kY, kR})) {
      EXPECT_FALSE(has("velar"));
    }
    EXPECT_EQ(articulationOf(phone, false).minCoeff() >= 0, true);
    EXPECT_LE(articulationOf(phone, false).maxCoeff(), 1);
  }
}

/// What is seen of the lips: open for AA, round for UW, spread for IY, each more than for its neighbours.
TEST(Articulation, LipsAreThoseOfTheirSounds) {
  using enum Phone;
  EXPECT_GT(articulation(kAA, "open"), articulation(kEH, "open"));
  EXPECT_GT(articulation(kEH, "open"), articulation(kIY, "open"));
  EXPECT_EQ(articulation(kM, "open"), 0);
  for (const Phone round : {kUW, kOW, kW, kSH}) {
    EXPECT_GT(articulation(round, "round"), 0.2F) << phoneName(round);
    EXPECT_EQ(articulation(round, "spread"), 0) << phoneName(round);
  }
  EXPECT_GT(articulation(kIY, "spread"), 0.2F);
  EXPECT_EQ(articulation(kIY, "round"), 0);
  EXPECT_GT(articulation(kAW, "round", true), articulation(kAW, "round")) << "it ends round";
}

/// The trapezium: high before low, front before back; a diphthong goes somewhere and another vowel stays.
TEST(Articulation, VowelsLieInTheirTrapezium) {
  using enum Phone;
  const auto rises = [](std::string_view what, std::initializer_list<Phone> phones) {
    float before = -1;
    for (const Phone phone : phones) {
      EXPECT_GT(articulation(phone, what), before) << what << " of " << phoneName(phone);
      before = articulation(phone, what);
    }
  };
  rises("height", {kAE, kEH, kEY, kIH, kIY});
  rises("height", {kAA, kAO, kOY, kOW, kUH, kUW});
  rises("height", {kAA, kAH, kER, kIH});
  rises("back", {kIY, kAE, kIH, kAH, kAA, kUW, kAO});
  for (const Phone phone : spokenPhones()) {
    if (!isVowel(phone)) continue;
    for (const char* what : {"height", "back"}) {
      const float begins = articulation(phone, what), ends = articulation(phone, what, true);
      EXPECT_GE(begins, 0) << phoneName(phone);
      EXPECT_LE(ends, 1) << phoneName(phone);
      if (!isDiphthong(phone)) {
        EXPECT_EQ(begins, ends) << phoneName(phone) << " " << what;
      }
    }
    if (isDiphthong(phone)) {
      EXPECT_GT(articulation(phone, "height", true), articulation(phone, "height") + 0.25F) << phoneName(phone);
      EXPECT_GT(articulation(phone, "height", true), articulation(kUH, "height")) << phoneName(phone);
      EXPECT_LT(articulation(phone, "height", true), articulation(kIY, "height")) << phoneName(phone);
      const bool ends_back = phone == kAW || phone == kOW;
      EXPECT_EQ(articulation(phone, "back", true) > 0.5F, ends_back) << phoneName(phone);
    }
  }
}

}  // namespace
}  // namespace mouthpiece
