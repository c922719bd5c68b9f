#include "singing/singing_voice.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/errors.h"
#include "base/files.h"
#include "base/text_numbers.h"
#include "base/child_process.h"
#include "voices/festival_script.h"
#include "singing/singing_script.h"
#include "voices/spoken_line_builder.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

/// Singing mode needs a voice whose segments have durations of their own: kal, not the HTS voices.
constexpr std::string_view kVoice = "kal_diphone";
constexpr std::string_view kHeapCells = "4000000";
constexpr Seconds kTimeLimit = 60;
constexpr std::string_view kCountsFile = "syllables.txt";

/// A token is a word, said as its first entry: neither numbers nor abbreviations nor parts of speech change the count
/// of syllables.
constexpr std::string_view kPlainWords = R"scheme(
(set! token_to_words (lambda (token name) (list name)))
(define (mouthpiece-syllables word) (car (cdr (cdr (lex.lookup word nil)))))
(define mouthpiece-words '({words}))
)scheme";

constexpr std::string_view kCount = R"scheme(
(define mouthpiece-counts (fopen "{counts}" "wb"))
(mapcar (lambda (word) (format mouthpiece-counts "%d\n" (length (mouthpiece-syllables word)))) mouthpiece-words)
(fclose mouthpiece-counts)
)scheme";

/// Festival 2.5's item.leafs runs on past the end of a syllable to the end of its word: singing mode, which takes a
/// syllable's phones by it, would give the first syllable's time to all of them.
constexpr std::string_view kFix = R"scheme(
(mapcar (lambda (word) (lex.add.entry (list word nil (mouthpiece-syllables word)))) mouthpiece-words)
(require 'singing-mode)
(define (item.leafs item) (item.daughters item))
)scheme";

