#include "hearing/alignment/forced_alignment.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "base/errors.h"
#include "base/index.h"
#include "base/statistics.h"
#include "hearing/alignment/phone_decoder.h"
#include "hearing/alignment/phone_ear.h"
#include "hearing/alignment/speech_finder.h"
#include "hearing/alignment/text_doubt.h"
#include "phonetics/labels/labels_builder.h"

namespace mouthpiece {
namespace {

/// A mean score a frame at which a word is as likely right as wrong, and how far from it the two part.
constexpr double kEvenScore = -90.0;
constexpr double kScoreSpread = 8.0;
/// More doubtful words than this: not the text that is said. Of five recorded singers' own words 3 to 22 % are
/// doubtful, of others 49 to 71 % (docs/theory/hearing/sung_alignment.md).
constexpr double kOtherTextShare = 0.3;
/// Labels further than this from where their words are heard belong to another sound: by far the most that alignment
/// itself is off.
constexpr Seconds kFarBeside = 0.2;
/// A stop's closing cannot be heard after silence: more than this of it is the pause before.
constexpr Seconds kLongestStopAfterSilence = 0.120;
/// PocketSphinx gives a phone at least three frames of 10 ms.
constexpr Seconds kShortestPhone = 0.030;

/// The phones that the model listens for.
const std::vector<Phone>& heardIn(const Pronunciation& way) { return way.heard.empty() ? way.phones : way.heard; }

WordWays waysOf(const std::vector<TranscriptWord>& words) {
  WordWays all;
  for (const TranscriptWord& word : words) {
    auto& ways = all.emplace_back();
    for (const Pronunciation& way : word.ways) ways.push_back(heardIn(way));
  }
  return all;
}

/// The way of `word` that the decoder took: its phones tell.
const Pronunciation& wayTaken(const TranscriptWord& word, const std::vector<Phone>& phones) {
  const auto taken = std::find_if(word.ways.begin(), word.ways.end(),
                                  [&](const Pronunciation& way) { return heardIn(way) == phones; });
  MOUTHPIECE_EXPECT(taken != word.ways.end());
  return *taken;
}

/// The decoder may give a silence in several parts.
std::vector<DecodedPhone> withWholeSilences(const std::vector<DecodedPhone>& decoded) {
  std::vector<DecodedPhone> whole;
  for (const DecodedPhone& phone : decoded) {
    if (phone.phone == Phone::kSil && !whole.empty() && whole.back().phone == Phone::kSil) {
      whole.back().span.end = phone.span.end;
    } else {
      whole.push_back(phone);
    }
  }
  return whole;
}

/// The decoder's borders lie on its own grid of 10 ms; those expected of all paths lie between.
std::vector<DecodedPhone> withFinerTimes(std::vector<DecodedPhone> decoded, std::span<const std::int16_t> samples,
                                         PhoneDecoder& decoder, const HeardPhones& heard) {
  const std::vector<Seconds> borders = decoder.hearAgain(samples, decoded, heard);
  for (std::size_t i = 0; i < borders.size(); ++i) decoded[i].span.end = decoded[i + 1].span.start = borders[i];
  return decoded;
}

/// Walks the decoded phones word by word.
class LabelWriter {
 public:
  LabelWriter(const std::vector<TranscriptWord>& words, Seconds duration, const Language& language)
      : words_(words), duration_(duration), language_(language) {}

  void add(const DecodedPhone& decoded) {
    if (decoded.phone != Phone::kSil && decoded.opens_word) {
      finishWord();
      ++word_count_;
    }
    PhoneSegment segment{.phone = decoded.phone,
                         .span = {std::min(decoded.span.start, duration_), std::min(decoded.span.end, duration_)}};
    if (segment.span.duration() <= 0) return;
    if (decoded.phone != Phone::kSil) {
      if (afterSilence() && isStop(decoded.phone)) {
        segment.span.start = std::max(segment.span.start, segment.span.end - kLongestStopAfterSilence);
      }
      segment.word = word_count_ - 1;
      places_.push_back(segments_.size());
      phones_.push_back(decoded.phone);
      score_ += decoded.score;
      frames_ += decoded.frames;
    }
    segments_.push_back(segment);
  }

