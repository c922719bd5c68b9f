#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "motion/blend.h"
#include "synthesis/fragment.h"
#include "synthesis/utterance_animation.h"

namespace mouthpiece {

// Of a blend, whether fragments or curves follow.
inline constexpr double kPartOfPhone = 0.9;  ///< its share of the shared phone, at most
inline constexpr double kPartOfSilence = 0.5;
inline constexpr Seconds kLongestInSilence = 0.300;

inline TimeSpan centred(Seconds middle, Seconds length) { return {middle - 0.5 * length, middle + 0.5 * length}; }

/// Over which stretches of the line one fragment gives way to the next.
struct JoinSpans {
  TimeSpan lips;        ///< all markers that speech moves
  TimeSpan upper_face;  ///< lids, brows, forehead, temples, canthi: longer, around the same middle
};

struct JoinOptions {
  Seconds overlap = 0;
  double frame_rate_hz = 0;
  bool search_coupling = false;
  bool as_published = false;  ///< EDGE 5.1.3: in the middle of the phone, over a part of the shortest phone there
  std::optional<Seconds> sound_cut = {};  ///< where the fragments' own sound goes over
};

/// The lips are joined inside (or, where the capture is too slow for that, around) the phone that both share: over at
/// most `overlap`, and where the lips of both agree best, so that a closure of one is not averaged with open lips of
/// the other. With `search_coupling` place and length are chosen together (cheapestCoupling()), the length up to twice
/// what it is otherwise, the place at `sound_cut` if there is one. In a silence the join is centred and longer.
JoinSpans placeJoin(const SpeechLabels& line, const Fragment& before, const Fragment& after,
                    const JoinOptions& options);

/// The joins that were placed last, for lines that are rendered piece by piece, each piece with some of the one before:
/// where the same fragments follow each other at the same times, their join stays. Not thread-safe.
class RecentJoins {
 public:
  /// placeJoin(); `origin`: when the line's clock begins on that of all pieces.
  JoinSpans place(const SpeechLabels& line, Seconds origin, const Fragment& before, const Fragment& after,
                  const JoinOptions& options);

 private:
  struct Kept {
    std::vector<std::int64_t> fragments;  ///< what the two are around their join, and when, to a nanosecond
    JoinSpans join;                       ///< on the clock of all pieces
  };
  std::vector<Kept> kept_;  ///< the latest last
};

/// Among what the join of two fragments is looked for.
struct CouplingSearch {
  TimeSpan middles;                  ///< where the middle of the blend may lie
  std::span<const Seconds> lengths;  ///< how long the blend may be; none is zero
};

/// Optimal coupling: the blend of lips and chin for which is least, added up over its length, by how far the lips of
/// both lie apart, what velocity the blend itself adds to theirs, and how fast they move
/// (docs/theory/units/joining.md).
TimeSpan cheapestCoupling(const Fragment& before, const Fragment& after, const CouplingSearch& search);

/// By how much the markers of two fragments lie apart at the middle of their join. Left to the blend alone, 3 mm in 60
/// ms are a jerk; so the fragments are first led towards each other, the one before over `reach_before` up to the join,
/// the one after over `reach_after` from there, each by its share. Neither reach touches a phone whose lips must close
/// or touch the teeth: there a shift would open them.
struct JoinOffset {
  Seconds time = 0;
  Seconds reach_before = 0;
  Seconds reach_after = 0;
  Eigen::RowVectorXd offset_mm;  ///< after - before, all columns; 0 where not seen

  [[nodiscard]] Eigen::RowVectorXd shiftOfBefore(Seconds at) const;
  [[nodiscard]] Eigen::RowVectorXd shiftOfAfter(Seconds at) const;
};

/// Joins [first, end).
struct JoinRange {
  std::size_t first = 0, end = std::numeric_limits<std::size_t>::max();
};
/// Those beside the fragments that are seen in frames [first, end) of `times`.
JoinRange joinsWithin(const std::vector<JoinSpans>& joins, std::span<const Seconds> times, Eigen::Index first,
                      Eigen::Index end);
/// One for each join, joins[i] lying between fragments i and i + 1; nothing is found out for those out of `range`.
std::vector<JoinOffset> findJoinOffsets(const SpeechLabels& line, const std::vector<UnitFragment>& fragments,
                                        const std::vector<JoinSpans>& joins, const JoinRange& range = {});

/// The fragments resampled at `times` (rising) and blended over `joins`, one between each fragment and the next (EDGE
/// 5.1.3): times x (3 * markers), mm. `offsets` (one a join, or none at all) are spread first. Where the capture of one
/// side was not seen, the other side stands for both; NaN only where neither was.
PositionMatrix blendFragments(const std::vector<UnitFragment>& fragments, const std::vector<JoinSpans>& joins,
                              const std::vector<JoinOffset>& offsets, std::span<const Seconds> times, BlendKind blend,
                              const MarkerLayout& layout);
/// Rows [first, end) of the same, to the last bit: a fragment is resampled as a whole wherever its rows are cut.
PositionMatrix blendFragments(const std::vector<UnitFragment>& fragments, const std::vector<JoinSpans>& joins,
                              const std::vector<JoinOffset>& offsets, std::span<const Seconds> times, BlendKind blend,
                              const MarkerLayout& layout, Eigen::Index first, Eigen::Index end);

/// Jumps of the finished motion at a join, whose middle is at `time`: the largest step of a marker from the frame
/// before to the frame after, and the largest change of a marker's velocity at either of the two.
Join measureJoin(const MotionClip& motion, Seconds time);
/// The same where only some rows are at hand, from frame `first` of `frame_count` on: from the one before joinFrame()
/// to the second after it.
Join measureJoin(const PositionMatrix& rows, Eigen::Index first, Eigen::Index frame_count, double frame_rate_hz,
                 Seconds time);
/// The last frame before a join.
Eigen::Index joinFrame(Seconds time, double frame_rate_hz, Eigen::Index frame_count);

/// What is usual within the capture itself, to compare joins with: percentiles over all pairs of frames of all takes,
/// each take resampled to `frame_rate_hz`, of the largest step of a marker and of its largest change of velocity.
struct FrameChange {
  double step_mm = 0;
  double velocity_change_mm_s = 0;
};
FrameChange frameChangePercentile(const Corpus& corpus, double frame_rate_hz, double percentile = 95);

}  // namespace mouthpiece
