#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <future>
#include <optional>
#include <string>
#include <utility>

#include "base/errors.h"
#include "base/index.h"
#include "base/memory.h"
#include "hearing/alignment/phone_ear.h"
#include "hearing/alignment/samples_to_hear.h"
#include "hearing/network/network_phones.h"
#include "hearing/network/word_network.h"
#include "hearing/recognition/collected_speech.h"
#include "hearing/recognition/hearing_odds.h"
#include "hearing/recognition/phones_in_words.h"
#include "hearing/recognition/recogniser.h"
#include "hearing/recognition/said_stretches.h"
#include "hearing/recognition/stretch_hearing.h"
#include "hearing/recognition/word_decider.h"

namespace mouthpiece {
namespace {

/// A word's phones weigh so much against what is heard without it, where it fits as words that are taken do.
constexpr double kWordWeight = 0.8;
/// A network hears words by those around them, so that stretches are heard together across such a pause.
constexpr Seconds kNearPause = 1.0;
/// Nobody speaks where a network hears less of phones.
constexpr Seconds kLeastPhones = 0.1;
/// A longer sound is heard by one after the other, for memory: by the network after the speaker is learnt, and by the
/// rest after the network's program has ended. To start that anew takes a few thousandths of its time.
constexpr Seconds kOneAfterTheOther = SamplesToHear::kInMemoryUntil;

/// What the ear alone hears of a stretch.
struct HeardByEar {
  Eigen::MatrixXf posteriors;
  bool is_speaker = false;  ///< PhoneEar::knowsSpeaker()
  VoiceTransform voice;     ///< PhoneEar::voice()
};

class SoundRecogniser : public Recogniser {
 public:
  explicit SoundRecogniser(const RecogniserOptions& options)
      : options_(options), language_(*options.language), ear_(language_), likeness_(lipLikeness()) {
    hears_network_phones_ = options_.word_network && options_.word_network->isThere();
    if (options_.as == HearAs::kPhones) return;
    if (options_.as == HearAs::kWords || WordSearch::isAvailable(language_)) words_.emplace(options_);
  }

  HeardSpeech hear(AudioClip audio, std::string_view name) override;

 private:
  [[nodiscard]] HeardByEar hearByEar(const Said& said);
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
  void collectPhones(const UndecidedStretch& stretch, const WordsHeard* words, CollectedSpeech& all) const;

  RecogniserOptions options_;
  const Language& language_;
  PhoneEar ear_;
  Eigen::MatrixXf likeness_;
  std::optional<WordDecider> words_;  ///< none where phones alone are heard
  bool hears_network_phones_ = false;
  double noisiness_ = 0;       ///< noisinessOf() the sound
  HeardPhones phones_of_all_;  ///< the network's of the whole sound; none where it is long, or not noisy
};

HeardByEar SoundRecogniser::hearByEar(const Said& said) {
  Eigen::MatrixXf posteriors = ear_.posteriors(said.samples, said.around);
  return {std::move(posteriors), ear_.knowsSpeaker(), ear_.voice()};
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

void SoundRecogniser::collectPhones(const UndecidedStretch& stretch, const WordsHeard* words,
                                    CollectedSpeech& all) const {
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
  UndecidedStretch stretch{.samples = said.samples,
                           .clip = {SamplesToHear::kRateHz, {}},
                           .span = {said.start, said.start + hearing.duration()},
                           .is_noisy = noisiness_ > 0,
                           .is_speaker = by_ear.is_speaker,
                           .voice = std::move(by_ear.voice),
                           .hearing = std::move(hearing),
                           .by_network = std::move(phones),
                           .by_both = std::move(by_both)};
  const bool is_noise = stretch.by_both && heardAsPhones(stretch.by_network) < kLeastPhones;
  if (is_noise && options_.hint.empty()) return all.passOver(stretch.span);
  if (!words_) {
    const StretchHearing& by_all = stretch.phones();
    if (by_all.heardFor() == 0) return all.passOver(stretch.span);
    all.addStretch(stretch.span, oddsOfPhones(by_all.fit(), by_all.heardFor() / by_all.duration()), by_all.heardFor());
    return collectPhones(stretch, nullptr, all);
  }
  for (const std::int16_t sample : said.samples) stretch.clip.samples.push_back(static_cast<float>(sample) / 32768.0F);
  WordDecision decision = words_->decide(by_network, stretch);
  std::optional<WordsHeard>& words = decision.words;
  if ((is_noise && !decision.by_hint) || isNoSpeech(decision, stretch.phones())) return all.passOver(stretch.span);
  all.addStretch(stretch.span, decision.odds, stretch.hearing.heardFor());
  if (!decision.are_taken) return collectPhones(stretch, words ? &*words : nullptr, all);
  doubtWords(decision.word_odds, said.start, *words, all);
  SpeechLabels& labels = words->alignment.labels;
  if (stretch.by_both && labels.words.size() == decision.word_odds.size())
    hearUnlikelyWords(*stretch.by_both, decision.word_odds, labels, words->fits);
  if (!decision.by_hint && !stretch.is_speaker) keepClosings(stretch.phones(), labels.phones, words->fits);
  collectWords(*words, said.start, all);
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
  const bool has_network = words_ && options_.word_network && options_.word_network->isThere();
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
  if (options_.speaker) ear_.learn(std::exchange(options_.speaker, {}));
  // A voice's own ear adds nothing to what the network hears (docs/theory/hearing/phone_ear.md).
  if (!hears_network_phones_) ear_.adaptTo(stretches);
  if (is_long) giveBackMemory();
  std::vector<HeardByEar> by_ear(said.size());  // of a long sound when each is heard, for memory
  const auto hearFrom = [&](std::size_t first, std::size_t end) {
    for (std::size_t i = first; i < end; ++i) by_ear[i] = hearByEar(said[i]);
  };
  hearFrom(0, is_long ? 0 : said.size());
  const std::vector<std::vector<NetworkWord>> by_network =
      network.valid() ? network.get() : std::vector<std::vector<NetworkWord>>(said.size());
  if (has_network && is_long) options_.word_network->endWaiting();
  CollectedSpeech all;
  for (std::size_t i = 0; i < said.size(); ++i) {
    if (is_long) hearFrom(i, i + 1);
    const bool hears_phones = hears_network_phones_;
    HeardPhones phones = by_ear[i].is_speaker ? HeardPhones() : phonesOf(said[i], heard);
    if (hears_phones && !hears_network_phones_) {  // the network has failed
      ear_.adaptTo(stretches);
      hearFrom(i, is_long ? i + 1 : said.size());
    }
    hearStretch(said[i], std::move(by_ear[i]), std::move(phones), by_network[i], all);
    to_hear.letGo();
  }
  all.finish(name, lasts, language_, options_.as != HearAs::kPhones, words_.has_value(), heard);
  if (!words_ && !options_.hint.empty())
    heard.warnings.push_back(fmt::format(
        "the hint tells nothing: words are not heard {}",
        options_.as == HearAs::kPhones ? "where phones are asked for" : fmt::format("in {}", language_.name)));
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
