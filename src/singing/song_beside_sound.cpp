// A song's score laid beside a recording of it.
#include "singing/song_beside_sound.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "base/errors.h"
#include "base/index.h"
#include "base/statistics.h"
#include "hearing/tags/hear_tags.h"
#include "phonetics/labels/labels_builder.h"

namespace mouthpiece {
namespace {

constexpr PitchOptions kPitch{.step = 0.01, .lowest_hz = 60, .highest_hz = 1100};
/// A song is looked for in steps of this, then about the best in steps of the pitch track. The longest song that is
/// read in the longest sound, 30 minutes in 4 hours, takes 3.5 s of processor time so.
constexpr std::size_t kCoarse = 10;
/// Pitches are counted in parts of a semitone; three parts side by side are one key.
constexpr double kPartsASemitone = 2;
constexpr std::size_t kParts = 24;
/// A word that is heard further from its place than those around it by this is not believed to be there.
constexpr Seconds kFarthestFromNeighbours = 0.25;
constexpr std::size_t kNeighbours = 4;  // on either side
/// Words that would lie so far outside of the sound are listened for: its singer is not the score's clock.
constexpr Seconds kSlack = 1.0;
/// A voice's last phone may be cut by so much.
constexpr Seconds kMostCut = 0.03;
constexpr Seconds kFarthestOffset = 14'400;  // as long as a sound may be
/// Voice outside of the song that is told.
constexpr Seconds kLongOutside = 2;

/// The notes of a score and a sound's pitch, step by step on one clock each. A pitch is in parts of an octave, -1 for
/// none.
class ScoreSearch {
 public:
  ScoreSearch(std::span<const Note> notes, const PitchTrack& pitch) : step_(pitch.step) {
    const auto partOf = [](double hz) {
      const double parts = std::round(12 * kPartsASemitone * std::log2(hz / 440));
      return static_cast<int>(parts - asReal(kParts) * std::floor(parts / asReal(kParts)));
    };
    for (const PitchFrame& frame : pitch.frames) heard_.push_back(frame.hz > 0 ? partOf(frame.hz) : -1);
    first_ = signedIndex(unsignedFloor(notes.front().span.start));
    for (const Note& note : notes) {
      written_.resize(std::max(written_.size(), unsignedFloor(note.span.start) - unsignedIndex(first_)), -1);
      written_.resize(std::max(written_.size(), unsignedFloor(note.span.end) - unsignedIndex(first_)), partOf(note.hz));
    }
  }

  /// How many more steps agree than speak against it, with the song's 0 at step `offset` of the sound; one of `every`
  /// steps is looked at. `agreement`: the share of the notes' steps that agree, where it is asked for.
  [[nodiscard]] double scoreAt(std::ptrdiff_t offset, std::ptrdiff_t every, double* agreement = nullptr) const {
    std::array<int, kParts> keys{};
    int voice_in_rest = 0, sung = 0;
    const std::ptrdiff_t shift = offset + first_;
    const std::ptrdiff_t begin = std::max<std::ptrdiff_t>(0, -shift);
    const std::ptrdiff_t end = std::min(signedIndex(written_.size()), signedIndex(heard_.size()) - shift);
    for (std::ptrdiff_t i = begin; i < end; i += every) {
      const int wanted = written_[unsignedIndex(i)], got = heard_[unsignedIndex(i + shift)];
      sung += wanted >= 0 ? 1 : 0;
      if (got < 0) continue;
      if (wanted < 0) {
        ++voice_in_rest;
      } else {
        ++keys[unsignedIndex(got - wanted + (got < wanted ? static_cast<int>(kParts) : 0))];
      }
    }
    int best = 0;
    for (std::size_t i = 0; i < kParts; ++i)
      best = std::max(best, keys[i] + keys[(i + 1) % kParts] + keys[(i + 2) % kParts]);
    if (agreement != nullptr) *agreement = sung > 0 ? static_cast<double>(best) / sung : 0;
    return best - voice_in_rest;
  }

