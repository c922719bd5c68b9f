#include "voices/spoken_line_builder.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/errors.h"
#include "base/index.h"
#include "base/text_encoding.h"

namespace mouthpiece {
namespace {

/// The voices reckon in 32-bit floats: what is beyond a microsecond is noise, and ugly in a TextGrid.
void roundTimes(std::vector<PhoneSegment>& phones) {
  const auto rounded = [](Seconds time) { return std::round(time * 1e6) / 1e6; };
  for (PhoneSegment& phone : phones) phone.span = {rounded(phone.span.start), rounded(phone.span.end)};
}

bool isWordByte(char c) {
  const auto byte = static_cast<unsigned char>(c);
  return byte >= 0x80 || (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}

/// What is left of a word in every voice's spelling: letters and digits in lower case.
std::string lettersOf(std::string_view word) {
  std::string letters = lowerCase(word);
  std::erase_if(letters, [](char c) { return !isWordByte(c); });
  return letters;
}

/// The words of a speakable text without the marks around them. A hyphen parts words, an apostrophe does not.
std::vector<std::string_view> writtenWords(std::string_view text) {
  std::vector<std::string_view> words;
  for (std::size_t at = 0; at < text.size();) {
    if (!isWordByte(text[at])) {
      ++at;
      continue;
    }
    std::size_t end = at;
    for (std::size_t i = at; i < text.size() && (isWordByte(text[i]) || text[i] == '\''); ++i) {
      if (isWordByte(text[i])) end = i + 1;
    }
    words.push_back(text.substr(at, end - at));
    at = end;
  }
  return words;
}

/// Words that a voice said without a pause, and how they are written as one.
struct WrittenWord {
  std::size_t first = 0, count = 0;
  std::string_view spelling;
};

/// Voices spell as they please: Flite's "mother" "'s", "dont" and "_a" are mother's, don't and A. Both lists go on in
/// step by their letters; what a voice says otherwise than it is written stays as it says it.
std::vector<WrittenWord> matchWords(const std::vector<LabelledWord>& said, std::string_view text) {
  constexpr std::size_t kReach = 2, kMore = 4, kMost = 200;
  std::vector<WrittenWord> matches;
  std::size_t next = 0, reach = kReach;
  for (const std::string_view written : writtenWords(text)) {
    const std::string letters = lettersOf(written);
    bool is_found = false;
    for (std::size_t first = next; !is_found && first < std::min(next + reach, said.size()); ++first) {
      std::string joined;
      std::size_t end = first;
      const auto isSaidOn = [&] {
        return end == first || said[end].phones.first.value == said[end - 1].phones.last.value + 1;
      };
      while (end < said.size() && joined.size() < letters.size() && isSaidOn()) joined += lettersOf(said[end++].text);
      is_found = joined == letters;
      if (!is_found) continue;
      matches.push_back({first, end - first, written});
      next = end;
    }
    reach = is_found ? kReach : std::min(reach + kMore, kMost);
  }
  return matches;
}

/// One word of those from `first` on. An 'll or 's joins the syllable before it.
void joinWords(SpeechLabels& labels, const WrittenWord& written) {
  for (std::size_t more = 1; more < written.count; ++more) {
    PhoneRange& whole = labels.words[written.first].phones;
    const PhoneRange part = labels.words[written.first + 1].phones;
    bool has_vowel = false;
    for (std::size_t i = part.first.value; i <= part.last.value; ++i) has_vowel |= isVowel(labels.phones[i].phone);
    const auto before = labels.phones[whole.last.value].syllable, own = labels.phones[part.first.value].syllable;
    const bool joins_syllable = !has_vowel && before && own && *own == *before + 1 &&
                                labels.phones[part.last.value].syllable == own && labels.syllables[*own].phones == part;
    for (LabelledPhone& phone : labels.phones) {
      if (phone.word && *phone.word > written.first) --*phone.word;
      if (joins_syllable && phone.syllable && *phone.syllable >= *own) --*phone.syllable;
    }
    if (joins_syllable) {
      labels.syllables[*before].phones.last = part.last;
      labels.syllables.erase(labels.syllables.begin() + signedIndex(*own));
    }
    whole.last = part.last;
    labels.words.erase(labels.words.begin() + signedIndex(written.first) + 1);
  }
  labels.words[written.first].text = written.spelling;
}

/// From the last word to the first: the places of those before it stay.
void spellAsWritten(SpeechLabels& labels, std::string_view text) {
  std::vector<WrittenWord> matches = matchWords(labels.words, text);
  for (auto match = matches.rbegin(); match != matches.rend(); ++match) joinWords(labels, *match);
}

}  // namespace

std::string withoutLoudWords(std::string speakable) {
  const auto isCapital = [](char c) { return c >= 'A' && c <= 'Z'; };
  for (std::size_t at = 0; at < speakable.size();) {
    std::size_t end = at;
    while (end < speakable.size() && (isWordByte(speakable[end]) || speakable[end] == '\'')) ++end;
    const std::string_view word = std::string_view(speakable).substr(at, end - at);
    const auto capitals = std::count_if(word.begin(), word.end(), isCapital);
    const auto other = std::count_if(word.begin(), word.end(), [&](char c) { return isWordByte(c) && !isCapital(c); });
    if (capitals > 1 && other == 0) speakable.replace(at, end - at, lowerCase(word));
    at = end + 1;
  }
  return speakable;
}

void SpokenLineBuilder::add(AudioClip audio, std::vector<PhoneSegment> phones, const std::vector<std::string>& words) {
  const bool is_said =
      std::any_of(phones.begin(), phones.end(), [](const PhoneSegment& p) { return p.phone != Phone::kSil; });
  if (!is_said || audio.samples.empty()) return;
  MOUTHPIECE_EXPECT(audio.sample_rate_hz > 0);
  roundTimes(phones);
  const auto label_samples = static_cast<std::size_t>(std::ceil(phones.back().span.end * audio.sample_rate_hz - 1e-3));
  audio.samples.resize(std::max(audio.samples.size(), label_samples), 0.0F);
  SpeechLabels labels = buildSpeechLabels(std::move(phones), words, audio.duration(), language_);
  if (line_.audio.samples.empty()) {
    line_.audio = std::move(audio);
    line_.labels = std::move(labels);
    return;
  }
  MOUTHPIECE_EXPECT(audio.sample_rate_hz == line_.audio.sample_rate_hz);
  appendSpeechLabels(line_.labels, labels);
  line_.audio.samples.insert(line_.audio.samples.end(), audio.samples.begin(), audio.samples.end());
}

SpokenLine SpokenLineBuilder::build(std::string text, std::string voice) {
  if (isEmpty()) {
    throw InputError("text", "",
                     fmt::format("has nothing to say in it: found '{}'; expected words", printable(text, 40)));
  }
  // The clocks of sound and labels end together to the last sample.
  line_.labels.phones.back().span.end = std::max(line_.labels.phones.back().span.end, line_.audio.duration());
  spellAsWritten(line_.labels, text);
  expectConsistent(line_.labels);
  line_.text = std::move(text);
  line_.voice = std::move(voice);
  return std::move(line_);
}

}  // namespace mouthpiece
