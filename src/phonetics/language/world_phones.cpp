#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <tuple>
#include <utility>

#include "base/errors.h"
#include "phonetics/language/language.h"

namespace mouthpiece {
namespace {

using enum Phone;

constexpr LanguagePhone kWorldInventory[] = {
    {kAA, "ɑ", "A"},   {kAE, "æ", "{"},  {kAH, "ə", "@"}, {kAO, "ɔ", "O"}, {kAW, "aʊ", "aU"}, {kAY, "aɪ", "aI"},
    {kEH, "ɛ", "E"},   {kER, "ɝ", "3`"}, {kEY, "e", "e"}, {kIH, "ɪ", "I"}, {kIY, "i", "i"},   {kOW, "o", "o"},
    {kOY, "ɔɪ", "OI"}, {kUH, "ʊ", "U"},  {kUW, "u", "u"}, {kB, "b", "b"},  {kCH, "tʃ", "tS"}, {kD, "d", "d"},
    {kDH, "ð", "D"},   {kF, "f", "f"},   {kG, "ɡ", "g"},  {kHH, "h", "h"}, {kJH, "dʒ", "dZ"}, {kK, "k", "k"},
    {kL, "l", "l"},    {kM, "m", "m"},   {kN, "n", "n"},  {kNG, "ŋ", "N"}, {kP, "p", "p"},    {kR, "ɹ", "r\\"},
    {kS, "s", "s"},    {kSH, "ʃ", "S"},  {kT, "t", "t"},  {kTH, "θ", "T"}, {kV, "v", "v"},    {kW, "w", "w"},
    {kY, "j", "j"},    {kZ, "z", "z"},   {kZH, "ʒ", "Z"}};

/// A row of phones as a sound: how it looks in English mouths, and how it sounds.
struct Reference {
  Phone phone;
  IpaSound sound;
};

IpaSound ipaSound(std::string_view symbol) {
  const IpaReading reading = readIpa(symbol);
  MOUTHPIECE_EXPECT(reading.sounds.size() == 1);
  return reading.sounds.front();
}

/// Rows of one sound; diphthongs and affricates are put together from these.
struct References {
  std::vector<Reference> seen, heard;
};

const References& references() {
  static const References kAll = [] {
    References all;
    for (const LanguagePhone& row : kWorldInventory) {
      const PhoneRow& phone = rowOf(row.phone);
      if (row.ipa == "aʊ" || row.ipa == "aɪ" || row.ipa == "ɔɪ" || phone.manner == Articulation::kAffricate) continue;
      Reference reference{row.phone, ipaSound(row.ipa)};
      all.heard.push_back(reference);
      // UH, as its viseme has it, is no rounder than AH.
      if (row.phone == kUH) continue;
      const VisemeRow &first = rowOf(phone.first), &last = rowOf(phone.last);
      reference.sound.rounding = std::max(0.0, 0.5 * (first.round + last.round));
      all.seen.push_back(reference);
    }
    return all;
  }();
  return kAll;
}

Phone nearest(const IpaSound& sound, const std::vector<Reference>& among,
              double (*distance)(const IpaSound&, const IpaSound&)) {
  double least = std::numeric_limits<double>::infinity();
  Phone best = kAH;
  for (const Reference& reference : among) {
    const double own = distance(sound, reference.sound);
    if (own < least) std::tie(least, best) = std::pair(own, reference.phone);
  }
  return best;
}

/// `reach`: how far both ends of a diphthong together may be from this one's: [ɛɪ] and [ɐʊ] are near, [ɔʏ] and [iə]
/// not. Around the vowels of "boat" lie [ɐʊ] and others' [eu], [iu] and [ʊu].
struct Diphthong {
  Phone phone;
  std::string_view from, to;
  double reach = 1.1;
};
constexpr Diphthong kDiphthongs[] = {{kAW, "a", "u"}, {kAY, "a", "i"},      {kOY, "ɔ", "i"},      {kEY, "ɛ", "i"},
                                     {kOW, "ɔ", "u"}, {kOW, "o", "ʊ", 0.3}, {kOW, "ə", "ʊ", 0.3}, {kOW, "ə", "u", 0.3}};

std::optional<Phone> diphthongOf(const IpaSound& from, const IpaSound& to) {
  double least = std::numeric_limits<double>::infinity();
  std::optional<Phone> best;
  for (const Diphthong& row : kDiphthongs) {
    const double distance = visibleDistance(from, ipaSound(row.from)) + visibleDistance(to, ipaSound(row.to));
    if (distance < std::min(least, row.reach)) std::tie(least, best) = std::pair(distance, std::optional(row.phone));
  }
  return best;
}

/// Two vowels of one symbol or word that make a diphthong: the second is marked as no syllable, or is a usual end.
bool glides(const IpaSound& from, const IpaSound& to) {
  if (!from.isVowel() || !to.isVowel() || to.stress != 0 || to.length > 1 || from.length > 1) return false;
  return !to.syllabic || (to.height > 0.8 && from.height < to.height);
}

/// Sounds that speakers of English hear otherwise than the nearest by articulation. A judgement: of these only the
/// uvular R was tried by the aligner's times, which it did not change.
struct HeardAs {
  std::string_view ipa;
  Phone phone;
};
constexpr HeardAs kHeardAs[] = {{"ɲ", kN}, {"ʁ", kHH}, {"ɣ", kG}, {"ç", kHH}, {"x", kHH}, {"r", kR}};

/// [ʔ], [h] and their kin have the mouth of what follows.
bool isGlottal(const IpaSound& sound) { return sound.place == Place::kGlottal; }

/// Lips that round while the tongue does something else: a W after it.
bool isLabialised(const IpaSound& sound) {
  return !sound.isVowel() && sound.rounding >= 0.75 && sound.place != Place::kLabialVelar &&
         sound.place != Place::kLabialPalatal && !(sound.sibilant && sound.place == Place::kPostalveolar);
}

SpelledPhone spelled(const IpaSound& sound) {
  const References& rows = references();
  IpaSound tongue = sound;
  if (isLabialised(sound)) tongue.rounding = 0;  // its lips are the W that follows
  SpelledPhone phone{nearest(tongue, rows.seen, visibleDistance), nearest(sound, rows.heard, audibleDistance),
                     sound.symbol, sound.stress};
  const auto heard = std::find_if(std::begin(kHeardAs), std::end(kHeardAs),
                                  [&](const HeardAs& row) { return ipaSound(row.ipa).isMadeLike(sound); });
  if (heard != std::end(kHeardAs)) phone.heard = heard->phone;
  if (isGlottal(sound)) phone.phone = phone.heard = kHH;
  // Lips that come near without touching: the capture has none such; B is the nearest, and lips are told not to touch.
  if (sound.place == Place::kBilabial && !sound.closesLips()) phone.phone = sound.voiced ? kB : kP;
  return phone;
}

/// What a voice writes in a way of its own as IPA, part by part; the rows stand longest first.
std::string usualIpa(std::string_view symbol, const Language& language) {
  std::string ipa;
  while (!symbol.empty()) {
    const auto odd = std::find_if(language.odd_symbols.begin(), language.odd_symbols.end(),
                                  [&](const OddSymbol& row) { return symbol.starts_with(row.written); });
    const bool is_odd = odd != language.odd_symbols.end();
    ipa += is_odd ? odd->ipa : symbol.substr(0, 1);
    symbol.remove_prefix(is_odd ? odd->written.size() : 1);
  }
  return ipa;
}

}  // namespace

std::span<const LanguagePhone> worldInventory() { return kWorldInventory; }

std::vector<SpelledPhone> phonesOfIpa(std::string_view text, std::vector<std::string>& unknown) {
  IpaReading reading = readIpa(text);
  for (std::string& symbol : reading.unknown) {
    if (std::find(unknown.begin(), unknown.end(), symbol) == unknown.end()) unknown.push_back(std::move(symbol));
  }
  std::vector<SpelledPhone> phones;
  const std::vector<IpaSound>& sounds = reading.sounds;
  for (std::size_t i = 0; i < sounds.size(); ++i) {
    const IpaSound* next = i + 1 < sounds.size() ? &sounds[i + 1] : nullptr;
    if (next != nullptr && glides(sounds[i], *next)) {
      if (const auto diphthong = diphthongOf(sounds[i], *next)) {
        phones.push_back({*diphthong, *diphthong, sounds[i].symbol + next->symbol, sounds[i].stress});
        ++i;
        continue;
      }
    }
    if (next != nullptr && sounds[i].opens_affricate && next->sibilant && next->rounding > 0.3) {
      const Phone phone = sounds[i].voiced ? kJH : kCH;
      phones.push_back({phone, phone, sounds[i].symbol + next->symbol, sounds[i].stress});
      ++i;
      continue;
    }
    phones.push_back(spelled(sounds[i]));
    if (isLabialised(sounds[i])) phones.push_back({kW, kW, "w", 0});
  }
  return phones;
}

std::vector<SpelledPhone> phonesOfSymbol(std::string_view symbol, PhoneSet set, const Language& language,
                                         std::vector<std::string>& unknown) {
  const bool has_own = language.inventory.data() != worldInventory().data();
  if (set == PhoneSet::kArpabet || has_own) {
    if (const auto own = phoneFromName(symbol, set, language))
      return {{*own, *own, "", stressOfName(symbol).value_or(0)}};
  }
  if (set == PhoneSet::kArpabet) return {};
  if (set == PhoneSet::kIpa && !language.odd_symbols.empty()) return phonesOfIpa(usualIpa(symbol, language), unknown);
  return phonesOfIpa(set == PhoneSet::kXSampa ? ipaFromXSampa(symbol) : std::string(symbol), unknown);
}

}  // namespace mouthpiece
