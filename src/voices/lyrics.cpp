#include "voices/lyrics.h"

#include <algorithm>

namespace mouthpiece {

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

}  // namespace mouthpiece
