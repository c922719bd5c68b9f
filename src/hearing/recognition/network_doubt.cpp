#include "hearing/recognition/network_doubt.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "audio/spectral_frames.h"
#include "base/errors.h"
#include "base/index.h"
#include "hearing/alignment/phone_ear.h"
#include "hearing/alignment/text_doubt.h"

namespace mouthpiece {
namespace {

constexpr Seconds kMostHeard = 59;  // the network takes a minute
/// Lines with better odds than this (logarithm) are believed as they are; odds count up to the second, what the network
/// says of a word down to the third.
constexpr double kSure = 2.5, kMostOdds = 8, kLeastScore = -15;
/// Levels over a quarter of a second that lie so far apart are speech and its pauses alone, or beats between them; dB.
constexpr double kPauseRangeDb = 30, kBeatRangeDb = 12;

double believedOdds(double confidence) {
  const double held = std::clamp(confidence, 1e-9, 1 - 1e-9);
  return std::clamp(std::log(held / (1 - held)), -kMostOdds, kMostOdds);
}
double confidenceOf(double odds) { return 1 / (1 + std::exp(-odds)); }

/// How far loud frames lie over the quietest quarter of a second, dB: beats leave no pause as long.
double rangeOverPausesDb(std::span<const std::int16_t> samples) {
  constexpr std::size_t kFrames = 25;
  constexpr double kLoud = 0.90, kQuiet = 0.03, kLeastPower = 0.1;
  std::vector<double> powers;
  for (const double db : speechLevelsDb(samples)) powers.push_back(std::pow(10.0, db / 10));
  if (powers.size() < kFrames) return 0;
  std::vector<double> means;
  double sum = std::accumulate(powers.begin(), powers.begin() + kFrames, 0.0);
  for (std::size_t end = kFrames;; ++end) {
    means.push_back(std::max(sum, 0.0) / kFrames);
    if (end == powers.size()) break;
    sum += powers[end] - powers[end - kFrames];
  }
  const auto quantile = [](std::vector<double>& values, double share) {
    const auto at = values.begin() + signedIndex(static_cast<std::size_t>(share * asReal(values.size() - 1)));
    std::nth_element(values.begin(), at, values.end());
    return *at;
  };
  return 10 * std::log10((quantile(powers, kLoud) + kLeastPower) / (quantile(means, kQuiet) + kLeastPower));
}

/// What the odds of a line change with, and whether it stands in silence.
struct Surroundings {
  double noise = 0, beats = 0;
  bool are_quiet = false;
};

Surroundings surroundingsOf(std::span<const std::int16_t> samples) {
  constexpr double kHardlyNoise = 0.05;
  const double noise = noiseOf(samples), range = rangeOverPausesDb(samples);
  const double beats = std::clamp((kPauseRangeDb - range) / (kPauseRangeDb - kBeatRangeDb), 0.0, 1.0);
  return {noise, beats * (1 - noise), noise < kHardlyNoise && range > kPauseRangeDb};
}

struct Line {
  std::size_t first = 0, end = 0;
};

/// Learnt like TextDoubt's weights (docs/theory/hearing/alignment.md#the-network-is-asked).
double oddsOfLine(double odds, std::span<const double> word_odds, std::span<const WordScore> scores,
                  const Surroundings& around) {
  const auto words = asReal(word_odds.size());
  double least_odds = kMostOdds, sum_odds = 0, least = 0, sum = 0, least_behind = 0, sum_behind = 0;
  for (std::size_t i = 0; i < word_odds.size(); ++i) {
    least_odds = std::min(least_odds, word_odds[i]);
    sum_odds += word_odds[i];
    least = std::min(least, std::max(scores[i].log_probability, kLeastScore));
    sum += std::max(scores[i].log_probability, kLeastScore);
    least_behind = std::min(least_behind, std::max(scores[i].behind, kLeastScore));
    sum_behind += std::max(scores[i].behind, kLeastScore);
  }
  const double end = std::max(scores.back().behind, kLeastScore);
  const double by_network = 5.446 + 0.2929 * odds + 0.1586 * least_odds - 0.0982 * sum_odds / words + 0.0646 * least +
                            0.2871 * sum / words + 0.2519 * least_behind + 0.4165 * sum_behind / words + 1.1036 * end +
                            1.200 * around.noise + 0.922 * around.beats;
  // What is heard in silence is judged well without the network, which forgives ends that are cut off.
  return around.are_quiet ? std::min(odds, by_network) : by_network;
}

double oddsOfWord(double odds, const WordScore& score) {
  return 2.582 + 0.6445 * odds + 0.5242 * std::max(score.log_probability, kLeastScore) -
         0.0788 * std::max(score.behind, kLeastScore);
}

}  // namespace

std::string judgeByNetwork(WordNetwork& network, const AudioClip& audio, ForcedAlignment& alignment) {
  const SpeechLabels& labels = alignment.labels;
  if (alignment.line_confidence.empty()) return {};
  if (!network.isThere()) return {};
  std::vector<Line> lines;
  std::vector<std::vector<std::int16_t>> sounds;
  std::vector<std::vector<std::string>> texts;
  const auto sampleAt = [&](Seconds time) {
    return signedIndex(std::min(audio.samples.size(), static_cast<std::size_t>(time * audio.sample_rate_hz)));
  };
  std::size_t first = 0;
  for (const std::size_t end : TextDoubt::lineEnds(labels.words.size())) {
    const Line line{std::exchange(first, end), end};
    const double believed = alignment.line_confidence[line.first];
    // 0: outside of speech
    if (believed == 0 || believedOdds(believed) >= kSure) continue;
    const Seconds from = line.first > 0 ? labels.spanOf(labels.words[line.first - 1].phones).end : 0.0;
    const Seconds to = end < labels.words.size() ? labels.spanOf(labels.words[end].phones).start : labels.duration();
    if (to - from > kMostHeard) continue;
    lines.push_back(line);
    sounds.push_back(samplesToHear(
        {audio.sample_rate_hz, {audio.samples.begin() + sampleAt(from), audio.samples.begin() + sampleAt(to)}}));
    auto& words = texts.emplace_back();
    for (std::size_t i = line.first; i < end; ++i) words.push_back(labels.words[i].text);
  }
  if (lines.empty()) return {};
  std::vector<std::vector<WordScore>> scores;
  try {
    scores = network.score(std::vector<std::span<const std::int16_t>>(sounds.begin(), sounds.end()), texts);
  } catch (const InputError& error) {
    return fmt::format("the network that hears words was not heard ({})", error.what());
  }
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (scores[i].empty()) continue;
    std::vector<double> word_odds;
    for (std::size_t word = lines[i].first; word < lines[i].end; ++word) {
      word_odds.push_back(believedOdds(alignment.confidence[word]));
      alignment.confidence[word] = confidenceOf(oddsOfWord(word_odds.back(), scores[i][word - lines[i].first]));
    }
    const double odds = oddsOfLine(believedOdds(alignment.line_confidence[lines[i].first]), word_odds, scores[i],
                                   surroundingsOf(sounds[i]));
    std::fill(alignment.line_confidence.begin() + signedIndex(lines[i].first),
              alignment.line_confidence.begin() + signedIndex(lines[i].end), confidenceOf(odds));
  }
  return {};
}

}  // namespace mouthpiece
