#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <future>
#include <limits>
#include <numeric>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "base/errors.h"
#include "base/index.h"
#include "base/text_encoding.h"
#include "hearing/alignment/forced_alignment.h"
#include "hearing/alignment/phone_ear.h"
#include "hearing/alignment/pronouncer.h"
#include "hearing/recognition/closings.h"
#include "hearing/recognition/hearing_odds.h"
#include "hearing/recognition/recogniser.h"
#include "hearing/recognition/sound_search.h"
#include "hearing/recognition/word_network.h"
#include "phonetics/labels/labels_builder.h"

namespace mouthpiece {
namespace {

constexpr int kEarRateHz = 16000;
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
/// A word is neither believed nor doubted further than by these odds.
constexpr double kLeastBelieved = 1e-4;
constexpr std::size_t kMostNamed = 12;  // words in a warning, or stretches
/// A stretch with less of phones is not doubted by itself: a click.
constexpr Seconds kLeastDoubted = 0.5;
/// Words of whose pairs a smaller share follow each other in a corpus' lines are none of its lines.
constexpr double kLeastInOrder = 0.8;
/// Where a network's words are in less of such order, the lines are not looked for.
constexpr double kLeastNearOrder = 0.15;
/// A network hears words by those around them, so that stretches are heard together across such a pause.
constexpr Seconds kNearPause = 1.0, kLongestHeard = 20;
/// What it gets of the sound around a stretch: a word's beginning may lie below what is found as speech.
constexpr Seconds kMargin = 0.2;
constexpr std::size_t kMostHintBytes = 1 << 16;

/// The logarithm of the odds of a word as a transcript's.
double oddsOf(double confidence) {
  const double held = std::clamp(confidence, kLeastBelieved, 1 - kLeastBelieved);
  return std::log(held / (1 - held));
}

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

/// The phones that are heard without words: how well they fit in the mean, and how long they are.
struct PhonesFit {
  double fit = 0, heard_s = 0;
  std::vector<Phone> row = {};
};

/// Phones and words on the clock of the whole sound, as they come.
struct Collected {
  std::vector<PhoneSegment> segments;
  std::vector<double> confidence;  ///< of each segment
  std::vector<std::string> words;
  std::vector<std::string> doubtful;  ///< words with their times
  std::vector<TimeSpan> doubted;      ///< stretches
  // Sums over stretches, each as long as it is:
  double stretch_s = 0, odds_s = 0;  ///< times the odds that much is heard wrongly
};

class SoundRecogniser : public Recogniser {
 public:
  explicit SoundRecogniser(const RecogniserOptions& options)
      : options_(options), language_(*options.language), ear_(language_), likeness_(lipLikeness()) {
    if (options_.as == HearAs::kPhones) return;
    if (!WordSearch::isAvailable(language_)) {
      if (options_.as == HearAs::kWords) WordSearch search(language_);  // says what is missing
      return;
    }
    pronouncer_.emplace(options_.lexicon, language_);
    aligner_.emplace(std::filesystem::path(), language_);
    readBook();
  }

  HeardSpeech hear(const AudioClip& audio, std::string_view name) override;

