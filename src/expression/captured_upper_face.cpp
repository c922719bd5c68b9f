// Unit selection for lids and brows, apart from the mouth's (docs/theory/expression.md).
#include "expression/captured_upper_face.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "base/index.h"
#include "base/smooth_step.h"
#include "base/statistics.h"
#include "motion/resample.h"
#include "units/file/corpus.h"

namespace mouthpiece {
namespace {

constexpr std::size_t kTakes = 24;      ///< that a line is made of, at most
constexpr std::size_t kMostBeats = 40;  ///< of one take: a long one gives a stretch of its own
constexpr double kMostUnseen = 0.02;    ///< of a take's samples
constexpr double kClosedShare = 0.4;    ///< of how far lids are open: less is a blink
constexpr Seconds kFade = 0.15;         ///< on either side of a cut

// Costs, in units of a cut between poses as far apart as two of the capture usually are.
constexpr double kCut = 1, kPoseApart = 1, kVelocityApart = 0.5;
constexpr double kLength = 1, kAccent = 0.4, kPhrase = 0.4, kChance = 0.3;
constexpr double kOtherKind = 50;  ///< a pause for a word, or the other way round: where there is nothing else

struct Source {
  std::size_t take = 0;  ///< of the chosen ones
  std::size_t beat = 0;
  TimeSpan span;
  Eigen::RowVectorXd enters, leaves, enters_mm_s, leaves_mm_s;
};

struct ChosenTake {
  MotionClip clip;  ///< the upper face alone
  std::vector<Beat> beats;
};

std::vector<Eigen::Index> upperColumns(const MarkerLayout& layout) {
  const std::vector<bool> upper = upperFaceColumns(layout);
  std::vector<Eigen::Index> columns;
  for (std::size_t i = 0; i < upper.size(); ++i) {
    if (upper[i]) columns.push_back(signedIndex(i));
  }
  return columns;
}

/// The take's upper face, without gaps; nothing where too much of it was not seen.
std::optional<MotionClip> upperClip(const MotionClip& motion, const std::vector<Eigen::Index>& columns) {
  MotionClip clip{motion.frame_rate_hz, {}, {}};
  clip.positions_mm.resize(motion.positions_mm.rows(), std::ssize(columns));
  for (std::size_t i = 0; i < columns.size(); ++i) {
    auto to = clip.positions_mm.col(signedIndex(i));
    to = motion.positions_mm.col(columns[i]);
    const auto unseen = to.array().isNaN().count();
    if (asReal(unseen) > kMostUnseen * asReal(to.size()) || unseen == to.size()) return std::nullopt;
    for (Eigen::Index k = 1; k < to.size(); ++k) to(k) = std::isnan(to(k)) ? to(k - 1) : to(k);
    for (Eigen::Index k = to.size() - 2; k >= 0; --k) to(k) = std::isnan(to(k)) ? to(k + 1) : to(k);
  }
  return clip;
}

/// Takes at random, of the speaker's own.
std::vector<ChosenTake> chosenTakes(const UnitDatabase& database, const std::vector<Eigen::Index>& columns,
                                    Dice& dice) {
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < database.columns().takeCount(); ++i) {
    if (database.columns().phoneCount(TakeIndex(i)) > 0 && !database.columns().isAdapted(TakeIndex(i)))
      order.push_back(i);
  }
  for (std::size_t i = order.size(); i > 1; --i) {
    const auto other = static_cast<std::size_t>(dice.share() * static_cast<double>(i));
    std::swap(order[i - 1], order[std::min(other, i - 1)]);
  }
  std::vector<ChosenTake> chosen;
  constexpr std::size_t kTried = 2 * kTakes;
  for (std::size_t i = 0; i < std::min(order.size(), kTried) && chosen.size() < kTakes; ++i) {
    const std::shared_ptr<const MotionClip> motion = database.motionOf(TakeIndex(order[i]));
    if (motion->frameCount() < 3) continue;
    std::optional<MotionClip> clip = upperClip(*motion, columns);
    if (!clip) continue;
    std::vector<Beat> beats = beatsOf(database.takeOf(TakeIndex(order[i])).labels);
    if (beats.size() > kMostBeats) {
      const auto first =
          signedIndex(static_cast<std::size_t>(dice.share() * asReal(std::ssize(beats) - signedIndex(kMostBeats))));
      beats = std::vector<Beat>(beats.begin() + first, beats.begin() + first + signedIndex(kMostBeats));
    }
    chosen.push_back({std::move(*clip), std::move(beats)});
  }
  return chosen;
}

/// The column of a lid's height among `columns`, the right eye's.
std::optional<Eigen::Index> lidHeight(const MarkerLayout& layout, const std::vector<Eigen::Index>& columns,
                                      std::string_view lid) {
  for (std::size_t i = 1; i < columns.size(); i += 3) {
    const LayoutMarker& marker = layout.markers[unsignedIndex(columns[i] / 3)];
    if (marker.region == "lid" && marker.side == Side::kRight && marker.name.starts_with(lid)) return signedIndex(i);
  }
  return std::nullopt;
}

/// Whether the lids close in one of the takes.
bool lidsClose(const std::vector<ChosenTake>& takes, const MarkerLayout& layout,
               const std::vector<Eigen::Index>& columns) {
  const auto upper = lidHeight(layout, columns, "LID_UP"), lower = lidHeight(layout, columns, "LID_LO");
  if (!upper || !lower) return false;
  return std::any_of(takes.begin(), takes.end(), [&](const ChosenTake& take) {
    const Eigen::VectorXd open = take.clip.positions_mm.col(*upper) - take.clip.positions_mm.col(*lower);
    return open.minCoeff() < kClosedShare * median({open.begin(), open.end()});
  });
}

/// The upper face of a clip that holds nothing else.
Eigen::RowVectorXd wholePoseAt(const MotionClip& clip, Seconds time) {
  std::vector<Eigen::Index> all(unsignedIndex(clip.positions_mm.cols()));
  std::iota(all.begin(), all.end(), Eigen::Index{0});
  return poseAt(clip, all, time);
}

Eigen::RowVectorXd velocityAt(const MotionClip& clip, Seconds time) {
  constexpr Seconds kStep = 0.03;
  return (wholePoseAt(clip, time + kStep) - wholePoseAt(clip, time - kStep)) / (2 * kStep);
}

std::vector<Source> sourcesOf(const std::vector<ChosenTake>& takes) {
  std::vector<Source> sources;
  for (std::size_t t = 0; t < takes.size(); ++t) {
    const MotionClip& clip = takes[t].clip;
    for (std::size_t b = 0; b < takes[t].beats.size(); ++b) {
      const TimeSpan span{takes[t].beats[b].span.start, std::min(takes[t].beats[b].span.end, clip.duration())};
      if (!(span.duration() > 0.02)) continue;
      sources.push_back({t, b, span, wholePoseAt(clip, span.start), wholePoseAt(clip, span.end),
                         velocityAt(clip, span.start), velocityAt(clip, span.end)});
    }
  }
  return sources;
}

/// The root mean square over all the takes of how far a pose lies from its take's mean one, all columns together.
double usualSpread(const std::vector<ChosenTake>& takes) {
  double squares = 0, frames = 0;
  for (const ChosenTake& take : takes) {
    const Eigen::RowVectorXd mean = take.clip.positions_mm.colwise().mean();
    squares += (take.clip.positions_mm.rowwise() - mean).squaredNorm();
    frames += asReal(take.clip.positions_mm.rows());
  }
  return std::max(std::sqrt(squares / std::max(frames, 1.0)), 1e-6);
}

double targetCost(const Beat& wanted, const Beat& there, Seconds length) {
  double cost = kLength * std::abs(std::log(wanted.span.duration() / length));
  if (wanted.is_silence != there.is_silence) cost += kOtherKind;
  if (wanted.is_accented != there.is_accented) cost += kAccent;
  if (wanted.starts_phrase != there.starts_phrase) cost += kPhrase;
  if (wanted.ends_phrase != there.ends_phrase) cost += kPhrase;
  return cost;
}

/// The cheapest way through the sources, one a beat (Viterbi).
std::vector<std::size_t> cheapestWay(const std::vector<Beat>& beats, const std::vector<ChosenTake>& takes,
                                     const std::vector<Source>& sources, Dice& dice) {
  const double spread = usualSpread(takes);
  constexpr double kVelocitySpreads = 10;  // a second: a blink
  const auto joinCost = [&](const Source& from, const Source& to) {
    if (from.take == to.take && from.beat + 1 == to.beat) return 0.0;
    return kCut + kPoseApart * (from.leaves - to.enters).norm() / spread +
           kVelocityApart * (from.leaves_mm_s - to.enters_mm_s).norm() / (kVelocitySpreads * spread);
  };
  const std::size_t count = sources.size();
  std::vector<double> cost(count, 0);
  std::vector<std::vector<std::size_t>> came(beats.size(), std::vector<std::size_t>(count, 0));
  // A cut costs the same whatever the beat: worked out once for all pairs.
  Eigen::MatrixXf joins(signedIndex(count), signedIndex(count));
  for (std::size_t from = 0; from < count; ++from) {
    for (std::size_t to = 0; to < count; ++to)
      joins(signedIndex(from), signedIndex(to)) = static_cast<float>(joinCost(sources[from], sources[to]));
  }
  for (std::size_t i = 0; i < beats.size(); ++i) {
    std::vector<double> next(count);
    for (std::size_t to = 0; to < count; ++to) {
      double best = i == 0 ? 0 : std::numeric_limits<double>::infinity();
      for (std::size_t from = 0; i > 0 && from < count; ++from) {
        const double way = cost[from] + double{joins(signedIndex(from), signedIndex(to))};
        if (way < best) {
          best = way;
          came[i][to] = from;
        }
      }
      const Source& source = sources[to];
      next[to] = best + targetCost(beats[i], takes[source.take].beats[source.beat], source.span.duration()) +
                 kChance * dice.share();
    }
    cost = std::move(next);
  }
  std::vector<std::size_t> way(beats.size());
  way.back() = unsignedIndex(std::min_element(cost.begin(), cost.end()) - cost.begin());
  for (std::size_t i = beats.size(); i-- > 1;) way[i - 1] = came[i][way[i]];
  return way;
}

/// Beats in a row that a take has in a row.
struct Run {
  std::size_t take = 0;
  TimeSpan span;  ///< in the line
  std::vector<TimeKnot> knots;
};

std::vector<Run> runsOf(const std::vector<Beat>& beats, const std::vector<Source>& sources,
                        const std::vector<std::size_t>& way) {
  std::vector<Run> runs;
  for (std::size_t i = 0; i < beats.size(); ++i) {
    const Source& source = sources[way[i]];
    const bool goes_on =
        i > 0 && sources[way[i - 1]].take == source.take && sources[way[i - 1]].beat + 1 == source.beat;
    if (!goes_on) runs.push_back({source.take, beats[i].span, {{source.span.start, beats[i].span.start}}});
    runs.back().span.end = beats[i].span.end;
    runs.back().knots.push_back({source.span.end, beats[i].span.end});
  }
  return runs;
}

}  // namespace

