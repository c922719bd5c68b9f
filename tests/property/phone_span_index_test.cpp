#include "units/phones/phone_span_index.h"

#include <gtest/gtest.h>

#include <chrono>
#include <iostream>
#include <random>

#include "support/phone_index.h"

namespace mouthpiece {
namespace {

using Takes = std::vector<std::vector<Phone>>;

/// The other route: looks at every place.
std::vector<PhonePlace> placesByLooking(const Takes& takes, std::span<const Phone> phones) {
  std::vector<PhonePlace> places;
  for (std::size_t take = 0; take < takes.size(); ++take) {
    for (std::size_t at = 0; at + phones.size() <= takes[take].size(); ++at) {
      if (std::equal(phones.begin(), phones.end(), takes[take].begin() + static_cast<std::ptrdiff_t>(at)) &&
          at < takes[take].size()) {
        places.push_back({TakeIndex(take), PhoneIndex(at)});
      }
    }
  }
  return places;
}

LongestMatch longestByLooking(const Takes& takes, std::span<const Phone> phones) {
  for (std::size_t length = phones.size(); length >= 2; --length) {
    auto places = placesByLooking(takes, phones.first(length));
    if (!places.empty()) return {length, std::move(places)};
  }
  return {};
}

class RandomTakes {
 public:
  explicit RandomTakes(std::uint64_t seed) : random_(seed) {}
  std::size_t below(std::size_t limit) { return random_() % limit; }
  std::vector<Phone> phones(std::size_t length, std::size_t alphabet) {
    std::vector<Phone> result(length);
    for (Phone& phone : result) phone = static_cast<Phone>(below(alphabet));
    return result;
  }
  Takes takes(std::size_t alphabet) {
    Takes result;
    const std::size_t count = below(8);
    for (std::size_t i = 0; i < count; ++i) {
      // Some takes repeat others, whole or in part, as spoken sentences do.
      if (!result.empty() && below(3) == 0) {
        result.push_back(result[below(result.size())]);
        if (!result.back().empty()) result.back().resize(1 + below(result.back().size()));
      } else {
        result.push_back(phones(below(40), alphabet));
      }
    }
    return result;
  }

 private:
  std::mt19937_64 random_;
};

TEST(PhoneSpanIndexProperty, AgreesWithANaiveSearch) {
  const std::uint64_t base = static_cast<std::uint64_t>(std::chrono::steady_clock::now().time_since_epoch().count());
  for (std::uint64_t round = 0; round < 2000; ++round) {
    const std::uint64_t seed = base + round;
    SCOPED_TRACE("seed " + std::to_string(seed));
    RandomTakes random(seed);
    const std::size_t alphabet = 1 + random.below(round % 4 == 0 ? kPhoneCount : 3);
    const Takes takes = random.takes(alphabet);
    const PhoneSpanIndex index = samples::phoneIndexOf(takes);
    for (int query = 0; query < 8; ++query) {
      std::vector<Phone> phones = random.phones(random.below(30), alphabet);
      if (query % 2 == 0 && !takes.empty()) {  // something that does occur, with a strange tail
        const auto& take = takes[random.below(takes.size())];
        const std::size_t from = take.empty() ? 0 : random.below(take.size());
        std::vector<Phone> known(take.begin() + static_cast<std::ptrdiff_t>(from), take.end());
        known.insert(known.end(), phones.begin(),
                     phones.begin() + static_cast<std::ptrdiff_t>(std::min<std::size_t>(3, phones.size())));
        phones = known;
      }
      const LongestMatch found = index.longestMatch(phones);
      const LongestMatch expected = longestByLooking(takes, phones);
      ASSERT_EQ(found.length, expected.length);
      ASSERT_EQ(found.places, expected.places);
      if (!phones.empty()) {
        const auto part = std::span(phones).first(1 + random.below(phones.size()));
        ASSERT_EQ(index.placesOf(part), placesByLooking(takes, part));
      }
    }
    if (HasFatalFailure()) return;
  }
  RecordProperty("first_seed", std::to_string(base));
  std::cout << "seeds " << base << " to " << base + 1999 << "\n";
}

TEST(PhoneSpanIndexProperty, ManyEqualPhonesAreSortedInTime) {
  const PhoneSpanIndex index = samples::phoneIndexOf({std::vector<Phone>(200'000, Phone::kSil)});
  const std::vector<Phone> wanted(199'900, Phone::kSil);
  EXPECT_EQ(index.placesOf(wanted).size(), 101U);
}

TEST(PhoneSpanIndexProperty, EmptyCorporaAndEmptyQueriesFindNothing) {
  const PhoneSpanIndex empty = samples::phoneIndexOf({});
  EXPECT_EQ(empty.longestMatch(std::vector<Phone>{Phone::kT, Phone::kAH}).length, 0U);
  EXPECT_TRUE(empty.placesOf(std::vector<Phone>{Phone::kT}).empty());
  const PhoneSpanIndex index = samples::phoneIndexOf({{Phone::kT, Phone::kAH}, {}});
  EXPECT_EQ(index.longestMatch({}).length, 0U);
  EXPECT_EQ(index.longestMatch(std::vector<Phone>{Phone::kT}).length, 0U) << "one phone is no pair";
}

}  // namespace
}  // namespace mouthpiece
