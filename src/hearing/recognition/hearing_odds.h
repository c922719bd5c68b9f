#pragma once

#include <algorithm>
#include <cmath>

namespace mouthpiece {

/// A word is neither believed nor doubted further than by these odds.
inline constexpr double kLeastBelieved = 1e-4;
/// The logarithm of the odds of a word as a transcript's, whose confidence is given.
inline double oddsOfConfidence(double confidence) {
  const double held = std::clamp(confidence, kLeastBelieved, 1 - kLeastBelieved);
  return std::log(held / (1 - held));
}

/// The logarithm of the odds that much of a stretch is heard wrongly (docs/theory/hearing/recognition.md#how-sure).
/// Words of the language model: by how far they are believed and how many rivals each has in the mean. A corpus' words
/// of who is not known: by the share of their pairs that follow each other in its lines, too. Others, and phones in
/// place of words: by how far the likeliest words' phones lie from those heard without words, and how far the words are
/// believed; where no words are looked for, by how well the phones fit and the share that they take.
inline double oddsOfModelWords(double believed, double rivals) { return -0.07 - 0.882 * believed + 1.536 * rivals; }
inline double oddsOfCorpusWords(double apart, double believed, double in_order) {
  return 14.9 + 4.34 * apart - 0.354 * believed - 16.6 * in_order;
}
inline double oddsOfWords(double apart, double believed) { return -0.393 + 5.69 * apart - 0.747 * believed; }
inline double oddsOfPhones(double fit, double share) { return 33.9 - 28.6 * fit - 11.8 * share; }
/// Words of the network (#a-network there): by how far they are believed, and the mean logarithm of their
/// probabilities.
inline double oddsOfNetworkWords(double believed, double sure) { return -1.07 - 0.293 * believed - 4.22 * sure; }
/// Of a word of the language model or the network, the logarithm of the odds that it is wrong, and from where on it is
/// told.
inline double oddsOfModelWord(double believed, double rivals) { return -0.661 - 0.389 * believed + 0.761 * rivals; }
inline double oddsOfNetworkWord(double believed, double sure) { return -0.911 - 0.344 * believed - 1.619 * sure; }
inline constexpr double kWordDoubted = 0.405;  // 1.5 to 1
/// Words of the network that are more likely wrong than the first tell less than phones. An ear that knows the speaker
/// hears phones better than words that are more likely wrong than the second.
inline constexpr double kNetworkUnlikely = 3, kNetworkTrusted = -1;
/// While it is being said a word of the network that is more likely wrong tells less than phones.
inline constexpr double kLiveWordUnlikely = 1;

}  // namespace mouthpiece
