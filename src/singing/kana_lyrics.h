#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "singing/song.h"

namespace mouthpiece {

/// The kana of a lyric, as it is written, without what vocal synthesizers write around it: "a か" and "か↑" are か.
/// "" for a lyric without kana, and for ー alone, which goes on with the vowel before.
std::string kanaOf(std::string_view lyric);

/// Whether a lyric has any sign of kana, ー alone too.
bool hasKanaSigns(std::string_view lyric);

/// Whether a lyric has signs that are no kana and must be read to be sung (ideographs).
bool hasIdeographs(std::string_view lyric);

/// Gives words in kana their sounds: ん and っ by the word that follows without a rest. A word of っ alone is the
/// closing before the next one, and a rest.
void sayKana(std::vector<SongWord>& words);

}  // namespace mouthpiece
