#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <future>
#include <limits>
#include <numeric>
#include <optional>
#include <string>
#include <utility>

#include "base/errors.h"
#include "base/index.h"
#include "base/memory.h"
#include "base/text_encoding.h"
#include "hearing/alignment/forced_alignment.h"
#include "hearing/alignment/phone_ear.h"
#include "hearing/alignment/pronouncer.h"
#include "hearing/alignment/samples_to_hear.h"
#include "hearing/recognition/collected_speech.h"
#include "hearing/recognition/hearing_odds.h"
#include "hearing/recognition/known_lines.h"
#include "hearing/recognition/network_phones.h"
#include "hearing/recognition/phones_in_words.h"
#include "hearing/recognition/recogniser.h"
#include "hearing/recognition/said_stretches.h"
#include "hearing/recognition/sound_search.h"
#include "hearing/recognition/stretch_hearing.h"
#include "hearing/recognition/word_network.h"

namespace mouthpiece {
namespace {

/// Words fit a stretch when their phones have this share of what is heard, in the mean over its frames; words of a
/// hint or a corpus do at less, and are taken before others that fit a little better. Where they surely fit no others
/// are looked for (docs/theory/hearing/recognition.md).
constexpr double kWordsFit = 0.40, kBookFits = 0.25, kBookBonus = 1.15, kSurelyFits = 0.70;
/// Where the speaker is known, words of the language model fit this share of what the phones do that are heard without
/// them, or the phones are taken: an ear that knows the speaker hears phones better than words that do not.
constexpr double kWordsAgainstPhones = 0.85;
/// Of who is not known even words that are wrong in part tell more than phones that are heard without them: words of
/// the language model are taken where they have these odds as a transcript's (logarithm, mean).
constexpr double kWordsBelieved = 3.0;
/// A word's phones weigh so much against what is heard without it, where it fits as words that are taken do.
constexpr double kWordWeight = 0.8;
/// Words of whose pairs a smaller share follow each other in a corpus' lines are none of its lines.
constexpr double kLeastInOrder = 0.8;
/// Where a network's words are in less of such order, the lines are not looked for.
constexpr double kLeastNearOrder = 0.15;
/// A network hears words by those around them, so that stretches are heard together across such a pause.
constexpr Seconds kNearPause = 1.0;
/// Nobody speaks where a network hears less of phones.
constexpr Seconds kLeastPhones = 0.1;
/// A longer sound is heard by one after the other, for memory: by the network after the speaker is learnt, and by the
/// rest after the network's program has ended. To start that anew takes a few thousandths of its time.
constexpr Seconds kOneAfterTheOther = SamplesToHear::kInMemoryUntil;

/// Words for a stretch, with their phones on its clock.
struct WordsHeard {
  ForcedAlignment alignment;
  std::vector<double> fits;  ///< of each phone: its share of what is heard
  double fit = 0;            ///< of all, in the mean over time
  double believed = 1;       ///< as a transcript is, the least believed of its lines
  double word_odds = 0;      ///< logarithm of the odds of a word as a transcript's, the mean
};

/// Words of a model of the language for a stretch.
struct ModelWords {
  WordsHeard heard;
  double odds = 0;                ///< logarithm of the odds that many are wrong
  std::vector<double> word_odds;  ///< of each of its words, that it is; none where they are not the labels' words
  bool by_network = false;
};

/// What the ear alone hears of a stretch.
struct HeardByEar {
  Eigen::MatrixXf posteriors;
  bool is_speaker = false;  ///< PhoneEar::knowsSpeaker()
  VoiceTransform voice;     ///< PhoneEar::voice()
};

/// What is heard of a stretch before it is known which words are taken.
struct Stretch {
  std::span<const std::int16_t> samples;  ///< 16 kHz
  AudioClip clip;                         ///< the same
  TimeSpan span;                          ///< on the sound's clock
  bool is_speaker;                        ///< HeardByEar
  VoiceTransform voice;                   ///< the same
  StretchHearing hearing;                 ///< by the ear alone, which the odds of words were learnt from
  HeardPhones by_network;                 ///< none where the network does not hear it
  std::optional<StretchHearing> by_both;  ///< by the ear and the network, where this hears it
  [[nodiscard]] const StretchHearing& phones() const { return by_both ? *by_both : hearing; }
};

/// The words that are taken for a stretch, if any, and the logarithm of the odds that much of them is wrong.
struct Decision {
  std::optional<WordsHeard> words;
  bool are_taken = false;         ///< else phones are heard, by the words where they fit
  bool by_model = false;          ///< no hint's or corpus' words
  std::vector<double> word_odds;  ///< ModelWords::word_odds
  double odds = 0;
};

class SoundRecogniser : public Recogniser {
 public:
  explicit SoundRecogniser(const RecogniserOptions& options)
      : options_(options), language_(*options.language), ear_(language_), likeness_(lipLikeness()) {
    hears_network_phones_ = options_.word_network && options_.word_network->isThere();
    if (options_.as == HearAs::kPhones) return;
    if (!WordSearch::isAvailable(language_)) {
      if (options_.as == HearAs::kWords) WordSearch search(language_);  // says what is missing
      return;
    }
    pronouncer_.emplace(options_.lexicon, language_);
    aligner_.emplace(std::filesystem::path(), language_);
    lines_.emplace(options_.hint, options_.known, *pronouncer_);
  }

