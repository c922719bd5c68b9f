#include "vocal/viseme_events.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "base/index.h"

namespace mouthpiece {
namespace {

using namespace vocal_numbers;

bool isFullyArticulated(Viseme viseme) { return isLabial(viseme) || rowOf(viseme).sibilant; }

/// Plosives, fricatives, affricates and nasals; the labials aside, which close whatever their length.
bool isJawNarrowing(Phone phone) {
  const bool is_obstruent = isStop(phone) || rowOf(phone).manner == Articulation::kFricative;
  return (is_obstruent || isNasal(phone)) && lipClosure(phone) == LipClosure::kNone;
}

/// The rounded part of a lip-heavy phone: OY's second half spreads the lips.
bool isLipHeavy(const VisemeEvent& event, const SpeechLabels& labels) {
  return rowOf(labels.phones[event.phone.value].phone).lip_heavy && event.viseme != Viseme::kEe;
}

double amplitudeOf(Viseme viseme, bool is_vowel, Seconds duration) {
  if (isFullyArticulated(viseme)) return kFull;
  if (is_vowel && duration >= kLongVowel) return kLong;
  return kShort;
}

VisemeEvent fourKeys(const SpeechLabels& labels, PhoneIndex index, Viseme viseme, TimeSpan part) {
  const LabelledPhone& phone = labels.phones[index.value];
  VisemeEvent event;
  event.viseme = viseme;
  event.phone = event.first_phone = event.last_phone = index;
  event.span = part;
  event.is_vowel = isVowel(phone.phone);
  const Seconds reach = isLipHeavy(event, labels) ? kLipHeavyOnset : kOnset;
  event.onset = part.start - reach;
  event.end = part.end + reach;
  const double amplitude = amplitudeOf(viseme, event.is_vowel, phone.span.duration());
  event.inner = {{part.start, amplitude}, {part.start + kSustain * part.duration(), amplitude}};
  return event;
}

/// The two of a long diphthong: over 120 ms about its turn the first gives way to the second, so that the mouth never
/// does both in full. (In short ones they overlap as neighbours do; so the poses were learnt.)
std::pair<VisemeEvent, VisemeEvent> crossFaded(VisemeEvent first, VisemeEvent second) {
  const Seconds turn = second.span.start;
  const Seconds half = 0.5 * std::min(kOnset, second.span.duration());
  first.inner.back().time = turn - half;
  first.end = turn + half;
  second.onset = turn - half;
  second.inner.front().time = turn + half;
  return {std::move(first), std::move(second)};
}

bool areNeighbours(const VisemeEvent& a, const VisemeEvent& b) { return a.last_phone.value + 1 >= b.first_phone.value; }

/// Pass 2 over the events of a line.
class Coarticulation {
 public:
  Coarticulation(std::vector<VisemeEvent> events, const SpeechLabels& labels)
      : events_(std::move(events)), labels_(labels) {}

  std::vector<VisemeEvent> run() {
    shapeAspirates();
    mergeRepeats();
    leaveJawToVowels();
    spreadLipHeavy();
    releasePlosives();
    return std::move(events_);
  }

 private:
  /// Two phones of one viseme in a row are one viseme.
  void mergeRepeats() {
    std::vector<VisemeEvent> merged;
    for (VisemeEvent& event : events_) {
      const bool repeats = !merged.empty() && merged.back().viseme == event.viseme &&
                           merged.back().last_phone.value + 1 >= event.first_phone.value &&
                           merged.back().span.end >= event.span.start && !merged.back().has_sung_keys &&
                           !event.has_sung_keys;
      if (!repeats) {
        merged.push_back(std::move(event));
        continue;
      }
      VisemeEvent& first = merged.back();
      const double amplitude = std::max(first.inner.back().value, event.inner.front().value);
      first.inner.front().value = amplitude;
      first.inner = {first.inner.front(), {event.inner.back().time, amplitude}};
      first.span.end = event.span.end;
      first.end = event.end;
      first.last_phone = event.last_phone;
      first.is_vowel = first.is_vowel || event.is_vowel;
    }
    events_ = std::move(merged);
  }

  /// HH is the next vowel's shape, reached already at its own beginning.
  void shapeAspirates() {
    for (std::size_t i = 0; i < events_.size(); ++i) {
      if (events_[i].viseme != Viseme::kH) continue;
      const bool has_vowel =
          i + 1 < events_.size() && events_[i + 1].is_vowel && events_[i + 1].phone.value == events_[i].phone.value + 1;
      if (has_vowel) {
        VisemeEvent& vowel = events_[i + 1];
        vowel.onset += events_[i].span.start - vowel.span.start;
        vowel.inner.front().time = events_[i].span.start;
        vowel.span.start = events_[i].span.start;
        vowel.first_phone = events_[i].first_phone;
      }
    }
    std::erase_if(events_, [](const VisemeEvent& event) { return event.viseme == Viseme::kH; });
  }

