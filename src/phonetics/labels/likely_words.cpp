#include "phonetics/labels/likely_words.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "phonetics/labels/labels_builder.h"

namespace mouthpiece {
namespace {

/// Wider surroundings count as much as one phone more in these.
constexpr double kHeldPhones = 1;
constexpr double kLeastChance = 1e-4;

/// Of no phone: silence, or the line's end.
std::uint32_t numberAt(const SpeechLabels& labels, std::size_t phone) {
  return phone < labels.phones.size() ? static_cast<std::uint32_t>(labels.phones[phone].phone) : 0U;
}

constexpr std::uint32_t keyOf(std::uint32_t kind, std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
  static_assert(kPhoneCount <= 64);
  return kind << 24U | a << 18U | b << 12U | c << 6U | d;
}

/// Around the border between the phone before `phone` and it: the two, with the one after, with the one before.
std::array<std::uint32_t, 3> aroundBorder(const SpeechLabels& labels, std::size_t phone) {
  const std::uint32_t before = numberAt(labels, phone - 1), after = numberAt(labels, phone);
  const std::uint32_t next = numberAt(labels, phone + 1);
  const std::uint32_t previous = phone > 1 ? numberAt(labels, phone - 2) : 0U;
  return {keyOf(0, 0, before, after, 0), keyOf(1, 0, before, after, next), keyOf(2, previous, before, after, next)};
}

/// Around a vowel: itself, with the phone after, with the one before.
std::array<std::uint32_t, 3> aroundVowel(const SpeechLabels& labels, std::size_t vowel) {
  const std::uint32_t own = numberAt(labels, vowel), after = numberAt(labels, vowel + 1);
  const std::uint32_t before = vowel > 0 ? numberAt(labels, vowel - 1) : 0U;
  return {keyOf(0, 0, own, 0, 0), keyOf(1, 0, own, after, 0), keyOf(2, before, own, after, 0)};
}

bool isSaid(const LabelledPhone& phone) { return phone.phone != Phone::kSil; }

bool lacksWord(const LabelledPhone& phone) { return isSaid(phone) && !phone.word; }

}  // namespace

void LikelyWords::count(Counts& counts, const Surroundings& surroundings, bool is_so) {
  for (const std::uint32_t key : surroundings) {
    Count& count = counts[key];
    count.yes += is_so ? 1 : 0;
    count.all += 1;
  }
}

double LikelyWords::chance(const Counts& counts, const Surroundings& surroundings, double usual) {
  double likely = usual;
  for (const std::uint32_t key : surroundings) {
    const auto found = counts.find(key);
    if (found == counts.end()) break;
    likely = (found->second.yes + kHeldPhones * likely) / (found->second.all + kHeldPhones);
  }
  return std::clamp(likely, kLeastChance, 1 - kLeastChance);
}

void LikelyWords::add(const SpeechLabels& labels) {
  for (std::size_t i = 1; i < labels.phones.size(); ++i) {
    const LabelledPhone &before = labels.phones[i - 1], &phone = labels.phones[i];
    if (phone.word && before.word) {
      const bool is_edge = phone.word != before.word;
      count(edges_, aroundBorder(labels, i), is_edge);
      all_edges_.yes += is_edge ? 1 : 0;
      all_edges_.all += 1;
    }
    if (phone.word && phone.syllable && isVowel(phone.phone))
      count(stresses_, aroundVowel(labels, i), labels.syllables[*phone.syllable].stress > 0);
  }
}

std::vector<bool> LikelyWords::wordStarts(const SpeechLabels& labels, std::size_t first, std::size_t end) const {
  std::vector<bool> starts(end - first, false);
  starts.front() = true;
  if (all_edges_.all == 0) return starts;
  const double usual = all_edges_.yes / all_edges_.all;
  // The likeliest cuts that leave a vowel in each word; best[has]: up to here, with a vowel in the last word or
  // without.
  constexpr double kImpossible = -1e9;
  struct Step {
    std::array<double, 2> best{kImpossible, kImpossible};
    std::array<bool, 2> cuts{false, false}, had_vowel{false, false};
  };
  std::vector<Step> steps(end - first);
  steps.front().best[isVowel(labels.phones[first].phone) ? 1 : 0] = 0;
  for (std::size_t i = 1; i < steps.size(); ++i) {
    const double edge = chance(edges_, aroundBorder(labels, first + i), usual);
    const bool is_vowel = isVowel(labels.phones[first + i].phone);
    const auto reach = [&](std::size_t from, std::size_t to, bool cuts, double likely) {
      const double value = steps[i - 1].best[from] + std::log(likely);
      if (value <= steps[i].best[to]) return;
      steps[i].best[to] = value;
      steps[i].cuts[to] = cuts;
      steps[i].had_vowel[to] = from == 1;
    };
    reach(0, is_vowel ? 1 : 0, false, 1 - edge);
    reach(1, 1, false, 1 - edge);
    reach(1, is_vowel ? 1 : 0, true, edge);
  }
  std::size_t has = steps.back().best[1] > kImpossible ? 1 : 0;
  for (std::size_t i = steps.size() - 1; i > 0; --i) {
    starts[i] = steps[i].cuts[has];
    has = steps[i].had_vowel[has] ? 1 : 0;
  }
  return starts;
}

bool LikelyWords::isStressed(const SpeechLabels& labels, std::size_t vowel) const {
  const double usual = labels.phones[vowel].phone == language_->reduced_vowel ? 0 : 1;
  return chance(stresses_, aroundVowel(labels, vowel), usual) > 0.5;
}

bool LikelyWords::areNeededFor(const SpeechLabels& labels) {
  return std::any_of(labels.phones.begin(), labels.phones.end(), lacksWord);
}

SpeechLabels LikelyWords::complete(const SpeechLabels& labels) const {
  if (!areNeededFor(labels)) return labels;
  std::vector<std::string> words;
  for (const LabelledWord& word : labels.words) words.push_back(word.text);
  std::vector<PhoneSegment> segments;
  for (std::size_t i = 0; i < labels.phones.size(); ++i) {
    const LabelledPhone& phone = labels.phones[i];
    PhoneSegment segment{.phone = phone.phone, .span = phone.span, .word = phone.word, .ipa = phone.ipa};
    if (phone.word) {
      segment.syllable = phone.syllable;
      if (phone.syllable && isVowel(phone.phone)) segment.stress = labels.syllables[*phone.syllable].stress;
    }
    segments.push_back(segment);
  }
  for (std::size_t first = 0; first < segments.size(); ++first) {
    if (!lacksWord(labels.phones[first])) continue;
    std::size_t end = first;
    while (end < segments.size() && lacksWord(labels.phones[end])) ++end;
    const std::vector<bool> starts = wordStarts(labels, first, end);
    for (std::size_t i = first; i < end; ++i) {
      if (starts[i - first]) words.emplace_back();
      segments[i].word = words.size() - 1;
      if (isVowel(segments[i].phone)) segments[i].stress = isStressed(labels, i) ? 1 : 0;
    }
    first = end - 1;
  }
  return buildSpeechLabels(std::move(segments), words, labels.duration(), *language_);
}

}  // namespace mouthpiece