  HeardSpeech hear(AudioClip audio, std::string_view name) override;

 private:
  /// PocketSphinx, from when it is first asked.
  WordSearch& search();
  [[nodiscard]] HeardByEar hearByEar(std::span<const std::int16_t> samples);
  /// Whether known lines may be said, by the network's words where it heard some.
  [[nodiscard]] bool mayBeKnown(const std::vector<NetworkWord>& by_network, bool is_speaker) const;
  /// The logarithm of the odds that much of known lines' words is wrong, against a network's: a hint's words are meant,
  /// and of the corpus' speaker those that follow each other as in its lines.
  [[nodiscard]] double oddsOfKnown(const WordsHeard& words, const Stretch& stretch, double in_order) const;
  std::optional<WordsHeard> wordsAs(std::string_view text, const Stretch& stretch);
  std::optional<ModelWords> wordsBySearch(const Stretch& stretch);
  std::optional<ModelWords> wordsByNetwork(const std::vector<NetworkWord>& words, const Stretch& stretch);
  /// The likelier of both.
  std::optional<ModelWords> wordsByModels(const std::vector<NetworkWord>& by_network, const Stretch& stretch);
  Decision decide(const std::vector<NetworkWord>& by_network, const Stretch& stretch);
  /// The network's words of each stretch of `to_hear`; none where it fails, which `heard` then tells.
  std::vector<std::vector<NetworkWord>> networkWords(std::span<const std::span<const std::int16_t>> stretches,
                                                     const SamplesToHear& to_hear, HeardSpeech& heard) const;
  /// What the network hears of a stretch; nothing where there is none, or where it fails, which `heard` then tells.
  HeardPhones hearByNetwork(std::span<const std::int16_t> samples, HeardSpeech& heard);
  /// What it hears of a stretch whose speaker is not known.
  HeardPhones phonesOf(const Said& said, HeardSpeech& heard);
  /// `phones`, `by_network`: the network's phones and words.
  void hearStretch(const Said& said, HeardByEar by_ear, HeardPhones phones, const std::vector<NetworkWord>& by_network,
                   CollectedSpeech& all);
  void collectPhones(const Stretch& stretch, const WordsHeard* words, CollectedSpeech& all) const;

