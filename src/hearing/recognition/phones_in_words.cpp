#include "hearing/recognition/phones_in_words.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "base/index.h"

namespace mouthpiece {
namespace {

/// Of who is not known a closing of the lips is kept that words lack, where the lips' phones have this share of what is
/// heard, in the mean over it.
constexpr double kClosingHeard = 0.6;
/// Less of a phone at the end of a word is its neighbour's.
constexpr Seconds kLeastPart = 0.02;

/// Puts `closing` among phones and what fits them. Consonants that lie under it for the most part go, others and vowels
/// keep what is left of them on either side. It belongs to the word of the first that goes, else of the next one, else
/// of the one before. It is not put where there is silence around it.
void putClosing(LabelledPhone closing, double fit, std::vector<LabelledPhone>& phones, std::vector<double>& fits) {
  constexpr Seconds kShortest = 0.03, kLongest = 0.10, kNearWord = 0.15;
  TimeSpan& span = closing.span;
  span.start = std::max(span.start, span.end - kLongest);
  for (const LabelledPhone& phone : phones) {  // a vowel stays
    if (!isVowel(phone.phone) || phone.span.start < span.start || phone.span.end > span.end) continue;
    const bool is_before = phone.span.start - span.start >= kShortest;
    (is_before ? span.end : span.start) = is_before ? phone.span.start : phone.span.end;
  }
  if (span.duration() < kShortest) return;
  std::vector<LabelledPhone> kept;
  std::vector<double> fits_kept;
  std::optional<LabelledPhone> gone;
  std::size_t place = 0;
  for (std::size_t i = 0; i < phones.size(); ++i) {
    LabelledPhone before = phones[i], after = phones[i];
    if (before.phone == Phone::kSil) continue;
    before.span.end = std::min(before.span.end, span.start);
    after.span.start = std::max(after.span.start, span.end);
    const Seconds left = std::max(before.span.duration(), 0.0) + std::max(after.span.duration(), 0.0);
    if (!isVowel(before.phone) && left < phones[i].span.duration() / 2) {
      if (!gone) gone = phones[i];
      continue;
    }
    const bool is_whole = left >= phones[i].span.duration();
    for (const LabelledPhone& part : {before, after}) {
      if (part.span.duration() <= 0) continue;
      if (!is_whole && part.span.duration() < kShortest) {  // the closing takes what would be too short
        const bool is_before = part.span.end <= span.start;
        (is_before ? span.start : span.end) = is_before ? part.span.start : part.span.end;
        continue;
      }
      if (part.span.end <= span.start) place = kept.size() + 1;
      kept.push_back(part);
      fits_kept.push_back(fits[i]);
    }
  }
  const LabelledPhone* last = place > 0 ? &kept[place - 1] : nullptr;
  const LabelledPhone* next = place < kept.size() ? &kept[place] : nullptr;
  const bool is_near = (last != nullptr && span.start - last->span.end <= kNearWord) ||
                       (next != nullptr && next->span.start - span.end <= kNearWord);
  if (!gone && !is_near) return;
  if (next != nullptr && next->span.start - span.end < kShortest) span.end = next->span.start;
  const LabelledPhone& owner = gone ? *gone : next != nullptr ? *next : *last;
  closing.word = owner.word;
  closing.syllable = owner.syllable;
  kept.insert(kept.begin() + signedIndex(place), closing);
  fits_kept.insert(fits_kept.begin() + signedIndex(place), fit);
  phones = std::move(kept);
  fits = std::move(fits_kept);
}

}  // namespace

void keepClosings(const StretchHearing& hearing, std::vector<LabelledPhone>& phones, std::vector<double>& fits) {
  constexpr Seconds kAtOnce = 0.02;
  for (const HeardPhone& heard : hearing.row()) {
    if (!isBilabial(heard.phone)) continue;
    double share = 0;
    for (const Phone lips : {Phone::kP, Phone::kB, Phone::kM}) {
      share += double{hearing.posteriors()
                          .row(static_cast<Eigen::Index>(lips))
                          .segment(signedIndex(heard.first), signedIndex(heard.end - heard.first))
                          .mean()};
    }
    const TimeSpan span = spanOf(heard);
    const bool is_there = std::any_of(phones.begin(), phones.end(), [&](const LabelledPhone& phone) {
      return isBilabial(phone.phone) && phone.span.start < span.end + kAtOnce && phone.span.end > span.start - kAtOnce;
    });
    if (share < kClosingHeard || is_there) continue;
    putClosing({.phone = heard.phone, .span = span, .word = {}, .syllable = {}}, share, phones, fits);
  }
}

void hearUnlikelyWords(const StretchHearing& hearing, const std::vector<double>& word_odds, SpeechLabels& labels,
                       std::vector<double>& fits) {
  std::vector<LabelledPhone> phones;
  std::vector<double> new_fits;
  for (std::size_t first = 0, end = 0; first < labels.phones.size(); first = end) {
    const std::optional<std::size_t> word = labels.phones[first].word;
    while (end < labels.phones.size() && labels.phones[end].word == word) ++end;
    const std::size_t before = phones.size();
    if (word && word_odds[*word] > 0) {
      const TimeSpan span{labels.phones[first].span.start, labels.phones[end - 1].span.end};
      for (const HeardPhone& heard : hearing.row()) {
        const TimeSpan said = spanOf(heard);
        const TimeSpan part{std::max(said.start, span.start), std::min(said.end, span.end)};
        if (heard.phone == Phone::kSil || part.duration() < kLeastPart) continue;
        phones.push_back({.phone = heard.phone, .span = part, .word = word, .syllable = {}});
        new_fits.push_back(heard.confidence);
      }
    }
    if (phones.size() > before) continue;
    for (std::size_t i = first; i < end; ++i) {
      phones.push_back(labels.phones[i]);
      new_fits.push_back(fits[i]);
    }
  }
  labels.phones = std::move(phones);
  fits = std::move(new_fits);
}

}  // namespace mouthpiece
