#include "support/random_corpus.h"

#include <array>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <limits>

#include "support/tiny_corpus.h"

namespace mouthpiece::samples {

std::string randomWords(Chance& chance) {
  constexpr std::array<const char*, 5> kPhones{"T", "AE", "M", "IY", "B"};
  std::string words;
  const std::size_t count = 1 + chance.below(4);
  for (std::size_t word = 0; word < count; ++word) {
    if (word > 0) words += chance.oneIn(5) ? " | " : " ";
    const std::size_t phones = 1 + chance.below(3);
    for (std::size_t i = 0; i < phones; ++i) {
      if (i > 0) words += '-';
      words += kPhones[chance.below(kPhones.size())];
    }
  }
  return words;
}

Corpus randomCorpus(Chance& chance) {
  constexpr std::array<double, 3> kRates{25, 60, 120};
  Corpus corpus = tinyCorpus(std::vector<std::string>{});
  const std::size_t count = 2 + chance.below(5);
  for (std::size_t i = 0; i < count; ++i) {
    corpus.takes.push_back(tinyTake("take" + std::to_string(i), randomWords(chance), 1 + chance.below(1'000'000),
                                    kRates[chance.below(kRates.size())]));
    PositionMatrix& positions = corpus.takes.back().motion.positions_mm;
    const double phase = chance.between(0, 6), reach_mm = chance.between(0, 2);
    for (Eigen::Index row = 0; row < positions.rows(); ++row)
      positions.row(row).array() += reach_mm * std::sin(phase + 0.1 * static_cast<double>(row));
    positions = positions.cast<float>().cast<double>().eval();  // as a corpus file holds it
    if (!chance.oneIn(3)) continue;
    const auto rows = static_cast<std::size_t>(positions.rows());
    const std::size_t from = chance.below(rows), length = 1 + chance.below(std::min<std::size_t>(8, rows - from));
    const auto marker = static_cast<Eigen::Index>(chance.below(4));
    positions.block(static_cast<Eigen::Index>(from), 3 * marker, static_cast<Eigen::Index>(length), 3)
        .setConstant(std::numeric_limits<double>::quiet_NaN());
  }
  return corpus;
}

std::uint64_t firstSeed() {
  const char* wanted = std::getenv("MOUTHPIECE_SEED");
  const std::uint64_t seed = wanted != nullptr ? std::strtoull(wanted, nullptr, 10) : 2004;
  std::cout << "MOUTHPIECE_SEED=" << seed << "\n";
  return seed;
}

}  // namespace mouthpiece::samples
