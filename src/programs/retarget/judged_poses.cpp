// What a face is judged by: poses of a corpus, and a song that nobody captured.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <span>

#include "base/errors.h"
#include "motion/lip_gauge.h"
#include "motion/resample.h"
#include "programs/retarget/commands.h"
#include "synthesis/lips.h"
#include "synthesis/synthesis.h"
#include "synthesis/tongue.h"
#include "units/file/corpus.h"

namespace mouthpiece {
namespace {

constexpr Seconds kReach = 0.02;       ///< beyond both ends of a B P M: label error
constexpr double kClosedShare = 0.25;  ///< of the take's range of openings: what counts as closed in the capture
constexpr std::size_t kClosures = 40, kSteps = 60, kSungSteps = 40;
/// Lips move furthest where they close or let go while the mouth is wide open: the widest of a corpus are looked at
/// step by step.
constexpr std::size_t kBorders = 16, kBorderFrames = 5;
constexpr Seconds kBeside = 0.035;  ///< of the phone: amid the way of LipPose::seal
/// Steps are frames of the capture, but no longer than those of a line as it is made unless told: a camera's frames lie
/// so far apart that an F's whole release falls between two, which is no jump.
constexpr double kLeastStepHz = 60;

double stepRateOf(const CorpusTake& take) { return std::max(take.motion.frame_rate_hz, kLeastStepHz); }

/// Opening of the outer lips in every frame; empty where the take does not tell.
std::vector<double> openingsOf(const CorpusTake& take, const LipGauge& lips) {
  if (!lips.hasLips() || !take.motion.positions_mm.allFinite()) return {};
  return lips.overFrames(&LipGauge::opening, take.motion.positions_mm);
}

using Openings = std::span<const double>;

/// The openings in a phone and `reach` around it.
Openings inPhone(const std::vector<double>& opening, double rate_hz, const TimeSpan& span, Seconds reach) {
  const auto first = static_cast<std::ptrdiff_t>(std::max(0.0, std::ceil((span.start - reach) * rate_hz)));
  const auto last = std::min(static_cast<std::ptrdiff_t>(opening.size()) - 1,
                             static_cast<std::ptrdiff_t>(std::floor((span.end + reach) * rate_hz)));
  if (last < first) return {};
  return Openings(opening).subspan(static_cast<std::size_t>(first), static_cast<std::size_t>(last - first + 1));
}

/// Rows taken from clips of one set of markers, one after the other.
class Gathered {
 public:
  explicit Gathered(const std::vector<std::string>& markers) {
    poses_.motion.marker_names = markers;
    poses_.motion.frame_rate_hz = kLeastStepHz;
  }

  struct Source {
    std::string name;
    PositionMatrix positions_mm;
    std::vector<Seconds> times;  ///< one a row
    const SpeechLabels& labels;
    std::vector<LipPose> lips;
    std::vector<TonguePose> tongue;
  };
  void take(const Source& from, std::size_t frame, bool closed, bool follows, bool is_way = false) {
    const Seconds time = from.times[frame];
    Phone phone = Phone::kSil;
    for (const LabelledPhone& said : from.labels.phones) {
      if (said.span.start <= time && time < said.span.end) phone = said.phone;
    }
    poses_.rows.push_back(
        {fmt::format("{} at {:.2f} s ({})", from.name, time, phoneName(phone)), closed, follows, is_way});
    poses_.lips.push_back(from.lips[frame]);
    poses_.tongue.push_back(from.tongue[frame]);
    rows_.push_back(from.positions_mm.row(signedIndex(frame)));
  }
  void takeStep(const Source& from, std::size_t frame) {
    take(from, frame, false, false);
    take(from, frame + 1, false, true);
  }
  void takeWay(const Source& from) {
    for (std::size_t frame = 0; frame < from.times.size(); ++frame) take(from, frame, false, frame > 0, true);
  }
  JudgedPoses all() {
    poses_.motion.positions_mm.resize(signedIndex(rows_.size()), signedIndex(3 * poses_.motion.marker_names.size()));
    for (std::size_t i = 0; i < rows_.size(); ++i) poses_.motion.positions_mm.row(signedIndex(i)) = rows_[i];
    return std::move(poses_);
  }

