#include "voices/festival_script.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <set>

#include "base/errors.h"
#include "base/text_encoding.h"
#include "base/text_numbers.h"
#include "phonetics/labels/syllables.h"

namespace mouthpiece {
namespace {

constexpr std::string_view kLetterWordStart = "mpletter";

/// Festival's tokeniser reads the text file as text (mode `text`: no mark-up), cuts it into utterances and hands each
/// to the hook, which writes the sound and one line a word and a phone: names have no blanks, an absent parent is 0.
constexpr std::string_view kScript = R"scheme(
(define mouthpiece-labels (fopen "{labels}" "wb"))
(define mouthpiece-count 0)
(define (mouthpiece-word word)
  (format mouthpiece-labels "word %s %s\n" (item.feat word 'id) (item.name word)))
(define (mouthpiece-phone phone)
  (format mouthpiece-labels "phone %s %s %s %s %s\n" (item.name phone) (item.feat phone 'end)
    (item.feat phone "R:SylStructure.parent.id") (item.feat phone "R:SylStructure.parent.stress")
    (item.feat phone "R:SylStructure.parent.R:SylStructure.parent.id")))
(define (mouthpiece-write utterance)
  (if (utt.relation.items utterance 'Segment)
    (begin
      (utt.save.wave utterance (string-append "utterance" mouthpiece-count ".wav") 'riff)
      (format mouthpiece-labels "utterance\n")
      (mapcar mouthpiece-word (utt.relation.items utterance 'Word))
      (mapcar mouthpiece-phone (utt.relation.items utterance 'Segment))
      (set! mouthpiece-count (+ mouthpiece-count 1))))
  utterance)
(set! tts_hooks (list utt.synth mouthpiece-write))
(tts_file "{text}" 'text)
(format mouthpiece-labels "end\n")
(fclose mouthpiece-labels)
)scheme";

bool isLetter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }
bool isWordCharacter(char c) { return isLetter(c) || (c >= '0' && c <= '9') || c == '\'' || c == '-'; }

/// Festival's name of a phone; its unstressed AH is ax.
std::string radioName(Phone phone, int stress) {
  return phone == Phone::kAH && stress == 0 ? "ax" : lowerCase(phoneName(phone));
}

/// "(((ax) 0) ((g eh n) 1))": nothing but names of phones and digits goes in.
std::string schemeSyllables(const Pronunciation& pronunciation) {
  const auto syllables = syllabify(pronunciation.phones);
  const std::size_t likely = likelyStressedSyllable(pronunciation.phones, syllables);
  const bool is_known =
      std::any_of(pronunciation.stress.begin(), pronunciation.stress.end(), [](int s) { return s >= 0; });
  std::string out;
  for (std::size_t s = 0; s < syllables.size(); ++s) {
    int stress = !is_known && s == likely ? 1 : 0;
    for (std::size_t i = 0; i < syllables[s].count; ++i) {
      stress = std::max(stress, pronunciation.stress[syllables[s].first + i]);
    }
    std::vector<std::string> names;
    for (std::size_t i = 0; i < syllables[s].count; ++i) {
      names.push_back(radioName(pronunciation.phones[syllables[s].first + i], stress));
    }
    out += fmt::format("(({}) {})", fmt::join(names, " "), stress);
  }
  return fmt::format("({})", out);
}

/// Goes through the text word by word, gathers the lexicon's entries and puts in the made-up letter words.
class LexiconPass {
 public:
  LexiconPass(std::string_view text, const Lexicon& lexicon) : text_(text), lexicon_(lexicon) {}

  void run() {
    for (std::size_t i = 0; i < text_.size();) {
      const std::size_t begin = i;
      while (i < text_.size() && isWordCharacter(text_[i])) ++i;
      if (i == begin) {
        spoken_ += text_[i++];
      } else {
        addWord(begin, i);
      }
    }
  }

  [[nodiscard]] const std::string& spoken() const { return spoken_; }
  [[nodiscard]] const std::string& entries() const { return entries_; }

 private:
  void addWord(std::size_t begin, std::size_t end) {
    const std::string word(text_.substr(begin, end - begin));
    // The M of "a.m." is no letter alone.
    const bool touches_point = (begin > 0 && text_[begin - 1] == '.') ||
                               (end + 1 < text_.size() && text_[end] == '.' && isWordCharacter(text_[end + 1]));
    if (touches_point || !isSaidByLexicon(word, lexicon_)) {
      spoken_ += word;
      return;
    }
    const bool is_letter_name = word.size() == 1 && lexicon_.words().contains(word) && word[0] <= 'Z';
    const std::string said = is_letter_name ? fmt::format("{}{}", kLetterWordStart, lowerCase(word)) : lowerCase(word);
    if (added_.insert(said).second) {
      entries_ += fmt::format("(lex.add.entry '(\"{}\" nil {}))\n", said, schemeSyllables(lexicon_.find(word).front()));
    }
    spoken_ += is_letter_name ? said : word;
  }

  std::string_view text_;
  const Lexicon& lexicon_;
  std::set<std::string> added_;
  std::string spoken_;
  std::string entries_;
};

/// The word as the user wrote it.
std::string shownWord(std::string_view name) {
  if (name.size() == kLetterWordStart.size() + 1 && lowerCase(name).starts_with(kLetterWordStart)) {
    return std::string(1, static_cast<char>(lowerCase(name).back() - 'a' + 'A'));
  }
  return std::string(name);
}

class LabelsParser {
 public:
  explicit LabelsParser(std::string_view bytes) : lines_(bytes) {}

  std::vector<FestivalUtterance> parse() {
    std::string_view line;
    while (lines_.next(line)) {
      splitFields(line, ' ', fields_);
      if (fields_[0] == "end" && fields_.size() == 1) return std::move(utterances_);
      if (fields_[0] == "utterance" && fields_.size() == 1) {
        utterances_.emplace_back();
        word_of_id_.clear();
        previous_end_ = 0;
      } else if (fields_[0] == "word" && fields_.size() == 3 && !utterances_.empty()) {
        addWord();
      } else if (fields_[0] == "phone" && fields_.size() == 6 && !utterances_.empty()) {
        addPhone();
      } else {
        fail(fmt::format("found '{}'", printable(line)));
      }
    }
    fail("ended in the middle");
  }

 private:
  [[noreturn]] void fail(std::string_view what) const {
    throw InputError("festival", fmt::format("labels line {}", lines_.lineNumber()),
                     fmt::format("{}; expected its labels", what));
  }

  void addWord() {
    auto& words = utterances_.back().words;
    // "John" + "'s" are one written word; the 's has no phones of its own where it is said within the word.
    word_of_id_[std::string(fields_[1])] = words.size();
    words.push_back(shownWord(fields_[2]));
  }

  void addPhone() {
    const auto phone = phoneFromName(fields_[1]);
    if (!phone) fail(fmt::format("found phone '{}'", printable(fields_[1])));
    const auto end = parseNumber(fields_[2]);
    if (!end || !(*end >= previous_end_ && *end < 1e5)) fail(fmt::format("found time '{}'", printable(fields_[2])));
    PhoneSegment segment{.phone = *phone, .span = {previous_end_, *end}};
    if (segment.span.duration() < 1e-4) return;  // a phone of no length is not said
    previous_end_ = *end;
    if (const auto word = word_of_id_.find(std::string(fields_[5])); word != word_of_id_.end())
      segment.word = word->second;
    if (fields_[3] != "0") {
      if (syllable_id_ != fields_[3]) ++syllable_number_;
      syllable_id_ = fields_[3];
      segment.syllable = syllable_number_;
      segment.stress = fields_[4] == "1" ? 1 : fields_[4] == "2" ? 2 : 0;
    }
    utterances_.back().phones.push_back(segment);
  }

  LineReader lines_;
  std::vector<std::string_view> fields_;
  std::vector<FestivalUtterance> utterances_;
  std::map<std::string, std::size_t> word_of_id_;
  std::string syllable_id_;
  std::size_t syllable_number_ = 0;
  Seconds previous_end_ = 0;
};

}  // namespace

std::string festivalWaveFile(std::size_t utterance) { return fmt::format("utterance{}.wav", utterance); }

bool isSaidByLexicon(std::string_view word, const Lexicon& lexicon) {
  return !word.empty() && isLetter(word[0]) &&
         std::all_of(word.begin(), word.end(), [](char c) { return isLetter(c) || c == '\''; }) &&
         !lexicon.find(word).empty();
}

FestivalJob makeFestivalJob(std::string_view voice, std::string_view speakable_text, const Lexicon* lexicon) {
  FestivalJob job{.script = fmt::format("(voice_{})\n", voice), .text = std::string(speakable_text)};
  if (lexicon != nullptr) {
    LexiconPass pass(speakable_text, *lexicon);
    pass.run();
    job.script += pass.entries();
    job.text = pass.spoken();
  }
  std::string script(kScript);
  const auto put = [&](std::string_view key, std::string_view value) {
    script.replace(script.find(key), key.size(), value);
  };
  put("{labels}", kFestivalLabelsFile);
  put("{text}", kFestivalTextFile);
  job.script += script;
  job.text += '\n';
  return job;
}

std::vector<FestivalUtterance> parseFestivalLabels(std::string_view bytes) {
  std::vector<FestivalUtterance> utterances = LabelsParser(bytes).parse();
  for (FestivalUtterance& utterance : utterances) {
    std::vector<bool> has_phones(utterance.words.size(), false);
    for (const PhoneSegment& segment : utterance.phones) {
      if (segment.word) has_phones[*segment.word] = true;
    }
    for (std::size_t w = 1; w < utterance.words.size(); ++w) {
      if (!has_phones[w] && utterance.words[w].starts_with('\'')) utterance.words[w - 1] += utterance.words[w];
    }
  }
  return utterances;
}

}  // namespace mouthpiece
