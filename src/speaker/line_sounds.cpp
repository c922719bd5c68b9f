#include "speaker/line_sounds.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <set>

#include "base/memory.h"
#include "base/text_encoding.h"
#include "hearing/alignment/forced_alignment.h"
#include "hearing/alignment/lyrics.h"
#include "hearing/alignment/samples_to_hear.h"
#include "hearing/alignment/untold_speech.h"
#include "hearing/network/network_doubt.h"
#include "hearing/network/network_phones.h"
#include "hearing/recognition/recogniser.h"
#include "hearing/times/times_file.h"
#include "phonetics/labels/label_files.h"
#include "phonetics/language/kana.h"
#include "phonetics/text/speakable_text.h"
#include "singing/song.h"
#include "singing/song_beside_sound.h"
#include "speaker/shared_files.h"

namespace mouthpiece {
namespace {

/// A longer recording is read again after its words were found, so that it is not held while they are.
constexpr Seconds kReadTwice = SamplesToHear::kInMemoryUntil;
/// A longer recording is kept at the rate that is heard: at 48 kHz an hour of samples would take 690 MB.
constexpr Seconds kOwnRateUntil = 1200;

AudioClip readRecording(const std::filesystem::path& path) {
  return readAudio(path, {.own_rate_until = kOwnRateUntil});
}

PhonePairs phonePairsOf(const UnitDatabase& units) {
  PhonePairs pairs;
  for (std::size_t a = 0; a < kPhoneCount; ++a) {
    for (std::size_t b = 0; b < kPhoneCount; ++b) {
      if (units.hasDiphone(Phone(a), Phone(b))) pairs.add(Phone(a), Phone(b));
    }
  }
  return pairs;
}

/// What the corpus' takes say may be said again.
std::vector<std::string> linesOf(const Corpus& corpus) {
  constexpr std::size_t kMostLines = 2000;
  std::set<std::string> lines;
  for (const TakeIndex take : evenlySpreadTakes(corpus, kMostLines)) {
    if (const std::string& text = takeOf(corpus, take).text; !text.empty()) lines.insert(text);
  }
  return {lines.begin(), lines.end()};
}

std::string recordedVoice(const std::filesystem::path& audio) { return "recorded:" + audio.filename().string(); }

/// The line's recording, nothing known of it yet.
LineSound recorded(const Line& source) {
  LineSound made;
  made.line.audio = readRecording(source.audio);
  made.line.voice = recordedVoice(source.audio);
  return made;
}

void addNotice(SpokenLine& line, const std::string& notice) {
  if (!notice.empty()) line.notice += (line.notice.empty() ? "" : "; ") + notice;
}

/// A text as it is written, not as it is said: its words, a blank between them.
std::string asWritten(std::string_view text) {
  return fmt::format("{}", fmt::join(blankSeparated(withoutMarkup(text)), " "));
}

}  // namespace

std::vector<LabelledSound> soundsOf(const Corpus& corpus, std::size_t most) {
  std::vector<LabelledSound> sounds;
  const std::size_t every = takeCount(corpus) / most + 1;
  for (std::size_t i = 0; i < takeCount(corpus); i += every) {
    const CorpusTake& take = takeOf(corpus, TakeIndex(i));
    sounds.push_back(
        {corpus.take_source != nullptr ? corpus.take_source->loadAudio(TakeIndex(i)) : take.audio, take.labels});
  }
  return sounds;
}

LineSounds::LineSounds(const SpeakerOptions& options, SharedCorpus corpus, const SynthesisOptions& synthesis,
                       const Language& language, const Lexicon* lexicon)
    : options_(options), corpus_(std::move(corpus)), synthesis_(synthesis), language_(language), lexicon_(lexicon) {}

LineSounds::~LineSounds() = default;

ForcedAligner& LineSounds::aligner() {
  if (!aligner_) aligner_ = std::make_unique<ForcedAligner>(std::filesystem::path(), language_);
  return *aligner_;
}

Pronouncer& LineSounds::pronouncer() {
  if (!pronouncer_) pronouncer_ = std::make_unique<Pronouncer>(lexicon_, language_);
  return *pronouncer_;
}

const std::shared_ptr<WordNetwork>& LineSounds::network() {
  if (!word_network_) word_network_ = sharedWordNetwork();
  return word_network_;
}

std::string LineSounds::judge(const SamplesToHear& to_hear, ForcedAlignment& alignment) {
  const bool asks_network = options_.hear != SpeakerOptions::Hear::kPhones;
  return asks_network ? judgeByNetwork(*network(), pronouncer(), to_hear, alignment) : std::string();
}

std::string LineSounds::doubtsAboutTimes(const AudioClip& audio, const std::string& text, std::string_view name) {
  const SamplesToHear to_hear(audio);
  try {
    ForcedAlignment alignment =
        aligner().align(to_hear, audio.duration(), pronouncer().wordsOf(text), name, SpeechKind::kSpoken);
    const std::string failure = judge(to_hear, alignment);
    SpokenLine told;
    addNotice(told, doubtsAbout(alignment));
    addNotice(told, failure);
    return told.notice;
  } catch (const InputError&) {  // whoever read the times has said that nobody speaks there
    return {};
  }
}

LineSound LineSounds::alignRecording(const Line& source) {
  LineSound made = recorded(source);
  SpokenLine& line = made.line;
  line.text = asWritten(source.text);
  const std::vector<TranscriptWord> words = pronouncer().wordsOf(source.text);
  const SpeechKind kind = source.is_sung ? SpeechKind::kSung : SpeechKind::kSpoken;
  const Seconds lasts = line.audio.duration();
  const bool is_long = lasts > kReadTwice;
  const SamplesToHear to_hear(line.audio);
  if (is_long) line.audio = {};
  const bool asks_network = options_.hear != SpeakerOptions::Hear::kPhones;
  std::string failure;
  HeardPhones heard;
  if (asks_network && !source.is_sung) {
    heard = phonesBesideText(*network(), to_hear.all(), language_, failure);
    if (is_long) network()->endWaiting();  // the aligner needs memory, too
  }
  ForcedAlignment alignment =
      aligner().align(to_hear, lasts, words, source.audio.string(), kind, BorderTimes::kFine, heard);
  const std::string untold = source.is_sung ? "" : untoldSpeech(to_hear.all(), alignment.labels);
  to_hear.letGo();
  if (is_long) {
    aligner_.reset();  // what it knows of the language takes as long to read as a tenth of a second of sound
    giveBackMemory();
  }
  if (asks_network && failure.empty()) {
    failure = judge(to_hear, alignment);
    if (is_long) network()->endWaiting();
  }
  if (is_long) line.audio = readRecording(source.audio);
  addNotice(line, doubtsAbout(alignment));
  addNotice(line, untold);
  addNotice(line, failure);
  line.labels = std::move(alignment.labels);
  return made;
}

LineSound LineSounds::hearRecording(const Line& source) {
  std::unique_ptr<Recogniser> timed;
  if (!source.times.empty()) {
    timed = makeTimedRecogniser(source.times, lexicon_, language_);
  } else if (!recogniser_ || recogniser_hint_ != source.hint) {
    RecogniserOptions wanted;
    wanted.as = options_.hear == SpeakerOptions::Hear::kWords    ? HearAs::kWords
                : options_.hear == SpeakerOptions::Hear::kPhones ? HearAs::kPhones
                                                                 : HearAs::kAuto;
    wanted.hint = source.hint;
    wanted.known = linesOf(corpus_.data().corpus);
    wanted.speaker = [from = corpus_](std::size_t most) { return soundsOf(from.data().corpus, most); };
    wanted.lexicon = lexicon_;
    wanted.language = &language_;
    wanted.word_network = network();
    recogniser_ = makeRecogniser(wanted);
    recogniser_hint_ = source.hint;
  }
  LineSound made = recorded(source);
  SpokenLine& line = made.line;
  const bool is_long = line.audio.duration() > kReadTwice;
  Recogniser& by = timed ? *timed : *recogniser_;
  HeardSpeech heard = by.hear(is_long ? std::exchange(line.audio, {}) : line.audio, source.audio.string());
  if (is_long) {
    recogniser_.reset();  // to make it anew for the next line takes a second
    giveBackMemory();
    line.audio = readRecording(source.audio);
  }
  line.labels = std::move(heard.labels);
  line.text = std::move(heard.text);
  for (const std::string& warning : heard.warnings) addNotice(line, warning);
  if (timed && !line.text.empty() && !source.is_sung)
    addNotice(line, doubtsAboutTimes(line.audio, line.text, source.audio.string()));
  made.notices = std::move(heard.notices);
  made.confidence = std::move(heard.confidence);
  return made;
}

LineSound LineSounds::readLabelled(const Line& source) {
  LineSound made = recorded(source);
  SpokenLine& line = made.line;
  line.labels = readLabels(source.phones, {.language = &language_});
  if (!source.is_sung) {
    line.notice = doubtsAbout(line.labels, line.audio, aligner(), source.audio.string());
    addNotice(line, untoldSpeech(SamplesToHear(line.audio).all(), line.labels));
  }
  line.text = asWritten(source.text);
  for (const LabelledWord& word : line.labels.words) {
    if (source.text.empty()) line.text += (line.text.empty() ? "" : " ") + word.text;
  }
  return made;
}

LineSound LineSounds::speak(const std::string& text) {
  if (lexicon_)
    line_lexicon_ = lexiconForLine(*lexicon_, speakableText(text, language_), phonePairsOf(corpus_.data().units));
  if (!voice_) {
    voice_ = makeVoice(options_.usual_voice.empty() ? voiceFor(language_) : options_.usual_voice,
                       VoiceOptions{line_lexicon_ ? &*line_lexicon_ : nullptr, &corpus_.data().units,
                                    synthesis_.selection, options_.rate});
  }
  LineSound made{{voice_->speak(text), {}, {}}};
  made.line.text = asWritten(text);
  return made;
}

LineSound LineSounds::speakOrRead(const Line& source) {
  if (source.audio.empty()) return speak(source.text);
  if (!source.times.empty() || (source.phones.empty() && source.text.empty())) return hearRecording(source);
  if (source.phones.empty()) return alignRecording(source);
  if (!lacksPhones(source.phones)) return readLabelled(source);
  Line words = source;
  words.times = std::exchange(words.phones, {});
  LineSound made = hearRecording(words);
  if (!source.text.empty()) made.line.text = asWritten(source.text);
  addNotice(made.line, fmt::format("{} has words without phones: these are found in the sound", words.times.string()));
  return made;
}

SpeechLabels LineSounds::withLikelyWords(SpeechLabels labels) {
  if (!LikelyWords::areNeededFor(labels)) return labels;
  if (!likely_words_) {
    likely_words_.emplace(language_);
    const Corpus& own = corpus_.data().corpus;
    for (const TakeIndex take : evenlySpreadTakes(own, kTakesOfWords)) likely_words_->add(takeOf(own, take).labels);
  }
  return likely_words_->complete(labels);
}

std::vector<std::size_t> LineSounds::guessedWords(const SpeechLabels& labels) {
  const Pronouncer& known = pronouncer();
  std::vector<std::size_t> guessed;
  for (std::size_t i = 0; i < labels.words.size(); ++i) {
    const std::string& word = labels.words[i].text;
    if (word.empty() || known.knows(word)) continue;
    if (!pronounceKana(word).phones.empty()) continue;  // in an English line: of a song, as they are written
    guessed.push_back(i);
  }
  return guessed;
}

LineSound LineSounds::songOf(const Line& source) {
  const Song song = readSong(source.song);
  const bool is_singable = &language_ == &english() || &language_ == &japanese() || lexicon_ != nullptr;
  if (!options_.language.empty() && !is_singable)
    throw InputError("language", "",
                     fmt::format("found {} for a written song, whose words are read as English or kana; expected en, "
                                 "ja, or a lexicon of its words",
                                 language_.name));
  AudioClip sound;
  if (!source.audio.empty()) sound = readRecording(source.audio);  // before Festival sings for nothing
  SungLine sung = singSong(song, {source.audio.empty() ? options_.voice : std::string(), lexicon_, {}});
  if (source.audio.empty()) return {std::move(sung)};
  sung = besideSound(std::move(sung), std::move(sound), source.song_offset, aligner(), source.audio.string());
  sung.line.voice = recordedVoice(source.audio);
  return {std::move(sung)};
}

LineSound LineSounds::soundOf(const Line& source) {
  if (!source.song.empty()) return songOf(source);
  LineSound made = speakOrRead(source);
  if (!source.is_sung && !synthesis_.curves.ma.automatic && synthesis_.curves.alone != CurveStyle::kSing) return made;
  SungLine heard = hearSong(std::move(made.line));
  if (source.audio.empty()) heard.warnings.clear();  // a voice of ours is not silent, clipped or off its text
  heard.notices.insert(heard.notices.begin(), made.notices.begin(), made.notices.end());
  return {std::move(heard), std::move(made.confidence)};
}

}  // namespace mouthpiece
