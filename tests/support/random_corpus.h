#pragma once

#include <random>
#include <string>

#include "units/file/corpus.h"

namespace mouthpiece::samples {

/// Chance that can be had again: every draw follows from the seed alone, on every machine.
class Chance {
 public:
  explicit Chance(std::uint64_t seed) : random_(seed) {}
  std::size_t below(std::size_t limit) { return random_() % limit; }
  bool oneIn(std::size_t count) { return below(count) == 0; }
  double between(double low, double high) { return low + (high - low) * static_cast<double>(below(100'000)) / 100'000; }

 private:
  std::mt19937_64 random_;
};

/// One to four words of one to three phones out of five, for tinyLabels(); now and then with a pause.
std::string randomWords(Chance& chance);

/// Two to six takes of such words, as tinyCorpus() makes them, with wobbling markers, at one of three frame rates each;
/// every third take was not seen for a while.
Corpus randomCorpus(Chance& chance);

/// The first of as many seeds as a test tries: always the same, or that of the variable MOUTHPIECE_SEED.
std::uint64_t firstSeed();

}  // namespace mouthpiece::samples
