#include "units/selection/unit_database.h"

#include <algorithm>
#include <cmath>
#include <list>
#include <mutex>
#include <numeric>
#include <optional>
#include <unordered_map>

#include "base/errors.h"

namespace mouthpiece {
namespace {

std::shared_ptr<const PhoneColumns> columnsOf(const Corpus& corpus) {
  if (corpus.phone_columns != nullptr) return corpus.phone_columns;
  return std::make_shared<const PhoneColumns>(phoneColumnsOf(corpus));
}

std::size_t diphoneIndex(Phone a, Phone b) {
  return static_cast<std::size_t>(a) * kPhoneCount + static_cast<std::size_t>(b);
}

}  // namespace

/// What is known of a take, each part when it is first asked for: a line looks at many takes and needs of most of them
/// only what was seen.
struct UnitDatabase::TakeFacts {
  std::once_flag has_unseen, has_lips;
  std::vector<std::uint32_t> unseen_before;  ///< frames with a NaN among the first k
  std::vector<PhoneLips> lips;               ///< one a phone
  std::vector<double> opening_left_mm;       ///< one a phone
};

struct UnitDatabase::TakeShapes {
  std::once_flag once;
  PackedShapes shapes;
};

struct UnitDatabase::PlaceShapes {
  std::mutex mutex;
  std::unordered_map<PhoneColumns::Position, PackedShapes> shapes;
};

/// The clips that were asked for last.
class UnitDatabase::RecentMotion {
 public:
  std::shared_ptr<const MotionClip> of(const TakeSource& source, TakeIndex take) {
    {
      const std::scoped_lock lock(mutex_);
      const auto found =
          std::find_if(clips_.begin(), clips_.end(), [&](const auto& clip) { return clip.first == take; });
      if (found != clips_.end()) {
        clips_.splice(clips_.begin(), clips_, found);
        return clips_.front().second;
      }
    }
    auto loaded = std::make_shared<const MotionClip>(source.load(take));
    const std::scoped_lock lock(mutex_);
    clips_.emplace_front(take, loaded);
    numbers_ += loaded->positions_mm.size();
    while (numbers_ > kMostNumbers && clips_.size() > 1) {
      numbers_ -= clips_.back().second->positions_mm.size();
      clips_.pop_back();
    }
    return loaded;
  }

 private:
  static constexpr Eigen::Index kMostNumbers = 4'000'000;  ///< 32 MB

