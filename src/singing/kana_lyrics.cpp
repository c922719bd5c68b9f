#include "singing/kana_lyrics.h"

#include <algorithm>
#include <optional>

#include "base/index.h"
#include "base/text_encoding.h"
#include "phonetics/language/kana.h"

namespace mouthpiece {
namespace {

constexpr char32_t kLongVowel = 0x30FC;  // ー
constexpr Seconds kNoRest = 1e-3;        // between words that follow each other

/// From ぁ to ゖ and from ァ to ヺ, and ー.
bool isKanaSign(char32_t sign) {
  return (sign >= 0x3041 && sign <= 0x3096) || (sign >= 0x30A1 && sign <= 0x30FA) || sign == kLongVowel;
}

bool isSmallTsu(std::string_view text) { return text == "っ" || text == "ッ"; }
bool endsInSmallTsu(std::string_view text) { return text.ends_with("っ") || text.ends_with("ッ"); }

}  // namespace

std::string kanaOf(std::string_view lyric) {
  std::string kana;
  bool is_sung = false;
  for (std::size_t at = 0; at < lyric.size();) {
    const std::optional<char32_t> sign = decodeUtf8(lyric, at);
    if (!sign) return "";
    if (!isKanaSign(*sign)) continue;
    appendUtf8(kana, *sign);
    is_sung |= *sign != kLongVowel;
  }
  return is_sung ? kana : "";
}

bool hasKanaSigns(std::string_view lyric) {
  for (std::size_t at = 0; at < lyric.size();) {
    const std::optional<char32_t> sign = decodeUtf8(lyric, at);
    if (!sign) return false;
    if (isKanaSign(*sign)) return true;
  }
  return false;
}

bool hasIdeographs(std::string_view lyric) {
  for (std::size_t at = 0; at < lyric.size();) {
    const std::optional<char32_t> sign = decodeUtf8(lyric, at);
    if (!sign) return false;
    if (*sign == 0x3005 || (*sign >= 0x3400 && *sign <= 0x9FFF) || (*sign >= 0x20000 && *sign <= 0x3FFFF)) return true;
  }
  return false;
}

void sayKana(std::vector<SongWord>& words) {
  const auto goesOn = [&](std::size_t i) {
    return i + 1 < words.size() && words[i + 1].span().start - words[i].end() < kNoRest &&
           !kanaOf(words[i + 1].text).empty();
  };
  bool is_closed = false;  // a っ stands before
  for (std::size_t i = 0; i < words.size(); ++i) {
    SongWord& word = words[i];
    if (kanaOf(word.text).empty()) {
      is_closed = false;
      continue;
    }
    const std::string own = (is_closed ? "ッ" : "") + word.text;
    is_closed = endsInSmallTsu(word.text) && goesOn(i);
    const std::size_t phones = pronounceKana(own).phones.size();
    word.said = pronounceKana(goesOn(i) ? own + words[i + 1].text : own);
    for (auto* values : {&word.said.phones, &word.said.heard}) values->resize(std::min(values->size(), phones));
    word.said.stress.resize(word.said.phones.size());
    word.said.ipa.resize(word.said.phones.size());
  }
  std::erase_if(words, [](const SongWord& word) { return isSmallTsu(word.text); });
}

}  // namespace mouthpiece
