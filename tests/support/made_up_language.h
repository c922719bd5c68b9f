#pragma once

#include <array>

#include "phonetics/language/language.h"

namespace mouthpiece {

/// A language of nine phones, two of which English lacks and hears as others: what one page of a new language says.
inline const Language& madeUpLanguage() {
  static constexpr std::array kInventory = {
      LanguagePhone{Phone::kAA, "a", "a"},     LanguagePhone{Phone::kOW, "o", "o", "AO"},
      LanguagePhone{Phone::kUW, "ø y", "2 y"}, LanguagePhone{Phone::kM, "m", "m"},
      LanguagePhone{Phone::kP, "p", "p"},      LanguagePhone{Phone::kT, "t", "t"},
      LanguagePhone{Phone::kK, "k q", "k"},    LanguagePhone{Phone::kCH, "ts", "ts", "T S"},
      LanguagePhone{Phone::kS, "s", "s"},
  };
  static constexpr std::array kSigns = {SpelledSign{'&', " un "}, SpelledSign{0x20B9, " rupi "}};
  static constexpr Language kLanguage{
      .tag = "x-tok",
      .name = "Tokish",
      .inventory = kInventory,
      .voice_symbols = {},
      .reduced_vowel = Phone::kAA,
      .text = {.expected = "Tokish letters", .own_letters = U"öÖ", .currencies = U"\u20B9", .signs = kSigns},
      .is_legal_onset = [](std::span<const Phone> consonants) { return consonants.size() == 1; },
      .read_out = [](std::string_view token) -> std::vector<std::string> {
        std::vector<std::string> words;
        for (const char c : token) {  // punctuation comes along
          if (c >= '0' && c <= '9') words.emplace_back(c == '3' ? "tok" : "pa");
        }
        return words;
      },
      .pronounce = [](std::string_view) { return Pronunciation{}; },
      .acoustic_model = "en-us/en-us",
      .dictionary = {},
  };
  return kLanguage;
}

inline constexpr std::string_view kMadeUpLexicon = "tok t o k\nmö m ø\npa p a\ntsa ts a\nmap m a p\nmats m a ts\n";

}  // namespace mouthpiece
