#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "phonetics/language/ipa.h"
#include "phonetics/language/phone.h"

namespace mouthpiece {

/// How one word can be said.
struct Pronunciation {
  std::vector<Phone> phones;
  std::vector<int> stress;            ///< a value a phone: 0, 1, 2 where a vowel's digit says so, -1 where nothing does
  std::vector<Phone> heard = {};      ///< a phone's nearest for an English ear (the acoustic model); none: `phones`
  std::vector<std::string> ipa = {};  ///< a symbol a phone; none: the phones' own names
};

/// How the phones of a label file are written. Symbols overlap (D is DH in X-SAMPA), so a file is read in one set.
enum class PhoneSet {
  kArpabet,  ///< and what phoneFromName knows: CMU, TIMIT, Festival radio, MFA's ARPA
  kXSampa,
  kIpa,  ///< MFA's English sets too
};

/// A sound of IPA as the phones at hand can show it and hear it.
struct SpelledPhone {
  Phone phone = Phone::kSil;  ///< whose mouth is the nearest
  Phone heard = Phone::kSil;  ///< whose sound is the nearest
  std::string ipa;            ///< as it is written; "" where it is the phone itself
  int stress = 0;             ///< marked before it
};

/// A word of a line and how it is said there.
struct SaidWord {
  std::string text;
  Pronunciation said;
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

/// A symbol that a voice writes in a way of its own, and its IPA.
struct OddSymbol {
  std::string_view written, ipa;
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
  bool any_letters = false;            ///< letters and marks of every script are kept as they are (NFC)
  std::u32string_view kept_signs{};    ///< that the voices themselves read aloud
  std::string_view locale{};           ///< in which ICU says amounts; "": the rules below do
  /// A text whose letters are plain with its numbers, abbreviations and the like as words; `is_known` says of a word
  /// that it stays as it is, and may be empty. nullptr: the voices say them.
  std::string (*in_words)(std::string_view text, const std::function<bool(std::string_view)>& is_known) = nullptr;
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
  /// How the words of a sentence are said in it, by an engine that knows the language; nullptr: word by word, by
  /// lexicon, dictionary and `pronounce`. Numbers are words. Thread-safe. Throws InputError when the engine is not
  /// installed.
  std::vector<SaidWord> (*say)(std::string_view sentence, const Language& language) = nullptr;
  std::string_view espeak_voice = {};                  ///< eSpeak NG's name of the language; "": it does not speak it
  std::string (*respell)(std::string_view) = nullptr;  ///< what eSpeak NG is given for a text; nullptr: the text
  std::span<const OddSymbol> odd_symbols = {};         ///< of that voice
  bool is_tuned = true;                                ///< its times and lips were measured (docs/guides/languages.md)

  /// nullptr where the language lacks the phone.
  [[nodiscard]] const LanguagePhone* find(Phone phone) const;
};

const Language& english();
const Language& japanese();

/// Those that were tried and measured, English first.
std::span<const Language* const> languages();

/// The language of a tag or a locale, as plainTag() takes them: where the whole is unknown, without its last parts; or
/// of a language's name in English, or in itself ("German", "Deutsch"). Any language that eSpeak NG has is one, though
/// `is_tuned` is false. Throws InputError naming the tuned ones.
const Language& languageOf(std::string_view tag);

/// The phones of a text in IPA, in the order that they are said: a sound's own row where there is one, else the nearest
/// by articulation. Where neither shows or says the whole, several: "pf" is P F, "kʷ" K W. Symbols that no row
/// describes are added to `unknown`.
std::vector<SpelledPhone> phonesOfIpa(std::string_view text, std::vector<std::string>& unknown);

/// The same of a symbol of a set: by the inventory of a language that has one of its own (English), else, and for what
/// that lacks, by articulation.
std::vector<SpelledPhone> phonesOfSymbol(std::string_view symbol, PhoneSet set, const Language& language,
                                         std::vector<std::string>& unknown);

/// The rows of phones with the IPA that they stand for: what a language without an inventory of its own goes by.
std::span<const LanguagePhone> worldInventory();

/// "ARPAbet", "X-SAMPA", "IPA".
std::string_view phoneSetName(PhoneSet set);

/// The set that knows the most of `names`; ARPAbet when in doubt.
PhoneSet likeliestPhoneSet(std::span<const std::string> names, const Language& language = english());

/// In X-SAMPA and IPA, length, stress, syllable, aspiration and tie marks are passed over. nullopt for an unknown
/// symbol, and for one that is said as two.
std::optional<Phone> phoneFromName(std::string_view name, PhoneSet set, const Language& language = english());

}  // namespace mouthpiece
