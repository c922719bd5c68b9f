#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "motion/lip_gauge.h"
#include "units/file/corpus.h"
#include "units/phones/phone_span_index.h"
#include "units/prediction/phone_shapes.h"

namespace mouthpiece {

/// Where the lips are in the middle stretch of a phone, for comparing two phones at which units may be joined.
struct PhoneLips {
  static constexpr Eigen::Index kPoints = 8;  ///< at (k + 0.5) / kPoints of the phone
  using Matrix = Eigen::Matrix<float, kPoints, Eigen::Dynamic, Eigen::RowMajor>;
  Matrix positions_mm;  ///< x y z of each lip and chin marker
  Matrix steps_mm;      ///< change per whole phone: the derivative by normalised time
};

/// A corpus made ready for finding units. Refers to the corpus, which must outlive it. Safe to share between threads.
class UnitDatabase {
 public:
  /// Of a corpus of more phones those of whole takes would be most of what a line needs in memory.
  static constexpr std::size_t kMostPhonesByTake = 200'000;

  /// Shapes are loaded by the take, and by the phone in a corpus of more than `most_phones_by_take`: the same shapes.
  explicit UnitDatabase(const Corpus& corpus, std::size_t most_phones_by_take = kMostPhonesByTake);
  ~UnitDatabase();
  UnitDatabase(const UnitDatabase&) = delete;
  UnitDatabase& operator=(const UnitDatabase&) = delete;

  [[nodiscard]] const Corpus& corpus() const { return corpus_; }
  [[nodiscard]] const PhoneSpanIndex& index() const { return index_; }
  [[nodiscard]] const PhoneColumns& columns() const { return index_.columns(); }
  [[nodiscard]] const CorpusTake& takeOf(TakeIndex take) const { return mouthpiece::takeOf(corpus_, take); }
  [[nodiscard]] const CorpusTake& takeOf(const PhonePlace& place) const { return takeOf(place.take); }
  /// The take's motion; never null. Of a corpus that was read so it is loaded when asked for, and those asked for last
  /// are kept, 32 MB of them: a line compares many takes of a large corpus and plays a few. Throws InputError when it
  /// is damaged.
  [[nodiscard]] std::shared_ptr<const MotionClip> motionOf(TakeIndex take) const;
  /// Its frames, for which it need not be loaded.
  [[nodiscard]] std::size_t frameCount(TakeIndex take) const { return unseenBefore(take).size() - 1; }
  [[nodiscard]] const LabelledPhone& phoneAt(const PhonePlace& place) const {
    return takeOf(place).labels.phones[place.phone.value];
  }

  /// Whether every marker is seen (no NaN) from the first to the last of `phone_count` phones, and the take's motion
  /// lasts as long. O(1) after the take's first question.
  [[nodiscard]] bool isSeen(const PhonePlace& first, std::size_t phone_count) const;

  /// The columns of a take's motion that hold lip and chin markers: x, y, z of each.
  [[nodiscard]] const std::vector<Eigen::Index>& lipColumns() const { return lip_columns_; }

  /// Computed for the whole take on its first question. NaN where not seen.
  [[nodiscard]] const PhoneLips& lipsOf(const PhonePlace& place) const;

  /// The layout's.
  [[nodiscard]] const LipGauge& lips() const { return lips_; }

  /// How far the lips stay open at their tightest in the phone and 20 ms around it, beyond
  /// the neutral pose; mm, negative when pressed. 0 in a layout without these markers.
  [[nodiscard]] double openingLeft(const PhonePlace& place) const;

  /// What the lattice compares. Only in a corpus with a trajectory model. From the file, or computed on the take's
  /// first question.
  [[nodiscard]] PhoneShape shapeOf(const PhonePlace& place) const;
  /// PhoneShapes::tightest_mm.
  [[nodiscard]] float tightestMm(const PhonePlace& place) const;

  /// Frees what was loaded of single takes; it is loaded again when asked for. What was handed out before is no longer
  /// valid, and no other thread may be asking.
  void forgetTakes();

  /// Where phone `a` followed by phone `b` occurs, in the order of the corpus; of `most` or more places evenly spread
  /// ones, fewer than `most`.
  [[nodiscard]] std::vector<PhonePlace> diphones(Phone a, Phone b, std::size_t most = SIZE_MAX) const;
  [[nodiscard]] bool hasDiphone(Phone a, Phone b) const;

 private:
  struct TakeFacts;
  struct TakeShapes;
  struct PlaceShapes;
  class RecentMotion;
  [[nodiscard]] const std::vector<std::uint32_t>& unseenBefore(TakeIndex take) const;
  [[nodiscard]] const TakeFacts& lipFactsOf(TakeIndex take) const;
  [[nodiscard]] const PackedShapes& shapesOf(TakeIndex take) const;
  [[nodiscard]] const PackedShapes& shapesAt(const PhonePlace& place) const;
  [[nodiscard]] PhoneShapes loadShapes(TakeIndex take) const;
  [[nodiscard]] PhoneShapes loadShapes(TakeIndex take, std::size_t first, std::size_t count) const;
  void makeRoomForTakes();

  const Corpus& corpus_;
  PhoneSpanIndex index_;
  bool has_shapes_by_take_;
  LipGauge lips_;
  double neutral_opening_mm_ = 0;
  std::vector<Eigen::Index> lip_columns_;
  std::vector<PhoneColumns::Position> pair_begin_;  ///< kPhoneCount x kPhoneCount: where their places begin, and end
  std::vector<PhoneColumns::Position> pair_places_;
  std::unique_ptr<TakeFacts[]> facts_;         ///< one a take
  std::unique_ptr<TakeShapes[]> shapes_;       ///< the same; null where shapes are kept by phone
  std::unique_ptr<PlaceShapes> place_shapes_;  ///< null where they are kept by take
  std::unique_ptr<RecentMotion> recent_;
};

/// The `columns` of `motion` at `time`, straight between the frames around it; held beyond the ends.
Eigen::RowVectorXd poseAt(const MotionClip& motion, const std::vector<Eigen::Index>& columns, Seconds time);

/// What the prediction misses on average where the corpus says the same in a like context: for each phone the mean of
/// captured less predicted over its places in the captured pairs of the line, each weighing exp(-d / 0.3 mm2), where d
/// is the mean squared distance of its own prediction to the line's; one more place of weight 1 and no difference holds
/// it back. `predicted`: predictedShapes() of the line. phones * PhoneShapes::kPoints rows, at shapeTimes(), a column a
/// component.
Eigen::MatrixXd contextMean(const SpeechLabels& target, const UnitDatabase& database,
                            const PhoneShapes::Matrix& predicted);

}  // namespace mouthpiece
