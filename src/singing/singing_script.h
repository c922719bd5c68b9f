#pragma once

#include <string>
#include <vector>

#include "singing/singing_voice.h"

namespace mouthpiece {

/// The words with as many syllables as Festival gives them: too many tones end in the last syllable, too few are
/// parted.
std::vector<SungWord> fitSyllables(std::vector<SungWord> words, const std::vector<std::size_t>& syllable_counts);

/// What Festival's singing mode reads: one frequency and length a tone, a row of short ones where there is vibrato.
std::string singingXml(const std::vector<SungWord>& words, Seconds first_rest, const SungVibrato& vibrato);

/// Throws InputError for words that are not letters and apostrophes, tones no voice sings, and songs that are too long.
void checkSungWords(const std::vector<SungWord>& words, Seconds first_rest);

}  // namespace mouthpiece