 private:
  void readBook();
  void addLine(std::string_view line);
  /// PocketSphinx, from when it is first asked.
  WordSearch& search();
  /// Whether the book's lines may be said, by the network's words where it heard some.
  [[nodiscard]] bool isOfBook(const std::vector<NetworkWord>& by_network) const;
  /// The share of the pairs of words that follow each other in the book's lines, too; where a line begins is one.
  [[nodiscard]] double inOrder(const std::vector<std::string>& words) const;
  /// The logarithm of the odds that much of the book's words is wrong, against a network's: a hint's words are meant,
  /// and of the corpus' speaker those that follow each other as in its lines.
  [[nodiscard]] double oddsOfBook(const WordsHeard& words, const PhonesFit& phones, double in_order) const;
  std::optional<WordsHeard> wordsAs(std::string_view text, const AudioClip& clip, const Eigen::MatrixXf& posteriors);
  [[nodiscard]] double fitOf(Phone phone, const TimeSpan& span, const Eigen::MatrixXf& posteriors) const;
  [[nodiscard]] PhonesFit fitOfPhones(const Eigen::MatrixXf& posteriors) const;
  /// Whether words of a model are taken, not the phones that are heard without them.
  [[nodiscard]] bool areLikely(const ModelWords& words, const PhonesFit& phones) const;
  std::optional<ModelWords> wordsBySearch(std::span<const std::int16_t> samples, const AudioClip& clip,
                                          const Eigen::MatrixXf& posteriors);
  std::optional<ModelWords> wordsByNetwork(const std::vector<NetworkWord>& words, const AudioClip& clip,
                                           const Eigen::MatrixXf& posteriors);
  /// The network's words of each stretch; none where it fails, which `heard` then tells.
  std::vector<std::vector<NetworkWord>> networkWords(std::span<const std::span<const std::int16_t>> stretches,
                                                     HeardSpeech& heard) const;
  /// `by_network`: the network's words.
  void hearStretch(std::span<const std::int16_t> samples, Seconds start, const std::vector<NetworkWord>& by_network,
                   Collected& all);
  /// Names words of a model that are likely wrong; their phones are no surer than they are.
  static void doubtWords(const std::vector<double>& word_odds, Seconds start, WordsHeard& words, Collected& all);
  void collect(const WordsHeard& words, Seconds start, Collected& all) const;
  void collectPhones(Eigen::MatrixXf posteriors, const WordsHeard* words, Seconds start, Collected& all) const;
  void warn(const Collected& all, HeardSpeech& heard) const;

