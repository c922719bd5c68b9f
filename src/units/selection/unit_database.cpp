#include "units/selection/unit_database.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <list>
#include <mutex>
#include <optional>

#include "base/errors.h"

namespace mouthpiece {
namespace {

std::vector<std::vector<Phone>> phonesOfTakes(const Corpus& corpus) {
  std::vector<std::vector<Phone>> takes(corpus.takes.size());
  for (std::size_t take = 0; take < takes.size(); ++take) {
    takes[take].reserve(corpus.takes[take].labels.phones.size());
    for (const LabelledPhone& phone : corpus.takes[take].labels.phones) takes[take].push_back(phone.phone);
  }
  return takes;
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

/// The clips that were asked for last.
class UnitDatabase::RecentMotion {
 public:
  std::shared_ptr<const MotionClip> of(const MotionSource& source, TakeIndex take) {
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

UnitDatabase::UnitDatabase(const Corpus& corpus)
    : corpus_(corpus),
      index_(phonesOfTakes(corpus)),
      lips_(corpus.layout),
      diphones_(kPhoneCount * kPhoneCount),
      facts_(std::make_unique<TakeFacts[]>(corpus.takes.size())),
      shapes_(std::make_unique<TakeShapes[]>(corpus.takes.size())),
      recent_(std::make_unique<RecentMotion>()) {
  for (std::size_t marker = 0; marker < corpus.layout.markers.size(); ++marker) {
    const std::string& region = corpus.layout.markers[marker].region;
    if (region != "lip" && region != "chin") continue;
    for (std::size_t axis = 0; axis < 3; ++axis) lip_columns_.push_back(signedIndex(3 * marker + axis));
  }
  if (lips_.hasLips()) {
    neutral_opening_mm_ = lips_.opening(
        Eigen::Map<const Eigen::RowVectorXd>(corpus.neutral_pose_mm.data(), corpus.neutral_pose_mm.size()));
  }
  std::vector<std::uint32_t> counts(diphones_.size());
  for (const CorpusTake& take : corpus.takes) {
    const auto& phones = take.labels.phones;
    for (std::size_t i = 0; i + 1 < phones.size(); ++i) ++counts[diphoneIndex(phones[i].phone, phones[i + 1].phone)];
  }
  for (std::size_t pair = 0; pair < counts.size(); ++pair) diphones_[pair].reserve(counts[pair]);
  for (std::size_t take = 0; take < corpus.takes.size(); ++take) {
    const auto& phones = corpus.takes[take].labels.phones;
    for (std::size_t i = 0; i + 1 < phones.size(); ++i) {
      diphones_[diphoneIndex(phones[i].phone, phones[i + 1].phone)].push_back({TakeIndex(take), PhoneIndex(i)});
    }
  }
}

UnitDatabase::~UnitDatabase() = default;

void UnitDatabase::forgetTakes() {
  facts_ = std::make_unique<TakeFacts[]>(corpus_.takes.size());
  shapes_ = std::make_unique<TakeShapes[]>(corpus_.takes.size());
  recent_ = std::make_unique<RecentMotion>();
}

const std::vector<PhonePlace>& UnitDatabase::diphones(Phone a, Phone b) const { return diphones_[diphoneIndex(a, b)]; }

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
  if (corpus_.motion_source == nullptr) return {std::shared_ptr<void>(), &corpus_.takes[take.value].motion};
  return recent_->of(*corpus_.motion_source, take);
}

const std::vector<std::uint32_t>& UnitDatabase::unseenBefore(TakeIndex take) const {
  TakeFacts& facts = facts_[take.value];
  std::call_once(facts.has_unseen, [&] {
    std::optional<std::vector<bool>> unseen;
    if (corpus_.motion_source != nullptr) unseen = corpus_.motion_source->loadUnseen(take);
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
    for (const LabelledPhone& phone : corpus_.takes[take.value].labels.phones) {
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

const PackedShapes& UnitDatabase::shapesOf(TakeIndex take) const {
  TakeShapes& known = shapes_[take.value];
  std::call_once(known.once, [&] {
    MOUTHPIECE_EXPECT(corpus_.trajectory_model != nullptr);
    PhoneShapes shapes;
    if (corpus_.motion_source != nullptr) shapes = corpus_.motion_source->loadShapes(take);
    if (shapes.phoneCount() == 0) {
      shapes = phoneShapes(*corpus_.trajectory_model, corpus_.takes[take.value].labels, *motionOf(take),
                           corpus_.neutral_pose_mm, lips_);
    }
    known.shapes = PackedShapes(shapes);
  });
  return known.shapes;
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
