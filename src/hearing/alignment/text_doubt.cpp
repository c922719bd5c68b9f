#include "hearing/alignment/text_doubt.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

#include "base/errors.h"
#include "base/index.h"
#include "base/statistics.h"
#include "hearing/alignment/doubt_weights.h"
#include "hearing/alignment/noise_adaptation.h"
#include "hearing/alignment/samples_to_hear.h"

namespace mouthpiece {
namespace {

constexpr Seconds kDoubtStep = 0.010;
/// So many frames are heard at once: the loop takes 20 KB for each.
constexpr Eigen::Index kHeardAtOnce = 2000;
/// A frame that says nothing for a phone.
constexpr float kLeastRatio = 1e-3F;
/// Facts count up to these: deviations of a length, seconds beside a word and in a line, odds.
constexpr double kMostDeviations = 4, kMostBeside = 0.3, kMostUntold = 1.0, kMostOdds = 8;
/// Levels as far apart as this are a silent room's, or a background's 10 dB under speech; dB.
constexpr double kSilentRangeDb = 40, kLoudestRangeDb = 10;
/// A background that changes by the first is steady, by the second as music; dB.
constexpr double kSteadyDb = 5, kMusicDb = 10;
constexpr std::size_t kShortPart = 15, kLongPart = 40;  // frames
/// A rival of a word begins and ends up to so many frames beside it; what each of its frames and phones costs, in nats;
/// how far it counts.
constexpr Eigen::Index kRivalReach = 10;
constexpr double kRivalFrame = 1.0, kRivalPhone = 1.0, kMostRival = 100;

template <typename Facts, typename Fact>
double& at(Facts& facts, Fact fact) {
  return facts[static_cast<std::size_t>(fact)];
}

/// Logarithm of the odds that what has these facts is said.
template <typename Facts>
double odds(const Facts& facts, const Weights<Facts>& weights, double noise) {
  const auto by = [&](const Evidence<Facts>& evidence) {
    return std::inner_product(facts.begin(), facts.end(), evidence.slopes.begin(), evidence.constant);
  };
  return by(weights.in_silence) + noise * by(weights.more_in_noise);
}

double likelihoodOf(double odds) { return 1 / (1 + std::exp(-odds)); }

double meanOf(std::span<const double> values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / asReal(values.size());
}

/// A word as it was found; its phones by their places.
struct FoundWord {
  std::vector<double> matches = {}, fits = {}, lengths = {};
  Eigen::Index first = 0, end = 0;                  ///< frames
  Phone before = Phone::kSil, after = Phone::kSil;  ///< what lies beside it
  double untold = 0;
};

/// Words that are judged together, and the silences before, between and after them.
struct FoundLine {
  std::vector<FoundWord> words;
  std::vector<double> frames, log_lengths;
  double untold = 0;
};

double matchOf(const FoundLine& line) {
  double sum = 0, count = 0;
  for (const FoundWord& word : line.words) {
    sum += std::accumulate(word.matches.begin(), word.matches.end(), 0.0);
    count += asReal(word.matches.size());
  }
  return sum / count;
}

/// By how much the likeliest row of phones beats a word in its place. Where it begins or ends beside the word's ends,
/// the neighbours have frames less, or their nearest phone longer. `path`: the match of each frame with its own phone.
double rivalOf(const FoundWord& word, const Eigen::MatrixXf& matches, const Eigen::ArrayXd& path) {
  const Eigen::Index low = std::max<Eigen::Index>(0, word.first - kRivalReach);
  const Eigen::Index high = std::min(path.size(), word.end + kRivalReach);
  const auto matchOf = [&](Phone phone, Eigen::Index t) {
    return double{matches(static_cast<Eigen::Index>(phone), t)};
  };
  // What the neighbours reach up to a frame, and from a frame on.
  Eigen::ArrayXd until = Eigen::ArrayXd::Zero(high - low + 1), since = until;
  for (Eigen::Index t = low; t < high; ++t)
    until[t - low + 1] = until[t - low] + (t < word.first ? path[t] : matchOf(word.before, t));
  for (Eigen::Index t = high; t-- > low;)
    since[t - low] = since[t - low + 1] + (t < word.end ? matchOf(word.after, t) : path[t]);
  constexpr double kNever = -1e9;
  Eigen::ArrayXd best = Eigen::ArrayXd::Constant(matches.rows() - 1, kNever);
  double rival = kNever;
  for (Eigen::Index t = low; t < high; ++t) {
    const bool may_begin = t <= std::min(word.first + kRivalReach, word.end);
    const double before = std::max(best.maxCoeff(), may_begin ? until[t - low] : kNever);
    best = best.max(before - kRivalPhone) + matches.col(t).tail(best.size()).array().cast<double>() - kRivalFrame;
    if (t + 1 >= std::max(word.end - kRivalReach, word.first))
      rival = std::max(rival, best.maxCoeff() + since[t - low + 1]);
  }
  const double own = path.segment(low, high - low).sum() - kRivalPhone * asReal(word.matches.size());
  return std::min(rival - own, kMostRival);
}

WordFacts factsOfWord(const FoundWord& word, double line_match, const Eigen::MatrixXf& matches,
                      const Eigen::ArrayXd& path) {
  const double root = std::sqrt(asReal(word.matches.size()));
  WordFacts facts{};
  at(facts, WordFact::kMatch) = std::accumulate(word.matches.begin(), word.matches.end(), 0.0) / root;
  at(facts, WordFact::kFit) = meanOf(word.fits);
  at(facts, WordFact::kLeastFit) = *std::min_element(word.fits.begin(), word.fits.end());
  at(facts, WordFact::kLongest) = *std::max_element(word.lengths.begin(), word.lengths.end());
  at(facts, WordFact::kUntold) = std::min(word.untold, kMostBeside);
  at(facts, WordFact::kLineMatch) = line_match;
  at(facts, WordFact::kFewPhones) = 1 / root;
  at(facts, WordFact::kRival) = rivalOf(word, matches, path) / root;
  const Eigen::Index follow = std::min(kRivalReach, path.size() - word.end);
  at(facts, WordFact::kAfter) = follow > 0 ? path.segment(word.end, follow).mean() : 0.0;
  return facts;
}

LineFacts factsOfLine(const FoundLine& line, std::span<const double> word_odds, double line_match, double unsteady) {
  LineFacts facts{};
  at(facts, LineFact::kWorstWord) = *std::min_element(word_odds.begin(), word_odds.end());
  at(facts, LineFact::kWords) = meanOf(word_odds);
  at(facts, LineFact::kMatch) = line_match;
  at(facts, LineFact::kUntold) = std::min(line.untold, kMostUntold);
  const double usual = meanOf(line.log_lengths);
  double squares = 0, longest = -kMostDeviations;
  for (const double length : line.log_lengths) squares += (length - usual) * (length - usual);
  for (const FoundWord& word : line.words) {
    for (const double length : word.lengths) longest = std::max(longest, length);
  }
  at(facts, LineFact::kUneven) = std::sqrt(squares / asReal(line.log_lengths.size()));
  at(facts, LineFact::kWorst150) = leastMean(line.frames, kShortPart);
  at(facts, LineFact::kWorst400) = leastMean(line.frames, kLongPart);
  at(facts, LineFact::kLongest) = longest;
  at(facts, LineFact::kUnsteady) = unsteady;
  return facts;
}

void judgeLine(const FoundLine& line, const Eigen::MatrixXf& matches, const Eigen::ArrayXd& path,
               const Background& background, Believed& believed) {
  const double match = matchOf(line);
  std::vector<double> word_odds;
  for (const FoundWord& word : line.words) {
    word_odds.push_back(std::clamp(odds(factsOfWord(word, match, matches, path), kWordWeights, background.noise),
                                   -kMostOdds, kMostOdds));
  }
  const double of_line =
      likelihoodOf(odds(factsOfLine(line, word_odds, match, background.unsteady), kLineWeights, background.noise));
  for (const double value : word_odds) {
    believed.words.push_back(likelihoodOf(value));
    believed.lines.push_back(of_line);
  }
}

}  // namespace

double noiseOf(std::span<const std::int16_t> samples) {
  return std::clamp((kSilentRangeDb - levelRangeDb(samples)) / (kSilentRangeDb - kLoudestRangeDb), 0.0, 1.0);
}

std::vector<std::size_t> TextDoubt::lineEnds(std::size_t words) {
  const std::size_t lines = std::max<std::size_t>(1, (words + kWordsALine - 1) / kWordsALine);
  std::vector<std::size_t> ends;
  for (std::size_t i = 1; i <= lines; ++i) ends.push_back(i * words / lines);
  return ends;
}

TextDoubt::TextDoubt(PhoneDecoder& decoder, const Language& language)
    : decoder_(decoder), loop_(loopOf(decoder.scorer().sharedModel(), language)) {}

Background TextDoubt::backgroundOf(std::span<const std::int16_t> samples) {
  Background background;
  background.noise = noiseOf(samples);
  if (background.noise <= 0) return background;
  const double unsteady_db = unsteadinessDb(decoder_.cepstraOf(samples));
  background.unsteady = background.noise * std::clamp((unsteady_db - kSteadyDb) / (kMusicDb - kSteadyDb), 0.0, 1.0);
  return background;
}

Eigen::MatrixXf TextDoubt::posteriorsOf(std::span<const std::int16_t> samples) {
  const Eigen::MatrixXf features = decoder_.featuresOf(samples);
  std::optional<SenoneScorer> in_noise;
  if (noisinessOf(samples) > 0 && features.cols() > 0) {
    in_noise.emplace(std::make_shared<TiedModel>(
        adaptedToNoise(decoder_.scorer().model(), decoder_.cepstraOf(samples), phonesIn(decoder_.scorer().model()))));
  }
  Eigen::MatrixXf posteriors(kPhoneCount, features.cols());
  for (Eigen::Index first = 0; first < features.cols(); first += kHeardAtOnce) {
    const Eigen::Index count = std::min(kHeardAtOnce, features.cols() - first);
    posteriors.middleCols(first, count) =
        loop_.posteriors(in_noise ? *in_noise : decoder_.scorer(), features.middleCols(first, count));
  }
  return posteriors;
}

Believed TextDoubt::judge(std::span<const DecodedPhone> decoded, std::span<const std::int16_t> samples) {
  const Eigen::MatrixXf posteriors = posteriorsOf(samples);
  if (posteriors.cols() == 0) return {};
  const Background background = backgroundOf(samples);
  const Eigen::MatrixXf ratios =
      Eigen::Map<const Eigen::MatrixXf>(kHeardRatios.data(), signedIndex(kPhoneCount), signedIndex(kPhoneCount))
          .transpose();
  const Eigen::MatrixXf matches = (ratios * posteriors).cwiseMax(kLeastRatio).array().log();
  const auto words = unsignedIndex(
      std::count_if(decoded.begin(), decoded.end(), [](const DecodedPhone& phone) { return phone.opens_word; }));
  const std::vector<std::size_t> ends = lineEnds(words);
  const auto framesOf = [&](const DecodedPhone& phone) {
    const Eigen::Index first = std::min(signedIndex(phone.first_frame), matches.cols() - 1);
    return std::pair(first, std::clamp<Eigen::Index>(phone.frames, 1, matches.cols() - first));
  };
  Eigen::ArrayXd path = Eigen::ArrayXd::Zero(matches.cols());
  for (const DecodedPhone& phone : decoded) {
    const auto [first, count] = framesOf(phone);
    path.segment(first, count) =
        matches.row(static_cast<Eigen::Index>(phone.phone)).segment(first, count).transpose().array().cast<double>();
  }
  Believed believed;
  FoundLine line;
  double untold_before = 0;
  Phone before = Phone::kSil;
  bool is_in_word = false;
  std::size_t line_index = 0, begun = 0;
  for (const DecodedPhone& phone : decoded) {
    const auto [first, count] = framesOf(phone);
    const bool is_silence = phone.phone == Phone::kSil;
    if (is_in_word && (is_silence || phone.opens_word)) line.words.back().after = phone.phone;
    if (phone.opens_word && begun++ == ends[line_index]) {
      judgeLine(std::exchange(line, {}), matches, path, background, believed);
      ++line_index;
    }
    const Phone last = std::exchange(before, phone.phone);
    is_in_word = !is_silence;
    line.frames.insert(line.frames.end(), path.begin() + first, path.begin() + first + count);
    if (is_silence) {
      const double untold = kDoubtStep * asReal(count) * (1 - double{posteriors.row(0).segment(first, count).mean()});
      line.untold += untold;
      if (!line.words.empty()) line.words.back().untold = std::max(line.words.back().untold, untold);
      untold_before = std::max(untold_before, untold);
      continue;
    }
    if (phone.opens_word) line.words.push_back({.first = first, .before = last, .untold = untold_before});
    untold_before = 0;
    FoundWord& word = line.words.back();
    word.end = first + count;
    const UsualPhone& usual = kUsualPhones[static_cast<std::size_t>(phone.phone)];
    const double length = std::log(asReal(count));
    word.matches.push_back(path.segment(first, count).mean());
    word.fits.push_back((phone.score / asReal(count) - usual.fit) / usual.fit_spread);
    word.lengths.push_back(
        std::clamp((length - usual.log_frames) / usual.log_frames_spread, -kMostDeviations, kMostDeviations));
    line.log_lengths.push_back(length);
  }
  if (!line.words.empty()) judgeLine(line, matches, path, background, believed);
  return believed;
}

}  // namespace mouthpiece
