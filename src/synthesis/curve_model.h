#pragma once

#include <memory>
#include <mutex>

#include "units/unit_database.h"
#include "vocal/viseme_poses.h"

namespace mouthpiece {

/// The viseme poses of a corpus, learnt when first asked for from at most kPoseTakes of its takes, evenly chosen.
/// Refers to the database. Thread-safe.
class CurveModel {
 public:
  explicit CurveModel(const UnitDatabase& database) : database_(database) {}

  /// Throws InputError when the corpus' layout lacks lips or a chin.
  [[nodiscard]] const VisemePoses& poses() const;
  /// Whether poses() can be had: the layout has the markers that it needs.
  [[nodiscard]] bool isPossible() const;

 private:
  const UnitDatabase& database_;
  mutable std::once_flag learnt_;
  mutable VisemePoses poses_;
};

inline constexpr std::size_t kPoseTakes = 60;

}  // namespace mouthpiece
