#include "mouthpiece/speaker.h"

#include <fmt/format.h>

#include <algorithm>
#include <future>
#include <set>

#include "base/errors.h"
#include "base/files.h"
#include "base/memory.h"
#include "deform/mesh/mesh_files.h"
#include "hearing/alignment/forced_alignment.h"
#include "hearing/alignment/lyrics.h"
#include "hearing/alignment/samples_to_hear.h"
#include "hearing/network/network_doubt.h"
#include "hearing/network/network_phones.h"
#include "hearing/recognition/recogniser.h"
#include "hearing/times/times_file.h"
#include "page_engine/line_package.h"
#include "phonetics/labels/label_files.h"
#include "phonetics/labels/likely_words.h"
#include "phonetics/language/kana.h"
#include "phonetics/text/lexicon.h"
#include "phonetics/text/speakable_text.h"
#include "singing/song.h"
#include "singing/song_beside_sound.h"
#include "singing/sung_line.h"
#include "speaker/live_setup.h"
#include "speaker/manner.h"
#include "speaker/shared_files.h"
#include "speaker/speaker_data.h"
#include "voices/voice.h"

namespace mouthpiece {
namespace {

/// About three hours of speech: what a line has loaded of a larger corpus is given back before its face takes memory.
/// Of a smaller one it stays for the next line.
constexpr std::size_t kMostPhonesKept = 70'000;

/// A longer recording is read again after its words were found, so that it is not held while they are.
constexpr Seconds kReadTwice = SamplesToHear::kInMemoryUntil;
/// A longer recording is kept at the rate that is heard: at 48 kHz an hour of samples would take 690 MB.
constexpr Seconds kOwnRateUntil = 1200;

AudioClip readRecording(const std::filesystem::path& path) {
  return readAudio(path, {.own_rate_until = kOwnRateUntil});
}

void expectNoBackoff(const UtteranceAnimation& animation, const std::string& corpus) {
  const auto found = std::find_if(animation.units.begin(), animation.units.end(),
                                  [](const PlacedUnit& unit) { return unit.is_backoff; });
  if (found == animation.units.end()) return;
  const auto& phones = animation.labels.phones;
  throw InputError(corpus, "",
                   fmt::format("lacks the phone pair {} {} (at {:.2f} s); expected it, since nothing may back it off",
                               phoneName(phones[found->phones.first.value].phone),
                               phoneName(phones[found->phones.last.value].phone), found->span.start));
}

std::string tunedLanguages() {
  std::string tags;
  for (const Language* language : languages()) {
    if (language->is_tuned) tags += fmt::format("{}{}", tags.empty() ? "" : ", ", language->tag);
  }
  return tags;
}

/// The language of the lines. Where one is asked for and no voice, the voice becomes the language's.
const Language& languageFor(SpeakerOptions& options) {
  if (options.language.empty()) return languageOfVoice(options.voice);
  const Language& language = languageOf(options.language);
  const bool is_default = options.voice == SpeakerOptions().voice;
  if (&languageOfVoice(options.voice) == &language) return language;
  if (!is_default)
    throw InputError(fmt::format("found the voice {} for text in {}; expected {}", printable(options.voice),
                                 language.name, voiceFor(language)));
  options.voice.clear();
  return language;
}

/// Symbols of the labels that no row of IPA describes, for a warning; "" for none.
std::string unknownSymbols(const SpeechLabels& labels) {
  std::vector<std::string> unknown;
  for (const LabelledPhone& phone : labels.phones) phonesOfIpa(phone.ipa, unknown);
  std::string names;
  for (const std::string& symbol : unknown) names += (names.empty() ? "" : " ") + symbol;
  return names.empty() ? "" : "said with a neutral mouth, since no row of IPA describes them: " + names;
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

struct Speaker::Data {
  Data(SpeakerOptions given, SharedCorpus shared_corpus, std::optional<SharedFace> shared_face)
      : options(std::move(given)), corpus(std::move(shared_corpus)), face(std::move(shared_face)) {}

  SpeakerOptions options;
  SharedCorpus corpus;
  std::optional<SharedFace> face;
  SynthesisOptions synthesis;
  bool owns_corpus = false;               ///< nobody else uses it: what a line has loaded of it may be given back
  const Language* language = &english();  ///< of the lines
  std::optional<Lexicon> lexicon;
  std::optional<Lexicon> line_lexicon;     ///< the same for the line at hand: pronunciations that the corpus can speak
  std::unique_ptr<Voice> voice;            ///< made when the first typed line comes
  std::unique_ptr<Pronouncer> pronouncer;  ///< these two when the first recording without labels comes
  std::unique_ptr<ForcedAligner> aligner;
  std::unique_ptr<Recogniser> recogniser;  ///< when the first recording without words comes; for its hint
  std::string recogniser_hint;
  std::shared_ptr<WordNetwork> word_network;  ///< when the first of either comes
  std::optional<LikelyWords> likely_words;    ///< of the corpus, when the first line comes that lacks some
  std::vector<double> heard_confidence;       ///< of the phones of the recording that was recognised last
  std::vector<std::string> heard_notices;     ///< of the same
  double load_ms = 0;
  std::string edits;  ///< JSON, as the file has them

  const std::shared_ptr<WordNetwork>& network() {
    if (!word_network) word_network = sharedWordNetwork();
    return word_network;
  }
  SpokenLine alignRecording(const Line& line);
  SpokenLine hearRecording(const Line& line);
  SpokenLine speakOrRead(const Line& line);
  /// A song that is written down, sung by a voice or beside a recording of it.
  SungLine songOf(const Line& line);
  /// The line, and for a song, a line drawn as one, or Ma from the sound, what is heard in it.
  SungLine soundOf(const Line& line);
  [[nodiscard]] SynthesisOptions synthesisFor(const Line& line) const;
  void giveBackTakes() const;
  /// The labels with their phones all in words.
  SpeechLabels withLikelyWords(SpeechLabels labels);
  /// The words that neither the lexicon nor the language's dictionary has.
  std::vector<GuessedWord> guessesIn(const SpeechLabels& labels);
  /// What of Ma, Ps, Ja and Li was asked for and does nothing in this line; "" where all of it does.
  [[nodiscard]] std::string idleStyle(const UtteranceAnimation& animation) const;
  /// What people are told of a line besides what its making warned of.
  [[nodiscard]] std::vector<std::string> remarksOn(const UtteranceAnimation& animation, const Line& line,
                                                   const SynthesisRequest& request, const SungLine& sound) const;
};

SpokenLine Speaker::Data::alignRecording(const Line& source) {
  if (!pronouncer) pronouncer = std::make_unique<Pronouncer>(lexicon ? &*lexicon : nullptr, *language);
  if (!aligner) aligner = std::make_unique<ForcedAligner>(std::filesystem::path(), *language);
  SpokenLine line;
  line.audio = readRecording(source.audio);
  line.text = source.text;
  const std::vector<TranscriptWord> words = pronouncer->wordsOf(source.text);
  const SpeechKind kind = source.is_sung ? SpeechKind::kSung : SpeechKind::kSpoken;
  const Seconds lasts = line.audio.duration();
  const bool is_long = lasts > kReadTwice;
  const SamplesToHear to_hear(line.audio);
  if (is_long) line.audio = {};
  const bool asks_network = options.hear != SpeakerOptions::Hear::kPhones;
  std::string failure;
  HeardPhones heard;
  if (asks_network && !source.is_sung) {
    heard = phonesBesideText(*network(), to_hear.all(), *language, failure);
    if (is_long) network()->endWaiting();  // the aligner needs memory, too
  }
  ForcedAlignment alignment =
      aligner->align(to_hear, lasts, words, source.audio.string(), kind, BorderTimes::kFine, heard);
  if (is_long) {
    aligner.reset();  // what it knows of the language takes as long to read as a tenth of a second of sound
    giveBackMemory();
  }
  if (asks_network && failure.empty()) {
    failure = judgeByNetwork(*network(), *pronouncer, to_hear, alignment);
    if (is_long) network()->endWaiting();
  }
  if (is_long) line.audio = readRecording(source.audio);
  line.notice = doubtsAbout(alignment);
  if (!failure.empty()) line.notice += (line.notice.empty() ? "" : "; ") + failure;
  line.labels = std::move(alignment.labels);
  line.voice = "recorded:" + source.audio.filename().string();
  return line;
}

SpokenLine Speaker::Data::hearRecording(const Line& source) {
  const Lexicon* known = lexicon ? &*lexicon : nullptr;
  std::unique_ptr<Recogniser> timed;
  if (!source.times.empty()) {
    timed = makeTimedRecogniser(source.times, known, *language);
  } else if (!recogniser || recogniser_hint != source.hint) {
    RecogniserOptions wanted;
    wanted.as = options.hear == SpeakerOptions::Hear::kWords    ? HearAs::kWords
                : options.hear == SpeakerOptions::Hear::kPhones ? HearAs::kPhones
                                                                : HearAs::kAuto;
    wanted.hint = source.hint;
    wanted.known = linesOf(corpus.data().corpus);
    wanted.speaker = [from = corpus](std::size_t most) { return soundsOf(from.data().corpus, most); };
    wanted.lexicon = known;
    wanted.language = language;
    wanted.word_network = network();
    recogniser = makeRecogniser(wanted);
    recogniser_hint = source.hint;
  }
  SpokenLine line;
  line.audio = readRecording(source.audio);
  const bool is_long = line.audio.duration() > kReadTwice;
  Recogniser& by = timed ? *timed : *recogniser;
  HeardSpeech heard = by.hear(is_long ? std::exchange(line.audio, {}) : line.audio, source.audio.string());
  if (is_long) {
    recogniser.reset();  // to make it anew for the next line takes a second
    giveBackMemory();
    line.audio = readRecording(source.audio);
  }
  line.labels = std::move(heard.labels);
  line.text = std::move(heard.text);
  heard_confidence = std::move(heard.confidence);
  heard_notices = std::move(heard.notices);
  for (const std::string& warning : heard.warnings) line.notice += (line.notice.empty() ? "" : "; ") + warning;
  line.voice = "recorded:" + source.audio.filename().string();
  return line;
}

SpokenLine Speaker::Data::speakOrRead(const Line& source) {
  if (source.audio.empty()) {
    if (lexicon)
      line_lexicon = lexiconForLine(*lexicon, speakableText(source.text, *language), phonePairsOf(corpus.data().units));
    if (!voice) {
      if (options.voice.empty()) options.voice = voiceFor(*language);
      voice = makeVoice(options.voice, VoiceOptions{line_lexicon ? &*line_lexicon : nullptr, &corpus.data().units,
                                                    synthesis.selection, options.rate});
    }
    return voice->speak(source.text);
  }
  if (!source.times.empty() || (source.phones.empty() && source.text.empty())) return hearRecording(source);
  if (source.phones.empty()) return alignRecording(source);
  if (lacksPhones(source.phones)) {
    Line words = source;
    words.times = std::exchange(words.phones, {});
    SpokenLine line = hearRecording(words);
    if (!source.text.empty()) line.text = source.text;
    line.notice += (line.notice.empty() ? "" : "; ") +
                   fmt::format("{} has words without phones: these are found in the sound", words.times.string());
    return line;
  }
  SpokenLine line;
  line.audio = readRecording(source.audio);
  line.labels = readLabels(source.phones, {.language = language});
  if (!aligner) aligner = std::make_unique<ForcedAligner>(std::filesystem::path(), *language);
  if (!source.is_sung) line.notice = doubtsAbout(line.labels, line.audio, *aligner, source.audio.string());
  line.text = source.text;
  for (const LabelledWord& word : line.labels.words) {
    if (source.text.empty()) line.text += (line.text.empty() ? "" : " ") + word.text;
  }
  line.voice = "recorded:" + source.audio.filename().string();
  return line;
}

SpeechLabels Speaker::Data::withLikelyWords(SpeechLabels labels) {
  if (!LikelyWords::areNeededFor(labels)) return labels;
  if (!likely_words) {
    likely_words.emplace(*language);
    const Corpus& own = corpus.data().corpus;
    for (const TakeIndex take : evenlySpreadTakes(own, kTakesOfWords)) likely_words->add(takeOf(own, take).labels);
  }
  return likely_words->complete(labels);
}

std::vector<GuessedWord> Speaker::Data::guessesIn(const SpeechLabels& labels) {
  if (!pronouncer) pronouncer = std::make_unique<Pronouncer>(lexicon ? &*lexicon : nullptr, *language);
  std::vector<GuessedWord> guesses;
  for (const LabelledWord& word : labels.words) {
    if (word.text.empty() || pronouncer->knows(word.text)) continue;
    if (!pronounceKana(word.text).phones.empty()) continue;  // in an English line: of a song, as they are written
    GuessedWord& guess = guesses.emplace_back(GuessedWord{word.text, {}, labels.spanOf(word.phones)});
    for (std::size_t i = word.phones.first.value; i <= word.phones.last.value; ++i)
      guess.phones.emplace_back(labels.phones[i].name());
  }
  return guesses;
}

SungLine Speaker::Data::songOf(const Line& source) {
  const Song song = readSong(source.song);
  AudioClip sound;
  if (!source.audio.empty()) sound = readRecording(source.audio);  // before Festival sings for nothing
  SungLine sung = singSong(song, {{}, lexicon ? &*lexicon : nullptr, {}});
  if (source.audio.empty()) return sung;
  if (!aligner) aligner = std::make_unique<ForcedAligner>(std::filesystem::path(), *language);
  sung = besideSound(std::move(sung), std::move(sound), source.song_offset, *aligner, source.audio.string());
  sung.line.voice = "recorded:" + source.audio.filename().string();
  return sung;
}

SungLine Speaker::Data::soundOf(const Line& source) {
  if (!source.song.empty()) return songOf(source);
  SpokenLine line = speakOrRead(source);
  if (!source.is_sung && !synthesis.curves.ma.automatic && synthesis.curves.alone != CurveStyle::kSing)
    return SungLine{std::move(line), {}, {}};
  SungLine heard = hearSong(std::move(line));
  if (source.audio.empty()) heard.warnings.clear();  // a voice of ours is not silent, clipped or off its text
  return heard;
}

/// Songs are made of curves, with consonants of the capture under them, unless a style or curves alone were asked for.
SynthesisOptions Speaker::Data::synthesisFor(const Line& line) const {
  SynthesisOptions wanted = synthesis;
  // A person's recording says more than its phones; a voice of ours is no person.
  wanted.context.hear = !line.is_sung && (!line.audio.empty() || options.voice == "corpus");
  const bool curves_alone = options.manner.method == Manner::Method::kCurves;
  if (line.is_sung && curves_alone) wanted.curves.alone = CurveStyle::kSing;
  if (line.is_sung && !wanted.curves.alone) {
    wanted.curves.alone = CurveStyle::kSing;
    wanted.curves.layered = wanted.curves.fill_gaps;
  }
  return wanted;
}

std::string Speaker::Data::idleStyle(const UtteranceAnimation& animation) const {
  const bool has_curves =
      !animation.style.empty() || std::any_of(animation.units.begin(), animation.units.end(),
                                              [](const PlacedUnit& unit) { return unit.take.empty(); });
  if (has_curves) return "";
  const Manner& manner = options.manner;
  std::string idle;
  for (const auto& [given, name] : {std::pair(&manner.ma, "Ma"), std::pair(&manner.ps, "Ps"),
                                    std::pair(&manner.ja, "Ja"), std::pair(&manner.li, "Li")}) {
    if (given->isGiven()) idle += fmt::format("{}{}", idle.empty() ? "" : ", ", name);
  }
  if (idle.empty()) return "";
  return fmt::format(
      "{} shape{} VOCAL's curves, and captured motion makes this line: nothing of it is moved by {} (jaw "
      "and lips move it, or the style speech)",
      idle, idle.size() > 2 ? "" : "s", idle.size() > 2 ? "them" : "it");
}

std::vector<std::string> Speaker::Data::remarksOn(const UtteranceAnimation& animation, const Line& line,
                                                  const SynthesisRequest& request, const SungLine& sound) const {
  std::vector<std::string> remarks;
  const auto remark = [&](std::string text) {
    if (!text.empty()) remarks.push_back(std::move(text));
  };
  remark(idleStyle(animation));
  if (!language->is_tuned && line.song.empty())
    remark(fmt::format("{} is untuned: its times and lips were never measured (languages: {})", language->name,
                       tunedLanguages()));
  remark(unknownSymbols(animation.labels));
  remark(sound.line.notice);
  remarks.insert(remarks.end(), sound.warnings.begin(), sound.warnings.end());
  constexpr double kVocalBandHz = 8000;  // VOCAL 4.2
  const CurveOptions& curves = request.options.curves;
  const bool hears_accent = curves.ma.automatic || (animation.style == "sing" && !curves.ma.given);
  if (hears_accent && !request.tags.consonants.empty() && request.tags.consonant_low_hz < kVocalBandHz)
    remark(
        fmt::format("the sound has nothing above 8 kHz: the melodic accent is judged by its consonants above {:.1f} "
                    "kHz",
                    request.tags.consonant_low_hz / 1000));
  return remarks;
}

void Speaker::Data::giveBackTakes() const {
  UnitDatabase& units = corpus.data().units;
  if (!owns_corpus || (options.keep_motion && units.index().phoneCount() <= kMostPhonesKept)) return;
  units.forgetTakes();
  giveBackMemory();
}

Speaker::Speaker(const SpeakerOptions& options) {
  expectUsable(options);
  double load_ms = 0;
  std::optional<SharedFace> face;
  const SharedCorpus corpus = timed(load_ms, [&] {
    std::future<SharedFace> beside;
    if (options.with_face) beside = std::async(std::launch::async, [&] { return SharedFace(options.face); });
    SharedCorpus read(options.corpus);
    if (beside.valid()) face = beside.get();
    return read;
  });
  *this = Speaker(corpus, std::move(face), options);
  data_->owns_corpus = true;
  data_->load_ms += load_ms;
}

Speaker::Speaker(const SharedCorpus& corpus, std::optional<SharedFace> face, const SpeakerOptions& options) {
  expectUsable(options);
  data_ = std::make_unique<Data>(options, corpus, std::move(face));
  timed(data_->load_ms, [&] {
    data_->synthesis = synthesisOf(options.manner, corpus.data().curve_model);
    if (!options.manner.edits.empty()) data_->edits = readFile(options.manner.edits);
    data_->language = &languageFor(data_->options);
    if (!options.lexicon.empty()) data_->lexicon = Lexicon::read(options.lexicon, *data_->language);
  });
}

Speaker::Speaker(Speaker&&) noexcept = default;
Speaker& Speaker::operator=(Speaker&&) noexcept = default;
Speaker::~Speaker() = default;

Performance Speaker::perform(std::string_view text) { return perform(Line::typed(std::string(text))); }
FrameStream Speaker::stream(std::string_view text) { return FrameStream(perform(text)); }

LiveStream Speaker::live(const LiveOptions& options) const {
  return makeLiveStream({data_->corpus, data_->face, data_->synthesis, data_->options.voice, data_->options.rate,
                         data_->lexicon, data_->language, data_->options.hear},
                        options);
}

Performance Speaker::perform(const Line& given) {
  double speech_ms = 0;
  data_->heard_confidence.clear();
  data_->heard_notices.clear();
  const LineEdits& edits = data_->synthesis.edits;
  std::vector<std::string> doubts;
  Line line = given;
  // While a typed line is spoken the face is made ready; an hour's recording shall not be heard for a face that fails.
  const auto await_face = [&] {
    if (data_->face) timed(data_->load_ms, [&] { static_cast<void>(data_->face->data().rig()); });
  };
  if (!line.audio.empty()) await_face();
  if (!line.text.empty()) line.text = withWords(std::move(line.text), edits.words, doubts);
  SungLine sound = timed(speech_ms, [&] { return data_->soundOf(line); });
  if (!line.is_sung && line.song.empty()) sound.line.labels = data_->withLikelyWords(std::move(sound.line.labels));
  SpeechLabels labels_before = sound.line.labels;
  sound.line.labels = withBorders(std::move(sound.line.labels), edits.borders, doubts);

  const SynthesisRequest request{sound.line.text,
                                 sound.line.voice,
                                 std::move(sound.line.labels),
                                 {},
                                 data_->synthesisFor(line),
                                 std::move(sound.line.units),
                                 std::move(sound.tags)};
  auto made = std::make_shared<Performance::Data>();
  made->face = data_->face;
  made->corpus = data_->corpus;
  made->actor = data_->corpus.data().actor;
  if (!data_->edits.empty()) made->edits = data_->edits;
  made->tells_timing = data_->options.timing;
  UtteranceAnimation& animation = made->animation;
  animation.audio = std::move(sound.line.audio);  // where motion that is made later looks for it
  SynthesisedLine synthesised = synthesiseForPieces(request, data_->corpus.data().units, animation.audio);
  made->later = std::move(synthesised.motion);
  synthesised.animation.audio = std::move(animation.audio);
  animation = std::move(synthesised.animation);
  animation.corpus = data_->corpus.name();
  if (data_->options.page_engine) {
    SynthesisRequest again = request;
    again.labels = std::move(labels_before);
    again.options.edits = {};
    if (const std::string_view reason = whyNotPacked(again); reason.empty()) {
      made->to_make_again = std::move(again);
    } else {
      animation.notices.push_back(fmt::format("the page cannot make this line again by itself: {}", reason));
    }
  }
  await_face();
  std::vector<std::string> remarks = data_->remarksOn(animation, line, request, sound);
  animation.warnings.insert(animation.warnings.begin(), doubts.begin(), doubts.end());
  animation.warnings.insert(animation.warnings.end(), remarks.begin(), remarks.end());
  animation.notices.insert(animation.notices.begin(), sound.notices.begin(), sound.notices.end());
  animation.notices.insert(animation.notices.begin(), data_->heard_notices.begin(), data_->heard_notices.end());
  if (!animation.head.empty() && data_->face && isGlb(data_->face->data().meshPath()))
    animation.notices.emplace_back(
        "the head's motion is in films and in Live Link's CSV; a head that came as GLB has a skeleton of its own and "
        "stays as it is there");
  animation.timing_ms.speech = speech_ms;
  animation.timing_ms.load = std::exchange(data_->load_ms, 0.0);
  if (data_->options.manner.backoff == Manner::Backoff::kNone && animation.style.empty())
    expectNoBackoff(animation, data_->corpus.data().path.string());
  made->guesses = data_->guessesIn(animation.labels);
  made->tags = request.tags;
  made->confidence = std::move(data_->heard_confidence);
  made->style = styleFor(request.options.curves, request.labels, request.tags);
  data_->giveBackTakes();
  return Performance(std::move(made));
}

std::vector<std::string> voiceNames() { return knownVoices(); }
const char* version() { return MOUTHPIECE_VERSION; }

Line Line::typed(std::string text) { return {std::move(text), {}, {}, {}, false}; }
Line Line::recorded(std::filesystem::path audio, std::string transcript) {
  return {std::move(transcript), std::move(audio), {}, {}, false};
}
Line Line::labelled(std::filesystem::path audio, std::filesystem::path phones) {
  return {{}, std::move(audio), std::move(phones), {}, false};
}
Line Line::heard(std::filesystem::path audio, std::string hint) {
  return {{}, std::move(audio), {}, {}, false, {}, std::move(hint)};
}
Line Line::timed(std::filesystem::path audio, std::filesystem::path times) {
  return {{}, std::move(audio), {}, {}, false, std::move(times)};
}
Line Line::singing(std::filesystem::path song, std::filesystem::path audio) {
  return {{}, std::move(audio), {}, std::move(song), true};
}
Line Line::sung(std::filesystem::path audio, const std::filesystem::path& lyrics) {
  return {readLyrics(lyrics), std::move(audio), {}, {}, true};
}
Line Line::sungWords(std::filesystem::path audio, std::string_view lyrics) {
  return {parseLyrics(lyrics, "lyrics"), std::move(audio), {}, {}, true};
}

}  // namespace mouthpiece
