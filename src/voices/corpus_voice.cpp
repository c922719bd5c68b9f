#include "voices/corpus_voice.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "base/errors.h"
#include "voices/engines.h"

namespace mouthpiece {
namespace {

constexpr Seconds kLongestEdgeSilence = 0.25;  // before the first sound and after the last

/// Phones of the line and the phones of one recording that sound them.
struct SpokenRun {
  PhoneRange phones;
  PhonePlace first;      ///< in the corpus
  TimeSpan source = {};  ///< cut where the neighbours take over

  [[nodiscard]] PhonePlace placeOf(PhoneIndex phone) const {
    return {first.take, PhoneIndex(first.phone.value + phone.value - phones.first.value)};
  }
  [[nodiscard]] PhonePlace last() const { return placeOf(phones.last); }
};

/// A recording of that phone alone, nearest in length to the line's.
SpokenRun lonePhone(const SpeechLabels& line, PhoneIndex phone, const UnitDatabase& database) {
  const LabelledPhone& wanted = line.phones[phone.value];
  const std::vector<PhonePlace> places = database.index().placesOf(std::span(&wanted.phone, 1));
  if (places.empty()) {
    throw InputError(database.corpus().name, "",
                     fmt::format("found no recording of the phone {} (in '{}'); expected one to speak it with",
                                 phoneName(wanted.phone), line.wordOf(phone)));
  }
  const auto mismatch = [&](const PhonePlace& place) {
    return std::abs(std::log(database.phoneAt(place).span.duration() / wanted.span.duration()));
  };
  const auto best = std::min_element(places.begin(), places.end(), [&](const PhonePlace& a, const PhonePlace& b) {
    return mismatch(a) < mismatch(b);
  });
  return {{phone, phone}, *best};
}

/// The units' runs in order; phones that only stand-ins cover are sounded alone. Neighbours share a phone or touch.
std::vector<SpokenRun> runsOf(const SpeechLabels& line, const std::vector<SelectedUnit>& units,
                              const UnitDatabase& database) {
  std::vector<SpokenRun> runs;
  std::size_t next = 0;  // the first phone that no run covers
  const auto fillTo = [&](std::size_t phone) {
    for (; next < phone; ++next) runs.push_back(lonePhone(line, PhoneIndex(next), database));
  };
  for (const SelectedUnit& unit : units) {
    if (unit.is_backoff) continue;
    fillTo(unit.phones.first.value);
    runs.push_back({unit.phones, unit.source});
    next = unit.phones.last.value + 1;
  }
  fillTo(line.phones.size());
  return runs;
}

void cutRuns(std::vector<SpokenRun>& runs, const UnitDatabase& database, CorpusSounds& sounds) {
  for (SpokenRun& run : runs) {
    run.source = {database.phoneAt(run.first).span.start, database.phoneAt(run.last()).span.end};
  }
  TimeSpan& opening = runs.front().source;
  opening.start = std::max(opening.start, database.phoneAt(runs.front().first).span.end - kLongestEdgeSilence);
  TimeSpan& ending = runs.back().source;
  ending.end = std::min(ending.end, database.phoneAt(runs.back().last()).span.start + kLongestEdgeSilence);
  for (std::size_t i = 0; i + 1 < runs.size(); ++i) {
    SpokenRun &left = runs[i], &right = runs[i + 1];
    if (left.phones.last != right.phones.first) continue;
    const SoundCut cut = sounds.cut(left.last(), right.first);
    left.source.end = cut.left;
    right.source.start = cut.right;
  }
}

/// The runs' sounds and, on the clock that they make, the phones' spans.
class LineTimer {
 public:
  LineTimer(const SpeechLabels& line, const UnitDatabase& database, CorpusSounds& sounds, std::optional<double> rate)
      : line_(line), database_(database), sounds_(sounds), rate_(rate), spans_(line.phones.size()) {}

  /// Where the run is heard in the line.
  TimeSpan add(const SpokenRun& run) {
    const Seconds begin = now_;
    for (std::size_t i = run.phones.first.value; i <= run.phones.last.value; ++i) {
      const TimeSpan phone = database_.phoneAt(run.placeOf(PhoneIndex(i))).span;
      const TimeSpan part{std::max(phone.start, run.source.start), std::min(phone.end, run.source.end)};
      if (part.end <= part.start) continue;
      const Seconds start = now_;
      now_ += rate_ ? part.duration() / phone.duration() * line_.phones[i].span.duration() / *rate_ : part.duration();
      TimeSpan& span = spans_[i];
      if (span.end <= span.start) span.start = start;
      span.end = now_;
      // At the recording's own speed a run is one piece.
      const bool goes_on = !pieces_.empty() && !rate_ && i > run.phones.first.value;
      if (goes_on) {
        pieces_.back().source.end = part.end;
        pieces_.back().target.end = now_;
      } else {
        pieces_.push_back({&sounds_.soundOf(run.first.take), part, {start, now_}});
      }
    }
    return {begin, now_};
  }

  [[nodiscard]] SpeechLabels labels() const {
    SpeechLabels timed = line_;
    for (std::size_t i = 0; i < spans_.size(); ++i) timed.phones[i].span = spans_[i];
    return timed;
  }
  [[nodiscard]] const std::vector<SoundPiece>& pieces() const { return pieces_; }

 private:
  const SpeechLabels& line_;
  const UnitDatabase& database_;
  CorpusSounds& sounds_;
  std::optional<double> rate_;
  std::vector<TimeSpan> spans_;
  std::vector<SoundPiece> pieces_;
  Seconds now_ = 0;
};

}  // namespace

CorpusVoice::CorpusVoice(std::unique_ptr<Voice> reader, const UnitDatabase& database, const CorpusVoiceOptions& options)
    : reader_(std::move(reader)), database_(database), options_(options), sounds_(database) {}

SpokenLine CorpusVoice::speak(std::string_view text) {
  SpokenLine line = reader_->speak(text);
  SelectionOptions selection = options_.selection;
  selection.method = SelectionMethod::kViterbi;  // greedy would not look at the sound of a join
  selection.sound_join_cost = [this](const PhonePlace& left, const PhonePlace& right) {
    return sounds_.weights().in_join * sounds_.cut(left, right).cost;
  };
  line.units = selectUnits(line.labels, database_, selection);
  std::vector<SpokenRun> runs = runsOf(line.labels, line.units, database_);
  cutRuns(runs, database_, sounds_);
  LineTimer timer(line.labels, database_, sounds_, options_.rate);
  for (const SpokenRun& run : runs) {
    const TimeSpan heard = timer.add(run);
    for (SelectedUnit& unit : line.units) {
      if (!unit.is_backoff && unit.phones == run.phones) unit.sound = heard;
    }
  }
  line.labels = timer.labels();
  line.audio = joinSounds(timer.pieces(), sounds_.sampleRateHz());
  line.voice = "corpus:" + database_.corpus().name;
  return line;
}

std::unique_ptr<Voice> makeCorpusVoice(std::string_view, const Language& language, const VoiceOptions& options) {
  if (options.corpus == nullptr) throw InputError("found no corpus for the voice 'corpus'; expected one to speak with");
  constexpr std::string_view kReader = "kal_diphone";  // quick, and only its phones are used
  return std::make_unique<CorpusVoice>(makeFestivalVoice(kReader, language, options), *options.corpus,
                                       CorpusVoiceOptions{options.selection, options.rate});
}

}  // namespace mouthpiece
