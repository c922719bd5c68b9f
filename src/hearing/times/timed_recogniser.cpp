#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <optional>
#include <utility>

#include "base/counted.h"
#include "base/errors.h"
#include "base/files.h"
#include "base/index.h"
#include "base/text_encoding.h"
#include "hearing/alignment/forced_alignment.h"
#include "hearing/alignment/phone_ear.h"
#include "hearing/alignment/pronouncer.h"
#include "hearing/alignment/samples_to_hear.h"
#include "hearing/alignment/speech_finder.h"
#include "hearing/times/times_file.h"
#include "phonetics/labels/labels_builder.h"
#include "phonetics/language/language.h"

namespace mouthpiece {
namespace {

constexpr std::uint64_t kMostTimesBytes = std::uint64_t{64} << 20U;
/// Words closer together than this are aligned together, with so much sound around them.
constexpr Seconds kTogether = 0.3, kAround = 0.15;
constexpr Seconds kLongestTogether = 30;
constexpr double kUnsure = 0.5;
/// A shorter gap between two words is no pause: stops are closed as long.
constexpr Seconds kLeastPause = 0.060;

bool liesInSpeech(const SpeechLabels& labels, std::span<const std::int16_t> samples) {
  const std::vector<SoundStretch> stretches = findSpeech(samples);
  Seconds time = 0, in_speech = 0;
  for (const LabelledPhone& phone : labels.phones) {
    if (phone.phone == Phone::kSil) continue;
    time += phone.span.duration();
    in_speech += speechIn(phone.span, stretches);
  }
  return in_speech >= kLeastInSpeech * time;
}

/// "de", "de-CH" and "german" are German; what a file does not tell, or tells by a name that is not known, may be any.
bool isOf(const Language& language, std::string_view told) {
  const auto primary = [](const Language& one) { return one.tag.substr(0, one.tag.find('-')); };
  try {
    return told.empty() || primary(languageOf(told)) == primary(language);
  } catch (const InputError&) {
    return true;
  }
}

/// A sound, of which parts are aligned. Of one that is long and comes as it is heard nothing else is kept.
class SoundInParts {
 public:
  explicit SoundInParts(AudioClip audio) : lasts_(audio.duration()), audio_(std::move(audio)), to_hear_(audio_) {
    if (lasts_ > SamplesToHear::kInMemoryUntil && audio_.sample_rate_hz == SamplesToHear::kRateHz)
      audio_ = {SamplesToHear::kRateHz, {}};
  }
  [[nodiscard]] Seconds duration() const { return lasts_; }
  [[nodiscard]] const SamplesToHear& toHear() const { return to_hear_; }
  /// Both times within the sound.
  [[nodiscard]] AudioClip part(Seconds from, Seconds to) const {
    constexpr float kScale = 32767.0F;  // samplesToHear()'s
    const auto sample = [&](Seconds time, std::size_t count) {
      return signedIndex(std::min(count, static_cast<std::size_t>(time * audio_.sample_rate_hz)));
    };
    AudioClip clip{audio_.sample_rate_hz, {}};
    if (!audio_.samples.empty()) {
      const std::size_t count = audio_.samples.size();
      clip.samples.assign(audio_.samples.begin() + sample(from, count), audio_.samples.begin() + sample(to, count));
      return clip;
    }
    const std::span<const std::int16_t> all = to_hear_.all();
    for (auto at = sample(from, all.size()); at < sample(to, all.size()); ++at)
      clip.samples.push_back(static_cast<float>(all[unsignedIndex(at)]) / kScale);
    to_hear_.letGo();
    return clip;
  }

 private:
  Seconds lasts_;
  AudioClip audio_;
  SamplesToHear to_hear_;
};

class TimedRecogniser : public Recogniser {
 public:
  TimedRecogniser(const std::filesystem::path& file, const Lexicon* lexicon, const Language& language)
      : name_(file.string()),
        times_(parseTimes(readFile(file, kMostTimesBytes), name_, language)),
        is_loud_(std::ranges::none_of(times_.words,
                                      [](const TimesFile::Word& word) {
                                        return std::ranges::any_of(word.text,
                                                                   [](char c) { return c >= 'a' && c <= 'z'; });
                                      })),
        language_(language),
        lexicon_(lexicon) {}

  HeardSpeech hear(AudioClip audio, std::string_view name) override;

 private:
  struct Group {
    std::size_t first = 0, end = 0;  ///< of times_.words
  };
  [[nodiscard]] std::vector<Group> groupsWithoutPhones() const;
  void alignGroup(const Group& group, const SoundInParts& sound, HeardSpeech& heard);
  [[nodiscard]] std::vector<TimeSpan> spansWithoutGaps(const Group& group, const std::vector<std::size_t>& owners,
                                                       const SpeechLabels& labels, Seconds offset) const;
  void addAligned(const Group& group, const std::vector<std::size_t>& owners, const ForcedAlignment& alignment,
                  Seconds offset);
  void putInOrder();
  void dropBeyondSound(const SoundInParts& sound, HeardSpeech& heard);
  void warn(const SoundInParts& sound, HeardSpeech& heard) const;
  void addEvenly(const Group& group, const std::vector<std::size_t>& owners, const std::vector<TranscriptWord>& words);