  RecogniserOptions options_;
  const Language& language_;
  PhoneEar ear_;
  Eigen::MatrixXf likeness_;
  std::optional<Pronouncer> pronouncer_;
  std::optional<WordSearch> search_;
  std::optional<ForcedAligner> aligner_;
  std::optional<KnownLines> lines_;
  bool hears_network_phones_ = false;
  double noisiness_ = 0;       ///< noisinessOf() the sound
  HeardPhones phones_of_all_;  ///< the network's of the whole sound; none where it is long, or not noisy
};

WordSearch& SoundRecogniser::search() {
  if (!search_) {
    search_.emplace(language_);
    search_->setBook(lines_->book());
  }
  return *search_;
}

std::string textOf(const std::vector<std::string>& words) { return fmt::format("{}", fmt::join(words, " ")); }

std::string textOf(const std::vector<NetworkWord>& words) {
  std::string text;
  for (const NetworkWord& word : words) text += (text.empty() ? "" : " ") + word.text;
  return text;
}

HeardByEar SoundRecogniser::hearByEar(std::span<const std::int16_t> samples) {
  Eigen::MatrixXf posteriors = ear_.posteriors(samples);
  return {std::move(posteriors), ear_.knowsSpeaker(), ear_.voice()};
}

bool SoundRecogniser::mayBeKnown(const std::vector<NetworkWord>& by_network, bool is_speaker) const {
  if (lines_->book().lines.empty()) return false;
  if (!options_.hint.empty() || is_speaker || by_network.empty()) return true;
  std::vector<std::string> words;
  try {
    for (const TranscriptWord& word : pronouncer_->wordsOf(textOf(by_network))) words.push_back(lowerCase(word.text));
  } catch (const InputError&) {  // nothing that can be said
    return true;
  }
  return lines_->inOrder(words) >= kLeastNearOrder;
}

std::optional<WordsHeard> SoundRecogniser::wordsAs(std::string_view text, const Stretch& stretch) {
  if (text.empty()) return std::nullopt;
  WordsHeard heard;
  try {
    heard.alignment = aligner_->align(SamplesToHear(stretch.clip), stretch.clip.duration(), pronouncer_->wordsOf(text),
                                      "stretch", SpeechKind::kSpoken, BorderTimes::kFine, stretch.by_network);
  } catch (const InputError&) {  // the stretch is too short for them
    return std::nullopt;
  }
  for (const double line : heard.alignment.line_confidence) heard.believed = std::min(heard.believed, line);
  for (const double word : heard.alignment.confidence)
    heard.word_odds += oddsOfConfidence(word) / asReal(heard.alignment.confidence.size());
  double time = 0;
  for (const LabelledPhone& phone : heard.alignment.labels.phones) {
    heard.fits.push_back(stretch.hearing.fitOf(phone.phone, phone.span));
    if (phone.phone == Phone::kSil) continue;
    heard.fit += heard.fits.back() * phone.span.duration();
    time += phone.span.duration();
  }
  heard.fit /= std::max(time, kEarStep);
  return heard;
}

void collectWords(const WordsHeard& words, Seconds start, CollectedSpeech& all) {
  const SpeechLabels& labels = words.alignment.labels;
  std::vector<std::size_t> numbers;
  for (const LabelledWord& word : labels.words) numbers.push_back(all.addWord(word.text));
  for (std::size_t i = 0; i < labels.phones.size(); ++i) {
    const LabelledPhone& phone = labels.phones[i];
    if (phone.phone == Phone::kSil) continue;
    PhoneSegment segment{.phone = phone.phone, .span = {phone.span.start + start, phone.span.end + start}};
    if (phone.word) segment.word = numbers[*phone.word];
    if (phone.syllable) {
      segment.syllable = phone.syllable;
      if (isVowel(phone.phone)) segment.stress = labels.syllables[*phone.syllable].stress;
    }
    all.addPhone(segment, words.fits[i]);
  }
}

void SoundRecogniser::collectPhones(const Stretch& stretch, const WordsHeard* words, CollectedSpeech& all) const {
  const StretchHearing& hearing = stretch.phones();
  std::vector<HeardPhone> row = hearing.row();
  if (words != nullptr) {
    // What a word says counts by how well it fits.
    const double full = std::max(kWordsFit, hearing.fit());
    Eigen::MatrixXf posteriors = hearing.posteriors();
    for (const LabelledPhone& phone : words->alignment.labels.phones) {
      if (!phone.word) continue;
      const auto weight = asFloat(kWordWeight * std::min(1.0, hearing.fitOf(phone.phone, phone.span) / full));
      const auto [first, end] = hearing.framesOf(phone.span);
      posteriors.middleCols(first, end - first) *= 1 - weight;
      posteriors.row(signedIndex(static_cast<std::size_t>(phone.phone))).segment(first, end - first).array() += weight;
    }
    row = likeliestPhones(posteriors, likeness_, kFurtherPhone);
  }
  for (const HeardPhone& phone : row) {
    if (phone.phone == Phone::kSil) continue;
    const TimeSpan span = spanOf(phone);
    all.addPhone({.phone = phone.phone, .span = {span.start + stretch.span.start, span.end + stretch.span.start}},
                 phone.confidence);
  }
}

std::vector<std::vector<NetworkWord>> SoundRecogniser::networkWords(
    std::span<const std::span<const std::int16_t>> stretches, const SamplesToHear& to_hear, HeardSpeech& heard) const {
  std::vector<std::vector<NetworkWord>> words(stretches.size());
  try {
    for (std::size_t first = 0; first < stretches.size(); first += WordNetwork::kAskedOfOneProgram) {
      if (first > 0) options_.word_network->endWaiting();
      const std::size_t count = std::min(WordNetwork::kAskedOfOneProgram, stretches.size() - first);
      std::ranges::move(options_.word_network->hear(stretches.subspan(first, count)),
                        words.begin() + signedIndex(first));
      to_hear.letGo();
    }
  } catch (const InputError& error) {
    heard.warnings.push_back(fmt::format("the network that hears words was not heard ({})", error.what()));
    words.assign(stretches.size(), {});
  }
  return words;
}

double SoundRecogniser::oddsOfKnown(const WordsHeard& words, const Stretch& stretch, double in_order) const {
  if (!options_.hint.empty()) return -std::numeric_limits<double>::infinity();
  if (stretch.is_speaker) return in_order < kLeastInOrder ? 0 : -std::numeric_limits<double>::infinity();
  return oddsOfCorpusWords(stretch.hearing.apartFrom(words.alignment.labels), words.word_odds, in_order);
}

/// Whether words of a model are taken, not the phones that are heard without them.
bool areLikely(const ModelWords& words, const Stretch& stretch) {
  const WordsHeard& heard = words.heard;
  if (stretch.is_speaker && !(words.by_network && words.odds < kNetworkTrusted))
    return heard.fit >= std::max(kWordsFit, kWordsAgainstPhones * stretch.hearing.fit()) &&
           heard.believed >= kDoubtfulConfidence;
  return words.by_network ? words.odds < kNetworkUnlikely : heard.word_odds >= kWordsBelieved;
}

Decision SoundRecogniser::decide(const std::vector<NetworkWord>& by_network, const Stretch& stretch) {
  const StretchHearing& hearing = stretch.hearing;
  Decision decision;
  std::optional<WordsHeard>& best = decision.words;
  std::optional<ModelWords> found;
  double in_order = 0;
  if (mayBeKnown(by_network, stretch.is_speaker)) {
    const std::vector<std::string> words = search().hearBook(stretch.samples, stretch.voice);
    // Any sound is some row of a corpus' words; who does not speak its lines is not heard by them.
    in_order = lines_->inOrder(words);
    const bool may_be = !options_.hint.empty() || stretch.is_speaker || in_order >= kLeastInOrder;
    if (may_be) best = wordsAs(textOf(words), stretch);
  }
  if (!best || best->fit < kSurelyFits) {
    std::optional<ModelWords> any = wordsByModels(by_network, stretch);
    if (any && (!best || any->heard.fit > kBookBonus * best->fit ||
                (any->by_network && any->odds < oddsOfKnown(*best, stretch, in_order)))) {
      best = any->heard;
      found = std::move(any);
    }
  }
  const bool is_likely = best && (found ? areLikely(*found, stretch) : best->fit >= kBookFits);
  decision.are_taken = best && (options_.as == HearAs::kWords || is_likely);
  decision.by_model = found.has_value();
  if (decision.are_taken && found) {
    decision.odds = found->odds;
    decision.word_odds = found->word_odds;
  } else if (decision.are_taken && options_.hint.empty() && !stretch.is_speaker) {
    decision.odds = oddsOfKnown(*best, stretch, in_order);
  } else {
    decision.odds = best ? oddsOfWords(hearing.apartFrom(best->alignment.labels), best->word_odds)
                         : oddsOfWords(1, std::log(kLeastBelieved));
  }
  return decision;
}

/// Names words of a model that are likely wrong; their phones are no surer than they are.
void doubtWords(const std::vector<double>& word_odds, Seconds start, WordsHeard& words, CollectedSpeech& all) {
  const SpeechLabels& labels = words.alignment.labels;
  if (labels.words.size() != word_odds.size()) return;  // a word that is written as several is aligned as these
  for (std::size_t word = 0; word < labels.words.size(); ++word) {
    const double odds = word_odds[word];
    if (odds < kWordDoubted) continue;
    const LabelledWord& doubted = labels.words[word];
    all.doubtWord(doubted.text, start + labels.spanOf(doubted.phones).start);
    for (std::size_t i = doubted.phones.first.value; i <= doubted.phones.last.value; ++i)
      words.fits[i] = std::min(words.fits[i], 1 / (1 + std::exp(odds)));
  }
}

/// Where nothing but silence is heard without words, words of a model that are less likely said than not are what it
/// makes of noise: a network hears "you" in wind.
bool isNoSpeech(const Decision& decision, const StretchHearing& hearing) {
  const bool are_said = decision.are_taken && (!decision.by_model || decision.words->word_odds >= 0);
  return hearing.heardFor() == 0 && !are_said;
}

HeardPhones SoundRecogniser::hearByNetwork(std::span<const std::int16_t> samples, HeardSpeech& heard) {
  if (!hears_network_phones_) return {};
  try {
    return hearPhones(*options_.word_network, samples, *options_.language);
  } catch (const InputError& error) {
    heard.warnings.push_back(fmt::format("the network that hears phones was not heard ({})", error.what()));
    hears_network_phones_ = false;
    return {};
  }
}

HeardPhones SoundRecogniser::phonesOf(const Said& said, HeardSpeech& heard) {
  constexpr std::size_t kSamplesAFrame = 160;
  const auto first = static_cast<Eigen::Index>(std::lround(said.start / kEarStep)),
             frames = signedIndex(said.samples.size() / kSamplesAFrame);
  return first + frames <= phones_of_all_.cols() ? HeardPhones(phones_of_all_.middleCols(first, frames))
                                                 : hearByNetwork(said.samples, heard);
}

void SoundRecogniser::hearStretch(const Said& said, HeardByEar by_ear, HeardPhones phones,
                                  const std::vector<NetworkWord>& by_network, CollectedSpeech& all) {
  StretchHearing hearing(std::move(by_ear.posteriors), likeness_);
  std::optional<StretchHearing> by_both;
  if (phones.cols() > 0) {
    const Eigen::MatrixXf& posteriors = hearing.posteriors();
    by_both.emplace(heardByBoth(posteriors, phones.leftCols(posteriors.cols()), noisiness_, *options_.language),
                    likeness_);
  }
  Stretch stretch{.samples = said.samples,
                  .clip = {SamplesToHear::kRateHz, {}},
                  .span = {said.start, said.start + hearing.duration()},
                  .is_speaker = by_ear.is_speaker,
                  .voice = std::move(by_ear.voice),
                  .hearing = std::move(hearing),
                  .by_network = std::move(phones),
                  .by_both = std::move(by_both)};
  const bool is_noise = stretch.by_both && options_.hint.empty() && heardAsPhones(stretch.by_network) < kLeastPhones;
  if (is_noise) return all.passOver(stretch.span);
  if (!pronouncer_) {
    const StretchHearing& by_all = stretch.phones();
    if (by_all.heardFor() == 0) return all.passOver(stretch.span);
    all.addStretch(stretch.span, oddsOfPhones(by_all.fit(), by_all.heardFor() / by_all.duration()), by_all.heardFor());
    return collectPhones(stretch, nullptr, all);
  }
  for (const std::int16_t sample : said.samples) stretch.clip.samples.push_back(static_cast<float>(sample) / 32768.0F);
  Decision decision = decide(by_network, stretch);
  std::optional<WordsHeard>& words = decision.words;
  if (isNoSpeech(decision, stretch.phones())) return all.passOver(stretch.span);
  all.addStretch(stretch.span, decision.odds, stretch.hearing.heardFor());
  if (!decision.are_taken) return collectPhones(stretch, words ? &*words : nullptr, all);
  doubtWords(decision.word_odds, said.start, *words, all);
  SpeechLabels& labels = words->alignment.labels;
  if (stretch.by_both && labels.words.size() == decision.word_odds.size())
    hearUnlikelyWords(*stretch.by_both, decision.word_odds, labels, words->fits);
  if ((decision.by_model || options_.hint.empty()) && !stretch.is_speaker)
    keepClosings(stretch.phones(), labels.phones, words->fits);
  collectWords(*words, said.start, all);
}

std::optional<ModelWords> SoundRecogniser::wordsByModels(const std::vector<NetworkWord>& by_network,
                                                         const Stretch& stretch) {
  std::optional<ModelWords> any = wordsByNetwork(by_network, stretch);
  if (any && (any->odds < kNetworkUnlikely || noisiness_ > 0)) return any;  // in noise the search adds nothing
  std::optional<ModelWords> searched = wordsBySearch(stretch);              // the network's would not be taken
  return !any || (searched && searched->odds < any->odds) ? searched : any;
}

std::optional<ModelWords> SoundRecogniser::wordsBySearch(const Stretch& stretch) {
  const FoundWords found = search().hear(stretch.samples, stretch.voice);
  std::optional<WordsHeard> heard = wordsAs(textOf(found.words), stretch);
  if (!heard) return std::nullopt;
  const double rivals = std::accumulate(found.rivals.begin(), found.rivals.end(), 0.0) / asReal(found.rivals.size());
  ModelWords words{.heard = std::move(*heard), .odds = 0, .word_odds = {}};
  words.odds = oddsOfModelWords(words.heard.word_odds, rivals);
  const std::vector<double>& confidence = words.heard.alignment.confidence;
  for (std::size_t i = 0; i < confidence.size() && confidence.size() == found.rivals.size(); ++i)
    words.word_odds.push_back(oddsOfModelWord(oddsOfConfidence(confidence[i]), found.rivals[i]));
  return words;
}

std::optional<ModelWords> SoundRecogniser::wordsByNetwork(const std::vector<NetworkWord>& words,
                                                          const Stretch& stretch) {
  double sure = 0;
  for (const NetworkWord& word : words) sure += word.log_probability / asReal(words.size());
  std::optional<WordsHeard> heard = wordsAs(textOf(words), stretch);
  if (!heard) return std::nullopt;
  ModelWords found{.heard = std::move(*heard), .odds = 0, .word_odds = {}, .by_network = true};
  found.odds = oddsOfNetworkWords(found.heard.word_odds, sure);
  const std::vector<double>& confidence = found.heard.alignment.confidence;
  for (std::size_t i = 0; i < confidence.size() && confidence.size() == words.size(); ++i)
    found.word_odds.push_back(oddsOfNetworkWord(oddsOfConfidence(confidence[i]), words[i].log_probability));
  return found;
}

HeardSpeech SoundRecogniser::hear(AudioClip audio, std::string_view name) {
  const Seconds lasts = audio.duration();
  const SamplesToHear to_hear(audio);
  audio = {};
  const std::span<const std::int16_t> samples = to_hear.all();
  HeardSpeech heard;
  heard.stretches = findSpeech(samples);
  noisiness_ = noisinessOf(samples);
  phones_of_all_ = noisiness_ > 0 ? hearByNetwork(samples, heard) : HeardPhones();
  if (phones_of_all_.cols() > 0) heard.stretches = withHeardSpeech(std::move(heard.stretches), phones_of_all_);
  const bool is_long = lasts > kOneAfterTheOther;
  if (is_long) phones_of_all_ = {};
  to_hear.letGo();
  const bool has_network = pronouncer_ && options_.word_network && options_.word_network->isThere();
  const std::vector<Said> said = whatIsSaid(samples, heard.stretches, has_network ? kNearPause : 0);
  std::vector<std::span<const std::int16_t>> stretches, with_margins;
  for (const Said& stretch : said) {
    stretches.push_back(stretch.samples);
    with_margins.push_back(stretch.with_margins);
  }
  std::future<std::vector<std::vector<NetworkWord>>> network;
  if (has_network && !said.empty())
    network = std::async(is_long ? std::launch::deferred : std::launch::async,
                         [&] { return networkWords(with_margins, to_hear, heard); });
  ear_.learn(std::exchange(options_.speaker, {}));
  // A voice's own ear adds nothing to what the network hears (docs/theory/hearing/recognition.md).
  if (!hears_network_phones_) ear_.adaptTo(stretches);
  if (is_long) giveBackMemory();
  std::vector<HeardByEar> by_ear(said.size());  // of a long sound when each is heard, for memory
  const auto hearFrom = [&](std::size_t first) {
    for (std::size_t i = first; i < (is_long ? first : said.size()); ++i) by_ear[i] = hearByEar(stretches[i]);
  };
  hearFrom(0);
  const std::vector<std::vector<NetworkWord>> by_network =
      network.valid() ? network.get() : std::vector<std::vector<NetworkWord>>(said.size());
  if (has_network && is_long) options_.word_network->endWaiting();
  CollectedSpeech all;
  for (std::size_t i = 0; i < said.size(); ++i) {
    if (is_long) by_ear[i] = hearByEar(stretches[i]);
    const bool hears_phones = hears_network_phones_;
    HeardPhones phones = by_ear[i].is_speaker ? HeardPhones() : phonesOf(said[i], heard);
    if (hears_phones && !hears_network_phones_) {  // the network has failed
      ear_.adaptTo(stretches);
      hearFrom(i);
    }
    hearStretch(said[i], std::move(by_ear[i]), std::move(phones), by_network[i], all);
    to_hear.letGo();
  }
  all.finish(name, lasts, language_, options_.as != HearAs::kPhones, heard);
  return heard;
}

}  // namespace

std::vector<double> confidenceOf(const SpeechLabels& labels, const std::vector<PhoneSegment>& segments,
                                 const std::vector<double>& confidence) {
  std::vector<double> of_phones;
  std::size_t at = 0;
  for (const LabelledPhone& phone : labels.phones) {
    const Seconds middle = phone.span.middle();
    while (at + 1 < segments.size() && segments[at].span.end <= middle) ++at;
    const bool is_heard = at < segments.size() && segments[at].span.contains(middle);
    of_phones.push_back(phone.phone == Phone::kSil || !is_heard ? 1.0 : std::clamp(confidence[at], 0.0, 1.0));
  }
  return of_phones;
}

std::unique_ptr<Recogniser> makeRecogniser(const RecogniserOptions& options) {
  return std::make_unique<SoundRecogniser>(options);
}

}  // namespace mouthpiece
