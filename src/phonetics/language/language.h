#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "phonetics/language/phone.h"

namespace mouthpiece {

/// How one word can be said.
struct Pronunciation {
  std::vector<Phone> phones;
  std::vector<int> stress;  ///< a value a phone: 0, 1, 2 where a vowel's digit says so, -1 where nothing does
};

/// A phone that a language has. Several names of it have blanks between them; the first is the usual one.
struct LanguagePhone {
  Phone phone = Phone::kSil;    ///< the row that describes it
  std::string_view ipa;         ///< without length, stress, syllable, aspiration and tie marks
  std::string_view x_sampa;     ///< the same
  std::string_view heard_as{};  ///< phones of the acoustic model in turn; empty: the one of the row's name
};

/// An IPA symbol of a voice that no label file of the language has, and the phones said for it (rows' names).
struct VoiceSymbol {
  std::string_view ipa;
  std::string_view phones;
};

/// A sign of a text and what is written for it: ASCII, or words with blanks around them.
struct SpelledSign {
  char32_t sign;
  std::string_view spelled;
};

/// How a text of a language becomes one that its voices can say (speakableText).
struct TextRules {
  std::string_view expected;           ///< for errors: "letters that an English voice reads (Latin script)"
  std::u32string_view own_letters;     ///< kept as they are, besides A to Z and a to z
  std::u32string_view currencies;      ///< of `signs`, those said after the number that they stand before
  std::span<const SpelledSign> signs;  ///< besides dashes and quotes, which are written alike everywhere
};

/// What is known of a language; all that the rest of Mouthpiece asks about one. A constant: everything in it lives as
/// long as the program. Adding one: docs/guides/add_a_language_or_voice.md.
struct Language {
  std::string_view tag;   ///< BCP 47: "en"
  std::string_view name;  ///< "English"
  std::span<const LanguagePhone> inventory;
  std::span<const VoiceSymbol> voice_symbols;
  Phone reduced_vowel = Phone::kAH;  ///< never stressed where another vowel is there
  TextRules text;
  /// Whether these consonants, at least one, can open a syllable.
  bool (*is_legal_onset)(std::span<const Phone> consonants);
  /// The words that are said for `token` of a text, which has digits or signs in it: "25" -> "twenty" "five".
  std::vector<std::string> (*read_out)(std::string_view token);
  /// How a word that no lexicon has is said, by rule; no phones where nothing is known. Thread-safe, as read_out.
  Pronunciation (*pronounce)(std::string_view word);
  /// Folder of the acoustic model and file of the dictionary, within PocketSphinx' folder of models; may be empty.
  std::string_view acoustic_model, dictionary;

  /// nullptr where the language lacks the phone.
  [[nodiscard]] const LanguagePhone* find(Phone phone) const;
};

const Language& english();

/// All that there are, English first.
std::span<const Language* const> languages();

/// The language of a BCP 47 tag in any case ("en", "en-US"): where the whole is unknown, without its last parts.
/// Throws InputError naming the known ones.
const Language& languageOf(std::string_view tag);

/// How the phones of a label file are written. Symbols overlap (D is DH in X-SAMPA), so a file is read in one set.
enum class PhoneSet {
  kArpabet,  ///< and what phoneFromName knows: CMU, TIMIT, Festival radio, MFA's ARPA
  kXSampa,
  kIpa,  ///< MFA's English sets too
};

/// "ARPAbet", "X-SAMPA", "IPA".
std::string_view phoneSetName(PhoneSet set);

/// The set that knows the most of `names`; ARPAbet when in doubt.
PhoneSet likeliestPhoneSet(std::span<const std::string> names, const Language& language = english());

/// In X-SAMPA and IPA, length, stress, syllable, aspiration and tie marks are passed over. nullopt for an unknown
/// symbol.
std::optional<Phone> phoneFromName(std::string_view name, PhoneSet set, const Language& language = english());

}  // namespace mouthpiece
