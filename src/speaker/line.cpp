#include "mouthpiece/line.h"

#include <utility>

#include "hearing/alignment/lyrics.h"

namespace mouthpiece {

Line Line::typed(std::string text) { return {std::move(text), {}, {}, {}, false}; }
Line Line::recorded(std::filesystem::path audio, std::string transcript) {
  return {std::move(transcript), std::move(audio), {}, {}, false};
}
Line Line::labelled(std::filesystem::path audio, std::filesystem::path phones) {
  return {{}, std::move(audio), std::move(phones), {}, false};
}
Line Line::heard(std::filesystem::path audio, std::string hint) {
  return {{}, std::move(audio), {}, {}, false, {}, std::move(hint)};
}
Line Line::timed(std::filesystem::path audio, std::filesystem::path times) {
  return {{}, std::move(audio), {}, {}, false, std::move(times)};
}
Line Line::singing(std::filesystem::path song, std::filesystem::path audio) {
  return {{}, std::move(audio), {}, std::move(song), true};
}
Line Line::sung(std::filesystem::path audio, const std::filesystem::path& lyrics) {
  return {readLyrics(lyrics), std::move(audio), {}, {}, true};
}
Line Line::sungWords(std::filesystem::path audio, std::string_view lyrics) {
  return {parseLyrics(lyrics, "lyrics"), std::move(audio), {}, {}, true};
}

}  // namespace mouthpiece