  ForcedAlignment finish() {
    finishWord();
    std::vector<std::string> texts;
    for (const TranscriptWord& word : words_) texts.push_back(word.text);
    ForcedAlignment alignment{buildSpeechLabels(std::move(segments_), texts, duration_, language_), {}};
    for (const double score : scores_)
      alignment.confidence.push_back(1 / (1 + std::exp((kEvenScore - score) / kScoreSpread)));
    return alignment;
  }

 private:
  [[nodiscard]] bool afterSilence() const { return segments_.empty() || segments_.back().phone == Phone::kSil; }

  void finishWord() {
    if (word_count_ == 0) return;
    const Pronunciation& way = wayTaken(words_[word_count_ - 1], phones_);
    for (std::size_t i = 0; i < places_.size(); ++i) {
      if (way.stress[i] >= 0) segments_[places_[i]].stress = way.stress[i];
      segments_[places_[i]].phone = way.phones[i];
      if (!way.ipa.empty()) segments_[places_[i]].ipa = way.ipa[i];
    }
    scores_.push_back(score_ / frames_);
    places_.clear();
    phones_.clear();
    score_ = frames_ = 0;
  }

  const std::vector<TranscriptWord>& words_;
  Seconds duration_;
  const Language& language_;
  std::vector<PhoneSegment> segments_;
  std::vector<double> scores_;  ///< of the words, a frame in the mean
  std::size_t word_count_ = 0;
  std::vector<std::size_t> places_;  ///< of the word's phones in segments_
  std::vector<Phone> phones_;        ///< of the word
  double score_ = 0, frames_ = 0;
};

bool isOtherText(const ForcedAlignment& alignment) {
  const std::size_t doubtful = alignment.doubtfulWords().size();
  return doubtful > 1 && asReal(doubtful) > kOtherTextShare * asReal(alignment.labels.words.size());
}

std::string wordWithTime(const SpeechLabels& labels, std::size_t word) {
  return fmt::format("{} ({:.2f} s)", labels.words[word].text, labels.spanOf(labels.words[word].phones).start);
}

/// The labels' words as they are labelled, and when each begins; without words what lies between two silences is one.
std::vector<TranscriptWord> wordsOf(const SpeechLabels& labels, std::vector<Seconds>& starts) {
  std::vector<TranscriptWord> words;
  const std::size_t none = labels.words.size() + 1;
  std::size_t last = none;
  for (const LabelledPhone& phone : labels.phones) {
    if (phone.phone == Phone::kSil) {
      last = none;
      continue;
    }
    const std::size_t word = phone.word.value_or(labels.words.size());
    if (word != last) {
      words.push_back({word < labels.words.size() ? labels.words[word].text : "", {Pronunciation()}});
      starts.push_back(phone.span.start);
    }
    last = word;
    words.back().ways[0].phones.push_back(phone.phone);
    words.back().ways[0].stress.push_back(-1);
  }
  return words;
}

/// Any words lie somewhere in noise, of which the doubt knows nothing: a line is not believed where hardly any of its
/// words' time is speech.
void doubtLinesOutsideSpeech(std::span<const SoundStretch> stretches, ForcedAlignment& alignment) {
  const SpeechLabels& labels = alignment.labels;
  std::size_t word = 0;
  for (const std::size_t end : TextDoubt::lineEnds(labels.words.size())) {
    const std::size_t first = word;
    Seconds time = 0, in_speech = 0;
    for (; word < end; ++word) {
      const TimeSpan span = labels.spanOf(labels.words[word].phones);
      time += span.duration();
      in_speech += speechIn(span, stretches);
    }
    if (in_speech >= kLeastInSpeech * time) continue;
    std::fill(alignment.confidence.begin() + signedIndex(first), alignment.confidence.begin() + signedIndex(end), 0.0);
    if (alignment.line_confidence.empty()) continue;
    std::fill(alignment.line_confidence.begin() + signedIndex(first),
              alignment.line_confidence.begin() + signedIndex(end), 0.0);
  }
}

/// Less than for a recording alone, which is refused where no speech is found: that there are words speaks for speech.
void refuseWhereNobodySpeaks(std::span<const SoundStretch> stretches, SpeechKind kind, std::string_view name) {
  if (stretches.empty()) throw InputError(name, "", "holds silence only; expected speech");
  const auto isSteady = [](const SoundStretch& stretch) { return stretch.is_steady; };
  if (kind == SpeechKind::kSpoken && std::all_of(stretches.begin(), stretches.end(), isSteady))
    throw InputError(name, "", "holds steady noise or tones only; expected speech");
}

[[noreturn]] void failTooShort(Seconds lasts, const std::vector<TranscriptWord>& words, std::string_view name) {
  std::size_t phones = 0;
  for (const TranscriptWord& word : words) {
    std::size_t fewest = word.ways.front().phones.size();
    for (const Pronunciation& way : word.ways) fewest = std::min(fewest, way.phones.size());
    phones += fewest;
  }
  throw InputError(name, "",
                   fmt::format("lasts {:.2f} s and does not fit its {} words; expected at least {:.2f} s", lasts,
                               words.size(), kShortestPhone * asReal(phones)));
}

}  // namespace

std::vector<std::size_t> ForcedAlignment::doubtfulWords() const {
  std::vector<std::size_t> words;
  for (std::size_t first = 0, end = 0; first < confidence.size(); first = end) {
    // Words of one stretch share its confidence.
    end = first + 1;
    while (end < line_confidence.size() && line_confidence[end] == line_confidence[first]) ++end;
    if (!line_confidence.empty() && line_confidence[first] >= kDoubtfulConfidence) continue;
    const std::size_t before = words.size();
    for (std::size_t i = first; i < end; ++i) {
      if (confidence[i] < kDoubtfulConfidence) words.push_back(i);
    }
    if (!line_confidence.empty() && words.size() == before)
      words.push_back(unsignedIndex(
          std::min_element(confidence.begin() + signedIndex(first), confidence.begin() + signedIndex(end)) -
          confidence.begin()));
  }
  return words;
}

std::string doubtsAbout(const ForcedAlignment& alignment) {
  constexpr std::size_t kMostNamed = 12;
  const std::vector<std::size_t> doubtful = alignment.doubtfulWords();
  if (doubtful.empty()) return {};
  const std::size_t words = alignment.labels.words.size();
  std::string doubts = isOtherText(alignment)
                           ? fmt::format("the words do not fit the sound: {} of {} are not heard in it, among them ",
                                         doubtful.size(), words)
                           : "doubtful words: ";
  for (std::size_t i = 0; i < std::min(doubtful.size(), kMostNamed); ++i)
    doubts += (i > 0 ? ", " : "") + wordWithTime(alignment.labels, doubtful[i]);
  return doubts + (doubtful.size() > kMostNamed ? ", ..." : "");
}

std::string doubtsAbout(const SpeechLabels& labels, const AudioClip& audio, Aligner& aligner, std::string_view name) {
  std::vector<Seconds> starts;
  const std::vector<TranscriptWord> words = wordsOf(labels, starts);
  if (words.empty() || starts.back() >= audio.duration())
    return words.empty() ? ""
                         : fmt::format("the labels go on after the sound, which ends at {:.2f} s", audio.duration());
  ForcedAlignment heard;
  try {
    heard = aligner.align(audio, words, name, SpeechKind::kSpoken, BorderTimes::kFirstHeard);
  } catch (const InputError&) {
    return "the labels do not fit the sound: it is too short for their phones, or nobody speaks in it";
  }
  if (isOtherText(heard)) return doubtsAbout(heard);
  std::vector<double> beside;
  for (std::size_t i = 0; i < words.size(); ++i)
    beside.push_back(heard.labels.spanOf(heard.labels.words[i].phones).start - starts[i]);
  const double middle = median(beside);
  if (std::abs(middle) <= kFarBeside) return "";
  return fmt::format("the labels lie beside the sound: their words are heard {:.2f} s {}", std::abs(middle),
                     middle > 0 ? "later" : "earlier");
}

ForcedAligner::ForcedAligner(const std::filesystem::path& model, const Language& language)
    : language_(language), decoder_(std::make_unique<PhoneDecoder>(model, language)) {}
ForcedAligner::~ForcedAligner() = default;

ForcedAlignment ForcedAligner::align(const AudioClip& audio, const std::vector<TranscriptWord>& words,
                                     std::string_view name, SpeechKind kind, BorderTimes times) {
  return align(SamplesToHear(audio), audio.duration(), words, name, kind, times);
}

/// What is known of words before they are judged.
struct ForcedAligner::Placed {
  ForcedAlignment alignment;
  std::vector<DecodedPhone> decoded;
  std::vector<SoundStretch> stretches;
};

ForcedAligner::Placed ForcedAligner::place(const SamplesToHear& to_hear, Seconds lasts,
                                           const std::vector<TranscriptWord>& words, std::string_view name,
                                           SpeechKind kind, BorderTimes times, const HeardPhones& heard) {
  const std::span<const std::int16_t> samples = to_hear.all();
  if (words.empty()) throw InputError(name, "", "has a transcript without words; expected at least one");
  std::vector<SoundStretch> stretches = findSpeech(samples);
  to_hear.letGo();
  refuseWhereNobodySpeaks(stretches, kind, name);
  std::vector<DecodedPhone> decoded = decoder_->decode(samples, waysOf(words), kind, heard);
  if (decoded.empty()) failTooShort(lasts, words, name);
  const bool is_spoken = kind == SpeechKind::kSpoken;
  LabelWriter writer(words, lasts, language_);
  std::vector<DecodedPhone> placed = is_spoken ? withWholeSilences(decoded) : decoded;
  if (is_spoken && times == BorderTimes::kFine) placed = withFinerTimes(std::move(placed), samples, *decoder_, heard);
  for (const DecodedPhone& phone : placed) writer.add(phone);
  return {writer.finish(), std::move(decoded), std::move(stretches)};
}

SpeechLabels ForcedAligner::labelsOf(const AudioClip& audio, const std::vector<TranscriptWord>& words,
                                     std::string_view name) {
  return place(SamplesToHear(audio), audio.duration(), words, name, SpeechKind::kSpoken, BorderTimes::kFine, {})
      .alignment.labels;
}

ForcedAlignment ForcedAligner::align(const SamplesToHear& to_hear, Seconds lasts,
                                     const std::vector<TranscriptWord>& words, std::string_view name, SpeechKind kind,
                                     BorderTimes times, const HeardPhones& heard) {
  auto [alignment, decoded, stretches] = place(to_hear, lasts, words, name, kind, times, heard);
  if (kind != SpeechKind::kSpoken) return std::move(alignment);
  const std::span<const std::int16_t> samples = to_hear.all();
  if (!doubt_) doubt_ = std::make_unique<TextDoubt>(*decoder_, language_);
  Believed believed =
      &language_ == &english() ? doubt_->judge(decoded, samples) : doubt_->judgeLines(decoded, samples, heard);
  if (believed.words.size() == alignment.confidence.size()) {
    alignment.confidence = std::move(believed.words);
    alignment.line_confidence = std::move(believed.lines);
  }
  doubtLinesOutsideSpeech(stretches, alignment);
  to_hear.letGo();
  return std::move(alignment);
}

}  // namespace mouthpiece
