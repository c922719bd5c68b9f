#include "mouthpiece/speaker.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <future>

#include "base/errors.h"
#include "base/files.h"
#include "base/memory.h"
#include "deform/mesh/mesh_files.h"
#include "page_engine/line_package.h"
#include "phonetics/text/lexicon.h"
#include "phonetics/text/speakable_text.h"
#include "speaker/line_sounds.h"
#include "speaker/live_setup.h"
#include "speaker/manner.h"
#include "speaker/shared_files.h"
#include "speaker/speaker_data.h"

namespace mouthpiece {
namespace {

/// About three hours of speech: what a line has loaded of a larger corpus is given back before its face takes memory.
/// Of a smaller one it stays for the next line.
constexpr std::size_t kMostPhonesKept = 70'000;

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

/// Symbols of the labels that no row of IPA describes, for a warning; "" for none.
std::string unknownSymbols(const SpeechLabels& labels) {
  std::vector<std::string> unknown;
  for (const LabelledPhone& phone : labels.phones) phonesOfIpa(phone.ipa, unknown);
  std::string names;
  for (const std::string& symbol : unknown) names += (names.empty() ? "" : " ") + symbol;
  return names.empty() ? "" : "said with a neutral mouth, since no row of IPA describes them: " + names;
}

std::vector<GuessedWord> guessesOf(const SpeechLabels& labels, std::span<const std::size_t> words) {
  std::vector<GuessedWord> guesses;
  for (const std::size_t i : words) {
    const LabelledWord& word = labels.words[i];
    GuessedWord& guess = guesses.emplace_back(GuessedWord{word.text, {}, labels.spanOf(word.phones)});
    for (std::size_t phone = word.phones.first.value; phone <= word.phones.last.value; ++phone)
      guess.phones.emplace_back(labels.phones[phone].name());
  }
  return guesses;
}

/// One sentence for all of them.
std::string noticeOf(std::span<const GuessedWord> guesses) {
  constexpr std::size_t kMostNamed = 12;
  std::string named;
  for (const GuessedWord& guess : guesses.first(std::min(guesses.size(), kMostNamed)))
    named += fmt::format("{}{} ({:.2f} s: {})", named.empty() ? "" : ", ", guess.text, guess.span.start,
                         fmt::join(guess.phones, " "));
  if (guesses.size() > kMostNamed) named += fmt::format(" and {} more", guesses.size() - kMostNamed);
  return fmt::format("no dictionary has {}: these sounds are guessed (-o lexicon.txt writes them down to be mended)",
                     named);
}

}  // namespace

struct Speaker::Data {
  Data(const SpeakerOptions& given, const SharedCorpus& shared_corpus, std::optional<SharedFace> shared_face)
      : options(given),
        corpus(shared_corpus),
        face(std::move(shared_face)),
        synthesis(synthesisOf(options.manner, corpus.data().curve_model)),
        language(languageFor(options)) {
    if (!options.manner.edits.empty()) edits = readFile(options.manner.edits);
    if (!options.lexicon.empty()) lexicon = Lexicon::read(options.lexicon, language);
    sounds.emplace(options, corpus, synthesis, language, lexicon ? &*lexicon : nullptr);
  }

  SpeakerOptions options;
  SharedCorpus corpus;
  std::optional<SharedFace> face;
  SynthesisOptions synthesis;
  const Language& language;  ///< of the lines
  std::string edits;         ///< JSON, as the file has them
  std::optional<Lexicon> lexicon;
  std::optional<LineSounds> sounds;
  bool owns_corpus = false;  ///< nobody else uses it: what a line has loaded of it may be given back
  double load_ms = 0;

