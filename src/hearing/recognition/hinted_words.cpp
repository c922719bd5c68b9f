#include "hearing/recognition/hinted_words.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <set>
#include <span>
#include <utility>

#include "base/index.h"
#include "base/text_encoding.h"
#include "hearing/alignment/phone_edits.h"

namespace mouthpiece {
namespace {

/// Rows of phones whose edits cost more a phone are not alike.
constexpr double kMostApart = 0.45;
/// What is shorter sounds like too much.
constexpr std::size_t kLeastHinted = 4;
/// A word may be heard as so many more.
constexpr std::size_t kWordsMore = 3;

struct SaidPhrase {
  std::vector<std::string> words;
  std::vector<Phone> phones;
};

/// The words of the hint's lines, each alone, and the lines as they are.
std::vector<SaidPhrase> phrasesOf(const PhraseBook& book) {
  const std::map<std::string, std::vector<Phone>> phones(book.more.begin(), book.more.end());
  std::set<std::vector<std::string>> rows(book.lines.begin(), book.lines.end());
  for (const std::vector<std::string>& line : book.lines) {
    for (const std::string& word : line) rows.insert({word});
  }
  std::vector<SaidPhrase> phrases;
  for (const std::vector<std::string>& row : rows) {
    SaidPhrase phrase{row, {}};
    for (const std::string& word : row) std::ranges::copy(phones.at(word), std::back_inserter(phrase.phones));
    if (phrase.phones.size() >= kLeastHinted) phrases.push_back(std::move(phrase));
  }
  return phrases;
}

}  // namespace

std::vector<HintedPlace> hintedPlaces(const KnownLines& hint, const SpeechLabels& heard) {
  std::vector<HintedPlace> places;
  std::vector<std::string> words;
  std::set<std::string> hinted;
  for (const LabelledWord& word : heard.words) words.push_back(lowerCase(word.text));
  for (const auto& more : hint.book().more) hinted.insert(more.first);
  for (const SaidPhrase& phrase : phrasesOf(hint.book())) {
    for (std::size_t first = 0; first < words.size(); ++first) {
      std::vector<Phone> phones;
      bool is_other = false;
      for (std::size_t end = first + 1; end <= std::min(words.size(), first + phrase.words.size() + kWordsMore);
           ++end) {
        const PhoneRange range = heard.words[end - 1].phones;
        for (std::size_t i = range.first.value; i <= range.last.value; ++i) phones.push_back(heard.phones[i].phone);
        if (phrase.words.size() == 1 && hinted.contains(words[end - 1])) break;
        is_other = is_other || end - first > phrase.words.size() || words[end - 1] != phrase.words[end - first - 1];
        const double longer = asReal(std::max(phones.size(), phrase.phones.size()));
        const double least = PhoneEdits::kLeftOut * (2 * longer - asReal(phones.size() + phrase.phones.size()));
        if (!is_other || least > kMostApart * longer) continue;
        const double apart = cheapestEdits(phones, phrase.phones).price / longer;
        if (apart <= kMostApart) places.push_back({first, end, phrase.words, apart});
      }
    }
  }
  std::ranges::stable_sort(places, {}, &HintedPlace::apart);
  return places;
}

}  // namespace mouthpiece
