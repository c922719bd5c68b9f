#pragma once

#include <filesystem>
#include <string>

#include "heads/head_generator.h"
#include "retarget/rig/face_fit.h"
#include "retarget/rig/face_judge.h"
#include "units/file/corpus.h"

namespace mouthpiece::test {

/// A head fitted to ten clicks and moved by real captured motion, judged by what is seen and by nothing that
/// `retarget check` measures, and beside that as `retarget fit` judges it, at rest and in motion. Lengths in
/// millimetres of a mouth 51 mm wide.
struct MouthTrial {
  std::string refused;                 ///< why there is no fit; empty: there is one
  std::string faults;                  ///< what `retarget fit` finds; empty: it passes
  double edge_growth_mm = 0;           ///< of the edge that grows most
  double jump_mm = 0;                  ///< how much further a vertex goes from frame to frame than any marker
  std::size_t closures = 0, shut = 0;  ///< captured B P M; through how many nobody sees into the mouth
  double fit_s = 0;                    ///< of one core, without mending
  double mend_s = 0;                   ///< of one core; judging what it was given is not counted

  /// An edge grows further than lips ever move apart at their corners, a vertex flies, or every tenth closure gapes.
  [[nodiscard]] bool isTorn() const { return edge_growth_mm > 7 || jump_mm > 4 || shut * 10 < closures * 9; }
  [[nodiscard]] bool passes() const { return refused.empty() && faults.empty(); }
};

/// What `retarget fit` asks for; its file and hash are left open.
FitRequest requestFor(const ClickedHead& head, const Corpus& corpus);

/// `poses`: what fit's own judge moves it by; `take`: number of the corpus' take that moves it here, or of the next one
/// that is whole and has closures. Files are written under `folder`.
MouthTrial tryMouth(const ClickedHead& head, const Corpus& corpus, const JudgedPoses& poses, std::size_t take,
                    const std::filesystem::path& folder);

}  // namespace mouthpiece::test
