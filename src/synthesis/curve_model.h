#pragma once

#include <memory>
#include <mutex>
#include <optional>

#include "units/selection/unit_database.h"
#include "vocal/animation_curve.h"
#include "vocal/viseme_poses.h"
#include "vocal/vocal_style.h"

namespace mouthpiece {

/// Viseme poses from at most kPoseTakes takes of the corpus and about kPoseFrames frames, evenly chosen. Throws
/// InputError when the layout lacks lips or a chin, or too little is said.
VisemePoses learnPoses(const Corpus& corpus);
/// Those that were learnt when the corpus was built; empty in one that keeps none. Throws InputError when they are no
/// poses of its markers.
std::optional<VisemePoses> storedPoses(const Corpus& corpus);

/// The viseme poses of a corpus: those stored in it, or learnt when first asked for. Refers to the database.
/// Thread-safe.
class CurveModel {
 public:
  explicit CurveModel(const UnitDatabase& database) : database_(database) {}

  /// Throws InputError as storedPoses() and learnPoses() do.
  [[nodiscard]] const VisemePoses& poses() const;
  /// Whether poses() can be had: the layout has the markers that it needs.
  [[nodiscard]] bool isPossible() const;

 private:
  const UnitDatabase& database_;
  mutable std::once_flag learnt_;
  mutable VisemePoses poses_;
};

enum class CurveStyle { kSpeech, kSing };

/// One of Ma, Ps, Ja, Li as asked for: given, found from the sound (`automatic`), or left to the style.
struct StyleWish {
  std::optional<StyleSignal> given;
  bool automatic = false;
};

/// How VOCAL's curves take part.
struct CurveOptions {
  bool fill_gaps = false;             ///< pairs of phones that the corpus lacks are made of curves, not of stand-ins
  bool before_stand_ins = false;      ///< with fill_gaps: also where a prediction could lead stand-ins
  std::optional<CurveStyle> alone;    ///< curves make all of the motion
  bool layered = false;               ///< with kSing: consonants come from captured units where Ma is low
  StyleWish ma, ps, ja, li;           ///< left open: speech has Ma = Ps = 0, song finds both; Ja = Li = 1
  const CurveModel* model = nullptr;  ///< of the database at hand; null: learnt for this line
};

/// The parameters over the line.
VocalStyle styleFor(const CurveOptions& options, const SpeechLabels& labels, const AudioTags& tags);

inline constexpr std::size_t kPoseTakes = 60;
inline constexpr double kPoseFrames = 60'000;  ///< eight minutes at 120 Hz, 95 MB of 66 markers

}  // namespace mouthpiece
