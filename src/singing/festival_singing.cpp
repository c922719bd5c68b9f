#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "base/child_process.h"
#include "base/errors.h"
#include "base/files.h"
#include "base/index.h"
#include "base/text_numbers.h"
#include "base/unicode.h"
#include "singing/kana_lyrics.h"
#include "singing/sung_line.h"
#include "singing/timed_notes.h"
#include "voices/festival_script.h"
#include "voices/spoken_line_builder.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

/// Singing mode needs a voice whose segments have durations of their own: kal, not the HTS voices.
constexpr std::string_view kVoice = "kal_diphone";
constexpr std::string_view kHeapCells = "4000000";
constexpr Seconds kTimeLimit = 60;
constexpr std::string_view kCountsFile = "syllables.txt";
constexpr Seconds kVibratoStep = 0.02, kVibratoRise = 0.3;
constexpr double kMostSteps = 400;  // of one note: Festival's lists are recursive

/// kal's singing mode crashes above 500 Hz: B4 is sung, C5 is not.
constexpr double kHighestHz = 495;

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

/// What Festival is to say: apostrophes at a word's ends have no sound.
std::string spokenWord(std::string_view text) {
  text.remove_prefix(std::min(text.size(), text.find_first_not_of('\'')));
  return std::string(text.substr(0, text.find_last_not_of('\'') + 1));
}

/// A made-up word of letters for the `number`th word of a song that is said as its sounds tell.
std::string madeUpWord(std::size_t number) {
  std::string word = "mpkana";
  for (std::size_t rest = number + 1; rest > 0; rest /= 26) word += static_cast<char>('a' + rest % 26);
  return word;
}

/// Songs have their words without accents; a lexicon may have them with these ("für" says "fur").
void addWithoutAccents(Lexicon& lexicon) {
  std::vector<std::pair<std::string, Pronunciation>> plain;
  for (const auto& [word, said] : lexicon.words()) {
    if (std::string letters = wordLetters(word);
        toAscii(word) != word && lexicon.find(letters).empty() && !said.empty())
      plain.emplace_back(std::move(letters), said.front());
  }
  for (auto& [word, said] : plain) {
    if (!word.empty() && kanaOf(word).empty()) lexicon.add(word, std::move(said));
  }
}

/// Words in kana become made-up ones that kal says with the nearest of its phones; the lexicon tells how.
Song withMadeUpWords(Song song, Lexicon& lexicon) {
  for (std::size_t i = 0; i < song.words.size(); ++i) {
    SongWord& word = song.words[i];
    if (word.said.phones.empty()) continue;
    Pronunciation heard = word.said;
    if (!heard.heard.empty()) heard.phones = heard.heard;
    word.text = madeUpWord(i);
    lexicon.add(word.text, std::move(heard));
  }
  return song;
}

/// Gives made-up words their own text and phones back. Festival may have words of its own for rests.
void putBack(const Song& song, FestivalUtterance& utterance) {
  std::map<std::string, const SongWord*, std::less<>> made_up;
  for (std::size_t i = 0; i < song.words.size(); ++i) {
    if (!song.words[i].said.phones.empty()) made_up[madeUpWord(i)] = &song.words[i];
  }
  std::vector<std::vector<PhoneSegment*>> phones(utterance.words.size());
  for (PhoneSegment& phone : utterance.phones) {
    if (phone.word && *phone.word < phones.size()) phones[*phone.word].push_back(&phone);
  }
  for (std::size_t i = 0; i < utterance.words.size(); ++i) {
    const auto found = made_up.find(utterance.words[i]);
    if (found == made_up.end()) continue;
    const Pronunciation& said = found->second->said;
    utterance.words[i] = found->second->text;
    if (phones[i].size() != said.phones.size()) continue;
    for (std::size_t k = 0; k < phones[i].size(); ++k) {
      phones[i][k]->phone = said.phones[k];
      phones[i][k]->ipa = said.ipa[k];
    }
  }
}

/// By how many octaves a song must be lower for kal to sing it.
int octavesTooHigh(const Song& song) {
  double highest = kHighestHz;
  for (const Note& note : song.notes()) highest = std::max(highest, note.hz);
  return static_cast<int>(std::ceil(std::log2(highest / kHighestHz)));
}

Song lowered(Song song, int octaves) {
  for (SongWord& word : song.words) {
    for (Syllable& syllable : word.syllables) {
      for (Note& note : syllable.notes) note.hz = std::ldexp(note.hz, -octaves);
    }
  }
  return song;
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
    counts.push_back(unsignedIndex(std::lround(*count)));
  }
  if (counts.size() != words) {
    throw InputError("festival", "",
                     fmt::format("counted the syllables of {} words; expected {}", counts.size(), words));
  }
  return counts;
}

void checkPronounced(const Song& song, const std::vector<std::size_t>& counts) {
  const auto mute = std::find(counts.begin(), counts.end(), 0U);
  if (mute == counts.end()) return;
  const auto word = unsignedIndex(mute - counts.begin());
  throw InputError(
      "song", fmt::format("word {}", word + 1),
      fmt::format("Festival cannot say '{}'; expected another spelling, or a lexicon with it", song.words[word].text));
}

/// The frequencies and lengths of a syllable, in singing mode's way to write slurs.
struct Slur {
  std::string frequencies, lengths;

