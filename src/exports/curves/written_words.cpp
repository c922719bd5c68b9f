#include "exports/curves/written_words.h"

#include <algorithm>
#include <cstdint>
#include <map>
#include <span>
#include <utility>

#include "base/text_encoding.h"
#include "base/unicode.h"

namespace mouthpiece {
namespace {

/// Parts of the text that are said as others of the words, from `first` to before `end`.
struct Range {
  std::size_t first, end;
  [[nodiscard]] std::size_t size() const { return end - first; }
};
struct Counterpart {
  Range written, spoken;
};

/// The longest common subsequence of `written` and `spoken`, whose elements are equal where they are the same word (0:
/// no word): counterparts of one word each, and between them what is left of both.
std::vector<Counterpart> counterparts(std::span<const int> written, std::span<const int> spoken) {
  const std::size_t columns = spoken.size() + 1;
  std::vector<std::uint16_t> longest((written.size() + 1) * columns, 0);  // of what follows
  for (std::size_t w = written.size(); w-- > 0;) {
    for (std::size_t s = spoken.size(); s-- > 0;) {
      longest[w * columns + s] = written[w] == spoken[s] && written[w] != 0
                                     ? static_cast<std::uint16_t>(longest[(w + 1) * columns + s + 1] + 1)
                                     : std::max(longest[(w + 1) * columns + s], longest[w * columns + s + 1]);
    }
  }
  std::vector<Counterpart> found;
  Counterpart between{};
  const auto close = [&] {
    if (between.written.size() + between.spoken.size() > 0) found.push_back(between);
  };
  for (std::size_t w = 0, s = 0; w < written.size() && s < spoken.size();) {
    if (written[w] == spoken[s] && written[w] != 0) {
      close();
      found.push_back({{w, w + 1}, {s, s + 1}});
      ++w, ++s;
      between = {{w, w}, {s, s}};
    } else if (longest[(w + 1) * columns + s] >= longest[w * columns + s + 1]) {
      between.written.end = ++w;
    } else {
      between.spoken.end = ++s;
    }
  }
  between.written.end = written.size();
  between.spoken.end = spoken.size();
  close();
  return found;
}

/// The same of texts of any length, a stretch after the other: each goes on behind a word that both have.
std::vector<Counterpart> counterpartsOfStretches(std::span<const int> written, std::span<const int> spoken) {
  constexpr std::size_t kWritten = 600, kSpoken = 900, kTrusted = 450;  // words
  std::vector<Counterpart> all;
  for (std::size_t w = 0, s = 0;;) {
    const bool is_last = written.size() - w <= kWritten && spoken.size() - s <= kSpoken;
    std::vector<Counterpart> found = counterparts(written.subspan(w, std::min(kWritten, written.size() - w)),
                                                  spoken.subspan(s, std::min(kSpoken, spoken.size() - s)));
    const auto is_both = [&](const Counterpart& part) {
      return part.written.size() == 1 && part.spoken.size() == 1 && part.written.end <= kTrusted &&
             written[w + part.written.first] == spoken[s + part.spoken.first];
    };
    if (!is_last) found.erase(std::find_if(found.rbegin(), found.rend(), is_both).base(), found.end());
    for (const auto& [of_text, of_words] : found)
      all.push_back({{w + of_text.first, w + of_text.end}, {s + of_words.first, s + of_words.end}});
    if (is_last) return all;
    if (found.empty()) break;
    w = all.back().written.end, s = all.back().spoken.end;
  }
  const std::size_t end = all.empty() ? 0 : all.back().spoken.end;
  all.push_back({{written.size(), written.size()}, {end, spoken.size()}});  // they have no word in common
  return all;
}

std::string joined(const std::vector<std::string>& parts, Range range) {
  std::string all;
  for (std::size_t i = range.first; i < range.end; ++i) all.append(all.empty() ? "" : " ").append(parts[i]);
  return all;
}

}  // namespace

std::vector<WrittenWord> writtenWords(const SpeechLabels& labels, std::string_view text) {
  constexpr std::size_t kMostAtOnce = 42;  ///< bytes of one that stands for several words
  std::vector<WrittenWord> spoken;
  for (const LabelledWord& word : labels.words) {
    if (!word.text.empty()) spoken.push_back({labels.spanOf(word.phones), word.text});
  }
  const std::vector<std::string> parts = blankSeparated(text);
  if (parts.empty()) return spoken;

  std::map<std::string, int> numbers{{"", 0}};
  const auto numberOf = [&](const std::string& word) {
    return numbers.try_emplace(bareLetters(word), static_cast<int>(numbers.size())).first->second;
  };
  std::vector<int> written_numbers, spoken_numbers;
  for (const std::string& part : parts) written_numbers.push_back(numberOf(part));
  for (const WrittenWord& word : spoken) spoken_numbers.push_back(numberOf(word.text));

  std::vector<WrittenWord> words;
  std::string lead;  // signs before the first word
  const auto add = [&](const TimeSpan& span, const std::string& said) {
    words.push_back({span, lead.empty() ? said : std::exchange(lead, "") + " " + said});
  };
  for (const auto& [of_text, of_words] : counterpartsOfStretches(written_numbers, spoken_numbers)) {
    const std::string all = joined(parts, of_text);
    if (of_words.size() == 0) {
      // A dash stays with the word before it; what is written and not said does not.
      for (std::size_t i = of_text.first; i < of_text.end; ++i) {
        if (!bareLetters(parts[i]).empty()) continue;
        std::string& beside = words.empty() ? lead : words.back().text;
        beside.append(beside.empty() ? "" : " ").append(parts[i]);
      }
    } else if (of_text.size() == of_words.size()) {
      for (std::size_t i = 0; i < of_text.size(); ++i) add(spoken[of_words.first + i].span, parts[of_text.first + i]);
    } else if (!bareLetters(all).empty() && all.size() <= kMostAtOnce) {
      add({spoken[of_words.first].span.start, spoken[of_words.end - 1].span.end}, all);
    } else {
      for (std::size_t i = of_words.first; i < of_words.end; ++i) add(spoken[i].span, spoken[i].text);
    }
  }
  return words;
}

}  // namespace mouthpiece