  std::mutex mutex_;
  std::list<std::pair<TakeIndex, std::shared_ptr<const MotionClip>>> clips_;  ///< the last one first
  Eigen::Index numbers_ = 0;
};

UnitDatabase::UnitDatabase(const Corpus& corpus, std::size_t most_phones_by_take)
    : corpus_(corpus),
      index_(columnsOf(corpus)),
      has_shapes_by_take_(columns().phoneCount() <= most_phones_by_take),
      lips_(corpus.layout),
      pair_begin_(kPhoneCount * kPhoneCount + 1) {
  makeRoomForTakes();
  for (std::size_t marker = 0; marker < corpus.layout.markers.size(); ++marker) {
    const std::string& region = corpus.layout.markers[marker].region;
    if (region != "lip" && region != "chin") continue;
    for (std::size_t axis = 0; axis < 3; ++axis) lip_columns_.push_back(signedIndex(3 * marker + axis));
  }
  if (lips_.hasLips()) {
    neutral_opening_mm_ = lips_.opening(
        Eigen::Map<const Eigen::RowVectorXd>(corpus.neutral_pose_mm.data(), corpus.neutral_pose_mm.size()));
  }
  const auto forEachPair = [&](const auto& visit) {
    const std::vector<Phone>& phones = columns().phones;
    for (std::size_t take = 0; take < columns().takeCount(); ++take) {
      const PhoneColumns::Position end = columns().endOf(TakeIndex(take));
      for (PhoneColumns::Position i = columns().take_begin[take]; i + 1 < end; ++i)
        visit(diphoneIndex(phones[i], phones[i + 1]), i);
    }
  };
  forEachPair([&](std::size_t pair, auto /*position*/) { ++pair_begin_[pair + 1]; });
  std::partial_sum(pair_begin_.begin(), pair_begin_.end(), pair_begin_.begin());
  pair_places_.resize(pair_begin_.back());
  std::vector<PhoneColumns::Position> next = pair_begin_;
  forEachPair([&](std::size_t pair, PhoneColumns::Position position) { pair_places_[next[pair]++] = position; });
}

UnitDatabase::~UnitDatabase() = default;

void UnitDatabase::makeRoomForTakes() {
  facts_ = std::make_unique<TakeFacts[]>(takeCount(corpus_));
  shapes_ = has_shapes_by_take_ ? std::make_unique<TakeShapes[]>(takeCount(corpus_)) : nullptr;
  place_shapes_ = has_shapes_by_take_ ? nullptr : std::make_unique<PlaceShapes>();
  recent_ = std::make_unique<RecentMotion>();
}

void UnitDatabase::forgetTakes() { makeRoomForTakes(); }

std::vector<PhonePlace> UnitDatabase::diphones(Phone a, Phone b, std::size_t most) const {
  const std::size_t first = pair_begin_[diphoneIndex(a, b)], end = pair_begin_[diphoneIndex(a, b) + 1];
  const std::size_t every = (end - first) / most + 1;
  if (every == 1) return columns().placesOf(pair_places_.data() + first, pair_places_.data() + end);
  std::vector<PhoneColumns::Position> some;
  for (std::size_t i = first; i < end; i += every) some.push_back(pair_places_[i]);
  return columns().placesOf(some.data(), some.data() + some.size());
}

bool UnitDatabase::hasDiphone(Phone a, Phone b) const {
  return pair_begin_[diphoneIndex(a, b)] < pair_begin_[diphoneIndex(a, b) + 1];
}

Eigen::RowVectorXd poseAt(const MotionClip& motion, const std::vector<Eigen::Index>& columns, Seconds time) {
  const auto last = asReal(motion.frameCount() - 1);
  const double frame = std::clamp(time * motion.frame_rate_hz, 0.0, last);
  const auto before = static_cast<Eigen::Index>(frame);
  const Eigen::Index after = std::min<Eigen::Index>(before + 1, motion.positions_mm.rows() - 1);
  const double part = frame - asReal(before);
  return (1 - part) * motion.positions_mm(before, columns) + part * motion.positions_mm(after, columns);
}

double UnitDatabase::openingLeft(const PhonePlace& place) const {
  return lipFactsOf(place.take).opening_left_mm[place.phone.value];
}

std::shared_ptr<const MotionClip> UnitDatabase::motionOf(TakeIndex take) const {
  // The corpus outlives whoever asks; of its own motion nothing is to be freed.
  if (corpus_.take_source == nullptr) return {std::shared_ptr<void>(), &corpus_.takes[take.value].motion};
  return recent_->of(*corpus_.take_source, take);
}

const std::vector<std::uint32_t>& UnitDatabase::unseenBefore(TakeIndex take) const {
  TakeFacts& facts = facts_[take.value];
  std::call_once(facts.has_unseen, [&] {
    std::optional<std::vector<bool>> unseen;
    if (corpus_.take_source != nullptr) unseen = corpus_.take_source->loadUnseen(take);
    if (!unseen) {
      const std::shared_ptr<const MotionClip> motion = motionOf(take);
      const PositionMatrix& positions = motion->positions_mm;
      // A sum is NaN as soon as one of its terms is; positions are finite or NaN.
      unseen.emplace();
      for (Eigen::Index frame = 0; frame < positions.rows(); ++frame)
        unseen->push_back(std::isnan(positions.row(frame).sum()));
    }
    facts.unseen_before.push_back(0);
    for (const bool is_unseen : *unseen)
      facts.unseen_before.push_back(facts.unseen_before.back() + (is_unseen ? 1U : 0U));
  });
  return facts.unseen_before;
}

const UnitDatabase::TakeFacts& UnitDatabase::lipFactsOf(TakeIndex take) const {
  TakeFacts& facts = facts_[take.value];
  std::call_once(facts.has_lips, [&] {
    const std::shared_ptr<const MotionClip> kept = motionOf(take);
    const MotionClip& motion = *kept;
    const auto columns = signedIndex(lip_columns_.size());
    for (const LabelledPhone& phone : takeOf(take).labels.phones) {
      const double tightest = lips_.hasLips() ? lips_.tightest(motion, phone.span) : std::nan("");
      facts.opening_left_mm.push_back(std::isnan(tightest) ? 0 : tightest - neutral_opening_mm_);
      PhoneLips& lips = facts.lips.emplace_back();
      lips.positions_mm.resize(PhoneLips::kPoints, columns);
      lips.steps_mm.resize(PhoneLips::kPoints, columns);
      const Seconds spacing = phone.span.duration() / PhoneLips::kPoints;
      for (Eigen::Index k = 0; k < PhoneLips::kPoints; ++k) {
        const Seconds time = phone.span.start + (asReal(k) + 0.5) * spacing;
        // At least half a frame to each side, so that a short phone's speed is not that of one noisy frame pair.
        const Seconds reach = std::max(spacing, 0.5 / motion.frame_rate_hz);
        const Eigen::RowVectorXd change =
            poseAt(motion, lip_columns_, time + reach) - poseAt(motion, lip_columns_, time - reach);
        lips.positions_mm.row(k) = poseAt(motion, lip_columns_, time).cast<float>();
        lips.steps_mm.row(k) = (change * (phone.span.duration() / (2 * reach))).cast<float>();
      }
    }
  });
  return facts;
}

const PhoneLips& UnitDatabase::lipsOf(const PhonePlace& place) const {
  return lipFactsOf(place.take).lips[place.phone.value];
}

PhoneShapes UnitDatabase::loadShapes(TakeIndex take) const {
  MOUTHPIECE_EXPECT(corpus_.trajectory_model != nullptr);
  PhoneShapes shapes;
  if (corpus_.take_source != nullptr) shapes = corpus_.take_source->loadShapes(take);
  if (shapes.phoneCount() > 0) return shapes;
  return phoneShapes(*corpus_.trajectory_model, takeOf(take).labels, *motionOf(take), corpus_.neutral_pose_mm, lips_);
}

PhoneShapes UnitDatabase::loadShapes(TakeIndex take, std::size_t first, std::size_t count) const {
  PhoneShapes some;
  if (corpus_.take_source != nullptr) some = corpus_.take_source->loadSomeShapes(take, first, count);
  if (some.phoneCount() > 0) return some;
  const PhoneShapes all = loadShapes(take);
  const Eigen::Index row = signedIndex(first), rows = signedIndex(count);
  some.captured = all.captured.middleRows(row, rows);
  some.predicted = all.predicted.middleRows(row, rows);
  some.tightest_mm.assign(all.tightest_mm.begin() + row, all.tightest_mm.begin() + row + rows);
  return some;
}

const PackedShapes& UnitDatabase::shapesOf(TakeIndex take) const {
  TakeShapes& known = shapes_[take.value];
  std::call_once(known.once, [&] { known.shapes = PackedShapes(loadShapes(take)); });
  return known.shapes;
}

/// Who asks for a phone asks for the next one soon.
const PackedShapes& UnitDatabase::shapesAt(const PhonePlace& place) const {
  const PhoneColumns::Position at = columns().positionOf(place);
  const std::scoped_lock lock(place_shapes_->mutex);
  auto& known = place_shapes_->shapes;
  if (const auto found = known.find(at); found != known.end()) return found->second;
  const std::size_t count = std::min<std::size_t>(2, columns().phoneCount(place.take) - place.phone.value);
  const PhoneShapes shapes = loadShapes(place.take, place.phone.value, count);
  for (std::size_t i = 0; i < count; ++i) known.try_emplace(at + static_cast<PhoneColumns::Position>(i), shapes, i, 1U);
  return known.at(at);
}

PhoneShape UnitDatabase::shapeOf(const PhonePlace& place) const {
  return shapes_ ? shapesOf(place.take).unpacked(place.phone.value) : shapesAt(place).unpacked(0);
}

float UnitDatabase::tightestMm(const PhonePlace& place) const {
  return shapes_ ? shapesOf(place.take).tightestMm(place.phone.value) : shapesAt(place).tightestMm(0);
}

bool UnitDatabase::isSeen(const PhonePlace& first, std::size_t phone_count) const {
  const LabelledPhone& last = takeOf(first).labels.phones[first.phone.value + phone_count - 1];
  const std::vector<std::uint32_t>& unseen_before = unseenBefore(first.take);
  const double rate = takeOf(first).motion.frame_rate_hz;
  const auto frames = asReal(unseen_before.size() - 1);
  // The last silence may outlast the capture: the pose is held there. Speech may not, but for one frame's rounding.
  const Seconds needed = last.phone == Phone::kSil ? last.span.start : last.span.end;
  if (needed * rate > frames) return false;
  const double begin = std::clamp(std::floor(phoneAt(first).span.start * rate), 0.0, frames - 1);
  const double end = std::clamp(std::ceil(last.span.end * rate) + 1, begin + 1, frames);
  return unseen_before[static_cast<std::size_t>(end)] == unseen_before[static_cast<std::size_t>(begin)];
}

}  // namespace mouthpiece
