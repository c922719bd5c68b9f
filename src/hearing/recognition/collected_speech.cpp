#include "hearing/recognition/collected_speech.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/errors.h"
#include "base/index.h"

namespace mouthpiece {
namespace {

constexpr std::size_t kMostNamed = 12;  // words in a warning, or places
/// A stretch with less of phones is not doubted by itself: a click.
constexpr Seconds kLeastDoubted = 0.5;

/// Nobody holds a closing, or a tongue between the teeth, for so long: noise is heard as it, but for what lies next to
/// another phone (docs/theory/hearing/recognition.md#noise-around-a-line).
constexpr Seconds kHeldTooLong = 0.35, kHeldAtMost = 0.12;

bool isHeldByNobody(const PhoneSegment& phone) {
  return phone.span.duration() > kHeldTooLong && (isStop(phone.phone) || phone.phone == Phone::kDH);
}

/// The first of `items`, each by `text`, with commas between them.
template <typename Item, typename Text>
std::string named(const std::vector<Item>& items, Text text) {
  std::string all;
  for (std::size_t i = 0; i < std::min(items.size(), kMostNamed); ++i) all += (i > 0 ? ", " : "") + text(items[i]);
  return all + (items.size() > kMostNamed ? ", ..." : "");
}
std::string placeOf(const TimeSpan& span) { return fmt::format("{:.1f} to {:.1f} s", span.start, span.end); }

}  // namespace

void shortenHeldPhones(std::vector<PhoneSegment>& segments) {
  constexpr Seconds kSame = 1e-6;
  for (std::size_t i = 0; i < segments.size(); ++i) {
    PhoneSegment& phone = segments[i];
    if (!isHeldByNobody(phone)) continue;
    const auto isNextTo = [&](const PhoneSegment& other) { return !phone.word || other.word == phone.word; };
    const bool follows = i > 0 && isNextTo(segments[i - 1]) && phone.span.start - segments[i - 1].span.end < kSame;
    const bool goes_on =
        i + 1 < segments.size() && isNextTo(segments[i + 1]) && segments[i + 1].span.start - phone.span.end < kSame;
    if (goes_on && follows && phone.word) continue;  // inside of a word
    if (goes_on)
      phone.span.start = phone.span.end - kHeldAtMost;
    else
      phone.span.end = phone.span.start + kHeldAtMost;
  }
}

void CollectedSpeech::addPhone(const PhoneSegment& phone, double confidence) {
  segments_.push_back(phone);
  confidence_.push_back(confidence);
}

std::size_t CollectedSpeech::addWord(std::string text) {
  words_.push_back(std::move(text));
  return words_.size() - 1;
}

void CollectedSpeech::addStretch(const TimeSpan& stretch, double odds, Seconds heard_for) {
  stretch_s_ += stretch.duration();
  odds_s_ += stretch.duration() * odds;
  if (odds > 0 && heard_for >= kLeastDoubted) doubted_.push_back(stretch);
}

void CollectedSpeech::doubtWord(std::string_view word, Seconds start) {
  doubtful_.push_back(fmt::format("{} ({:.2f} s)", word, start));
}

std::string CollectedSpeech::doubts() const {
  const double sure = 1 / (1 + std::exp(odds_s_ / std::max(stretch_s_, kEarStep)));
  const std::string words = named(doubtful_, [](const std::string& word) { return word; });
  if (sure < 0.5) {
    return fmt::format("what was heard is doubtful ({:.2f} of 1{}{})", sure, words.empty() ? "" : "; most of all ",
                       words);
  }
  std::string what;
  if (!doubted_.empty()) what = "what was heard is doubtful from " + named(doubted_, placeOf);
  if (!words.empty()) what += (what.empty() ? "" : "; ") + ("words that may be wrong: " + words);
  return what;
}

void CollectedSpeech::warn(bool words_wanted, bool takes_hints, HeardSpeech& heard) const {
  for (const SoundKind kind : {SoundKind::kMusic, SoundKind::kNoise}) {
    std::string places;
    for (const SoundStretch& stretch : heard.stretches) {
      if (stretch.kind == kind) places += (places.empty() ? "" : ", ") + placeOf(stretch.span);
    }
    if (!places.empty())
      heard.warnings.push_back(
          fmt::format("{} without speech, passed over: {}", kind == SoundKind::kMusic ? "music" : "noise", places));
  }
  const auto wordless =
      std::count_if(segments_.begin(), segments_.end(), [](const auto& phone) { return !phone.word; });
  if (wordless > 0 && words_wanted)
    heard.warnings.push_back(fmt::format("{} of {} phones were heard without words", wordless, segments_.size()));
  const std::string what = doubts();
  if (!what.empty())
    heard.warnings.push_back(what +
                             (takes_hints ? "; a transcript or a hint would help" : "; a transcript would help"));
}

void CollectedSpeech::finish(std::string_view name, Seconds duration, const Language& language, bool words_wanted,
                             bool takes_hints, HeardSpeech& heard) {
  for (SoundStretch& stretch : heard.stretches) {
    const bool is_noise = std::any_of(passed_over_.begin(), passed_over_.end(),
                                      [&](const TimeSpan& span) { return span.contains(stretch.span.middle()); });
    if (is_noise) stretch.kind = SoundKind::kNoise;
  }
  if (segments_.empty()) {
    throw InputError(name, "",
                     heard.stretches.empty() ? "holds silence only; expected speech"
                                             : "holds no speech that can be heard; expected speech");
  }
  // Stretches meet where one was cut.
  for (std::size_t i = 0; i + 1 < segments_.size(); ++i)
    segments_[i].span.end = std::min(segments_[i].span.end, segments_[i + 1].span.start);
  for (std::size_t i = 0; i < segments_.size();) {
    segments_[i].span.end = std::min(segments_[i].span.end, duration);
    if (segments_[i].span.duration() > 0) {
      ++i;
      continue;
    }
    segments_.erase(segments_.begin() + signedIndex(i));
    confidence_.erase(confidence_.begin() + signedIndex(i));
  }
  shortenHeldPhones(segments_);
  heard.text = fmt::format("{}", fmt::join(words_, " "));
  warn(words_wanted, takes_hints, heard);
  heard.labels = buildSpeechLabels(segments_, words_, duration, language);
  heard.confidence = confidenceOf(heard.labels, segments_, confidence_);
}

}  // namespace mouthpiece
