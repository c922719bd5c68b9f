#include "programs/corpus/prompt_sentences.h"

#include <algorithm>
#include <cctype>

#include "base/errors.h"
#include "base/files.h"
#include "base/text_encoding.h"
#include "hearing/alignment/pronouncer.h"

namespace mouthpiece {
namespace {

bool saysSomething(std::string_view phrase) {
  return std::any_of(phrase.begin(), phrase.end(),
                     [](unsigned char byte) { return std::isalnum(byte) != 0 || byte >= 0x80; });
}

/// The parts of a sentence between which a speaker stops: at a sign of punctuation before a blank.
std::vector<std::string_view> phrasesOf(std::string_view sentence) {
  std::vector<std::string_view> phrases;
  while (!sentence.empty()) {
    std::size_t end = sentence.find_first_of(",;:.!?");
    while (end != std::string_view::npos && end + 1 < sentence.size() && sentence[end + 1] != ' ')
      end = sentence.find_first_of(",;:.!?", end + 1);
    end = std::min(end, sentence.size());
    if (saysSomething(sentence.substr(0, end))) phrases.push_back(sentence.substr(0, end));
    sentence.remove_prefix(std::min(end + 1, sentence.size()));
  }
  return phrases;
}

}  // namespace

std::vector<std::string> sentenceLines(std::string_view text) {
  std::vector<std::string> lines;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string line(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (line.find_first_not_of(" \t") != std::string::npos && line.front() != '#') lines.push_back(std::move(line));
  }
  return lines;
}

std::vector<std::string> sentencesOf(const std::filesystem::path& file, bool is_grammar) {
  const std::string text = decodeText(readFile(file, kMostPromptBytes), file.string());
  std::vector<std::string> sentences = is_grammar ? sentencesOfGrammar(text, file.string()) : sentenceLines(text);
  if (sentences.empty()) throw InputError(file.string(), "", "holds no sentence; expected one a line");
  return sentences;
}

Prompt promptOf(const std::string& sentence, const Pronouncer& pronouncer) {
  Prompt prompt{sentence, {}};
  for (const std::string_view phrase : phrasesOf(sentence)) {
    const std::vector<TranscriptWord> words = pronouncer.wordsOf(phrase);
    if (!words.empty() && !prompt.phones.empty()) prompt.phones.push_back(Phone::kSil);
    for (const TranscriptWord& word : words) {
      const auto& phones = word.ways.front().phones;
      prompt.phones.insert(prompt.phones.end(), phones.begin(), phones.end());
    }
  }
  return prompt;
}

}  // namespace mouthpiece
