#pragma once

#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "hearing/alignment/pronouncer.h"
#include "hearing/recognition/sound_search.h"

namespace mouthpiece {

/// Lines that may be said: a hint's, whose words are meant, and a corpus' own.
class KnownLines {
 public:
  /// UTF-8, hostile. Throws InputError where the hint is too long or cannot be said; known lines that cannot are left
  /// out.
  KnownLines(std::string_view hint, const std::vector<std::string>& known, const Pronouncer& pronouncer);

  [[nodiscard]] const PhraseBook& book() const { return book_; }
  /// The share of the pairs of words that follow each other in the lines, too; where a line begins is one.
  [[nodiscard]] double inOrder(const std::vector<std::string>& words) const;

 private:
  void add(std::string_view line, const Pronouncer& pronouncer);

  PhraseBook book_;
  std::set<std::pair<std::string, std::string>> follows_;  ///< words that follow each other
};

}  // namespace mouthpiece
