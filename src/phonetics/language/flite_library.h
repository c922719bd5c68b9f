#pragma once

#include <mutex>
#include <string>
#include <string_view>
#include <vector>

struct cst_voice_struct;

namespace mouthpiece {

/// Flite's library keeps its voices in global variables: whoever calls it holds this.
std::mutex& fliteLock();

/// One of the voices linked into the program (slt, rms, awb, kal16), alive as long as it; nullptr for another name. The
/// caller holds fliteLock().
cst_voice_struct* fliteVoice(std::string_view name);

/// Flite's names of the phones of a word in lower case, from its dictionary or its letter-to-sound rules, with stress;
/// none when it has none. Thread-safe.
std::vector<std::string> flitePhones(const std::string& word);

/// The words that Flite says for `token` of a line of text: "25" -> "twenty" "five". Thread-safe.
std::vector<std::string> fliteWords(std::string_view token);

}  // namespace mouthpiece
