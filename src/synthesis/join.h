#pragma once

#include <optional>

#include "synthesis/fragment.h"
#include "synthesis/utterance_animation.h"

namespace mouthpiece {

/// Over which stretches of the line one fragment gives way to the next.
struct JoinSpans {
  TimeSpan lips;        ///< all markers that speech moves
  TimeSpan upper_face;  ///< lids, brows, forehead, temples, canthi: longer, around the same middle
};

/// The lips are joined inside (or, where the capture is too slow for that, around) the phone that both share: over at
/// most `overlap`, and where the lips of both agree best, so that a closure of one is not averaged with open lips of
/// the other. With `search_coupling` place and length are chosen together (cheapestCoupling()), the length up to twice
/// what it is otherwise; where the fragments' own sound is cut at `sound_cut`, that is the place. In a silence the join
/// is centred and longer.
JoinSpans placeJoin(const SpeechLabels& line, const Fragment& before, const Fragment& after, Seconds overlap,
                    double frame_rate_hz, bool search_coupling = false, std::optional<Seconds> sound_cut = {});

/// Jumps of the finished motion at a join, whose middle is at `time`: the largest step of a marker from the frame
/// before to the frame after, and the largest change of a marker's velocity at either of the two.
Join measureJoin(const MotionClip& motion, Seconds time);

/// What is usual within the capture itself, to compare joins with: percentiles over all pairs of frames of all takes,
/// each take resampled to `frame_rate_hz`, of the largest step of a marker and of its largest change of velocity.
struct FrameChange {
  double step_mm = 0;
  double velocity_change_mm_s = 0;
};
FrameChange frameChangePercentile(const Corpus& corpus, double frame_rate_hz, double percentile = 95);

}  // namespace mouthpiece