  /// Inside its word a phone looks ahead for its shape, the last one back; what has no word looks both ways.
  [[nodiscard]] bool looksAt(const VisemeEvent& from, const VisemeEvent& at) const {
    const LabelledPhone& own = labels_.phones[from.phone.value];
    if (!own.word) return true;
    const PhoneRange& word = labels_.words[*own.word].phones;
    const bool is_behind = at.phone < from.phone;
    if (word.first == word.last) return true;  // a word of one phone
    return is_behind == (from.phone == word.last);
  }

  /// Lip-heavy visemes replace the lips of the consonants beside them that look at them and are not labial.
  void spreadLipHeavy() {
    const auto gives_way = [&](const VisemeEvent& event) {
      return !event.is_vowel && !isLabial(event.viseme) && !isLipHeavy(event, labels_);
    };
    for (std::size_t i = 0; i < events_.size(); ++i) {
      VisemeEvent& heavy = events_[i];
      if (!isLipHeavy(heavy, labels_)) continue;
      if (i > 0 && areNeighbours(events_[i - 1], heavy) && gives_way(events_[i - 1]) &&
          looksAt(events_[i - 1], heavy)) {
        const Seconds earlier = heavy.inner.front().time - events_[i - 1].span.start;
        heavy.inner.front().time -= earlier;
        heavy.onset -= earlier;
        events_[i - 1].lips = 0;
      }
      if (i + 1 < events_.size() && areNeighbours(heavy, events_[i + 1]) && gives_way(events_[i + 1]) &&
          looksAt(events_[i + 1], heavy)) {
        const Seconds later = events_[i + 1].inner.back().time - heavy.inner.back().time;
        heavy.inner.back().time += later;
        heavy.end += later;
        events_[i + 1].lips = 0;
      }
    }
  }

  void leaveJawToVowels() {
    for (std::size_t i = 0; i < events_.size(); ++i) {
      VisemeEvent& event = events_[i];
      if (rowOf(event.viseme).tongue_only) event.lips = 0;
      const Phone phone = labels_.phones[event.phone.value].phone;
      if (!isJawNarrowing(phone) || event.span.duration() >= kJawFrame) continue;
      const auto is_similar = [&](const VisemeEvent& other) {
        return isJawNarrowing(labels_.phones[other.phone.value].phone);
      };
      const bool has_similar =
          (i > 0 && areNeighbours(events_[i - 1], event) && is_similar(events_[i - 1])) ||
          (i + 1 < events_.size() && areNeighbours(event, events_[i + 1]) && is_similar(events_[i + 1]));
      if (!has_similar) event.jaw = 0;
    }
  }

  /// Every non-nasal opens the lips at some point: a P or B before a pause lets go of them.
  void releasePlosives() {
    constexpr Seconds kRelease = 0.060;
    constexpr double kReleased = 0.2;
    for (std::size_t i = 0; i < events_.size(); ++i) {
      const std::size_t last = events_[i].last_phone.value;
      const Phone phone = labels_.phones[last].phone;
      const bool before_pause = last + 1 < labels_.phones.size() && labels_.phones[last + 1].phone == Phone::kSil;
      if (events_[i].viseme != Viseme::kMBP || isNasal(phone) || !before_pause) continue;
      VisemeEvent release = events_[i];
      release.viseme = Viseme::kUh;
      release.span = {events_[i].span.end, events_[i].span.end + kRelease};
      release.onset = events_[i].span.end - 0.5 * kRelease;
      release.inner = {{release.span.end, kReleased}};
      release.end = release.span.end + kOnset;
      events_.insert(events_.begin() + signedIndex(++i), release);
    }
  }

  std::vector<VisemeEvent> events_;
  const SpeechLabels& labels_;
};

}  // namespace

Seconds diphthongTurn(const TimeSpan& span) { return std::max(span.middle(), span.end - kOnset); }

std::vector<VisemeEvent> fourKeyEvents(const SpeechLabels& labels) {
  std::vector<VisemeEvent> events;
  for (std::size_t i = 0; i < labels.phones.size(); ++i) {
    const LabelledPhone& phone = labels.phones[i];
    if (phone.phone == Phone::kSil) continue;
    const Viseme first = firstViseme(phone.phone);
    const Viseme last = lastViseme(phone.phone);
    const Seconds turn = diphthongTurn(phone.span);
    const PhoneIndex index(i);
    if (first == last) {
      events.push_back(fourKeys(labels, index, first, phone.span));
    } else {
      VisemeEvent opening = fourKeys(labels, index, first, {phone.span.start, turn});
      VisemeEvent closing = fourKeys(labels, index, last, {turn, phone.span.end});
      if (phone.span.duration() >= kLongVowel) std::tie(opening, closing) = crossFaded(opening, closing);
      events.push_back(std::move(opening));
      events.push_back(std::move(closing));
    }
  }
  return events;
}

std::vector<VisemeEvent> coarticulated(std::vector<VisemeEvent> events, const SpeechLabels& labels) {
  return Coarticulation(std::move(events), labels).run();
}

}  // namespace mouthpiece
