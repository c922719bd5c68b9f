#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "motion/lip_pose.h"
#include "motion/motion_clip.h"
#include "motion/tongue_pose.h"
#include "phonetics/labels/labels_builder.h"
#include "phonetics/labels/likely_words.h"
#include "synthesis/fragment.h"
#include "synthesis/join.h"
#include "synthesis/synthesis.h"

namespace mouthpiece {

/// Frames side by side, as many of each.
struct LiveFrames {
  PositionMatrix positions_mm;  ///< frames x (3 * markers); no NaN
  std::vector<LipPose> lips;
  std::vector<TonguePose> tongue;
};

/// The guided motion (docs/theory/units/context_transfer.md) of a line that is still being said: each frame is made
/// from a window around it, from what was said within the last two seconds to what is known of what comes
/// (docs/theory/units/live.md). Fragments that a frame was made of are kept; those ahead are chosen again as more
/// is known. Where that moves a frame beside one that was shown, the difference fades away. Time and memory of a frame
/// do not grow with the line. Refers to the database. For one thread.
class LiveMotion {
 public:
  /// Throws InputError unless the method is the guided one, of units of any kind, without dials, parameters of VOCAL's
  /// curves and edits, in a corpus with a trajectory model.
  LiveMotion(const UnitDatabase& database, const SynthesisOptions& options, const Language& language);

  /// What is said next, for good. Phones follow one another without gaps and last longer than zero; silences side by
  /// side become one. Words and syllables are counted from the stream's start.
  void say(const PhoneSegment& phone);
  /// Until when it is known what is said.
  [[nodiscard]] Seconds saidUntil() const { return said_.empty() ? 0 : said_.back().segment.span.end; }

  /// The next frames, `count` of them, from what was said and what is likely to follow (`guess`, from saidUntil() on).
  LiveFrames render(std::size_t count, std::span<const PhoneSegment> guess);
  /// How many frames were made.
  [[nodiscard]] std::size_t frameCount() const { return next_frame_; }
  /// So many frames were shown without render(), the last of them as `last` (one frame).
  void skip(std::size_t count, const LiveFrames& last);

 private:
  struct Said {
    PhoneSegment segment;
    std::optional<PhonePlace> place = std::nullopt;  ///< of the fragment for this phone and the next
  };
  /// What render() looks at: a phrase, or as much of it as matters.
  struct Window {
    SpeechLabels labels;                             ///< on its own clock
    std::shared_ptr<const PredictedLine> predicted;  ///< of these labels
    Seconds origin = 0;                              ///< of that clock
    std::size_t first = 0;                           ///< of said_: which of them is the labels' first phone
    Seconds until = 0;                               ///< frames from here on belong to the next phrase
    bool is_silent = false;                          ///< for so long that the face rests
  };

  [[nodiscard]] Seconds timeOf(std::size_t frame) const;
  [[nodiscard]] Window windowAt(const TimeSpan& frames, std::span<const PhoneSegment> guess) const;
  void addLikelyFuture(std::vector<PhoneSegment>& segments) const;
  LiveFrames renderPhrase(std::size_t count, const Window& window);
  [[nodiscard]] LiveFrames resting(std::size_t count) const;
  [[nodiscard]] std::vector<SelectedUnit> unitsFor(const Window& window) const;
  void settle(const Window& window, const std::vector<SelectedUnit>& units, Seconds shown_until);
  void forget();

  const UnitDatabase& database_;
  SynthesisOptions options_;
  const Language& language_;
  LikelyWords likely_words_;
  TakePredictions predictions_;
  RecentJoins recent_joins_;
  std::deque<Said> said_;
  std::size_t next_frame_ = 0;
  Eigen::RowVectorXd shown_;  ///< the last frame: markers, lips, tongue; empty before the first
  Eigen::RowVectorXd led_;    ///< by how much it was moved from where it was rendered
};

}  // namespace mouthpiece
