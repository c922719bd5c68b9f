#include "hearing/alignment/lyrics.h"

#include <algorithm>

#include "base/errors.h"
#include "base/files.h"
#include "base/text_encoding.h"

namespace mouthpiece {
namespace {

constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 20U;

/// Letters beyond ASCII are judged by who reads them out.
bool isSpoken(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || (c & 0x80) != 0;
}

}  // namespace

std::string sungText(std::string_view lyrics) {
  std::string sung;
  while (!lyrics.empty()) {
    const std::size_t open = std::min(lyrics.find('['), lyrics.size());
    sung += lyrics.substr(0, open);
    lyrics.remove_prefix(open);
    if (lyrics.empty()) break;
    const std::size_t close = lyrics.find_first_of("]\n");
    const bool is_closed = close != std::string_view::npos && lyrics[close] == ']';
    sung += ' ';
    lyrics.remove_prefix(is_closed ? close + 1 : 1);
  }
  return sung;
}

std::string parseLyrics(std::string_view bytes, std::string_view name) {
  std::string sung = sungText(decodeText(bytes, name));
  if (std::none_of(sung.begin(), sung.end(), isSpoken))
    throw InputError(name, "", "holds no words; expected what is sung, outside of square brackets");
  return sung;
}

std::string readLyrics(const std::filesystem::path& path) {
  return parseLyrics(readFile(path, kMostBytes), path.string());
}

}  // namespace mouthpiece