  RecogniserOptions options_;
  const Language& language_;
  PhoneEar ear_;
  Eigen::MatrixXf likeness_;
  std::optional<Pronouncer> pronouncer_;
  std::optional<WordSearch> search_;
  std::optional<ForcedAligner> aligner_;
  PhraseBook book_;                                        ///< the hint and the known lines
  std::set<std::pair<std::string, std::string>> follows_;  ///< words that follow each other in the book's lines
};

WordSearch& SoundRecogniser::search() {
  if (!search_) {
    search_.emplace(language_);
    search_->setBook(book_);
  }
  return *search_;
}

void SoundRecogniser::addLine(std::string_view line) {
  std::vector<std::string> words;
  for (const TranscriptWord& word : pronouncer_->wordsOf(line)) {
    std::string text = lowerCase(word.text);
    book_.more.push_back({text, word.ways.front().phones});
    words.push_back(std::move(text));
  }
  book_.lines.push_back(std::move(words));
}

void SoundRecogniser::readBook() {
  if (options_.hint.size() > kMostHintBytes)
    throw InputError("hint", "", fmt::format("has {} bytes; expected at most 64 KiB", options_.hint.size()));
  if (!options_.hint.empty()) addLine(options_.hint);
  for (const std::string& line : options_.known) {
    try {
      addLine(line);
    } catch (const InputError&) {  // a line that cannot be said is none that is said again
    }
  }
  for (const std::vector<std::string>& line : book_.lines) {
    std::string before;
    for (const std::string& word : line) follows_.emplace(std::exchange(before, word), word);
  }
}

std::string textOf(const std::vector<std::string>& words) { return fmt::format("{}", fmt::join(words, " ")); }

std::string textOf(const std::vector<NetworkWord>& words) {
  std::string text;
  for (const NetworkWord& word : words) text += (text.empty() ? "" : " ") + word.text;
  return text;
}

bool SoundRecogniser::isOfBook(const std::vector<NetworkWord>& by_network) const {
  if (book_.lines.empty()) return false;
  if (!options_.hint.empty() || ear_.knowsSpeaker() || by_network.empty()) return true;
  std::vector<std::string> words;
  try {
    for (const TranscriptWord& word : pronouncer_->wordsOf(textOf(by_network))) words.push_back(lowerCase(word.text));
  } catch (const InputError&) {  // nothing that can be said
    return true;
  }
  return inOrder(words) >= kLeastNearOrder;
}

double SoundRecogniser::inOrder(const std::vector<std::string>& words) const {
  double known = 0;
  std::string before;
  for (const std::string& word : words) known += follows_.contains({std::exchange(before, word), word}) ? 1 : 0;
  return known / std::max(1.0, asReal(words.size()));
}

/// The frames of what is heard that belong to `span`; none where it lies outside.
std::pair<Eigen::Index, Eigen::Index> framesOf(const TimeSpan& span, const Eigen::MatrixXf& posteriors) {
  const auto frame = [&](Seconds time, Eigen::Index least) {
    return std::clamp<Eigen::Index>(std::lround((time - kEarShift) / kEarStep), least, posteriors.cols());
  };
  const Eigen::Index first = frame(span.start, 0);
  return {first, frame(span.end, first)};
}

double SoundRecogniser::fitOf(Phone phone, const TimeSpan& span, const Eigen::MatrixXf& posteriors) const {
  const auto [first, end] = framesOf(span, posteriors);
  if (end <= first) return 0;
  return (likeness_.row(signedIndex(static_cast<std::size_t>(phone))) * posteriors.middleCols(first, end - first))
      .mean();
}

std::optional<WordsHeard> SoundRecogniser::wordsAs(std::string_view text, const AudioClip& clip,
                                                   const Eigen::MatrixXf& posteriors) {
  if (text.empty()) return std::nullopt;
  WordsHeard heard;
  try {
    heard.alignment = aligner_->align(clip, pronouncer_->wordsOf(text), "stretch");
  } catch (const InputError&) {  // the stretch is too short for them
    return std::nullopt;
  }
  for (const double line : heard.alignment.line_confidence) heard.believed = std::min(heard.believed, line);
  for (const double word : heard.alignment.confidence)
    heard.word_odds += oddsOf(word) / asReal(heard.alignment.confidence.size());
  double time = 0;
  for (const LabelledPhone& phone : heard.alignment.labels.phones) {
    heard.fits.push_back(fitOf(phone.phone, phone.span, posteriors));
    if (phone.phone == Phone::kSil) continue;
    heard.fit += heard.fits.back() * phone.span.duration();
    time += phone.span.duration();
  }
  heard.fit /= std::max(time, kEarStep);
  return heard;
}

void SoundRecogniser::collect(const WordsHeard& words, Seconds start, Collected& all) const {
  const SpeechLabels& labels = words.alignment.labels;
  const std::size_t before = all.words.size();
  for (const LabelledWord& word : labels.words) all.words.push_back(word.text);
  for (std::size_t i = 0; i < labels.phones.size(); ++i) {
    const LabelledPhone& phone = labels.phones[i];
    if (phone.phone == Phone::kSil) continue;
    PhoneSegment segment{.phone = phone.phone, .span = {phone.span.start + start, phone.span.end + start}};
    if (phone.word) segment.word = before + *phone.word;
    if (phone.syllable) {
      segment.syllable = phone.syllable;
      if (isVowel(phone.phone)) segment.stress = labels.syllables[*phone.syllable].stress;
    }
    all.segments.push_back(segment);
    all.confidence.push_back(words.fits[i]);
  }
}

void SoundRecogniser::collectPhones(Eigen::MatrixXf posteriors, const WordsHeard* words, Seconds start,
                                    Collected& all) const {
  if (words != nullptr) {
    // What a word says counts by how well it fits.
    const double full = std::max(kWordsFit, fitOfPhones(posteriors).fit);
    for (const LabelledPhone& phone : words->alignment.labels.phones) {
      if (!phone.word) continue;
      const double fit = fitOf(phone.phone, phone.span, posteriors);
      const auto weight = asFloat(kWordWeight * std::min(1.0, fit / full));
      const auto [first, end] = framesOf(phone.span, posteriors);
      posteriors.middleCols(first, end - first) *= 1 - weight;
      posteriors.row(signedIndex(static_cast<std::size_t>(phone.phone))).segment(first, end - first).array() += weight;
    }
  }
  for (const HeardPhone& phone : likeliestPhones(posteriors, likeness_, kFurtherPhone)) {
    if (phone.phone == Phone::kSil) continue;
    const TimeSpan span{asReal(phone.first) * kEarStep + kEarShift + start,
                        asReal(phone.end) * kEarStep + kEarShift + start};
    all.segments.push_back({.phone = phone.phone, .span = span});
    all.confidence.push_back(phone.confidence);
  }
}

PhonesFit SoundRecogniser::fitOfPhones(const Eigen::MatrixXf& posteriors) const {
  PhonesFit phones;
  double frames = 0;
  for (const HeardPhone& phone : likeliestPhones(posteriors, likeness_, kFurtherPhone)) {
    if (phone.phone == Phone::kSil) continue;
    const Eigen::Index count = signedIndex(phone.end - phone.first);
    const auto heard = posteriors.middleCols(signedIndex(phone.first), count);
    phones.fit += double{(likeness_.row(static_cast<Eigen::Index>(phone.phone)) * heard).sum()};
    frames += asReal(count);
    phones.row.push_back(phone.phone);
  }
  phones.fit /= std::max(frames, 1.0);
  phones.heard_s = frames * kEarStep;
  return phones;
}

/// How far the phones of words lie from a row that was heard without them: the fewest changes from one to the other, a
/// phone of the longer one.
double apart(const SpeechLabels& words, const std::vector<Phone>& row) {
  std::vector<std::size_t> changes(row.size() + 1);
  std::iota(changes.begin(), changes.end(), 0U);
  std::size_t count = 0;
  for (const LabelledPhone& phone : words.phones) {
    if (phone.phone == Phone::kSil) continue;
    std::size_t before = std::exchange(changes[0], ++count);
    for (std::size_t i = 0; i < row.size(); ++i) {
      const std::size_t exchanged = before + (row[i] == phone.phone ? 0U : 1U);
      before = changes[i + 1];
      changes[i + 1] = std::min({exchanged, before + 1, changes[i] + 1});
    }
  }
  return asReal(changes.back()) / std::max(1.0, asReal(std::max(count, row.size())));
}

std::vector<std::vector<NetworkWord>> SoundRecogniser::networkWords(
    std::span<const std::span<const std::int16_t>> stretches, HeardSpeech& heard) const {
  try {
    return hearWords(options_.word_network, stretches);
  } catch (const InputError& error) {
    heard.warnings.push_back(fmt::format("the network that hears words was not heard ({})", error.what()));
    return std::vector<std::vector<NetworkWord>>(stretches.size());
  }
}

double SoundRecogniser::oddsOfBook(const WordsHeard& words, const PhonesFit& phones, double in_order) const {
  if (!options_.hint.empty()) return -std::numeric_limits<double>::infinity();
  if (ear_.knowsSpeaker()) return in_order < kLeastInOrder ? 0 : -std::numeric_limits<double>::infinity();
  return oddsOfCorpusWords(apart(words.alignment.labels, phones.row), words.word_odds, in_order);
}

void SoundRecogniser::hearStretch(std::span<const std::int16_t> samples, Seconds start,
                                  const std::vector<NetworkWord>& by_network, Collected& all) {
  const Eigen::MatrixXf posteriors = ear_.posteriors(samples);
  const Seconds length = asReal(posteriors.cols()) * kEarStep;
  const PhonesFit phones = fitOfPhones(posteriors);
  all.stretch_s += length;
  const auto doubt = [&](double odds) {
    all.odds_s += length * odds;
    if (odds > 0 && phones.heard_s >= kLeastDoubted) all.doubted.push_back({start, start + length});
  };
  if (!pronouncer_) {
    doubt(oddsOfPhones(phones.fit, phones.heard_s / length));
    return collectPhones(posteriors, nullptr, start, all);
  }
  AudioClip clip{kEarRateHz, {}};
  for (const std::int16_t sample : samples) clip.samples.push_back(static_cast<float>(sample) / 32768.0F);
  std::optional<WordsHeard> best;
  std::optional<ModelWords> found;
  double in_order = 0;
  if (isOfBook(by_network)) {
    const std::vector<std::string> words = search().hearBook(samples, ear_.voice());
    // Any sound is some row of a corpus' words; who does not speak its lines is not heard by them.
    in_order = inOrder(words);
    const bool may_be = !options_.hint.empty() || ear_.knowsSpeaker() || in_order >= kLeastInOrder;
    if (may_be) best = wordsAs(textOf(words), clip, posteriors);
  }
  if (!best || best->fit < kSurelyFits) {
    std::optional<ModelWords> any = wordsByNetwork(by_network, clip, posteriors);
    if (!any || any->odds >= kNetworkUnlikely) {  // they would not be taken
      std::optional<ModelWords> searched = wordsBySearch(samples, clip, posteriors);
      if (!any || (searched && searched->odds < any->odds)) any = std::move(searched);
    }
    if (any && (!best || any->heard.fit > kBookBonus * best->fit ||
                (any->by_network && any->odds < oddsOfBook(*best, phones, in_order)))) {
      best = any->heard;
      found = std::move(any);
    }
  }
  const bool is_likely = best && (found ? areLikely(*found, phones) : best->fit >= kBookFits);
  const bool are_words = best && (options_.as == HearAs::kWords || is_likely);
  if (are_words && found) {
    doubt(found->odds);
    doubtWords(found->word_odds, start, *best, all);
  } else if (are_words && options_.hint.empty() && !ear_.knowsSpeaker()) {
    doubt(oddsOfBook(*best, phones, in_order));
  } else {
    doubt(best ? oddsOfWords(apart(best->alignment.labels, phones.row), best->word_odds)
               : oddsOfWords(1, std::log(kLeastBelieved)));
  }
  if (are_words && (found || options_.hint.empty()) && !ear_.knowsSpeaker())
    keepClosings(posteriors, likeness_, best->alignment.labels.phones, best->fits);
  if (are_words) return collect(*best, start, all);
  collectPhones(posteriors, best ? &*best : nullptr, start, all);
}

std::optional<ModelWords> SoundRecogniser::wordsBySearch(std::span<const std::int16_t> samples, const AudioClip& clip,
                                                         const Eigen::MatrixXf& posteriors) {
  const FoundWords found = search().hear(samples, ear_.voice());
  std::optional<WordsHeard> heard = wordsAs(textOf(found.words), clip, posteriors);
  if (!heard) return std::nullopt;
  const double rivals = std::accumulate(found.rivals.begin(), found.rivals.end(), 0.0) / asReal(found.rivals.size());
  ModelWords words{.heard = std::move(*heard), .odds = 0, .word_odds = {}};
  words.odds = oddsOfModelWords(words.heard.word_odds, rivals);
  const std::vector<double>& confidence = words.heard.alignment.confidence;
  for (std::size_t i = 0; i < confidence.size() && confidence.size() == found.rivals.size(); ++i)
    words.word_odds.push_back(oddsOfModelWord(oddsOf(confidence[i]), found.rivals[i]));
  return words;
}

std::optional<ModelWords> SoundRecogniser::wordsByNetwork(const std::vector<NetworkWord>& words, const AudioClip& clip,
                                                          const Eigen::MatrixXf& posteriors) {
  double sure = 0;
  for (const NetworkWord& word : words) sure += word.log_probability / asReal(words.size());
  std::optional<WordsHeard> heard = wordsAs(textOf(words), clip, posteriors);
  if (!heard) return std::nullopt;
  ModelWords found{.heard = std::move(*heard), .odds = 0, .word_odds = {}, .by_network = true};
  found.odds = oddsOfNetworkWords(found.heard.word_odds, sure);
  const std::vector<double>& confidence = found.heard.alignment.confidence;
  for (std::size_t i = 0; i < confidence.size() && confidence.size() == words.size(); ++i)
    found.word_odds.push_back(oddsOfNetworkWord(oddsOf(confidence[i]), words[i].log_probability));
  return found;
}

void SoundRecogniser::doubtWords(const std::vector<double>& word_odds, Seconds start, WordsHeard& words,
                                 Collected& all) {
  const SpeechLabels& labels = words.alignment.labels;
  if (labels.words.size() != word_odds.size()) return;  // a word that is written as several is aligned as these
  for (std::size_t word = 0; word < labels.words.size(); ++word) {
    const double odds = word_odds[word];
    if (odds < kWordDoubted) continue;
    const LabelledWord& doubted = labels.words[word];
    all.doubtful.push_back(fmt::format("{} ({:.2f} s)", doubted.text, start + labels.spanOf(doubted.phones).start));
    for (std::size_t i = doubted.phones.first.value; i <= doubted.phones.last.value; ++i)
      words.fits[i] = std::min(words.fits[i], 1 / (1 + std::exp(odds)));
  }
}

bool SoundRecogniser::areLikely(const ModelWords& words, const PhonesFit& phones) const {
  const WordsHeard& heard = words.heard;
  if (ear_.knowsSpeaker() && !(words.by_network && words.odds < kNetworkTrusted))
    return heard.fit >= std::max(kWordsFit, kWordsAgainstPhones * phones.fit) && heard.believed >= kDoubtfulConfidence;
  return words.by_network ? words.odds < kNetworkUnlikely : heard.word_odds >= kWordsBelieved;
}

void SoundRecogniser::warn(const Collected& all, HeardSpeech& heard) const {
  for (const SoundKind kind : {SoundKind::kMusic, SoundKind::kNoise}) {
    std::string places;
    for (const SoundStretch& stretch : heard.stretches) {
      if (stretch.kind == kind)
        places += fmt::format("{}{:.1f} to {:.1f} s", places.empty() ? "" : ", ", stretch.span.start, stretch.span.end);
    }
    if (!places.empty())
      heard.warnings.push_back(
          fmt::format("{} without speech, passed over: {}", kind == SoundKind::kMusic ? "music" : "noise", places));
  }
  std::size_t in_words = 0;
  for (const PhoneSegment& segment : all.segments) in_words += segment.word ? 1U : 0U;
  if (in_words < all.segments.size() && options_.as != HearAs::kPhones) {
    heard.warnings.push_back(
        fmt::format("{} of {} phones were heard without words", all.segments.size() - in_words, all.segments.size()));
  }
  const double sure = 1 / (1 + std::exp(all.odds_s / std::max(all.stretch_s, kEarStep)));
  if (sure >= 0.5 && all.doubtful.empty() && all.doubted.empty()) return;
  std::string words;
  for (std::size_t i = 0; i < std::min(all.doubtful.size(), kMostNamed); ++i)
    words += (i > 0 ? ", " : "") + all.doubtful[i];
  if (all.doubtful.size() > kMostNamed) words += ", ...";
  std::string what;
  if (sure < 0.5) {
    what =
        fmt::format("what was heard is doubtful ({:.2f} of 1{}{})", sure, words.empty() ? "" : "; most of all ", words);
  } else {
    for (std::size_t i = 0; i < std::min(all.doubted.size(), kMostNamed); ++i)
      what += fmt::format("{}{:.1f} to {:.1f} s", i > 0 ? ", " : "what was heard is doubtful from ",
                          all.doubted[i].start, all.doubted[i].end);
    if (all.doubted.size() > kMostNamed) what += ", ...";
    if (!words.empty()) what += (what.empty() ? "" : "; ") + ("words that may be wrong: " + words);
  }
  heard.warnings.push_back(what + "; a transcript or a hint would help");
}

/// Stretches of speech; those that lie no farther apart than `pause` are one, kLongestHeard at most.
std::vector<TimeSpan> toHear(const std::vector<SoundStretch>& stretches, Seconds pause) {
  std::vector<TimeSpan> spans;
  bool is_next = false;  // nothing else than a pause lies before it
  for (const SoundStretch& stretch : stretches) {
    const bool is_speech = stretch.kind == SoundKind::kSpeech;
    if (is_speech && is_next && stretch.span.start - spans.back().end < pause &&
        stretch.span.end - spans.back().start <= kLongestHeard) {
      spans.back().end = stretch.span.end;
    } else if (is_speech) {
      spans.push_back(stretch.span);
    }
    is_next = is_speech;
  }
  return spans;
}

HeardSpeech SoundRecogniser::hear(const AudioClip& audio, std::string_view name) {
  const std::vector<std::int16_t> samples = samplesToHear(audio);
  HeardSpeech heard;
  heard.stretches = findSpeech(samples);
  const bool has_network = pronouncer_ && hasWordNetwork(options_.word_network);
  const auto samplesOf = [&](const TimeSpan& span) {
    const auto first = std::min(samples.size(), static_cast<std::size_t>(std::max(0.0, span.start) * kEarRateHz));
    const auto end = std::min(samples.size(), static_cast<std::size_t>(span.end * kEarRateHz));
    return std::span<const std::int16_t>(samples).subspan(first, std::max(first, end) - first);
  };
  std::vector<std::span<const std::int16_t>> said, with_margins;
  std::vector<Seconds> starts;
  const std::vector<TimeSpan> spans = toHear(heard.stretches, has_network ? kNearPause : 0);
  for (std::size_t i = 0; i < spans.size(); ++i) {
    const TimeSpan& span = spans[i];
    if (samplesOf(span).empty()) continue;
    // What is said before and after is not heard twice.
    const Seconds before = i > 0 ? spans[i - 1].end : 0;
    const Seconds after = i + 1 < spans.size() ? spans[i + 1].start : audio.duration();
    said.push_back(samplesOf(span));
    with_margins.push_back(samplesOf({std::max(before, span.start - kMargin), std::min(after, span.end + kMargin)}));
    starts.push_back(span.start);
  }
  std::future<std::vector<std::vector<NetworkWord>>> network;
  if (has_network && !said.empty())
    network = std::async(std::launch::async, [&] { return networkWords(with_margins, heard); });
  ear_.learn(std::exchange(options_.speaker, {}));
  ear_.adaptTo(said);
  const std::vector<std::vector<NetworkWord>> by_network =
      network.valid() ? network.get() : std::vector<std::vector<NetworkWord>>(said.size());
  Collected all;
  for (std::size_t i = 0; i < said.size(); ++i) hearStretch(said[i], starts[i], by_network[i], all);
  if (all.segments.empty()) {
    throw InputError(name, "",
                     heard.stretches.empty() ? "holds silence only; expected speech"
                                             : "holds no speech that can be heard; expected speech");
  }
  // Stretches meet where one was cut.
  for (std::size_t i = 0; i + 1 < all.segments.size(); ++i)
    all.segments[i].span.end = std::min(all.segments[i].span.end, all.segments[i + 1].span.start);
  for (std::size_t i = 0; i < all.segments.size();) {
    all.segments[i].span.end = std::min(all.segments[i].span.end, audio.duration());
    if (all.segments[i].span.duration() > 0) {
      ++i;
      continue;
    }
    all.segments.erase(all.segments.begin() + signedIndex(i));
    all.confidence.erase(all.confidence.begin() + signedIndex(i));
  }
  for (const std::string& word : all.words) heard.text += (heard.text.empty() ? "" : " ") + word;
  warn(all, heard);
  heard.labels = buildSpeechLabels(all.segments, all.words, audio.duration(), language_);
  heard.confidence = confidenceOf(heard.labels, all.segments, all.confidence);
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
