#include "hearing/recognition/word_decider.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <numeric>
#include <string>
#include <utility>

#include "base/errors.h"
#include "base/index.h"
#include "base/text_encoding.h"
#include "hearing/alignment/samples_to_hear.h"
#include "hearing/recognition/hearing_odds.h"
#include "hearing/recognition/hinted_words.h"

namespace mouthpiece {
namespace {

/// Words of a hint or a corpus fit at less than others, and are taken before such as fit a little better. Where they
/// surely fit no others are looked for.
constexpr double kBookFits = 0.25, kBookBonus = 1.15, kSurelyFits = 0.70;
/// Where the speaker is known, words of the language model fit this share of what the phones do that are heard without
/// them, or the phones are taken: an ear that knows the speaker hears phones better than words that do not.
constexpr double kWordsAgainstPhones = 0.85;
/// Of who is not known even words that are wrong in part tell more than phones that are heard without them: words of
/// the language model are taken where they have these odds as a transcript's (logarithm, mean).
constexpr double kWordsBelieved = 3.0;
/// Words of whose pairs a smaller share follow each other in a hint, or in a corpus' lines, are not theirs.
constexpr double kLeastInOrder = 0.8;
/// Words of a hint take the place of others of which the network is less sure (mean logarithm of their probabilities),
/// where they are believed as a transcript's and fit this share of what the others do; so many places are tried.
constexpr double kSureOfWords = -0.5, kHintedBelieved = 0.9, kHintedFits = 0.7;
constexpr std::size_t kPlacesTried = 8;
/// A hint's words have this share of as many phones as are heard without words: one word is none of a line of eight.
constexpr double kLeastOfPhones = 0.5;
/// The names of their words among the searches.
constexpr const char *kHint = "hint", *kCorpus = "corpus";
/// Where a network's words are in less of such order, the lines are not looked for.
constexpr double kLeastNearOrder = 0.15;

}  // namespace

WordDecider::WordDecider(const RecogniserOptions& options)
    : as_(options.as),
      language_(*options.language),
      pronouncer_(options.lexicon, language_),
      aligner_(std::filesystem::path(), language_),
      hint_(KnownLines::ofHint(options.hint, pronouncer_)),
      lines_(options.known, pronouncer_) {
  if (!WordSearch::isAvailable(language_)) search();  // says what is missing
}

WordSearch& WordDecider::search() {
  if (!search_) {
    search_.emplace(language_);
    search_->setBook(kHint, hint_.book());
    search_->setBook(kCorpus, lines_.book());
  }
  return *search_;
}

namespace {

std::string textOf(const std::vector<std::string>& words) { return fmt::format("{}", fmt::join(words, " ")); }

std::string textOf(const std::vector<NetworkWord>& words) {
  std::string text;
  for (const NetworkWord& word : words) text += (text.empty() ? "" : " ") + word.text;
  return text;
}

}  // namespace

bool WordDecider::mayBeKnown(const std::vector<NetworkWord>& by_network, bool is_speaker) const {
  if (lines_.book().lines.empty()) return false;
  if (is_speaker || by_network.empty()) return true;
  std::vector<std::string> words;
  try {
    for (const TranscriptWord& word : pronouncer_.wordsOf(textOf(by_network))) words.push_back(lowerCase(word.text));
  } catch (const InputError&) {  // nothing that can be said
    return true;
  }
  return lines_.inOrder(words) >= kLeastNearOrder;
}

std::optional<WordsHeard> WordDecider::wordsAs(std::string_view text, const UndecidedStretch& stretch) {
  if (text.empty()) return std::nullopt;
  WordsHeard heard;
  try {
    heard.alignment = aligner_.align(SamplesToHear(stretch.clip), stretch.clip.duration(), pronouncer_.wordsOf(text),
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

double WordDecider::oddsOfKnown(const WordsHeard& words, const UndecidedStretch& stretch, double in_order) const {
  if (stretch.is_speaker) return in_order < kLeastInOrder ? 0 : -std::numeric_limits<double>::infinity();
  return oddsOfCorpusWords(stretch.hearing.apartFrom(words.alignment.labels), words.word_odds, in_order);
}

namespace {

/// Whether words of a model are taken, not the phones that are heard without them.
bool areLikely(const ModelWords& words, const UndecidedStretch& stretch) {
  const WordsHeard& heard = words.heard;
  if (stretch.is_speaker && !(words.by_network && words.odds < kNetworkTrusted))
    return heard.fit >= std::max(kWordsFit, kWordsAgainstPhones * stretch.hearing.fit()) &&
           heard.believed >= kDoubtfulConfidence;
  return words.by_network ? words.odds < kNetworkUnlikely : heard.word_odds >= kWordsBelieved;
}

}  // namespace

std::optional<WordsHeard> WordDecider::hintedWords(const UndecidedStretch& stretch) {
  if (hint_.book().lines.empty()) return std::nullopt;
  const std::vector<std::string> words = search().hearBook(kHint, stretch.samples, stretch.voice);
  if (hint_.inOrder(words) < kLeastInOrder) return std::nullopt;
  std::optional<WordsHeard> heard = wordsAs(textOf(words), stretch);
  if (!heard) return std::nullopt;
  const auto said = std::ranges::count_if(heard->alignment.labels.phones,
                                          [](const LabelledPhone& phone) { return phone.phone != Phone::kSil; });
  const auto without_words =
      std::ranges::count_if(stretch.phones().row(), [](const HeardPhone& phone) { return phone.phone != Phone::kSil; });
  return asReal(said) < kLeastOfPhones * asReal(without_words) ? std::nullopt : std::move(heard);
}

WordDecision WordDecider::decide(const std::vector<NetworkWord>& by_network, const UndecidedStretch& stretch) {
  const StretchHearing& hearing = stretch.hearing;
  WordDecision decision;
  std::optional<WordsHeard>& best = decision.words;
  std::optional<ModelWords> found;
  best = hintedWords(stretch);
  decision.by_hint = best.has_value();
  double in_order = 0;
  if (!best && mayBeKnown(by_network, stretch.is_speaker)) {
    const std::vector<std::string> words = search().hearBook(kCorpus, stretch.samples, stretch.voice);
    // Any sound is some row of a corpus' words; who does not speak its lines is not heard by them.
    in_order = lines_.inOrder(words);
    const bool may_be = stretch.is_speaker || in_order >= kLeastInOrder;
    if (may_be) best = wordsAs(textOf(words), stretch);
  }
  if (!best || best->fit < kSurelyFits) {
    std::optional<ModelWords> any = wordsByModels(by_network, stretch);
    if (any && (!best || any->heard.fit > kBookBonus * best->fit ||
                (any->by_network && !decision.by_hint && any->odds < oddsOfKnown(*best, stretch, in_order)))) {
      best = any->heard;
      decision.by_hint = false;
      found = std::move(any);
    }
  }
  const bool is_likely = best && (found ? areLikely(*found, stretch) : best->fit >= kBookFits);
  decision.are_taken = best && (as_ == HearAs::kWords || is_likely);
  decision.by_model = found.has_value();
  if (decision.are_taken && found) {
    decision.odds = found->odds;
    decision.word_odds = found->word_odds;
  } else if (decision.are_taken && !decision.by_hint && !stretch.is_speaker) {
    decision.odds = oddsOfKnown(*best, stretch, in_order);
  } else {
    decision.odds = best ? oddsOfWords(hearing.apartFrom(best->alignment.labels), best->word_odds)
                         : oddsOfWords(1, std::log(kLeastBelieved));
  }
  return decision;
}

std::optional<ModelWords> WordDecider::wordsByModels(const std::vector<NetworkWord>& by_network,
                                                     const UndecidedStretch& stretch) {
  std::optional<ModelWords> any = wordsByNetwork(by_network, stretch);
  if (any && !hint_.book().lines.empty()) any = withHintedWords(std::move(*any), by_network, stretch);
  if (any && (any->odds < kNetworkUnlikely || stretch.is_noisy)) return any;  // in noise the search adds nothing
  std::optional<ModelWords> searched = wordsBySearch(stretch);                // the network's would not be taken
  return !any || (searched && searched->odds < any->odds) ? searched : any;
}

std::optional<ModelWords> WordDecider::wordsBySearch(const UndecidedStretch& stretch) {
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

std::optional<ModelWords> WordDecider::wordsByNetwork(const std::vector<NetworkWord>& words,
                                                      const UndecidedStretch& stretch) {
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

namespace {

/// How far what is heard between two times fits the labels' phones there.
double fitBetween(const SpeechLabels& labels, const TimeSpan& span, const StretchHearing& hearing) {
  double fit = 0;
  for (const LabelledPhone& phone : labels.phones) {
    const TimeSpan part{std::max(phone.span.start, span.start), std::min(phone.span.end, span.end)};
    if (part.duration() > 0) fit += hearing.fitOf(phone.phone, part) * part.duration();
  }
  return fit / std::max(span.duration(), kEarStep);
}

TimeSpan spanOfWords(const SpeechLabels& labels, std::size_t first, std::size_t end) {
  return labels.spanOf({labels.words[first].phones.first, labels.words[end - 1].phones.last});
}

}  // namespace

ModelWords WordDecider::withHintedWords(ModelWords found, std::vector<NetworkWord> words,
                                        const UndecidedStretch& stretch) {
  for (bool is_changed = true; std::exchange(is_changed, false);) {
    const SpeechLabels& heard = found.heard.alignment.labels;
    if (heard.words.size() != words.size()) break;  // a word that is written as several is said as these
    const std::vector<HintedPlace> places = hintedPlaces(hint_, heard);
    for (std::size_t i = 0; i < std::min(places.size(), kPlacesTried) && !is_changed; ++i) {
      const HintedPlace& place = places[i];
      double sure = 0;
      for (std::size_t at = place.first; at < place.end; ++at)
        sure += words[at].log_probability / asReal(place.end - place.first);
      // Of words that sound the same the hint alone tells which are meant; its own words (0) are not changed again.
      const bool sounds_alike = place.apart == 0 && sure < 0;
      if (!sounds_alike && sure > kSureOfWords) continue;
      std::vector<NetworkWord> hinted(words.begin(), words.begin() + signedIndex(place.first));
      for (const std::string& word : place.words) hinted.push_back({word, 0});
      hinted.insert(hinted.end(), words.begin() + signedIndex(place.end), words.end());
      std::optional<ModelWords> other = wordsByNetwork(hinted, stretch);
      if (!other || other->heard.alignment.labels.words.size() != hinted.size()) continue;
      const SpeechLabels& said = other->heard.alignment.labels;
      const auto believed = other->heard.alignment.confidence.begin() + signedIndex(place.first);
      const TimeSpan before = spanOfWords(heard, place.first, place.end),
                     after = spanOfWords(said, place.first, place.first + place.words.size());
      const TimeSpan span{std::min(before.start, after.start), std::max(before.end, after.end)};
      const double fit = fitBetween(heard, span, stretch.phones()),
                   fit_hinted = fitBetween(said, span, stretch.phones());
      const double least_believed = *std::min_element(believed, believed + std::ssize(place.words));
      if (!sounds_alike && (least_believed < kHintedBelieved || fit_hinted < kHintedFits * fit)) continue;
      found = std::move(*other);
      words = std::move(hinted);
      is_changed = true;
    }
  }
  return found;
}

bool isNoSpeech(const WordDecision& decision, const StretchHearing& hearing) {
  const bool are_said = decision.are_taken && (!decision.by_model || decision.words->word_odds >= 0);
  return hearing.heardFor() == 0 && !are_said;
}

}  // namespace mouthpiece
