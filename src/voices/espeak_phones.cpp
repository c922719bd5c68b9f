#include "voices/engines.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/errors.h"
#include "base/index.h"
#include "base/text_numbers.h"

namespace mouthpiece {
namespace {

constexpr double kVowelShare = 0.6;         // of a vowel and the R that is written with it
constexpr double kLateShare = 1.0 / 3.0;    // of a vowel and the l announced at its end
constexpr Seconds kLateSonorant = 0.030;    // an l shorter than this was announced late
constexpr Seconds kLongestClosure = 0.120;  // of a stop
constexpr Seconds kClosureAfterPause = 0.060;
constexpr Seconds kLeastBefore = 0.020;         // what a closure leaves to the phone before
constexpr Seconds kShortestPhone = 1e-3;        // eSpeak's pauses of no length
constexpr Seconds kPauseInWord = 0.080;         // eSpeak's before a stop: its closure, as in "compra"
constexpr double kClosureLevel = 0.02;          // of the utterance's peak: a closure's voicing is below
constexpr std::string_view kSyllabicMark = "̩";  // U+0329

bool beginsCharacter(std::string_view text, std::size_t at) {
  return at == text.size() || (static_cast<unsigned char>(text[at]) & 0xC0U) != 0x80U;
}

/// The phones that the language says for a symbol as a whole; none for another.
std::vector<Phone> phonesOfWhole(std::string_view symbol, const Language& language) {
  std::vector<Phone> phones;
  const auto own = std::find_if(language.voice_symbols.begin(), language.voice_symbols.end(),
                                [&](const VoiceSymbol& candidate) { return candidate.ipa == symbol; });
  if (own != language.voice_symbols.end()) {
    std::vector<std::string_view> names;
    splitFields(own->phones, ' ', names);
    for (const std::string_view name : names) phones.push_back(phoneFromName(name).value());
  } else if (const auto phone = phoneFromName(symbol, PhoneSet::kIpa, language); phone && *phone != Phone::kSil) {
    if (symbol.ends_with(kSyllabicMark)) phones.push_back(language.reduced_vowel);
    phones.push_back(*phone);
  }
  return phones;
}

/// The phones of `text` from `at`, which is moved behind them; the longest known symbol wins.
std::vector<Phone> takeSymbol(std::string_view text, std::size_t& at, const Language& language) {
  for (std::size_t end = text.size(); end > at; --end) {
    if (!beginsCharacter(text, end)) continue;
    std::vector<Phone> phones = phonesOfWhole(text.substr(at, end - at), language);
    if (phones.empty()) continue;
    at = end;
    return phones;
  }
  return {};
}

/// Since when the sound before `time` has been no louder than a closure's, at most kLongestClosure before.
Seconds closureBefore(Seconds time, const AudioClip& audio, float loud) {
  const auto end = std::min(unsignedIndex(std::lrint(time * audio.sample_rate_hz)), audio.samples.size());
  const auto longest = std::min(static_cast<std::size_t>(kLongestClosure * audio.sample_rate_hz), end);
  std::size_t quiet = 0;
  while (quiet < longest && std::abs(audio.samples[end - 1 - quiet]) <= loud) ++quiet;
  return time - asReal(quiet) / audio.sample_rate_hz;
}

/// The events' phones with the times that eSpeak gives.
std::vector<PhoneSegment> announcedPhones(const std::vector<EspeakEvent>& events, Seconds end, const Language& language,
                                          std::vector<std::string>& unknown) {
  std::vector<PhoneSegment> phones;
  for (std::size_t i = 0; i < events.size(); ++i) {
    const TimeSpan span{events[i].time, i + 1 < events.size() ? events[i + 1].time : end};
    if (span.duration() < kShortestPhone) continue;
    if (events[i].symbol.empty()) {
      const bool is_in_word = i > 0 && i + 1 < events.size() && events[i - 1].word == events[i + 1].word &&
                              !events[i + 1].symbol.empty() && span.duration() < kPauseInWord;
      if (is_in_word && !phones.empty() && phones.back().phone != Phone::kSil) {
        phones.back().span.end = span.end;
        continue;
      }
      phones.push_back({.phone = Phone::kSil, .span = span});
      continue;
    }
    std::vector<SpelledPhone> parts = phonesOfEspeakSymbol(events[i].symbol, language, unknown);
    if (parts.empty()) parts.push_back({Phone::kAH, Phone::kAH, events[i].symbol, 0});
    Seconds start = span.start;
    for (std::size_t p = 0; p < parts.size(); ++p) {
      const bool is_last = p + 1 == parts.size();
      const Seconds part_end = is_last ? span.end : start + kVowelShare * (span.end - start);
      phones.push_back(
          {.phone = parts[p].phone, .span = {start, part_end}, .word = events[i].word, .ipa = std::move(parts[p].ipa)});
      start = part_end;
    }
  }
  return phones;
}

/// After a pause nobody hears where the closure begins.
Seconds closureAfterPause(const PhoneSegment& stop, Seconds pause_start) {
  return std::max(pause_start, stop.span.start - kClosureAfterPause);
}

void takeClosures(std::vector<PhoneSegment>& phones, const AudioClip& audio) {
  float peak = 0;
  for (const float sample : audio.samples) peak = std::max(peak, std::abs(sample));
  for (std::size_t i = 0; i < phones.size(); ++i) {
    if (!isStop(phones[i].phone)) continue;
    if (i == 0) {
      phones[i].span.start = closureAfterPause(phones[i], 0);
      continue;
    }
    PhoneSegment& before = phones[i - 1];
    const Seconds closed = closureBefore(phones[i].span.start, audio, asFloat(kClosureLevel) * peak);
    const Seconds start = before.phone == Phone::kSil ? closureAfterPause(phones[i], before.span.start + kShortestPhone)
                                                      : std::max(closed, before.span.start + kLeastBefore);
    if (start < phones[i].span.start) before.span.end = phones[i].span.start = start;
  }
}

void mendLateSonorants(std::vector<PhoneSegment>& phones) {
  for (std::size_t i = 1; i < phones.size(); ++i) {
    PhoneSegment& vowel = phones[i - 1];
    if (phones[i].phone != Phone::kL || !isVowel(vowel.phone) || phones[i].span.duration() > kLateSonorant) continue;
    const Seconds both = phones[i].span.end - vowel.span.start;
    vowel.span.end = phones[i].span.start = phones[i].span.end - kLateShare * both;
  }
}

}  // namespace

std::vector<SpelledPhone> phonesOfEspeakSymbol(std::string_view symbol, const Language& language,
                                               std::vector<std::string>& unknown) {
  if (language.say != nullptr) return phonesOfSymbol(symbol, PhoneSet::kIpa, language, unknown);
  std::vector<SpelledPhone> phones;
  for (std::size_t at = 0; at < symbol.size();) {
    const std::vector<Phone> next = takeSymbol(symbol, at, language);
    if (next.empty()) return phonesOfIpa(symbol, unknown);
    for (const Phone phone : next) phones.push_back({phone, phone, "", 0});
  }
  return phones;
}

namespace {

/// The phones of a stretch of IPA between two marks, all of it.
std::vector<Phone> takeVowels(std::string_view text, std::size_t& taken) {
  std::vector<std::string> unknown;
  std::vector<Phone> phones;
  for (const SpelledPhone& phone : phonesOfIpa(text, unknown)) phones.push_back(phone.phone);
  if (!phones.empty()) taken = text.size();
  return phones;
}

}  // namespace

std::vector<int> stressesOfEspeakText(std::string_view transcription, const Language& language) {
  constexpr std::string_view kPrimary = "ˈ", kSecondary = "ˌ";
  std::vector<int> stresses;
  int stress = 0;
  for (std::size_t at = 0; at < transcription.size();) {
    const std::string_view rest = transcription.substr(at);
    if (rest.starts_with(kPrimary) || rest.starts_with(kSecondary)) {
      stress = rest.starts_with(kPrimary) ? 1 : 2;
      at += kPrimary.size();
      continue;
    }
    // A symbol ends at the latest where the next mark or word begins.
    std::size_t end = std::min({rest.find(kPrimary), rest.find(kSecondary), rest.find_first_of(" \n_"), rest.size()});
    std::size_t taken = 0;
    const std::vector<Phone> phones = language.say != nullptr ? takeVowels(rest.substr(0, end), taken)
                                                              : takeSymbol(rest.substr(0, end), taken, language);
    for (const Phone phone : phones) {
      if (isVowel(phone)) stresses.push_back(std::exchange(stress, 0));
    }
    if (phones.empty()) {  // a blank, or a sign that is no sound
      taken = 1;
      while (!beginsCharacter(rest, taken)) ++taken;
    }
    at += taken;
  }
  return stresses;
}

std::vector<PhoneSegment> phonesFromEspeak(const std::vector<EspeakEvent>& events, const std::vector<int>& stresses,
                                           const AudioClip& audio, const Language& language,
                                           std::vector<std::string>& unknown) {
  std::vector<PhoneSegment> phones = announcedPhones(events, audio.duration(), language, unknown);
  mendLateSonorants(phones);
  takeClosures(phones, audio);
  std::vector<PhoneSegment*> vowels;
  for (PhoneSegment& phone : phones) {
    if (isVowel(phone.phone)) vowels.push_back(&phone);
  }
  if (vowels.size() == stresses.size()) {
    for (std::size_t i = 0; i < vowels.size(); ++i) vowels[i]->stress = stresses[i];
  }
  return phones;
}

}  // namespace mouthpiece
