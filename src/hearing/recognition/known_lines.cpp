#include "hearing/recognition/known_lines.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/errors.h"
#include "base/index.h"
#include "base/text_encoding.h"

namespace mouthpiece {
namespace {

constexpr std::size_t kMostHintBytes = 1 << 16;

}  // namespace

KnownLines::KnownLines(std::string_view hint, const std::vector<std::string>& known, const Pronouncer& pronouncer) {
  if (hint.size() > kMostHintBytes)
    throw InputError("hint", "", fmt::format("has {} bytes; expected at most 64 KiB", hint.size()));
  if (!hint.empty()) add(hint, pronouncer);
  for (const std::string& line : known) {
    try {
      add(line, pronouncer);
    } catch (const InputError&) {  // a line that cannot be said is none that is said again
    }
  }
  for (const std::vector<std::string>& line : book_.lines) {
    std::string before;
    for (const std::string& word : line) follows_.emplace(std::exchange(before, word), word);
  }
}

void KnownLines::add(std::string_view line, const Pronouncer& pronouncer) {
  std::vector<std::string> words;
  for (const TranscriptWord& word : pronouncer.wordsOf(line)) {
    std::string text = lowerCase(word.text);
    book_.more.push_back({text, word.ways.front().phones});
    words.push_back(std::move(text));
  }
  book_.lines.push_back(std::move(words));
}

double KnownLines::inOrder(const std::vector<std::string>& words) const {
  double known = 0;
  std::string before;
  for (const std::string& word : words) known += follows_.contains({std::exchange(before, word), word}) ? 1 : 0;
  return known / std::max(1.0, asReal(words.size()));
}

}  // namespace mouthpiece
