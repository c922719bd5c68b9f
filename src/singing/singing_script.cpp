#include "singing/singing_script.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/errors.h"

namespace mouthpiece {
namespace {

constexpr Seconds kVibratoStep = 0.02;
constexpr double kMostSteps = 400;  // of one tone: Festival's lists are recursive
constexpr Seconds kVibratoRise = 0.3;
constexpr double kLowestHz = 40, kHighestHz = 2200;
constexpr Seconds kShortestTone = 0.01, kLongestTone = 60, kLongestRest = 120, kLongestSong = 1800;
constexpr std::size_t kMostWords = 5000, kLongestWord = 40, kMostTones = 200;

bool isLetter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }

[[noreturn]] void failWord(std::size_t number, std::string_view what) {
  throw InputError("song", fmt::format("word {}", number + 1), what);
}

void checkTone(const SungTone& tone, std::size_t word) {
  if (!(tone.hz >= kLowestHz && tone.hz <= kHighestHz)) {
    failWord(word, fmt::format("has a tone of {:g} Hz; expected {} to {}", tone.hz, kLowestHz, kHighestHz));
  }
  if (!(tone.duration >= kShortestTone && tone.duration <= kLongestTone)) {
    failWord(word, fmt::format("has a tone of {:g} s; expected {} to {}", tone.duration, kShortestTone, kLongestTone));
  }
}

/// The frequencies and lengths of a syllable, in singing mode's way to write slurs.
struct Slur {
  std::string frequencies;
  std::string lengths;

  void add(double hz, Seconds length) {
    frequencies += fmt::format("{}{:.2f}", frequencies.empty() ? "" : "+", hz);
    lengths += fmt::format("{}{:.5f}", lengths.empty() ? "" : "+", length);
  }
};

void addTone(Slur& slur, const SungTone& tone, const SungVibrato& vibrato) {
  if (!tone.vibrato) return slur.add(tone.hz, tone.duration);
  const double steps = std::clamp(std::round(tone.duration / kVibratoStep), 1.0, kMostSteps);
  for (double step = 0; step < steps; ++step) {
    const Seconds time = (step + 0.5) * tone.duration / steps;
    const double growth = std::clamp((time - vibrato.delay) / kVibratoRise, 0.0, 1.0);
    const double swing = std::sin(2 * std::numbers::pi * vibrato.rate_hz * (time - vibrato.delay));
    slur.add(tone.hz * std::exp2(growth * vibrato.depth_semitones * swing / 12), tone.duration / steps);
  }
}

/// Parts the last tone of the last syllable into `parts` syllables.
void partLastSyllable(SungWord& word, std::size_t parts) {
  SungTone& last = word.syllables.back().back();
  last.duration /= static_cast<double>(parts);
  const SungTone part = last;
  for (std::size_t i = 1; i < parts; ++i) word.syllables.push_back({part});
}

}  // namespace

void checkSungWords(const std::vector<SungWord>& words, Seconds first_rest) {
  if (words.empty() || words.size() > kMostWords) {
    throw InputError("song", "", fmt::format("holds {} words; expected 1 to {}", words.size(), kMostWords));
  }
  Seconds total = first_rest;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const SungWord& word = words[i];
    const bool is_plain =
        std::all_of(word.text.begin(), word.text.end(), [](char c) { return isLetter(c) || c == '\''; });
    const bool has_letter = std::any_of(word.text.begin(), word.text.end(), isLetter);
    if (!is_plain || !has_letter || word.text.size() > kLongestWord) {
      failWord(i, fmt::format("found '{}'; expected letters and apostrophes", printable(word.text, 50)));
    }
    if (word.syllables.empty() || word.syllables.size() > kLongestWord)
      failWord(i, "has no tones, or too many syllables");
    for (const auto& tones : word.syllables) {
      if (tones.empty() || tones.size() > kMostTones) failWord(i, "has a syllable without tones, or with too many");
      for (const SungTone& tone : tones) {
        checkTone(tone, i);
        total += tone.duration;
      }
    }
    if (!(word.rest >= 0 && word.rest <= kLongestRest))
      failWord(i, fmt::format("rests {:g} s; expected 0 to {}", word.rest, kLongestRest));
    total += word.rest;
  }
  if (!(first_rest >= 0 && first_rest <= kLongestRest) || total > kLongestSong) {
    throw InputError("song", "", fmt::format("lasts {:g} s; expected at most {} s", total, kLongestSong));
  }
}

std::vector<SungWord> fitSyllables(std::vector<SungWord> words, const std::vector<std::size_t>& syllable_counts) {
  MOUTHPIECE_EXPECT(words.size() == syllable_counts.size());
  for (std::size_t i = 0; i < words.size(); ++i) {
    auto& syllables = words[i].syllables;
    const std::size_t wanted = std::max<std::size_t>(1, syllable_counts[i]);
    while (syllables.size() > wanted) {
      auto& kept = syllables[syllables.size() - 2];
      kept.insert(kept.end(), syllables.back().begin(), syllables.back().end());
      syllables.pop_back();
    }
    if (syllables.size() < wanted) partLastSyllable(words[i], wanted - syllables.size() + 1);
  }
  return words;
}

std::string singingXml(const std::vector<SungWord>& words, Seconds first_rest, const SungVibrato& vibrato) {
  std::string xml =
      "<?xml version=\"1.0\"?>\n<!DOCTYPE SINGING PUBLIC \"-//SINGING//DTD SINGING mark up//EN\" \"Singing.v0_1.dtd\" "
      "[]>\n"
      "<SINGING BPM=\"60\">\n";
  if (first_rest > 0) xml += fmt::format("<REST SECONDS=\"{:.4f}\"></REST>\n", first_rest);
  for (const SungWord& word : words) {
    std::string frequencies, lengths;
    for (const auto& tones : word.syllables) {
      Slur slur;
      for (const SungTone& tone : tones) addTone(slur, tone, vibrato);
      frequencies += (frequencies.empty() ? "" : ",") + slur.frequencies;
      lengths += (lengths.empty() ? "" : ",") + slur.lengths;
    }
    const auto first = word.text.find_first_not_of('\'');
    const auto last = word.text.find_last_not_of('\'');
    std::string text = word.text.substr(first, last - first + 1);
    std::transform(text.begin(), text.end(), text.begin(),
                   [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
    xml +=
        fmt::format("<DURATION SECONDS=\"{}\"><PITCH FREQ=\"{}\">{}</PITCH></DURATION>\n", lengths, frequencies, text);
    if (word.rest > 0) xml += fmt::format("<REST SECONDS=\"{:.4f}\"></REST>\n", word.rest);
  }
  return xml + "</SINGING>\n";
}

}  // namespace mouthpiece