  void add(double hz, Seconds length) {
    frequencies += fmt::format("{}{:.2f}", frequencies.empty() ? "" : "+", hz);
    lengths += fmt::format("{}{:.5f}", lengths.empty() ? "" : "+", length);
  }

  void add(const Note& note, const SungVibrato& vibrato) {
    const Seconds length = note.span.duration();
    if (!note.vibrato) return add(note.hz, length);
    const double steps = std::clamp(std::floor(length / kVibratoStep + 0.5 + 1e-6), 1.0, kMostSteps);
    for (double step = 0; step < steps; ++step) {
      const Seconds time = (step + 0.5) * length / steps;
      const double growth = std::clamp((time - vibrato.delay) / kVibratoRise, 0.0, 1.0);
      const double swing = std::sin(2 * std::numbers::pi * vibrato.rate_hz * (time - vibrato.delay));
      add(note.hz * std::exp2(growth * vibrato.depth_semitones * swing / 12), length / steps);
    }
  }
};

std::string restXml(Seconds length) {
  constexpr Seconds kShortestRest = 1e-6;
  return length > kShortestRest ? fmt::format("<REST SECONDS=\"{:.4f}\"></REST>\n", length) : "";
}

/// The notes that were sung, and the vibrato of those that have it.
AudioTags tagsOf(const Song& song, const SungVibrato& vibrato) {
  AudioTags tags;
  tags.notes = song.notes();
  for (const Note& note : tags.notes) {
    const TimeSpan span{note.span.start + vibrato.delay, note.span.end};
    if (note.vibrato && span.duration() > 0) tags.vibrato.push_back({span, vibrato.rate_hz, vibrato.depth_semitones});
  }
  return tags;
}

}  // namespace

std::string festivalSingingXml(const Song& song, const SungVibrato& vibrato) {
  std::string xml =
      "<?xml version=\"1.0\"?>\n<!DOCTYPE SINGING PUBLIC \"-//SINGING//DTD SINGING mark up//EN\" \"Singing.v0_1.dtd\" "
      "[]>\n<SINGING BPM=\"60\">\n";
  Seconds sung_until = 0;
  for (const SongWord& word : song.words) {
    xml += restXml(word.span().start - sung_until);
    sung_until = word.end();
    Slur sung;
    for (const Syllable& syllable : word.syllables) {
      Slur slur;
      for (const Note& note : syllable.notes) slur.add(note, vibrato);
      sung.frequencies += (sung.frequencies.empty() ? "" : ",") + slur.frequencies;
      sung.lengths += (sung.lengths.empty() ? "" : ",") + slur.lengths;
    }
    xml += fmt::format("<DURATION SECONDS=\"{}\"><PITCH FREQ=\"{}\">{}</PITCH></DURATION>\n", sung.lengths,
                       sung.frequencies, spokenWord(word.text));
  }
  return xml + restXml(song.duration - sung_until) + "</SINGING>\n";
}

SungLine singWithFestival(const Song& written, const SingingOptions& options) {
  checkSong(written, "song");
  Lexicon lexicon = options.lexicon != nullptr ? *options.lexicon : Lexicon();
  addWithoutAccents(lexicon);
  const Song song = withMadeUpWords(written, lexicon);
  std::string text, lyrics, quoted;
  for (const SongWord& word : written.words) text += (text.empty() ? "" : " ") + spokenWord(word.text);
  for (const SongWord& word : song.words) {
    const std::string spoken = spokenWord(word.text);
    lyrics += (lyrics.empty() ? "" : " ") + spoken;
    quoted += fmt::format("\"{}\" ", spoken);
  }
  // The script that speaks a text, with singing mode's reader in the place of the text's.
  const std::string job = replaced(makeFestivalJob(kVoice, lyrics, &lexicon).script, "'text)", "'singing)");
  const auto labels_begin = job.find("(define mouthpiece-labels");
  MOUTHPIECE_EXPECT(labels_begin != std::string::npos);
  const std::string start = job.substr(0, labels_begin) + replaced(kPlainWords, "{words}", quoted);
  SingingRun festival;
  const std::vector<std::size_t> counts = syllableCounts(festival, start, song.words.size());
  checkPronounced(written, counts);
  const Song fitted = withSyllables(song, counts);
  const int octaves = octavesTooHigh(fitted);
  writeFileAtomically(festival.file(kFestivalTextFile), festivalSingingXml(lowered(fitted, octaves), options.vibrato));
  const std::string sing =
      replaced(job.substr(labels_begin), "(list utt.synth ", "(list utt.synth mouthpiece-join-all ");
  festival.run(start + std::string(kFix) + std::string(kHold) + sing, std::string(kFestivalLabelsFile));
  SpokenLineBuilder builder;
  std::size_t number = 0;
  for (FestivalUtterance& utterance : parseFestivalLabels(readFile(festival.file(kFestivalLabelsFile)))) {
    putBack(written, utterance);
    builder.add(readAudio(festival.file(festivalWaveFile(number++))), std::move(utterance.phones), utterance.words);
  }
  SungLine sung{builder.build(text, fmt::format("festival:{}", kVoice)), tagsOf(fitted, options.vibrato), {}};
  if (octaves > 0) {
    sung.notices.push_back(fmt::format("the voice sings up to B4: it is heard {} lower than written",
                                       octaves == 1 ? "an octave" : fmt::format("{} octaves", octaves)));
  }
  return sung;
}

}  // namespace mouthpiece
