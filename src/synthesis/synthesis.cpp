#include "synthesis/synthesis.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>

#include "base/errors.h"
#include "motion/position_limits.h"
#include "motion/resample.h"
#include "synthesis/fragment.h"
#include "synthesis/join.h"
#include "synthesis/tongue.h"

namespace mouthpiece {
namespace {

/// Milliseconds since it was made.
class Stopwatch {
 public:
  [[nodiscard]] double elapsedMs() const {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// Where one of two poses was not seen, the other stands for both.
void fillFromEachOther(PositionMatrix& a, PositionMatrix& b) {
  for (Eigen::Index i = 0; i < a.size(); ++i) {
    double& first = a.data()[i];
    double& second = b.data()[i];
    if (std::isnan(first)) first = second;
    if (std::isnan(second)) second = first;
  }
}

/// What is still NaN at a fragment's edge takes the nearest frame's value, and the neutral pose where there is none.
void fillUnseen(PositionMatrix& positions, const MarkerPositions& neutral) {
  if (positions.allFinite()) return;
  for (Eigen::Index column = 0; column < positions.cols(); ++column) {
    double last = neutral.data()[column];
    for (Eigen::Index row = 0; row < positions.rows(); ++row) {
      if (!std::isnan(positions(row, column))) {
        last = positions(row, column);
        break;
      }
    }
    for (Eigen::Index row = 0; row < positions.rows(); ++row) {
      if (std::isnan(positions(row, column))) positions(row, column) = last;
      last = positions(row, column);
    }
  }
}

/// Columns that no phone moves: lids blink and brows rise when they will. A cut through such a movement shows, so they
/// are blended over longer than the lips.
std::vector<bool> upperFaceColumns(const MarkerLayout& layout) {
  std::vector<bool> upper;
  for (const LayoutMarker& marker : layout.markers) {
    const bool is_upper = marker.region == "forehead" || marker.region == "temple" || marker.region == "brow" ||
                          marker.region == "lid" || marker.region == "canthus";
    upper.insert(upper.end(), 3, is_upper);
  }
  return upper;
}

/// The fragments resampled at the frame times and blended over `joins`, one between each fragment and the next (EDGE
/// 5.1.3).
class Blender {
 public:
  Blender(const std::vector<UnitFragment>& fragments, const std::vector<JoinSpans>& joins,
          std::span<const Seconds> times, double frame_rate_hz, BlendKind blend, const MarkerLayout& layout)
      : fragments_(fragments),
        joins_(joins),
        times_(times),
        frame_rate_hz_(frame_rate_hz),
        blend_(blend),
        upper_(upperFaceColumns(layout)) {}

  [[nodiscard]] PositionMatrix blend() const {
    PositionMatrix result(static_cast<Eigen::Index>(times_.size()), static_cast<Eigen::Index>(upper_.size()));
    for (std::size_t i = 0; i < fragments_.size(); ++i) {
      const std::size_t begin = i == 0 ? 0 : frameFrom(joins_[i - 1].upper_face.start);
      const std::size_t end = i + 1 == fragments_.size() ? times_.size() : frameFrom(joins_[i].upper_face.end);
      if (begin < end) add(i, begin, end, result);
    }
    return result;
  }

 private:
  /// First frame at or after `time`, at most the end.
  [[nodiscard]] std::size_t frameFrom(Seconds time) const {
    const double frame = std::ceil(time * frame_rate_hz_);
    return frame <= 0 ? 0 : std::min(times_.size(), static_cast<std::size_t>(frame));
  }

  /// Frames [begin, end) of fragment `i` over what the fragments before it made.
  void add(std::size_t i, std::size_t begin, std::size_t end, PositionMatrix& result) const {
    PositionMatrix poses = fragments_[i].fragment.posesAt(times_.subspan(begin, end - begin));
    std::size_t blended_end = begin;
    if (i > 0) {
      blended_end = std::clamp(frameFrom(joins_[i - 1].upper_face.end), begin, end);
      const auto rows = static_cast<Eigen::Index>(blended_end - begin);
      PositionMatrix before = result.middleRows(static_cast<Eigen::Index>(begin), rows);
      PositionMatrix after = poses.topRows(rows);
      fillFromEachOther(before, after);
      const std::span<const Seconds> times = times_.subspan(begin, blended_end - begin);
      const PositionMatrix speech = blendRows(before, after, times, joins_[i - 1].lips, blend_);
      PositionMatrix blended = blendRows(before, after, times, joins_[i - 1].upper_face, blend_);
      for (std::size_t column = 0; column < upper_.size(); ++column) {
        const auto at = static_cast<Eigen::Index>(column);
        if (!upper_[column]) blended.col(at) = speech.col(at);
      }
      result.middleRows(static_cast<Eigen::Index>(begin), rows) = blended;
    }
    const auto rest = static_cast<Eigen::Index>(end - blended_end);
    result.middleRows(static_cast<Eigen::Index>(blended_end), rest) = poses.bottomRows(rest);
  }

  const std::vector<UnitFragment>& fragments_;
  const std::vector<JoinSpans>& joins_;
  std::span<const Seconds> times_;
  double frame_rate_hz_;
  BlendKind blend_;
  std::vector<bool> upper_;
};

TimeSpan notBefore(const TimeSpan& span, const TimeSpan& earlier) {
  return {std::max(span.start, earlier.start), std::max(span.end, earlier.end)};
}

/// Joins lie in the order of the line, so that each blend begins where the one before has begun.
std::vector<JoinSpans> placeJoins(const SynthesisRequest& request, const std::vector<UnitFragment>& fragments) {
  std::vector<JoinSpans> joins;
  for (std::size_t i = 0; i + 1 < fragments.size(); ++i) {
    JoinSpans join = placeJoin(request.labels, fragments[i].fragment, fragments[i + 1].fragment,
                               request.options.overlap_ms / 1000, request.options.frame_rate_hz);
    if (!joins.empty()) {
      join.lips = notBefore(join.lips, joins.back().lips);
      join.upper_face = notBefore(join.upper_face, joins.back().upper_face);
    }
    joins.push_back(join);
  }
  return joins;
}

PlacedUnit describe(const SelectedUnit& unit, const SpeechLabels& line, const UnitDatabase& database) {
  const CorpusTake& take = database.takeOf(unit.source);
  const std::size_t count = unit.phones.last.value - unit.phones.first.value + 1;
  PlacedUnit placed;
  placed.phones = unit.phones;
  placed.take = take.name;
  placed.source_first = unit.source.phone;
  placed.source_span = take.labels.spanOf({unit.source.phone, PhoneIndex(unit.source.phone.value + count - 1)});
  placed.span = line.spanOf(unit.phones);
  placed.scale = scaleOf(take.labels, unit.source.phone, count);
  placed.cost = unit.target_cost + unit.join_cost;
  placed.is_backoff = unit.is_backoff;
  return placed;
}

MotionClip restingMotion(const Corpus& corpus, std::size_t frames, double frame_rate_hz) {
  const Eigen::Map<const Eigen::RowVectorXd> rest(corpus.neutral_pose_mm.data(), corpus.neutral_pose_mm.size());
  return {frame_rate_hz, corpus.layout.markerNames(), rest.replicate(static_cast<Eigen::Index>(frames), 1)};
}

void animateUnits(const SynthesisRequest& request, const UnitDatabase& database, const std::vector<SelectedUnit>& units,
                  std::span<const Seconds> times, UtteranceAnimation& animation) {
  const std::vector<UnitFragment> fragments = cutIntoFragments(request.labels, database, units);
  const std::vector<JoinSpans> joins = placeJoins(request, fragments);
  MotionClip& motion = animation.motion;
  const MarkerLayout& layout = database.corpus().layout;
  motion.positions_mm = Blender(fragments, joins, times, motion.frame_rate_hz, request.options.blend, layout).blend();
  fillUnseen(motion.positions_mm, database.corpus().neutral_pose_mm);
  for (std::size_t i = 0; i < joins.size(); ++i) {
    // Between two fragments of one unit lies a pause of the take itself.
    if (fragments[i].unit != fragments[i + 1].unit) animation.joins.push_back(measureJoin(motion, joins[i].lips));
  }
}

void expectUsable(const SynthesisRequest& request, const Corpus& corpus) {
  expectFrameRate(request.options.frame_rate_hz, "synthesis", "frame rate");
  if (!(request.options.overlap_ms >= 0 && request.options.overlap_ms <= 1000)) {
    throw InputError(fmt::format("found a blend of {} ms; expected 0 to 1000 ms", request.options.overlap_ms));
  }
  if (request.labels.phones.empty()) throw InputError("found no phone to speak; expected at least silence");
  if (corpus.takes.empty()) throw InputError(fmt::format("the corpus {} has no takes", corpus.name));
}

}  // namespace

UtteranceAnimation synthesise(const SynthesisRequest& request, const UnitDatabase& database) {
  const Corpus& corpus = database.corpus();
  expectUsable(request, corpus);
  UtteranceAnimation animation;
  animation.text = request.text;
  animation.voice = request.voice;
  animation.corpus = corpus.name;
  animation.labels = request.labels;
  animation.audio = request.audio;

  const Stopwatch selecting;
  const std::vector<SelectedUnit> units = selectUnits(request.labels, database, request.options.selection);
  for (const SelectedUnit& unit : units) animation.units.push_back(describe(unit, request.labels, database));
  animation.timing_ms.selection = selecting.elapsedMs();

  const Stopwatch moving;
  const double rate = request.options.frame_rate_hz;
  constexpr double kRounding = 1e-6;  // frames
  const Seconds duration = std::max(request.labels.duration(), request.audio.duration());
  const auto frames = static_cast<std::size_t>(std::max(1.0, std::ceil(duration * rate - kRounding)));
  const std::vector<Seconds> times = frameTimes(0, frames, rate);
  animation.motion = restingMotion(corpus, frames, rate);
  if (!units.empty()) animateUnits(request, database, units, times, animation);
  animation.tongue = tongueFromPhones(request.labels, times);
  animation.timing_ms.motion = moving.elapsedMs();
  return animation;
}

UtteranceAnimation synthesise(const SynthesisRequest& request, const Corpus& corpus) {
  const Stopwatch indexing;
  const UnitDatabase database(corpus);
  const double index_ms = indexing.elapsedMs();
  UtteranceAnimation animation = synthesise(request, database);
  animation.timing_ms.selection += index_ms;
  return animation;
}

}  // namespace mouthpiece
