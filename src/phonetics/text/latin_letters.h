#pragma once

#include <string_view>

namespace mouthpiece {

/// The ASCII letters that stand for a Latin letter with marks, a ligature or a special letter: U+00E9 -> "e", U+00DF ->
/// "ss". Empty for everything else, letters that no plain letter stands for included.
std::string_view plainLatinLetters(char32_t code_point);

}  // namespace mouthpiece
