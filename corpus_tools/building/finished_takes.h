#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "corpus_tools/building/build_parts.h"
#include "motion/cleaning/rigid.h"
#include "units/file/corpus.h"

namespace mouthpiece {

/// The motion and sound of takes that a build has done: in its parts on disk, or in the corpus that it goes on from.
/// A corpus has hundreds of times the takes that are worked on at once, so of all of them only a little motion is kept
/// in memory. Reading is thread-safe.
class FinishedTakes final : public MotionSource {
 public:
  /// `most_held_bytes` of motion stay in memory; the rest is read from `parts` when asked for.
  explicit FinishedTakes(const BuildParts& parts, std::size_t most_held_bytes = kMostHeldBytes)
      : parts_(parts), most_held_bytes_(most_held_bytes) {}

  /// Takes the motion out of the take of that key, which is in the parts. Thread-safe.
  void takeOver(const std::string& key, MotionClip& motion);
  /// The next take is the one of `key`, or take `take` of `earlier`.
  void addPart(const std::string& key);
  void addEarlier(std::shared_ptr<const MotionSource> earlier, TakeIndex take);

  /// From now on take `take` is moved by `move`, and after that all takes by `face_from_head`.
  void move(std::size_t take, const RigidMotion& move) { places_[take].move = move; }
  void turnAll(const RigidMotion& face_from_head) { face_from_head_ = face_from_head; }

  [[nodiscard]] MotionClip load(TakeIndex take) const override;
  [[nodiscard]] AudioClip loadAudio(TakeIndex take) const override;

 private:
  struct Place {
    std::string key;
    std::shared_ptr<const MotionSource> earlier;
    TakeIndex earlier_take;
    std::optional<RigidMotion> move;
  };
  struct Held {
    MotionClip without_positions;
    Eigen::MatrixXf positions_mm;
  };
  /// The takes of a short session, which are then not read again and again.
  static constexpr std::size_t kMostHeldBytes = 8 << 20;

  const BuildParts& parts_;
  std::size_t most_held_bytes_;
  std::vector<Place> places_;
  std::mutex mutex_;
  std::map<std::string, Held> held_;  ///< by key
  std::size_t held_bytes_ = 0;
  std::optional<RigidMotion> face_from_head_;
};

/// Motion as the database keeps it, so that a take is the same whether it was just done or read back.
void roundToFloats(MotionClip& motion);

}  // namespace mouthpiece