  std::string name_;
  TimesFile times_;
  bool is_loud_;  ///< none of its words has small letters
  const Language& language_;
  const Lexicon* lexicon_;
  std::optional<Pronouncer> pronouncer_;
  std::optional<ForcedAligner> aligner_;
  std::vector<PhoneSegment> segments_;
  std::vector<double> confidence_;
  std::vector<std::string> words_;
};

std::vector<TimedRecogniser::Group> TimedRecogniser::groupsWithoutPhones() const {
  std::vector<bool> has_phones(times_.words.size());
  for (const PhoneSegment& phone : segments_) {
    if (phone.word) has_phones[*phone.word] = true;
  }
  std::vector<Group> all;
  for (std::size_t i = 0; i < times_.words.size(); ++i) {
    if (has_phones[i]) continue;
    const bool joins = !times_.words_are_lines && !all.empty() && all.back().end == i &&
                       times_.words[i].span.start - times_.words[i - 1].span.end < kTogether &&
                       times_.words[i].span.end - times_.words[all.back().first].span.start < kLongestTogether;
    if (joins) {
      all.back().end = i + 1;
    } else {
      all.push_back({i, i + 1});
    }
  }
  return all;
}

/// The times of a group's words; two that no pause parts, by the gap between them or by what is heard, meet: where
/// they are heard to, if that lies in the gap.
std::vector<TimeSpan> TimedRecogniser::spansWithoutGaps(const Group& group, const std::vector<std::size_t>& owners,
                                                        const SpeechLabels& labels, Seconds offset) const {
  std::vector<TimeSpan> spans;
  for (std::size_t i = group.first; i < group.end; ++i) spans.push_back(times_.words[i].span);
  for (std::size_t w = 1; w < labels.words.size(); ++w) {
    if (owners[w] != owners[w - 1] + 1) continue;
    TimeSpan &before = spans[owners[w - 1]], &after = spans[owners[w]];
    const PhoneIndex last = labels.words[w - 1].phones.last, first = labels.words[w].phones.first;
    const bool is_pause = first.value != last.value + 1;
    if (after.start <= before.end || (is_pause && after.start - before.end >= kLeastPause)) continue;
    before.end = after.start = std::clamp(labels.phones[last.value].span.end + offset, before.end, after.start);
  }
  return spans;
}

/// The aligner's phones; where a word has times of its own, stretched to them.
void TimedRecogniser::addAligned(const Group& group, const std::vector<std::size_t>& owners,
                                 const ForcedAlignment& alignment, Seconds offset) {
  const SpeechLabels& labels = alignment.labels;
  const std::vector<TimeSpan> spans = spansWithoutGaps(group, owners, labels, offset);
  // A word of the file may be read out as several.
  for (std::size_t w = 0; w < labels.words.size();) {
    std::size_t end = w;
    while (end < labels.words.size() && owners[end] == owners[w]) ++end;
    const PhoneIndex first = labels.words[w].phones.first, last = labels.words[end - 1].phones.last;
    const TimeSpan found{labels.phones[first.value].span.start + offset, labels.phones[last.value].span.end + offset};
    const TimesFile::Word& given = times_.words[group.first + owners[w]];
    const TimeSpan& own = spans[owners[w]];
    const double stretch = times_.words_are_lines || found.duration() <= 0 ? 1 : own.duration() / found.duration();
    const Seconds start = times_.words_are_lines ? found.start : own.start;
    for (; w < end; ++w) {
      words_.push_back(labels.words[w].text);
      for (std::size_t i = labels.words[w].phones.first.value; i <= labels.words[w].phones.last.value; ++i) {
        const LabelledPhone& phone = labels.phones[i];
        if (phone.phone == Phone::kSil) continue;
        PhoneSegment segment{.phone = phone.phone,
                             .span = {start + stretch * (phone.span.start + offset - found.start),
                                      start + stretch * (phone.span.end + offset - found.start)},
                             .word = words_.size() - 1,
                             .ipa = phone.ipa};
        if (phone.syllable && isVowel(phone.phone)) segment.stress = labels.syllables[*phone.syllable].stress;
        segments_.push_back(segment);
        confidence_.push_back(given.confidence * alignment.confidence[w]);
      }
    }
  }
}

/// Without a sound that holds them: the usual phones, each as long as the others.
void TimedRecogniser::addEvenly(const Group& group, const std::vector<std::size_t>& owners,
                                const std::vector<TranscriptWord>& words) {
  for (std::size_t w = 0; w < words.size();) {
    std::size_t end = w, phones = 0;
    for (; end < words.size() && owners[end] == owners[w]; ++end) phones += words[end].ways.front().phones.size();
    const TimesFile::Word& given = times_.words[group.first + owners[w]];
    const Seconds step = given.span.duration() / asReal(std::max<std::size_t>(1, phones));
    Seconds at = given.span.start;
    for (; w < end; ++w) {
      words_.push_back(words[w].text);
      const Pronunciation& way = words[w].ways.front();
      for (std::size_t i = 0; i < way.phones.size(); ++i) {
        segments_.push_back({.phone = way.phones[i],
                             .span = {at, at + step},
                             .word = words_.size() - 1,
                             .ipa = way.ipa.empty() ? std::string() : way.ipa[i]});
        confidence_.push_back(0.5 * given.confidence);
        at += step;
      }
    }
  }
}

void TimedRecogniser::alignGroup(const Group& group, const SoundInParts& sound, HeardSpeech& heard) {
  if (!pronouncer_) {
    pronouncer_.emplace(lexicon_, language_);
    aligner_.emplace(std::filesystem::path(), language_);
  }
  std::vector<TranscriptWord> words;
  std::vector<std::size_t> owners;  // the file's word that each is part of
  for (std::size_t i = group.first; i < group.end; ++i) {
    try {
      for (TranscriptWord& word : pronouncer_->wordsOf(times_.words[i].text, is_loud_)) {
        words.push_back(std::move(word));
        owners.push_back(i - group.first);
      }
    } catch (const InputError&) {
      heard.warnings.push_back(fmt::format("'{}' at {:.2f} s cannot be said and is left out",
                                           printable(times_.words[i].text, 40), times_.words[i].span.start));
    }
  }
  if (words.empty()) return;
  // Words outside the sound were refused before.
  const Seconds from = std::max({0.0, times_.words[group.first].span.start - kAround,
                                 group.first > 0 ? times_.words[group.first - 1].span.end : 0.0});
  const Seconds to = std::min({sound.duration(), times_.words[group.end - 1].span.end + kAround,
                               group.end < times_.words.size() ? times_.words[group.end].span.start : 1e9});
  try {
    addAligned(group, owners, aligner_->align(sound.part(from, to), words, name_), from);
  } catch (const InputError&) {
    heard.warnings.push_back(
        fmt::format("the words from {:.2f} to {:.2f} s are not heard there: their phones are evenly "
                    "spread",
                    from, to));
    addEvenly(group, owners, words);
  }
}

/// Words that were aligned come between those whose phones were given.
void TimedRecogniser::putInOrder() {
  std::vector<std::size_t> order(segments_.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [this](std::size_t a, std::size_t b) { return segments_[a].span.start < segments_[b].span.start; });
  std::vector<PhoneSegment> segments;
  std::vector<double> confidence;
  std::vector<std::string> words;
  std::optional<std::size_t> last_word;
  for (const std::size_t i : order) {
    segments.push_back(segments_[i]);
    confidence.push_back(confidence_[i]);
    if (!segments_[i].word) continue;
    if (last_word != segments_[i].word) words.push_back(words_[*segments_[i].word]);
    last_word = segments_[i].word;
    segments.back().word = words.size() - 1;
  }
  segments_ = std::move(segments);
  confidence_ = std::move(confidence);
  words_ = std::move(words);
}

/// Recognisers make up words behind a recording's end ("Thanks for watching!"): they are left out where most words are
/// this sound's.
void TimedRecogniser::dropBeyondSound(const SoundInParts& sound, HeardSpeech& heard) {
  const auto is_beyond = [&](const auto& each) { return each.span.start >= sound.duration(); };
  const auto first = std::ranges::find_if(times_.words, is_beyond);
  const auto beyond = times_.words.end() - first;
  if (beyond == 0 || 2 * beyond >= std::ssize(times_.words)) return;
  std::string text;
  for (auto word = first; word != times_.words.end(); ++word) text += (text.empty() ? "" : " ") + word->text;
  heard.warnings.push_back(
      fmt::format("'{}' begins at {:.2f} s by {}, after the sound, which lasts {:.2f} s: {} left out",
                  printable(text, 60), first->span.start, name_, sound.duration(), beyond == 1 ? "it is" : "they are"));
  times_.words.erase(first, times_.words.end());
  std::erase_if(times_.phones, [&](const PhoneSegment& phone) {
    return is_beyond(phone) || (phone.word && *phone.word >= times_.words.size());
  });
}

/// What is odd about the times and their words.
void TimedRecogniser::warn(const SoundInParts& sound, HeardSpeech& heard) const {
  if (!liesInSpeech(heard.labels, sound.toHear().all()))
    heard.warnings.push_back(
        fmt::format("hardly any speech is heard where {} has words: its times may be another sound's", name_));
  // A subtitle may stay longer than what is said.
  constexpr Seconds kMayOverhang = 0.25;
  if (!times_.words.empty() && !times_.words_are_lines &&
      times_.words.back().span.end > sound.duration() + kMayOverhang) {
    const TimesFile::Word& word = times_.words.back();
    heard.warnings.push_back(
        fmt::format("'{}' ends at {:.2f} s by {}, after the sound, which lasts {:.2f} s: it is cut there",
                    printable(word.text, 40), word.span.end, name_, sound.duration()));
  }
  if (const std::size_t left_out = times_.not_said.size(); left_out > 0) {
    constexpr std::size_t kShown = 5, kMostBytes = 120;
    const auto shown = std::span(times_.not_said).first(std::min(kShown, left_out));
    heard.notices.push_back(fmt::format("{} left out as not said, by {}: {}{}", left_out, times_.kind,
                                        printable(fmt::format("{}", fmt::join(shown, " ")), kMostBytes),
                                        left_out > kShown ? " ..." : ""));
  }
  if (times_.cut_lines > 0)
    heard.notices.push_back(fmt::format("{} of {} cut where the next line begins, which {} overlapped",
                                        counted(times_.cut_lines, "line"), times_.kind,
                                        times_.cut_lines == 1 ? "it" : "they"));
  if (!isOf(language_, times_.language))
    heard.warnings.push_back(fmt::format("{} tells that its language is {}, and is read as {}: say which it is",
                                         times_.kind, printable(times_.language, 20), language_.name));
  std::string doubtful;
  std::size_t count = 0;
  for (const TimesFile::Word& word : times_.words) {
    if (word.confidence < kUnsure && count++ < 12) doubtful += (doubtful.empty() ? "" : ", ") + word.text;
  }
  if (!doubtful.empty()) heard.warnings.push_back(fmt::format("{} is unsure of: {}", times_.kind, doubtful));
}

HeardSpeech TimedRecogniser::hear(AudioClip audio, std::string_view name) {
  const SoundInParts sound(std::move(audio));
  HeardSpeech heard;
  dropBeyondSound(sound, heard);
  const Seconds last = std::max(times_.words.empty() ? 0.0 : times_.words.back().span.start,
                                times_.phones.empty() ? 0.0 : times_.phones.back().span.start);
  if (last >= sound.duration()) {
    throw InputError(
        name_, "",
        fmt::format("has times up to {:.2f} s, and {} lasts {:.2f} s; expected times of this "
                    "sound{}",
                    last, name, sound.duration(), 1e-3 * last < sound.duration() && last > 100 ? ", in seconds" : ""));
  }
  segments_.clear();
  confidence_.clear();
  words_.clear();
  const bool has_phones = !times_.phones.empty() && !(times_.phones_are_shapes && !times_.words.empty());
  if (has_phones) {
    segments_ = times_.phones;
    for (const TimesFile::Word& word : times_.words) words_.push_back(word.text);
    for (const PhoneSegment& segment : segments_)
      confidence_.push_back(times_.phones_are_shapes ? kUnsure
                            : segment.word           ? times_.words[*segment.word].confidence
                                                     : 1);
    if (times_.phones_are_shapes)
      heard.warnings.push_back(times_.kind +
                               " tells mouth shapes, not phones: each is shown by one phone that looks so");
  }
  for (const Group& group : groupsWithoutPhones()) alignGroup(group, sound, heard);
  if (has_phones) putInOrder();
  // The sound's end is the end; neighbours do not overlap.
  std::vector<PhoneSegment> kept;
  std::vector<double> sure;
  for (std::size_t i = 0; i < segments_.size(); ++i) {
    PhoneSegment segment = segments_[i];
    segment.span.start = std::max(segment.span.start, kept.empty() ? 0.0 : kept.back().span.end);
    segment.span.end = std::min(segment.span.end, sound.duration());
    if (segment.span.duration() < 1e-4) continue;
    kept.push_back(segment);
    sure.push_back(confidence_[i]);
  }
  if (kept.empty()) throw InputError(name_, "", "has no word that can be said; expected words of this sound");
  heard.labels = buildSpeechLabels(kept, words_, sound.duration(), language_);
  heard.confidence = confidenceOf(heard.labels, kept, sure);
  for (const LabelledWord& word : heard.labels.words) heard.text += (heard.text.empty() ? "" : " ") + word.text;
  warn(sound, heard);
  return heard;
}

}  // namespace

std::unique_ptr<Recogniser> makeTimedRecogniser(const std::filesystem::path& file, const Lexicon* lexicon,
                                                const Language& language) {
  return std::make_unique<TimedRecogniser>(file, lexicon, language);
}

}  // namespace mouthpiece
