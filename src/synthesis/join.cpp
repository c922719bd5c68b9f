#include "synthesis/join.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "base/index.h"
#include "motion/resample.h"

namespace mouthpiece {
namespace {

constexpr double kPartOfPhone = 0.9;  ///< the blend's share of the shared phone, at most
constexpr double kCaptureFramesInBlend =
    2.5;  ///< at least, whatever the overlap asked for: a slow capture has no more to blend
constexpr double kPartOfSilence = 0.5;
constexpr Seconds kLongestInSilence = 0.300;
constexpr Seconds kUpperFaceOverlap = 0.240;

TimeSpan centred(Seconds middle, Seconds length) { return {middle - 0.5 * length, middle + 0.5 * length}; }

Seconds blendLength(Seconds phone, double capture_rate_hz, Seconds overlap) {
  if (overlap <= 0) return 0;
  return std::max(std::min(overlap, kPartOfPhone * phone), kCaptureFramesInBlend / capture_rate_hz);
}

/// Mean squared distance of the lips over a blend, mm^2, with a mild preference for the middle of the phone.
double disagreement(const Fragment& before, const Fragment& after, TimeSpan blend) {
  double sum = 0;
  for (const double u : {0.25, 0.5, 0.75}) {
    const Seconds time = std::lerp(blend.start, blend.end, u);
    sum += (before.lipsAt(time) - after.lipsAt(time)).squaredNorm();
  }
  return sum / (asReal(before.lipsAt(blend.start).size()) + 1);
}

double largestStep(const MotionClip& motion, Eigen::Index frame) {
  const Eigen::RowVectorXd step = motion.positions_mm.row(frame + 1) - motion.positions_mm.row(frame);
  return Eigen::Map<const MarkerPositions>(step.data(), step.size() / 3, 3).rowwise().norm().maxCoeff();
}

double largestVelocityChange(const MotionClip& motion, Eigen::Index frame) {
  const auto& rows = motion.positions_mm;
  const Eigen::RowVectorXd change =
      (rows.row(frame + 1) - 2 * rows.row(frame) + rows.row(frame - 1)) * motion.frame_rate_hz;
  return Eigen::Map<const MarkerPositions>(change.data(), change.size() / 3, 3).rowwise().norm().maxCoeff();
}

double percentileOf(std::vector<double>& values, double percentile) {
  if (values.empty()) return 0;
  const auto at =
      static_cast<std::ptrdiff_t>(std::clamp(percentile / 100, 0.0, 1.0) * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

/// Anywhere but at the very ends of the phone, over `length` to twice that.
TimeSpan searchCoupling(const LabelledPhone& phone, const Fragment& before, const Fragment& after, Seconds length,
                        std::optional<Seconds> sound_cut) {
  constexpr double kMargin = 0.1;  // of the phone
  const std::array<Seconds, 3> lengths{length, 1.5 * length, 2 * length};
  const Seconds margin = kMargin * phone.span.duration();
  TimeSpan middles{phone.span.start + margin, phone.span.end - margin};
  if (sound_cut) middles.start = middles.end = std::clamp(*sound_cut, middles.start, middles.end);
  return cheapestCoupling(before, after, {middles, lengths});
}

TimeSpan placeLipJoin(const LabelledPhone& phone, const Fragment& before, const Fragment& after,
                      const JoinOptions& options) {
  const PhoneIndex shared = after.phones().first;
  const Seconds length =
      std::max(blendLength(phone.span.duration(), std::min(before.captureRateHz(), after.captureRateHz()),
                           options.overlap),
               std::min(options.overlap, 2 / options.frame_rate_hz));
  const Seconds room = std::max(0.0, phone.span.duration() - length);
  const auto at = [&](double u) {
    const Seconds middle = phone.span.middle() + (u - 0.5) * room;
    return centred(middle, length);
  };
  // A stand-in that plays another phone gives way to the real one as soon as it can.
  const bool before_is_strange = before.sourcePhone(shared).phone != phone.phone;
  const bool after_is_strange = after.sourcePhone(shared).phone != phone.phone;
  if (before_is_strange != after_is_strange) return at(before_is_strange ? 0 : 1);
  if (options.search_coupling && length > 0) return searchCoupling(phone, before, after, length, options.sound_cut);
  TimeSpan best = at(0.5);
  double least = disagreement(before, after, best);
  constexpr double kOffCentre = 1.1;  // a place off the middle must be that much better
  for (const double u : {0.375, 0.625, 0.25, 0.75, 0.125, 0.875, 0.0, 1.0}) {
    const double found = kOffCentre * disagreement(before, after, at(u));
    if (found < least) {
      least = found;
      best = at(u);
    }
  }
  return best;
}

/// What both fragments may show of the pause, so that neither has to hold still within the blend.
TimeSpan placeSilentJoin(const LabelledPhone& phone, const LabelledPhone& before, const LabelledPhone& after) {
  const Seconds captured = std::min(before.span.duration(), after.span.duration());
  return centred(phone.span.middle(),
                 std::min(kLongestInSilence, kPartOfSilence * std::min(phone.span.duration(), captured)));
}

}  // namespace

JoinSpans placeJoin(const SpeechLabels& line, const Fragment& before, const Fragment& after,
                    const JoinOptions& options) {
  const PhoneIndex shared = after.phones().first;
  const LabelledPhone& phone = line.phones[shared.value];
  if (phone.phone == Phone::kSil) {
    const TimeSpan join = placeSilentJoin(phone, before.sourcePhone(shared), after.sourcePhone(shared));
    return {join, join};
  }
  const TimeSpan lips = placeLipJoin(phone, before, after, options);
  return {lips, centred(lips.middle(), std::max(kUpperFaceOverlap, lips.duration()))};
}

Join measureJoin(const MotionClip& motion, Seconds time) {
  Join join{time, 0, 0};
  const Eigen::Index last = motion.positions_mm.rows() - 1;
  if (last < 1) return join;
  const auto frame = std::clamp<Eigen::Index>(static_cast<Eigen::Index>(time * motion.frame_rate_hz), 0, last - 1);
  join.position_jump_mm = largestStep(motion, frame);
  for (const Eigen::Index at : {frame, frame + 1}) {
    if (at < 1 || at >= last) continue;
    join.velocity_jump_mm_s = std::max(join.velocity_jump_mm_s, largestVelocityChange(motion, at));
  }
  return join;
}

FrameChange frameChangePercentile(const Corpus& corpus, double frame_rate_hz, double percentile) {
  std::vector<double> steps;
  std::vector<double> changes;
  const auto keepSeen = [](std::vector<double>& values, double value) {
    if (std::isfinite(value)) values.push_back(value);
  };
  for (std::size_t take = 0; take < corpus.takes.size(); ++take) {
    const bool on_demand = corpus.motion_source != nullptr;
    const MotionClip captured = on_demand ? corpus.motion_source->load(TakeIndex(take)) : corpus.takes[take].motion;
    const MotionClip motion = resampleClip(captured, frame_rate_hz);
    for (Eigen::Index frame = 0; frame + 1 < motion.positions_mm.rows(); ++frame) {
      keepSeen(steps, largestStep(motion, frame));
      if (frame > 0) keepSeen(changes, largestVelocityChange(motion, frame));
    }
  }
  return {percentileOf(steps, percentile), percentileOf(changes, percentile)};
}

}  // namespace mouthpiece
