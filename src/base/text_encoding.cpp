#include "base/text_encoding.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "base/errors.h"

namespace mouthpiece {
namespace {

constexpr bool isSurrogate(char32_t unit) { return unit >= 0xD800 && unit < 0xE000; }

std::string decodeUtf16(std::string_view bytes, bool is_big_endian, std::string_view file) {
  if (bytes.size() % 2 != 0) throw InputError(file, "", "is UTF-16 with half a character at its end");
  const auto unitAt = [&](std::size_t i) -> char32_t {
    const auto first = static_cast<unsigned char>(bytes[i]);
    const auto second = static_cast<unsigned char>(bytes[i + 1]);
    return is_big_endian ? (char32_t{first} << 8U) | second : (char32_t{second} << 8U) | first;
  };
  std::string out;
  for (std::size_t i = 2; i < bytes.size(); i += 2) {
    char32_t code_point = unitAt(i);
    if (isSurrogate(code_point)) {
      const char32_t low = i + 3 < bytes.size() ? unitAt(i + 2) : 0;
      if (code_point >= 0xDC00 || low < 0xDC00 || low >= 0xE000) {
        throw InputError(file, fmt::format("byte {}", i), "found half a UTF-16 surrogate pair");
      }
      code_point = 0x10000 + ((code_point - 0xD800) << 10U) + (low - 0xDC00);
      i += 2;
    }
    appendUtf8(out, code_point);
  }
  return out;
}

/// What a byte stands for that is no part of UTF-8: by Windows-1252, which has 27 signs where Latin-1 has controls.
char32_t windowsSign(unsigned char byte) {
  constexpr std::array<char16_t, 32> kFrom80{0x20AC, 0,      0x201A, 0x0192, 0x201E, 0x2026, 0x2020, 0x2021,
                                             0x02C6, 0x2030, 0x0160, 0x2039, 0x0152, 0,      0x017D, 0,
                                             0,      0x2018, 0x2019, 0x201C, 0x201D, 0x2022, 0x2013, 0x2014,
                                             0x02DC, 0x2122, 0x0161, 0x203A, 0x0153, 0,      0x017E, 0x0178};
  const char32_t sign = byte >= 0x80 && byte < 0xA0 ? char32_t{kFrom80[byte - 0x80U]} : 0;
  return sign != 0 ? sign : byte;
}

bool isUtf8(std::string_view text) {
  for (std::size_t i = 0; i < text.size();) {
    if (!decodeUtf8(text, i)) return false;
  }
  return true;
}

}  // namespace

std::optional<char32_t> decodeUtf8(std::string_view text, std::size_t& offset) {
  const auto byteAt = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned lead = byteAt(offset);
  if (lead < 0x80) {
    ++offset;
    return lead;
  }
  const std::size_t length = lead >= 0xC2 && lead < 0xE0   ? 2
                             : (lead >> 4U) == 0xE         ? 3
                             : lead >= 0xF0 && lead < 0xF5 ? 4
                                                           : 0;
  if (length == 0 || length > text.size() - offset) return std::nullopt;
  char32_t code_point = lead & (0x7FU >> length);
  for (std::size_t i = 1; i < length; ++i) {
    const unsigned byte = byteAt(offset + i);
    if ((byte & 0xC0U) != 0x80U) return std::nullopt;
    code_point = (code_point << 6U) | (byte & 0x3FU);
  }
  constexpr char32_t kSmallest[] = {0, 0, 0x80, 0x800, 0x10000};
  if (code_point < kSmallest[length] || isSurrogate(code_point) || code_point > 0x10FFFF) return std::nullopt;
  offset += length;
  return code_point;
}

void appendUtf8(std::string& out, char32_t code_point) {
  const auto put = [&](char32_t byte) { out.push_back(static_cast<char>(byte)); };
  const auto tail = [&](unsigned shift) { put(0x80U | ((code_point >> shift) & 0x3FU)); };
  if (code_point < 0x80) {
    put(code_point);
  } else if (code_point < 0x800) {
    put(0xC0U | (code_point >> 6U));
    tail(0);
  } else if (code_point < 0x10000) {
    put(0xE0U | (code_point >> 12U));
    tail(6);
    tail(0);
  } else {
    put(0xF0U | (code_point >> 18U));
    tail(12);
    tail(6);
    tail(0);
  }
}

std::string_view kindOfNoText(std::string_view bytes) {
  using namespace std::string_view_literals;
  struct Sign {
    std::string_view begin, kind;  ///< a question mark stands for any byte
  };
  constexpr Sign kSigns[] = {{"RIFF????WAVE"sv, "a sound (WAV)"},
                             {"RF64????WAVE"sv, "a sound (WAV)"},
                             {"RIFF????AVI "sv, "a film (AVI)"},
                             {"RIFF????WEBP"sv, "a picture (WebP)"},
                             {"FORM????AIF"sv, "a sound (AIFF)"},
                             {".snd\0"sv, "a sound (AU)"},
                             {"fLaC\0"sv, "a sound (FLAC)"},
                             {"OggS\0"sv, "a sound (Ogg)"},
                             {"ID3\2"sv, "a sound (MP3)"},
                             {"ID3\3"sv, "a sound (MP3)"},
                             {"ID3\4"sv, "a sound (MP3)"},
                             {"\xFF\xFB"sv, "a sound (MP3)"},
                             {"\xFF\xF3"sv, "a sound (MP3)"},
                             {"\0\0\0?ftyp"sv, "a sound or a film (MPEG-4)"},
                             {"\x1A\x45\xDF\xA3"sv, "a sound or a film (Matroska, WebM)"},
                             {"MThd\0"sv, "a song (MIDI)"},
                             {"\x89PNG"sv, "a picture (PNG)"},
                             {"\xFF\xD8\xFF"sv, "a picture (JPEG)"},
                             {"GIF8?a"sv, "a picture (GIF)"},
                             {"%PDF-"sv, "a PDF"},
                             {"PK\3\4"sv, "a ZIP archive, as files of Word and LibreOffice and packed MusicXML are"},
                             {"\x1F\x8B"sv, "a gzip archive"},
                             {"\xD0\xCF\x11\xE0"sv, "a file of an older Office"},
                             {"SQLite format 3\0"sv, "a corpus or another database"},
                             {"[\0\0\0\0"sv, "a face, as `retarget fit` makes them"},
                             {"\2P"sv, "a motion capture (C3D)"},
                             {"glTF?\0"sv, "a head (GLB)"},
                             {"Kaydara FBX Binary"sv, "a scene (FBX)"}};
  for (const auto& [begin, kind] : kSigns) {
    const std::string_view found = bytes.substr(0, begin.size());
    if (std::equal(begin.begin(), begin.end(), found.begin(), found.end(),
                   [](char sign, char byte) { return sign == '?' || sign == byte; }))
      return kind;
  }
  return {};
}

void expectText(std::string_view bytes, std::string_view file, std::string_view expected) {
  if (const std::string_view kind = kindOfNoText(bytes); !kind.empty())
    throw InputError(file, "", fmt::format("is {}; expected {}", kind, expected));
}

std::string decodeText(std::string_view bytes, std::string_view file) {
  expectText(bytes, file, "text");
  if (bytes.starts_with("\xFE\xFF")) return decodeUtf16(bytes, true, file);
  if (bytes.starts_with("\xFF\xFE")) return decodeUtf16(bytes, false, file);
  if (bytes.starts_with("\xEF\xBB\xBF")) bytes.remove_prefix(3);
  if (isUtf8(bytes)) return std::string(bytes);
  std::string out;
  for (const char c : bytes) appendUtf8(out, windowsSign(static_cast<unsigned char>(c)));
  return out;
}

std::vector<std::string> blankSeparated(std::string_view text) {
  std::vector<std::string> parts;
  bool goes_on = false;
  for (const char c : text) {
    const bool is_blank = static_cast<unsigned char>(c) <= ' ' || c == 0x7F;
    if (!is_blank && !goes_on) parts.emplace_back();
    if (!is_blank) parts.back().push_back(c);
    goes_on = !is_blank;
  }
  return parts;
}

std::string lowerCase(std::string_view text) {
  std::string lower(text);
  std::transform(lower.begin(), lower.end(), lower.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
  return lower;
}

std::string xmlEscaped(std::string_view text) {
  std::string escaped;
  for (const char c : text) escaped += c == '&' ? "&amp;" : c == '<' ? "&lt;" : c == '>' ? "&gt;" : std::string(1, c);
  return escaped;
}

}  // namespace mouthpiece