  [[nodiscard]] std::ptrdiff_t best() const {
    const auto every = signedIndex(kCoarse);
    const auto bestOf = [&](std::ptrdiff_t from, std::ptrdiff_t to, std::ptrdiff_t by, std::ptrdiff_t looked_at) {
      std::ptrdiff_t best = from;
      double highest = -1e9;
      for (std::ptrdiff_t offset = from; offset <= to; offset += by) {
        const double score = scoreAt(offset, looked_at);
        if (score > highest) best = offset;
        highest = std::max(highest, score);
      }
      return best;
    };
    const std::ptrdiff_t length = signedIndex(written_.size());
    const std::ptrdiff_t coarse = bestOf(-first_ - length, signedIndex(heard_.size()) - first_, every, every);
    return bestOf(coarse - 2 * every, coarse + 2 * every, 1, 1);
  }

  [[nodiscard]] bool hasPitch() const {
    return std::any_of(heard_.begin(), heard_.end(), [](int part) { return part >= 0; });
  }

 private:
  [[nodiscard]] std::size_t unsignedFloor(Seconds time) const {
    return static_cast<std::size_t>(std::max(0.0, std::round(time / step_)));
  }

  Seconds step_;
  std::ptrdiff_t first_ = 0;  ///< step of the first note on the song's clock
  std::vector<int> written_;  ///< from there on
  std::vector<int> heard_;
};

/// The score's time on the sound's clock: straight between knots, as before the first and after the last.
class ScoreClock {
 public:
  explicit ScoreClock(Seconds offset) : offset_(offset) {}

  void add(Seconds score, Seconds sound) {
    if (knots_.empty() || (score > knots_.back().first && sound > knots_.back().second))
      knots_.emplace_back(score, sound);
  }
  [[nodiscard]] Seconds operator()(Seconds score) const {
    if (knots_.empty()) return score + offset_;
    const auto after = std::upper_bound(knots_.begin(), knots_.end(), score,
                                        [](Seconds time, const auto& knot) { return time < knot.first; });
    if (after == knots_.begin()) return score + after->second - after->first;
    const auto before = std::prev(after);
    if (after == knots_.end()) return score + before->second - before->first;
    return std::lerp(before->second, after->second, (score - before->first) / (after->first - before->first));
  }