  [[nodiscard]] SynthesisOptions synthesisFor(const Line& line) const;
  void giveBackTakes() const;
  /// What of Ma, Ps, Ja and Li was asked for and does nothing in this line; "" where all of it does.
  [[nodiscard]] std::string idleStyle(const UtteranceAnimation& animation) const;
  /// What people are told of a line besides what its making warned of.
  [[nodiscard]] std::vector<std::string> remarksOn(const UtteranceAnimation& animation, const Line& line,
                                                   const SynthesisRequest& request, const SungLine& sound) const;
};

/// Songs are made of curves, with consonants of the capture under them, unless a style or curves alone were asked for.
SynthesisOptions Speaker::Data::synthesisFor(const Line& line) const {
  SynthesisOptions wanted = synthesis;
  // A person's recording says more than its phones; a voice of ours is no person.
  wanted.context.hear = !line.is_sung && (!line.audio.empty() || options.usual_voice == "corpus");
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
  if (!language.is_tuned && line.song.empty())
    remark(fmt::format("{} is untuned: its times and lips were never measured (languages: {})", language.name,
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
  double load_ms = 0;
  timed(load_ms, [&] { data_ = std::make_unique<Data>(options, corpus, std::move(face)); });
  data_->load_ms = load_ms;
}

Speaker::Speaker(Speaker&&) noexcept = default;
Speaker& Speaker::operator=(Speaker&&) noexcept = default;
Speaker::~Speaker() = default;

Performance Speaker::perform(std::string_view text) { return perform(Line::typed(std::string(text))); }
FrameStream Speaker::stream(std::string_view text) { return FrameStream(perform(text)); }

LiveStream Speaker::live(const LiveOptions& options) const {
  return makeLiveStream({data_->corpus, data_->face, data_->synthesis, data_->options.usual_voice, data_->options.rate,
                         data_->lexicon, &data_->language, data_->options.hear},
                        options);
}

Performance Speaker::perform(const Line& given) {
  double speech_ms = 0;
  const LineEdits& edits = data_->synthesis.edits;
  std::vector<std::string> doubts;
  Line line = given;
  // While a typed line is spoken the face is made ready; an hour's recording shall not be heard for a face that fails.
  const auto await_face = [&] {
    if (data_->face) timed(data_->load_ms, [&] { static_cast<void>(data_->face->data().rig()); });
  };
  if (!line.audio.empty()) await_face();
  std::vector<std::string> unspeakable;
  line.text = withoutLoneCharacters(line.text, data_->language, unspeakable);
  if (!line.text.empty()) line.text = withWords(std::move(line.text), edits.words, doubts);
  LineSound sound = timed(speech_ms, [&] { return data_->sounds->soundOf(line); });
  if (!line.is_sung && line.song.empty())
    sound.line.labels = data_->sounds->withLikelyWords(std::move(sound.line.labels));
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
  if (!animation.head.empty() && data_->face && isGlb(data_->face->data().meshPath()))
    animation.notices.emplace_back(
        "the head's motion is in films and in Live Link's CSV; a head that came as GLB has a skeleton of its own and "
        "stays as it is there");
  animation.timing_ms.speech = speech_ms;
  animation.timing_ms.load = std::exchange(data_->load_ms, 0.0);
  if (data_->options.manner.backoff == Manner::Backoff::kNone && animation.style.empty())
    expectNoBackoff(animation, data_->corpus.data().path.string());
  animation.guessed_words = data_->sounds->guessedWords(animation.labels);
  made->guesses = guessesOf(animation.labels, animation.guessed_words);
  if (!unspeakable.empty())
    animation.notices.push_back(fmt::format("left out, since no voice of {} says them: {}", data_->language.name,
                                            printable(fmt::format("{}", fmt::join(unspeakable, " ")), 120)));
  if (!made->guesses.empty()) animation.notices.push_back(noticeOf(made->guesses));
  made->tags = request.tags;
  made->confidence = std::move(sound.confidence);
  made->style = styleFor(request.options.curves, request.labels, request.tags);
  data_->giveBackTakes();
  return Performance(std::move(made));
}

std::vector<std::string> voiceNames() { return knownVoices(); }
const char* version() { return MOUTHPIECE_VERSION; }

}  // namespace mouthpiece