 private:
  JudgedPoses poses_;
  std::vector<Eigen::RowVectorXd> rows_;
};

/// A take at `times`, rising, interpolated as a line's units are.
Gathered::Source sourceOf(const CorpusTake& take, const std::vector<Seconds>& times) {
  const std::vector<Seconds> captured = frameTimes(0, take.motion.frameCount(), take.motion.frame_rate_hz);
  return {take.name,
          MotionResampler(captured, times).apply(take.motion.positions_mm),
          times,
          take.labels,
          lipsFromPhones(take.labels, times),
          tongueFromPhones(take.labels, times)};
}

/// The ways of the lips to and from B P M, beside which the mouth is as wide open as may be, less, and least.
void takeBorders(const std::vector<const CorpusTake*>& takes, const MarkerLayout& layout, Gathered& gathered) {
  struct Border {
    const CorpusTake* take;
    Seconds first;
    double opening;
  };
  std::vector<Border> borders;
  for (const CorpusTake* take : takes) {
    const std::vector<double> opening = openingsOf(*take, LipGauge(layout));
    const double rate_hz = take->motion.frame_rate_hz;
    const Seconds way = asReal(kBorderFrames - 1) / stepRateOf(*take);
    const Seconds last = take->motion.timeOf(FrameIndex{take->motion.frameCount() - 1}) - way;
    if (opening.empty() || last < 0) continue;
    for (const LabelledPhone& said : take->labels.phones) {
      if (!isBilabial(said.phone)) continue;
      for (const Seconds middle : {said.span.start - kBeside, said.span.end + kBeside}) {
        const Seconds first = std::clamp(middle - 0.5 * way, 0.0, last);
        borders.push_back({take, first, opening[unsignedIndex(wholePart((first + 0.5 * way) * rate_hz))]});
      }
    }
  }
  std::stable_sort(borders.begin(), borders.end(),
                   [](const Border& a, const Border& b) { return a.opening > b.opening; });
  const std::size_t stride = borders.size() / kBorders + 1;
  for (std::size_t i = 0; i < borders.size(); i += stride) {
    const Border& border = borders[i];
    std::vector<Seconds> times;
    for (std::size_t k = 0; k < kBorderFrames; ++k)
      times.push_back(border.first + asReal(k) / stepRateOf(*border.take));
    gathered.takeWay(sourceOf(*border.take, times));
  }
}

/// Every vowel, held on a note of a rising scale, between consonants that close, round and part the lips.
SynthesisRequest scaleOfVowels(double frame_rate_hz) {
  constexpr std::array kVowels{Phone::kAA, Phone::kIY, Phone::kUW, Phone::kEH, Phone::kOW, Phone::kAE,
                               Phone::kAY, Phone::kAO, Phone::kER, Phone::kIH, Phone::kAW, Phone::kUH};
  constexpr std::array kConsonants{Phone::kM, Phone::kF, Phone::kL, Phone::kW, Phone::kP, Phone::kTH, Phone::kSH};
  constexpr Seconds kVowel = 0.4, kConsonant = 0.1, kSilence = 0.2;
  constexpr double kLowestHz = 110, kSemitone = 1.0594631;
  SynthesisRequest song;
  song.options.frame_rate_hz = frame_rate_hz;
  song.options.curves.alone = CurveStyle::kSing;
  Seconds end = 0;
  const auto say = [&](Phone phone, Seconds length) {
    LabelledPhone& said = song.labels.phones.emplace_back();
    said.phone = phone;
    said.span = {end, end + length};
    end += length;
  };
  say(Phone::kSil, kSilence);
  double hz = kLowestHz;
  for (std::size_t i = 0; i < kVowels.size(); ++i) {
    say(kConsonants[i % kConsonants.size()], kConsonant);
    say(kVowels[i], kVowel);
    song.tags.notes.push_back({song.labels.phones.back().span, hz});
    hz *= kSemitone * kSemitone;
  }
  say(Phone::kSil, kSilence);
  return song;
}

void takeSong(const Corpus& corpus, double frame_rate_hz, Gathered& gathered) {
  const UnitDatabase database(corpus);
  if (!CurveModel(database).isPossible()) return;
  const SynthesisRequest request = scaleOfVowels(frame_rate_hz);
  UtteranceAnimation sung;
  try {
    sung = synthesise(request, database);
  } catch (const InputError&) {
    return;  // A corpus of a few words does not tell how its visemes look.
  }
  const Gathered::Source song{"a song",
                              sung.motion.positions_mm,
                              frameTimes(0, sung.motion.frameCount(), frame_rate_hz),
                              sung.labels,
                              sung.lips,
                              sung.tongue};
  const std::size_t stride = sung.motion.frameCount() / kSungSteps + 1;
  for (std::size_t frame = 0; frame + 1 < sung.motion.frameCount(); frame += stride) gathered.takeStep(song, frame);
}

}  // namespace

LipFrames lipFrames(const CorpusTake& take, const MarkerLayout& layout, std::size_t& others) {
  constexpr std::size_t kEach = 8;
  LipFrames frames;
  const std::vector<double> opening = openingsOf(take, LipGauge(layout));
  if (opening.empty()) return frames;
  const auto [low, high] = std::minmax_element(opening.begin(), opening.end());
  const auto frame_of = [&](Openings::iterator at) { return static_cast<std::size_t>(&*at - opening.data()); };
  for (const LabelledPhone& phone : take.labels.phones) {
    const bool closes = isBilabial(phone.phone);
    if (!closes && (phone.phone == Phone::kSil || others++ % kEach != 0)) continue;
    const Openings own = inPhone(opening, take.motion.frame_rate_hz, phone.span, closes ? kReach : 0);
    if (own.empty()) continue;
    const auto [tightest, widest] = std::minmax_element(own.begin(), own.end());
    if (!closes) frames.open.push_back(frame_of(widest));
    if (closes && *tightest < *low + kClosedShare * (*high - *low)) frames.closed.push_back(frame_of(tightest));
  }
  return frames;
}

JudgedPoses judgedPoses(const Corpus& corpus) {
  Gathered gathered(corpus.layout.markerNames());
  std::vector<const CorpusTake*> takes;
  std::vector<std::pair<const CorpusTake*, std::size_t>> closures;
  std::size_t others = 0;
  for (const CorpusTake& take : corpus.takes) {
    if (take.motion.frameCount() < 2 || !take.motion.positions_mm.allFinite()) continue;
    takes.push_back(&take);
    for (const std::size_t frame : lipFrames(take, corpus.layout, others).closed) closures.emplace_back(&take, frame);
  }
  if (takes.empty()) return gathered.all();
  const std::size_t stride = closures.size() / kClosures + 1;
  for (std::size_t i = 0; i < closures.size(); i += stride) {
    const auto& [take, frame] = closures[i];
    gathered.take(sourceOf(*take, {take->motion.timeOf(FrameIndex{frame})}), 0, true, false);
  }
  std::mt19937 random(66);
  for (std::size_t i = 0; i < kSteps; ++i) {
    const CorpusTake& take = *takes[random() % takes.size()];
    const Seconds time = take.motion.timeOf(FrameIndex{random() % (take.motion.frameCount() - 1)});
    gathered.takeStep(sourceOf(take, {time, time + 1 / stepRateOf(take)}), 0);
  }
  takeBorders(takes, corpus.layout, gathered);
  takeSong(corpus, stepRateOf(*takes[0]), gathered);
  return gathered.all();
}

}  // namespace mouthpiece
