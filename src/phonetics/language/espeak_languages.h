#pragma once

#include <string_view>
#include <vector>

#include "phonetics/language/language.h"

namespace mouthpiece {

/// The languages that eSpeak NG says for us and that have a row of their own.
const std::vector<Language>& espeakRows();

/// Any other of eSpeak NG's list by its tag or its English name, untuned; nullptr for one that it does not know.
const Language* untunedLanguage(std::string_view lower_case_tag);

/// Whether eSpeak NG gives no usable phones of the language, Cantonese: untunedLanguage() lacks it.
bool isUnusable(std::string_view lower_case_tag);

/// What all languages share that go by IPA: the inventory, onsets by sonority, text of any script.
Language worldLanguage(std::string_view tag, std::string_view name);

}  // namespace mouthpiece