std::optional<CapturedUpperFace> capturedUpperFace(const std::vector<Beat>& beats, std::span<const Seconds> times,
                                                   const UnitDatabase& database, Dice& dice) {
  const MarkerLayout& layout = database.corpus().layout;
  const std::vector<Eigen::Index> columns = upperColumns(layout);
  if (columns.empty() || beats.empty()) return std::nullopt;
  const std::vector<ChosenTake> takes = chosenTakes(database, columns, dice);
  const std::vector<Source> sources = sourcesOf(takes);
  if (sources.empty() || !lidsClose(takes, layout, columns)) return std::nullopt;
  const std::vector<Run> runs = runsOf(beats, sources, cheapestWay(beats, takes, sources, dice));

  CapturedUpperFace made;
  made.stretches = runs.size();
  made.positions_mm = PositionMatrix::Zero(std::ssize(times), signedIndex(3 * layout.markers.size()));
  PositionMatrix line(std::ssize(times), std::ssize(columns));
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const bool is_first = r == 0, is_last = r + 1 == runs.size();
    const Seconds from = is_first ? times.front() : runs[r].span.start - kFade;
    const Seconds to = is_last ? times.back() + 1 : runs[r].span.end + kFade;
    const auto first = std::lower_bound(times.begin(), times.end(), from) - times.begin();
    const auto end = std::lower_bound(times.begin(), times.end(), to) - times.begin();
    if (first >= end) continue;
    const auto own = times.subspan(unsignedIndex(first), unsignedIndex(end - first));
    const PositionMatrix poses = resampleWarped(takes[runs[r].take].clip, TimeWarp(runs[r].knots), own);
    for (Eigen::Index k = first; k < end; ++k) {
      const Seconds since = times[unsignedIndex(k)] - runs[r].span.start;
      const double share = is_first ? 1 : smoothStep(-kFade, kFade, since);
      const auto pose = poses.row(k - first);
      line.row(k) = share < 1 ? ((1 - share) * line.row(k) + share * pose).eval() : pose.eval();
    }
  }
  for (std::size_t i = 0; i < columns.size(); ++i) made.positions_mm.col(columns[i]) = line.col(signedIndex(i));
  return made;
}

}  // namespace mouthpiece