/// A held vowel of one diphone on each side would have the way into it stretched as much as itself: the sound would
/// come tenths of a second after the label. So it is sung as a vowel of natural length, a held one and a vowel of
/// natural length, joined by kal's diphones from a vowel to itself; before the labels are written it is one again.
constexpr std::string_view kHold = R"scheme(
(define (mouthpiece-hold segment)
  (let ((start (item.feat segment 'segment_start)) (end (item.feat segment 'end)) (name (item.name segment)))
    (if (and (string-equal "+" (item.feat segment 'ph_vc)) (> (- end start) 0.25))
      (begin
        (item.set_feat segment 'mouthpiece_end end)
        (item.set_feat segment 'end (+ start 0.06))
        (item.insert segment (list name (list (list "end" end) (list "mouthpiece_part" 1))) 'after)
        (item.insert segment (list name (list (list "end" (- end 0.08)) (list "mouthpiece_part" 1))) 'after)))))
(define (mouthpiece-join segment)
  (cond
    ((equal? 1 (item.feat segment 'mouthpiece_part)) (item.delete segment))
    ((> (item.feat segment 'mouthpiece_end) 0) (item.set_feat segment 'end (item.feat segment 'mouthpiece_end)))))
(set! after_analysis_hooks
  (list (lambda (utterance) (mapcar mouthpiece-hold (utt.relation.items utterance 'Segment)) utterance)))
(define (mouthpiece-join-all utterance)
  (mapcar mouthpiece-join (utt.relation.items utterance 'Segment))
  utterance)
)scheme";

std::string replaced(std::string_view text, std::string_view key, std::string_view value) {
  std::string out(text);
  const auto at = out.find(key);
  MOUTHPIECE_EXPECT(at != std::string::npos);
  return out.replace(at, key.size(), value);
}

std::string lowerWord(const std::string& word) {
  std::string lower;
  for (const char c : word) lower += c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  const auto first = lower.find_first_not_of('\'');
  return lower.substr(first, lower.find_last_not_of('\'') - first + 1);
}

/// One run of Festival in a private folder.
class SingingRun {
 public:
  SingingRun() {
    const auto program = findProgram("festival");
    if (!program)
      throw InputError("festival", "",
                       "is not installed. Get it with: sudo apt-get install festival festvox-kallpc16k");
    program_ = *program;
  }

  void run(std::string_view script, const std::string& needed) {
    writeFileAtomically(folder_.path() / "sing.scm", script);
    const ChildResult result =
        runChild(program_, {"--heap", std::string(kHeapCells), "-b", "sing.scm"}, folder_.path(), kTimeLimit);
    if (result.output.find(fmt::format("unbound variable : voice_{}", kVoice)) != std::string::npos) {
      throw InputError("festival", "",
                       fmt::format("has no voice {}. Get it with: sudo apt-get install festvox-kallpc16k", kVoice));
    }
    if (result.timed_out || result.exit_code != 0 || !fs::exists(folder_.path() / needed)) {
      throw InputError("festival", "", fmt::format("could not sing: {}", printable(result.output, 200)));
    }
  }

  [[nodiscard]] fs::path file(std::string_view name) const { return folder_.path() / name; }

 private:
  PrivateFolder folder_;
  fs::path program_;
};

std::vector<std::size_t> syllableCounts(SingingRun& festival, const std::string& start, std::size_t words) {
  festival.run(start + replaced(kCount, "{counts}", kCountsFile), std::string(kCountsFile));
  const std::string bytes = readFile(festival.file(kCountsFile));
  std::vector<std::size_t> counts;
  LineReader lines(bytes);
  for (std::string_view line; lines.next(line);) {
    const auto count = parseNumber(line);
    if (!count || !(*count >= 0 && *count < 100)) break;
    counts.push_back(static_cast<std::size_t>(*count));
  }
  if (counts.size() != words) {
    throw InputError("festival", "",
                     fmt::format("counted the syllables of {} words; expected {}", counts.size(), words));
  }
  return counts;
}

void checkPronounced(const std::vector<SungWord>& words, const std::vector<std::size_t>& counts) {
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (counts[i] == 0) {
      throw InputError(
          "song", fmt::format("word {}", i + 1),
          fmt::format("Festival cannot say '{}'; expected another spelling, or a lexicon with it", words[i].text));
    }
  }
}

std::vector<TimedTone> timedTones(const std::vector<SungWord>& words, Seconds first_rest) {
  std::vector<TimedTone> tones;
  Seconds time = first_rest;
  for (const SungWord& word : words) {
    for (const auto& syllable : word.syllables) {
      for (const SungTone& tone : syllable) {
        tones.push_back({{time, time + tone.duration}, tone.hz, tone.vibrato});
        time += tone.duration;
      }
    }
    time += word.rest;
  }
  return tones;
}

}  // namespace

SungLine singWords(const std::vector<SungWord>& words, Seconds first_rest, const SingingOptions& options) {
  checkSungWords(words, first_rest);
  std::string lyrics, quoted;
  for (const SungWord& word : words) {
    lyrics += (lyrics.empty() ? "" : " ") + lowerWord(word.text);
    quoted += fmt::format("\"{}\" ", lowerWord(word.text));
  }
  // The script that speaks a text, with singing mode's reader in the place of the text's.
  const std::string job = replaced(makeFestivalJob(kVoice, lyrics, options.lexicon).script, "'text)", "'singing)");
  const auto labels_begin = job.find("(define mouthpiece-labels");
  MOUTHPIECE_EXPECT(labels_begin != std::string::npos);
  const std::string start = job.substr(0, labels_begin) + replaced(kPlainWords, "{words}", quoted);
  SingingRun festival;
  const std::vector<std::size_t> counts = syllableCounts(festival, start, words.size());
  checkPronounced(words, counts);
  const std::vector<SungWord> fitted = fitSyllables(words, counts);
  writeFileAtomically(festival.file(kFestivalTextFile), singingXml(fitted, first_rest, options.vibrato));
  const std::string sing =
      replaced(job.substr(labels_begin), "(list utt.synth ", "(list utt.synth mouthpiece-join-all ");
  festival.run(start + std::string(kFix) + std::string(kHold) + sing, std::string(kFestivalLabelsFile));
  SpokenLineBuilder builder;
  std::size_t number = 0;
  for (FestivalUtterance& utterance : parseFestivalLabels(readFile(festival.file(kFestivalLabelsFile)))) {
    builder.add(readAudio(festival.file(festivalWaveFile(number++))), std::move(utterance.phones), utterance.words);
  }
  SungLine sung{.line = builder.build(lyrics, fmt::format("festival:{}", kVoice)),
                .tones = timedTones(fitted, first_rest)};
  return sung;
}

}  // namespace mouthpiece