 private:
  Seconds offset_;
  std::vector<std::pair<Seconds, Seconds>> knots_;
};

/// A word of the score, and where it is heard in the sound.
struct PlacedWord {
  std::size_t word = 0;            ///< of the score's labels
  std::vector<TimeSpan> phones{};  ///< as they are heard; none: it is not believed
  [[nodiscard]] bool isHeard() const { return !phones.empty(); }
};

TranscriptWord asTranscript(const SpeechLabels& labels, std::size_t word) {
  TranscriptWord said{labels.words[word].text, {Pronunciation()}};
  const PhoneRange range = labels.words[word].phones;
  std::vector<std::string> unknown;
  for (std::size_t i = range.first.value; i <= range.last.value; ++i) {
    const LabelledPhone& phone = labels.phones[i];
    said.ways[0].phones.push_back(phone.phone);
    said.ways[0].stress.push_back(-1);
    const std::vector<SpelledPhone> spelled = phonesOfIpa(phone.ipa, unknown);
    said.ways[0].heard.push_back(spelled.size() == 1 ? spelled[0].heard : phone.phone);
  }
  return said;
}

/// The words that may lie in the sound, heard where the aligner finds them near their place.
std::vector<PlacedWord> placeWords(const SpeechLabels& labels, Seconds offset, const AudioClip& sound, Aligner& aligner,
                                   std::string_view name) {
  std::vector<PlacedWord> placed;
  std::vector<TranscriptWord> words;
  for (std::size_t i = 0; i < labels.words.size(); ++i) {
    const TimeSpan span = labels.spanOf(labels.words[i].phones);
    if (span.start + offset < -kSlack || span.end + offset > sound.duration() + kSlack) continue;
    placed.push_back({i});
    words.push_back(asTranscript(labels, i));
  }
  if (words.empty()) return placed;
  SpeechLabels found;
  try {
    found = aligner.align(sound, words, name, SpeechKind::kSung).labels;
  } catch (const InputError&) {
    return placed;  // too short for all of them: the score says when
  }
  if (found.words.size() != words.size()) return placed;
  std::vector<double> late;
  for (std::size_t i = 0; i < placed.size(); ++i)
    late.push_back(found.spanOf(found.words[i].phones).start -
                   labels.spanOf(labels.words[placed[i].word].phones).start - offset);
  for (std::size_t i = 0; i < placed.size(); ++i) {
    const std::size_t from = i > kNeighbours ? i - kNeighbours : 0;
    const std::size_t to = std::min(placed.size(), i + kNeighbours + 1);
    const double usual = median(std::vector<double>(late.begin() + signedIndex(from), late.begin() + signedIndex(to)));
    const PhoneRange range = found.words[i].phones;
    if (std::abs(late[i] - usual) > kFarthestFromNeighbours) continue;
    if (range.last.value - range.first.value + 1 != words[i].ways[0].phones.size()) continue;
    for (std::size_t k = range.first.value; k <= range.last.value; ++k)
      placed[i].phones.push_back(found.phones[k].span);
  }
  return placed;
}

/// Leaves out what is not in the sound.
void keepWithin(Seconds duration, const SpeechLabels& labels, const ScoreClock& clock,
                std::vector<PlacedWord>& placed) {
  std::erase_if(placed, [&](const PlacedWord& word) {
    const TimeSpan span = labels.spanOf(labels.words[word.word].phones);
    const Seconds start = word.isHeard() ? word.phones.front().start : clock(span.start);
    const Seconds end = word.isHeard() ? word.phones.back().end : clock(span.end);
    return start < 0 || end > duration + kMostCut;
  });
}

ScoreClock clockOf(const SpeechLabels& labels, Seconds offset, const std::vector<PlacedWord>& placed) {
  ScoreClock clock(offset);
  for (const PlacedWord& word : placed) {
    if (!word.isHeard()) continue;
    const TimeSpan span = labels.spanOf(labels.words[word.word].phones);
    clock.add(span.start, word.phones.front().start);
    clock.add(span.end, word.phones.back().end);
  }
  return clock;
}

SpeechLabels movedLabels(const SpeechLabels& labels, const std::vector<PlacedWord>& placed, const ScoreClock& clock,
                         Seconds duration) {
  std::vector<PhoneSegment> segments;
  std::vector<std::string> texts;
  Seconds until = 0;
  for (const PlacedWord& word : placed) {
    const PhoneRange range = labels.words[word.word].phones;
    for (std::size_t i = range.first.value; i <= range.last.value; ++i) {
      const LabelledPhone& phone = labels.phones[i];
      TimeSpan span = word.isHeard() ? word.phones[i - range.first.value]
                                     : TimeSpan{clock(phone.span.start), clock(phone.span.end)};
      span = {std::max(span.start, until), std::min(span.end, duration)};
      if (span.duration() <= 0) continue;
      until = span.end;
      PhoneSegment& segment = segments.emplace_back(PhoneSegment{.phone = phone.phone, .span = span});
      segment.word = texts.size();
      segment.syllable = phone.syllable;
      if (phone.syllable) segment.stress = labels.syllables[*phone.syllable].stress;
      segment.ipa = phone.ipa;
    }
    texts.push_back(labels.words[word.word].text);
  }
  return buildSpeechLabels(std::move(segments), texts, duration);
}

/// How long there is a voice before `begin` and after `end`.
std::pair<Seconds, Seconds> voiceOutside(const PitchTrack& pitch, Seconds begin, Seconds end) {
  std::pair<Seconds, Seconds> outside{0, 0};
  for (std::size_t i = 0; i < pitch.frames.size(); ++i) {
    if (pitch.frames[i].hz <= 0) continue;
    if (asReal(i) * pitch.step < begin) outside.first += pitch.step;
    if (asReal(i) * pitch.step > end) outside.second += pitch.step;
  }
  return outside;
}

/// What of song and sound has no counterpart in the other.
std::vector<std::string> lengthWarnings(const SpeechLabels& score, const std::vector<PlacedWord>& placed,
                                        const SpeechLabels& moved, const PitchTrack& pitch, Seconds duration) {
  std::vector<std::string> warnings;
  const std::size_t before = placed.front().word, after = score.words.size() - 1 - placed.back().word;
  if (before > 0)
    warnings.push_back(fmt::format("{} of the song's {} words come before the sound begins: they are left out", before,
                                   score.words.size()));
  if (after > 0)
    warnings.push_back(
        fmt::format("{} of the song's {} words come after the sound's end at {:.2f} s: they are left out", after,
                    score.words.size(), duration));
  const Seconds begin = moved.spanOf(moved.words.front().phones).start;
  const Seconds end = moved.spanOf(moved.words.back().phones).end;
  const auto [early, late] = voiceOutside(pitch, begin, end);
  if (early > kLongOutside)
    warnings.push_back(
        fmt::format("{:.1f} s of voice come before the song's first word at {:.2f} s: the song has no "
                    "words for them",
                    early, begin));
  if (late > kLongOutside)
    warnings.push_back(fmt::format(
        "{:.1f} s of voice come after the song's last word, which ends at {:.2f} s: the song has no words for them",
        late, end));
  return warnings;
}

}  // namespace

SongPlace songAt(Seconds offset, std::span<const Note> notes, const PitchTrack& pitch) {
  SongPlace place{offset, 0};
  if (notes.empty()) return place;
  static_cast<void>(ScoreSearch(notes, pitch).scoreAt(std::lround(offset / pitch.step), 1, &place.agreement));
  return place;
}

std::optional<SongPlace> findSong(std::span<const Note> notes, const PitchTrack& pitch) {
  if (notes.empty()) return std::nullopt;
  const ScoreSearch search(notes, pitch);
  if (!search.hasPitch()) return std::nullopt;
  return songAt(asReal(search.best()) * pitch.step, notes, pitch);
}

SungLine besideSound(SungLine sung, AudioClip sound, std::optional<Seconds> offset, Aligner& aligner,
                     std::string_view name) {
  if (offset && !(std::abs(*offset) <= kFarthestOffset))
    throw InputError("song offset", "",
                     fmt::format("is {:g} s; expected {:g} to {:g}", *offset, -kFarthestOffset, kFarthestOffset));
  const SpeechLabels& score = sung.line.labels;
  const PitchTrack pitch = trackPitch(sound, kPitch);
  SongPlace place = songAt(offset.value_or(0), sung.tags.notes, pitch);
  if (!offset) {
    const std::optional<SongPlace> found = findSong(sung.tags.notes, pitch);
    if (!found) throw InputError(name, "", "has no pitch in it; expected somebody who sings the song");
    if (found->agreement >= kLeastAgreement) place = *found;
  }
  std::vector<PlacedWord> placed = placeWords(score, place.offset, sound, aligner, name);
  const ScoreClock clock = clockOf(score, place.offset, placed);
  keepWithin(sound.duration(), score, clock, placed);
  if (placed.empty())
    throw InputError(
        name, "",
        fmt::format("lasts {:.2f} s, in which no word of the song lies whole (the song begins at {:.2f} s); "
                    "expected the song's own sound",
                    sound.duration(), place.offset));
  SungLine beside;
  beside.line.labels = movedLabels(score, placed, clock, sound.duration());
  beside.tags = hearTags(sound, &beside.line.labels);
  beside.warnings = lengthWarnings(score, placed, beside.line.labels, pitch, sound.duration());
  if (place.agreement < kLeastAgreement)
    beside.warnings.push_back(fmt::format(
        "the song's notes are not heard in the sound ({:.0f} % of their time{}): another song, other singers or "
        "instruments with it{}",
        100 * place.agreement, offset ? "" : ", taken from the sound's beginning",
        offset ? "" : "; when the song begins in it can be told"));
  const std::vector<std::string> heard = soundWarnings(sound, &beside.line.labels, beside.tags);
  beside.warnings.insert(beside.warnings.end(), heard.begin(), heard.end());
  beside.tags.notes.clear();
  for (const Note& note : sung.tags.notes) {
    const TimeSpan span{std::max(0.0, clock(note.span.start)), std::min(sound.duration(), clock(note.span.end))};
    if (span.duration() > 0) beside.tags.notes.push_back({span, note.hz, note.vibrato});
  }
  const auto believed = std::count_if(placed.begin(), placed.end(), [](const PlacedWord& w) { return w.isHeard(); });
  if (2 * believed < signedIndex(placed.size()))
    beside.warnings.push_back(
        fmt::format("only {} of {} words are heard near their place in the song: other words may "
                    "be sung, or the song begins elsewhere",
                    believed, placed.size()));
  beside.notices.push_back(
      fmt::format("the song's clock begins at {:+.2f} s of the sound{}; {:.0f} % of its notes' time are heard at their "
                  "pitch, {} of {} words are where they are heard, the others where the score has them",
                  place.offset, offset ? " as told" : "", 100 * place.agreement, believed, placed.size()));
  for (std::size_t i = 0; i < placed.size(); ++i)
    beside.line.text += (i > 0 ? " " : "") + score.words[placed[i].word].text;
  beside.line.audio = std::move(sound);
  return beside;
}

}  // namespace mouthpiece
