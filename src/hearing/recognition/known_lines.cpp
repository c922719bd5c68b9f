#include "hearing/recognition/known_lines.h"

#include <fmt/format.h>

#include <algorithm>
#include <tuple>

#include "base/errors.h"
#include "base/index.h"
#include "base/text_encoding.h"

namespace mouthpiece {
namespace {

constexpr std::size_t kMostHintBytes = 1 << 16;

}  // namespace

KnownLines::KnownLines(const std::vector<std::string>& lines, const Pronouncer& pronouncer) {
  for (const std::string& line : lines) {
    std::vector<std::string> words;
    try {
      for (const TranscriptWord& word : pronouncer.wordsOf(line)) {
        words.push_back(lowerCase(word.text));
        book_.more.push_back({words.back(), word.ways.front().phones});
      }
    } catch (const InputError&) {  // a line that cannot be said is none that is said again
      continue;
    }
    std::string before;
    for (const std::string& word : words) follows_.emplace(std::exchange(before, word), word);
    book_.lines.push_back(std::move(words));
  }
}

KnownLines KnownLines::ofHint(std::string_view hint, const Pronouncer& pronouncer) {
  if (hint.size() > kMostHintBytes)
    throw InputError("hint", "", fmt::format("has {} bytes; expected at most 64 KiB", hint.size()));
  std::vector<std::string> phrases;
  if (!hint.empty()) {
    try {
      std::ignore = pronouncer.wordsOf(hint);
    } catch (const InputError& error) {  // what cannot be said is the hint's, not a text's
      constexpr std::string_view kText = "text:";
      const std::string message = error.what();
      if (!message.starts_with(kText)) throw;
      throw InputError("hint:" + message.substr(kText.size()));
    }
    phrases.emplace_back();
  }
  for (std::size_t i = 0; i < hint.size(); ++i) {
    const bool is_last_of_word = i + 1 == hint.size() || hint[i + 1] == ' ' || hint[i + 1] == '\n';
    if (hint[i] == '\n' || hint[i] == ';' || (hint[i] == ',' && is_last_of_word)) {
      phrases.emplace_back();
    } else {
      phrases.back() += hint[i];
    }
  }
  return {phrases, pronouncer};
}

double KnownLines::inOrder(const std::vector<std::string>& words) const {
  double known = 0;
  std::string before;
  for (const std::string& word : words) known += follows_.contains({std::exchange(before, word), word}) ? 1 : 0;
  return known / std::max(1.0, asReal(words.size()));
}

}  // namespace mouthpiece
