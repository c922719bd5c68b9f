#include "hearing/network/network_doubt.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "base/errors.h"
#include "base/index.h"
#include "base/statistics.h"
#include "hearing/alignment/phone_edits.h"
#include "hearing/alignment/text_doubt.h"

namespace mouthpiece {
namespace {

/// The network's memory grows with the square of what it hears at once: 0.25 GB for this, 0.45 for a minute.
constexpr Seconds kMostHeard = 20;
/// Lines of these odds (logarithm) are sure and not heard again; of a sound no longer than this each word must be, too.
constexpr Seconds kHeardWhole = 60;
constexpr double kSureLine = 2.75, kSureWord = 1.25;
/// Odds count up to the first, what the network says of a word down to the second.
constexpr double kMostOdds = 8, kLeastScore = -15;

double believedOdds(double confidence) {
  const double held = std::clamp(confidence, 1e-9, 1 - 1e-9);
  return std::clamp(std::log(held / (1 - held)), -kMostOdds, kMostOdds);
}
double confidenceOf(double odds) { return 1 / (1 + std::exp(-odds)); }

/// By how much two rows of phones differ where they differ most: of four phones in a row of the one those that the
/// other has not, a vowel for another or a consonant for another counting less.
struct Differences {
  double in_text, in_heard;
};

constexpr std::size_t kInARow = 4;

Differences differencesOf(const std::vector<Phone>& text, const std::vector<Phone>& heard) {
  if (text.empty() || heard.empty()) return {kInARow, kInARow};
  const PhoneEdits edits = cheapestEdits(text, heard);
  const auto most = [&](const std::vector<double>& prices) {
    std::vector<double> same;  // less than none
    for (const double price : prices) same.push_back(price == PhoneEdits::kLeftOut ? -1 : -price);
    return -leastMean(same, kInARow) * asReal(std::min(kInARow, same.size()));
  };
  return {most(edits.of_first), most(edits.of_second)};
}

/// As the dictionary has the words first; none where they cannot be said.
std::vector<Phone> phonesOf(const std::string& words, const Pronouncer& pronouncer) {
  std::vector<Phone> phones;
  try {
    for (const TranscriptWord& word : pronouncer.wordsOf(words))
      phones.insert(phones.end(), word.ways.front().phones.begin(), word.ways.front().phones.end());
  } catch (const InputError&) {  // nothing is heard
  }
  return phones;
}

struct Line {
  std::size_t first = 0, end = 0;  ///< of the words
  std::span<const std::int16_t> sound;
  std::vector<std::string> text;
};

/// Learnt like TextDoubt's weights (docs/theory/hearing/doubt.md#the-network-is-asked).
double oddsOfLine(std::span<const double> word_odds, const TextScore& score, const Differences& differences,
                  double noise) {
  constexpr double kMostBehind = 60, kMostBefore = 20, kNothingHeard = -5;
  const double worst_word = *std::min_element(word_odds.begin(), word_odds.end());
  double least_behind = 0;
  for (std::size_t i = 0; i < word_odds.size(); ++i)
    least_behind = std::min(least_behind, std::max(score.words[i].behind, kLeastScore));
  const double end = std::max(score.words.back().behind, kLeastScore);
  const double against_heard =
      std::clamp(score.log_probability - score.heard_log_probability, -kMostBehind, kMostBefore) /
      asReal(word_odds.size());
  const double sure = score.heard_tokens > 0 ? score.heard_log_probability / asReal(score.heard_tokens) : kNothingHeard;
  return 5.413 + 0.4583 * worst_word + 0.2564 * least_behind + 0.8298 * end + 0.9459 * differences.in_text -
         1.1672 * differences.in_heard + 0.7721 * against_heard - 2.2104 * sure + noise;
}

/// A line whose middle word is believed less than this is not said: where next to nothing is heard, for no text speaks
/// that the network is unsure of what it hears.
constexpr double kLeastMiddleWord = 0.25;

double oddsOfWord(double odds, const WordScore& score) {
  return 2.582 + 0.6445 * odds + 0.5242 * std::max(score.log_probability, kLeastScore) -
         0.0788 * std::max(score.behind, kLeastScore);
}

bool isSure(const Line& line, const ForcedAlignment& alignment) {
  const std::span<const double> words = std::span(alignment.confidence).subspan(line.first, line.end - line.first);
  return believedOdds(alignment.line_confidence[line.first]) >= kSureLine &&
         (alignment.labels.duration() > kHeardWhole ||
          std::ranges::all_of(words, [](double word) { return believedOdds(word) >= kSureWord; }));
}

std::vector<Line> linesToAsk(const SamplesToHear& to_hear, const ForcedAlignment& alignment) {
  const SpeechLabels& labels = alignment.labels;
  const std::span<const std::int16_t> samples = to_hear.all();
  const auto sampleAt = [&](Seconds time) {
    return std::min(samples.size(), static_cast<std::size_t>(time * SamplesToHear::kRateHz));
  };
  std::vector<Line> lines;
  std::size_t first = 0;
  for (const std::size_t end : TextDoubt::lineEnds(labels.words.size())) {
    Line line{.first = std::exchange(first, end), .end = end, .sound = {}, .text = {}};
    const bool is_outside_speech = alignment.line_confidence[line.first] == 0;
    if (is_outside_speech || isSure(line, alignment)) continue;
    Seconds from = line.first > 0 ? labels.spanOf(labels.words[line.first - 1].phones).end : 0.0;
    Seconds to = end < labels.words.size() ? labels.spanOf(labels.words[end].phones).start : labels.duration();
    const TimeSpan said{labels.spanOf(labels.words[line.first].phones).start,
                        labels.spanOf(labels.words[end - 1].phones).end};
    if (said.duration() > kMostHeard) continue;
    if (to - from > kMostHeard) {  // the pauses around it are cut
      const Seconds beside = (kMostHeard - said.duration()) / 2;
      from = std::max(from, said.start - beside);
      to = std::min(to, said.end + beside);
    }
    line.sound = samples.subspan(sampleAt(from), sampleAt(to) - sampleAt(from));
    for (std::size_t i = line.first; i < end; ++i) line.text.push_back(labels.words[i].text);
    lines.push_back(std::move(line));
  }
  return lines;
}

void believe(const Line& line, const TextScore& score, const Pronouncer& pronouncer, ForcedAlignment& alignment) {
  std::vector<double> word_odds;
  for (std::size_t word = line.first; word < line.end; ++word) {
    word_odds.push_back(believedOdds(alignment.confidence[word]));
    alignment.confidence[word] = confidenceOf(oddsOfWord(word_odds.back(), score.words[word - line.first]));
  }
  std::string heard;
  for (const NetworkWord& word : score.heard) heard += (heard.empty() ? "" : " ") + word.text;
  const Differences differences =
      differencesOf(phonesOf(fmt::format("{}", fmt::join(line.text, " ")), pronouncer), phonesOf(heard, pronouncer));
  const double middle = median(
      {alignment.confidence.begin() + signedIndex(line.first), alignment.confidence.begin() + signedIndex(line.end)});
  double of_line = confidenceOf(oddsOfLine(word_odds, score, differences, noiseOf(line.sound)));
  if (middle < kLeastMiddleWord) of_line = std::min(of_line, middle);
  std::fill(alignment.line_confidence.begin() + signedIndex(line.first),
            alignment.line_confidence.begin() + signedIndex(line.end), of_line);
}

}  // namespace

std::string judgeByNetwork(WordNetwork& network, const Pronouncer& pronouncer, const SamplesToHear& to_hear,
                           ForcedAlignment& alignment) {
  const bool is_english = &pronouncer.language() == &english();
  if (!is_english || alignment.line_confidence.empty() || !network.isThere()) return {};
  const std::vector<Line> lines = linesToAsk(to_hear, alignment);
  try {
    for (std::size_t first = 0; first < lines.size(); first += WordNetwork::kAskedOfOneProgram) {
      if (first > 0) network.endWaiting();
      const std::span<const Line> some =
          std::span(lines).subspan(first, std::min(WordNetwork::kAskedOfOneProgram, lines.size() - first));
      std::vector<std::span<const std::int16_t>> sounds;
      std::vector<std::vector<std::string>> texts;
      for (const Line& line : some) {
        sounds.push_back(line.sound);
        texts.push_back(line.text);
      }
      const std::vector<std::optional<TextScore>> scores = network.score(sounds, texts);
      for (std::size_t i = 0; i < some.size(); ++i) {
        if (scores[i]) believe(some[i], *scores[i], pronouncer, alignment);
      }
      to_hear.letGo();
    }
  } catch (const InputError& error) {
    return fmt::format("the network that hears words was not heard ({})", error.what());
  }
  return {};
}

}  // namespace mouthpiece
