#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "hearing/alignment/phone_decoder.h"
#include "hearing/alignment/phone_loop.h"

namespace mouthpiece {

/// For or against a word.
enum class WordFact : std::size_t {
  kMatch,      ///< sum over its phones of their match (below), over the root of their number
  kFit,        ///< mean of the phones' scores in the alignment, in deviations from what they reach in right texts
  kLeastFit,   ///< of a phone
  kLongest,    ///< of its phones, in deviations of the logarithm of lengths
  kUntold,     ///< seconds of speech in the longer silence beside it
  kLineMatch,  ///< mean match of all phones of the line
  kFewPhones,  ///< one over the root of how many phones it has
  kRival,      ///< by how much other phones in its place match better (rivalOf), over the root of its phones
  kAfter,      ///< mean match of the 100 ms that follow it
  kCount
};
using WordFacts = std::array<double, static_cast<std::size_t>(WordFact::kCount)>;

/// For or against a line.
enum class LineFact : std::size_t {
  kWorstWord,  ///< the least odds of a word
  kWords,      ///< the mean odds
  kMatch,      ///< mean match of all phones
  kUntold,     ///< seconds of speech in silences
  kUneven,     ///< standard deviation of the logarithm of phones' lengths
  kWorst150,   ///< least mean match over 150 ms, silences too
  kWorst400,   ///< over 400 ms
  kLongest,    ///< of all phones
  kUnsteady,   ///< Background::unsteady
  kCount
};
using LineFacts = std::array<double, static_cast<std::size_t>(LineFact::kCount)>;

/// What is heard besides speech.
struct Background {
  double noise = 0;     ///< 0: as in a silent room; 1: speech stands 10 dB over it
  double unsteady = 0;  ///< of that, what changes as music does (unsteadinessDb)
};

/// Background::noise of a sound, 16 kHz.
double noiseOf(std::span<const std::int16_t> samples);

/// How far words are believed, 0 to 1.
struct Believed {
  std::vector<double> words;
  std::vector<double>
      lines;  ///< of each word, its stretch of up to kWordsALine words; 0.5: 2 in 100 right ones have less
};

/// Whether words that were found in a sound are those that are said in it: their phones against what is heard where any
/// may be said (S. M. Witt and S. J. Young, 2000; docs/theory/hearing/doubt.md). A frame's match with a phone is
/// the logarithm of how much more often what is heard then is heard in that phone than at any time. Not thread-safe.
class TextDoubt {
 public:
  static constexpr std::size_t kWordsALine = 12;
  /// Where the stretches end that are judged together.
  static std::vector<std::size_t> lineEnds(std::size_t words);

  /// `decoder` is kept alive by the caller.
  TextDoubt(PhoneDecoder& decoder, const Language& language);

  [[nodiscard]] Background backgroundOf(std::span<const std::int16_t> samples);
  /// Of all phones, whatever is said, as PhoneLoop has them.
  [[nodiscard]] Eigen::MatrixXf posteriorsOf(std::span<const std::int16_t> samples);

  /// `decoded`: what PhoneDecoder::decode() found of English words in `samples`, 16 kHz.
  Believed judge(std::span<const DecodedPhone> decoded, std::span<const std::int16_t> samples);
  /// The same of words in a language whose sounds the model never learnt: lines alone, whose words share their odds.
  /// `heard`: by what decode() was told besides, if by anything, they are judged.
  Believed judgeLines(std::span<const DecodedPhone> decoded, std::span<const std::int16_t> samples,
                      const HeardPhones& heard = {});

 private:
  PhoneDecoder& decoder_;
  PhoneLoop loop_;
};

}  // namespace mouthpiece
