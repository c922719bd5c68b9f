#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>

#include "phonetics/labels/label_entries.h"

namespace mouthpiece {

/// Reads a Praat TextGrid (docs/formats/textgrid.md): long or short text, UTF-8, UTF-16 with its mark, or Windows-1252.
/// Needs a tier `phones` (or `phonemes`, `phone`, `segments`, "NAME - phones"); a tier `words` and one `syllables`,
/// whose text is the stress, are used when there. Throws InputError naming file and line for what is no TextGrid,
/// intervals that run backwards or overlap, and phones that are not ARPAbet.
SpeechLabels readTextGrid(const std::filesystem::path& path, const Language& language = english());
/// The same from memory; `name` stands for the file in messages.
SpeechLabels parseTextGrid(std::string_view bytes, std::string_view name, const Language& language = english());

/// By its first bytes, whatever its encoding.
bool isTextGrid(std::string_view bytes);

/// The entries of its tiers as they stand there, times from the file's start on; none of a tier that is missing.
LabelTiers parseTextGridTiers(std::string_view bytes, std::string_view name);

/// The names of all its tiers, printable.
std::vector<std::string> tierNames(std::string_view bytes, std::string_view name);

/// Long text, UTF-8, tiers `words`, `phones`, `syllables`; atomically. `confidence`: of each phone, 0 to 1, for a tier
/// `confidence`; empty: none.
void writeTextGrid(const std::filesystem::path& path, const SpeechLabels& labels,
                   std::span<const double> confidence = {});
std::string formatTextGrid(const SpeechLabels& labels, std::span<const double> confidence = {});

}  // namespace mouthpiece
