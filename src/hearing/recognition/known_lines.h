#pragma once

#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "hearing/alignment/pronouncer.h"
#include "hearing/recognition/sound_search.h"

namespace mouthpiece {

/// Lines that may be said.
class KnownLines {
 public:
  /// UTF-8, hostile. Lines that cannot be said are left out.
  KnownLines(const std::vector<std::string>& lines, const Pronouncer& pronouncer);
  /// The words and phrases of a hint, a line each: `,`, `;` and ends of lines part them. UTF-8, hostile; "" has none.
  /// Throws InputError where it is too long or cannot be said.
  static KnownLines ofHint(std::string_view hint, const Pronouncer& pronouncer);

  [[nodiscard]] const PhraseBook& book() const { return book_; }
  /// The share of the pairs of words that follow each other in the lines, too; where a line begins is one.
  [[nodiscard]] double inOrder(const std::vector<std::string>& words) const;

 private:
  PhraseBook book_;
  std::set<std::pair<std::string, std::string>> follows_;  ///< words that follow each other
};

}  // namespace mouthpiece
