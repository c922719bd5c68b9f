#include "base/unicode.h"

#include <unicode/locid.h>
#include <unicode/normalizer2.h>
#include <unicode/translit.h>
#include <unicode/uchar.h>
#include <unicode/unistr.h>

#include <memory>

#include "base/errors.h"
#include "base/text_encoding.h"

namespace mouthpiece {
namespace {

bool isAscii(std::string_view text) {
  for (const char c : text) {
    if (static_cast<unsigned char>(c) >= 0x80) return false;
  }
  return true;
}

icu::UnicodeString unicodeOf(std::string_view text) {
  return icu::UnicodeString::fromUTF8(icu::StringPiece(text.data(), static_cast<int32_t>(text.size())));
}

std::string normalised(std::string_view text, const icu::Normalizer2* form) {
  MOUTHPIECE_EXPECT(form != nullptr);
  UErrorCode error = U_ZERO_ERROR;
  std::string out;
  form->normalize(unicodeOf(text), error).toUTF8String(out);
  MOUTHPIECE_EXPECT(U_SUCCESS(error));
  return out;
}

std::string transliterated(std::string_view text, const char* rules) {
  UErrorCode error = U_ZERO_ERROR;
  const std::unique_ptr<icu::Transliterator> made(icu::Transliterator::createInstance(rules, UTRANS_FORWARD, error));
  if (U_FAILURE(error) || !made)
    throw InputError("text", "", std::string("cannot be read in other letters: ICU's data lack ") + rules);
  icu::UnicodeString changed = unicodeOf(text);
  made->transliterate(changed);
  std::string out;
  changed.toUTF8String(out);
  return out;
}

}  // namespace

std::string toNfc(std::string_view text) {
  if (isAscii(text)) return std::string(text);
  UErrorCode error = U_ZERO_ERROR;
  return normalised(text, icu::Normalizer2::getNFCInstance(error));
}

std::string toNfd(std::string_view text) {
  if (isAscii(text)) return std::string(text);
  UErrorCode error = U_ZERO_ERROR;
  return normalised(text, icu::Normalizer2::getNFDInstance(error));
}

std::string toLower(std::string_view text) {
  std::string lower;
  unicodeOf(text).toLower(icu::Locale::getRoot()).toUTF8String(lower);
  return lower;
}

bool isWordSign(char32_t code_point) {
  return u_isalnum(static_cast<UChar32>(code_point)) != 0 || isJoiningMark(code_point);
}

bool isJoiningMark(char32_t code_point) {
  const auto type = u_charType(static_cast<UChar32>(code_point));
  return type == U_NON_SPACING_MARK || type == U_COMBINING_SPACING_MARK || type == U_ENCLOSING_MARK;
}

std::string toAscii(std::string_view text) {
  return isAscii(text) ? std::string(text) : transliterated(toNfc(text), "Latin-ASCII");
}

std::string bareLetters(std::string_view text) {
  std::string folded, bare;
  unicodeOf(toNfd(text)).foldCase().toUTF8String(folded);
  for (std::size_t at = 0; at < folded.size();) {
    const auto c = decodeUtf8(folded, at);
    if (!c) break;
    if (isWordSign(*c) && !isJoiningMark(*c)) appendUtf8(bare, *c);
  }
  return bare;
}

std::string toPinyin(std::string_view text) { return transliterated(text, "Han-Latin"); }

std::string slugOf(std::string_view text, std::size_t longest) {
  std::string slug;
  const std::string apart = lowerCase(toNfd(text));
  for (std::size_t at = 0; at < apart.size() && slug.size() < longest;) {
    const char32_t c = decodeUtf8(apart, at).value_or(' ');
    const bool is_plain = (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9');
    if (is_plain) slug += static_cast<char>(c);
    if (!is_plain && !isJoiningMark(c) && !slug.empty() && slug.back() != '-') slug += '-';
  }
  while (!slug.empty() && slug.back() == '-') slug.pop_back();
  return slug;
}

}  // namespace mouthpiece
