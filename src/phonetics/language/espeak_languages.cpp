#include "phonetics/language/espeak_languages.h"

#include <algorithm>

#include "base/text_encoding.h"
#include "base/unicode.h"
#include "phonetics/language/espeak_library.h"

namespace mouthpiece {
namespace {

struct EspeakRow {
  std::string_view tag, name, voice;
  std::span<const OddSymbol> odd_symbols = {};
};

/// Its phone of "durch" has no IPA name in eSpeak NG 1.51.
constexpr OddSymbol kGermanSymbols[] = {{"??", "ʊɐ̯"}};

/// Adding a language: one more row.
constexpr EspeakRow kEspeakRows[] = {
    {"de", "German", "de", kGermanSymbols},
    {"es", "Spanish", "es"},
    {"es-419", "Spanish of Latin America", "es-419"},
    {"fr", "French", "fr-fr"},
    {"it", "Italian", "it"},
    {"pt", "Portuguese", "pt"},
    {"pt-BR", "Portuguese of Brazil", "pt-br"},
    {"pl", "Polish", "pl"},
    {"nl", "Dutch", "nl"},
};

/// How eSpeak NG writes Mandarin's sounds in Pinyin's voice: an h for breath, a dot for a curled tongue.
constexpr OddSymbol kMandarinSymbols[] = {{"ts.h", "ʈʂʰ"}, {"tɕh", "tɕʰ"}, {"tsh", "tsʰ"}, {"ts.", "ʈʂ"}, {"s.", "ʂ"},
                                          {"ph", "pʰ"},    {"th", "tʰ"},   {"kh", "kʰ"},   {"i.", "ɻ̩"},   {"i̪", "z̩"},
                                          {"nɡ", "ŋ"},     {"iɛ", "jɛ"},   {"yɛ", "ɥɛ"},   {"iɑ", "jɑ"},  {"io", "jo"},
                                          {"uo", "wo"},    {"ue", "we"},   {"uɑ", "wɑ"},   {"ər", "ɚ"}};

/// From the mouth's most open to its most shut: what may follow inwards in an onset.
int sonority(Phone phone) {
  switch (rowOf(phone).manner) {
    case Articulation::kApproximant:
      return 4;
    case Articulation::kLateral:
      return 3;
    case Articulation::kNasal:
      return 2;
    case Articulation::kFricative:
    case Articulation::kAspirate:
      return 1;
    default:
      return 0;
  }
}

bool risesInSonority(std::span<const Phone> consonants) {
  if (consonants.size() > 1 && (consonants.front() == Phone::kS || consonants.front() == Phone::kSH))
    consonants = consonants.subspan(1);
  for (std::size_t i = 1; i < consonants.size(); ++i) {
    if (sonority(consonants[i]) < std::max(2, sonority(consonants[i - 1]) + 1)) return false;
  }
  return consonants.front() != Phone::kNG || consonants.size() == 1;
}

std::vector<std::string> asItStands(std::string_view token) { return {std::string(token)}; }
Pronunciation unknownWord(std::string_view) { return {}; }

/// The words and phones of a sentence, as eSpeak NG speaks it in one go: liaison and numbers are in it.
std::vector<SaidWord> sayWithEspeak(std::string_view sentence, const Language& language) {
  const std::string given = language.respell == nullptr ? std::string(sentence) : language.respell(sentence);
  const EspeakSpeech speech =
      speakWithEspeak(language.espeak_voice, given, language.respell == nullptr ? std::string_view() : sentence);
  std::vector<SaidWord> words;
  for (const std::string& word : speech.words) words.push_back({word, {}});
  std::vector<std::string> unknown;
  for (const EspeakEvent& event : speech.events) {
    if (event.symbol.empty() || event.word >= words.size()) continue;
    Pronunciation& said = words[event.word].said;
    std::vector<SpelledPhone> phones = phonesOfSymbol(event.symbol, PhoneSet::kIpa, language, unknown);
    if (phones.empty()) phones.push_back({Phone::kAH, Phone::kAH, event.symbol, 0});  // named in the report
    for (SpelledPhone& phone : phones) {
      said.phones.push_back(phone.phone);
      said.heard.push_back(phone.heard);
      said.stress.push_back(-1);
      said.ipa.push_back(std::move(phone.ipa));
    }
  }
  return words;
}

Language espeakLanguage(std::string_view tag, std::string_view name, std::string_view voice, bool is_tuned) {
  Language language = worldLanguage(tag, name);
  language.say = sayWithEspeak;
  language.text.kept_signs = U"&%+=@$€£¥°§";
  language.text.locale = tag == "pt" ? "pt-PT" : tag;  // CLDR's "pt" is Brazil's
  language.espeak_voice = voice;
  language.is_tuned = is_tuned;
  return language;
}

}  // namespace

Language worldLanguage(std::string_view tag, std::string_view name) {
  return {.tag = tag,
          .name = name,
          .inventory = worldInventory(),
          .voice_symbols = {},
          .text = {.expected = "letters of any script",
                   .own_letters = {},
                   .currencies = {},
                   .signs = {},
                   .any_letters = true},
          .is_legal_onset = risesInSonority,
          .read_out = asItStands,
          .pronounce = unknownWord,
          .acoustic_model = "en-us/en-us",
          .dictionary = {}};
}

const std::vector<Language>& espeakRows() {
  static const std::vector<Language> kAll = [] {
    std::vector<Language> all;
    for (const EspeakRow& row : kEspeakRows) {
      all.push_back(espeakLanguage(row.tag, row.name, row.voice, true));
      all.back().odd_symbols = row.odd_symbols;
    }
    Language mandarin = espeakLanguage("zh", "Mandarin", "cmn-latn-pinyin", false);
    mandarin.respell = toPinyin;
    mandarin.text.kept_signs = {};  // the voice of Pinyin knows none
    mandarin.text.locale = {};
    mandarin.odd_symbols = kMandarinSymbols;
    all.push_back(mandarin);
    return all;
  }();
  return kAll;
}

bool isUnusable(std::string_view lower_case_tag) { return lower_case_tag.substr(0, lower_case_tag.find('-')) == "yue"; }

const Language* untunedLanguage(std::string_view lower_case_tag) {
  static const std::vector<Language> kAll = [] {
    std::vector<Language> all;
    for (const EspeakLanguage& row : espeakLanguages()) {
      if (!row.tag.starts_with("en") && row.tag != "ja" && row.tag != "cmn" && !isUnusable(row.tag))
        all.push_back(espeakLanguage(row.tag, row.name, row.tag, false));
    }
    return all;
  }();
  const auto found = std::find_if(kAll.begin(), kAll.end(), [&](const Language& known) {
    return lowerCase(known.tag) == lower_case_tag || lowerCase(known.name) == lower_case_tag;
  });
  return found == kAll.end() ? nullptr : &*found;
}

}  // namespace mouthpiece
