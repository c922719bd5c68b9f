#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace mouthpiece {

/// What a file is that is no text, by how it begins: "a sound (WAV)", "a corpus or another database". Empty for what is
/// none of those that are known, as all text is.
std::string_view kindOfNoText(std::string_view bytes);
/// Throws InputError for what kindOfNoText() knows: "is a sound (WAV); expected EXPECTED".
void expectText(std::string_view bytes, std::string_view file, std::string_view expected);

/// Text of a file as UTF-8: UTF-16 when it starts with its byte order mark, UTF-8 when it is that (its mark is taken
/// off), else Windows-1252, which has Latin-1's letters. Throws InputError for broken UTF-16 and for what is known not
/// to be text.
std::string decodeText(std::string_view bytes, std::string_view file);

/// The code point that starts at `offset`, which moves behind it; nullopt for broken UTF-8 (overlong and surrogates
/// too).
std::optional<char32_t> decodeUtf8(std::string_view text, std::size_t& offset);

void appendUtf8(std::string& out, char32_t code_point);

/// What stands between blanks and control characters (ASCII's).
std::vector<std::string> blankSeparated(std::string_view text);

/// A to Z become a to z; everything else stays.
std::string lowerCase(std::string_view text);

/// `text` between the tags of an XML file: &, < and > as entities.
std::string xmlEscaped(std::string_view text);

}  // namespace mouthpiece
