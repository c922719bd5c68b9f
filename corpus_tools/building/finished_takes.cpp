#include "corpus_tools/building/finished_takes.h"

#include "base/errors.h"
#include "corpus_tools/takes/pose_fit.h"

namespace mouthpiece {

void roundToFloats(MotionClip& motion) { motion.positions_mm = motion.positions_mm.cast<float>().cast<double>(); }

void FinishedTakes::takeOver(const std::string& key, MotionClip& motion) {
  const std::size_t bytes = sizeof(float) * static_cast<std::size_t>(motion.positions_mm.size());
  const std::scoped_lock lock(mutex_);
  PositionMatrix positions_mm;
  positions_mm.swap(motion.positions_mm);
  if (held_bytes_ + bytes > most_held_bytes_) return;
  held_bytes_ += bytes;
  held_[key] = {motion, positions_mm.cast<float>()};
}

void FinishedTakes::addPart(const std::string& key) { places_.push_back({key, nullptr, {}, {}}); }

void FinishedTakes::addEarlier(std::shared_ptr<const MotionSource> earlier, TakeIndex take) {
  places_.push_back({"", std::move(earlier), take, {}});
}

MotionClip FinishedTakes::load(TakeIndex take) const {
  const Place& place = places_.at(take.value);
  MotionClip motion;
  if (place.earlier != nullptr) {
    motion = place.earlier->load(place.earlier_take);
  } else if (const auto held = held_.find(place.key); held != held_.end()) {
    motion = held->second.without_positions;
    motion.positions_mm = held->second.positions_mm.cast<double>();
  } else {
    motion = parts_.load(place.key).motion;
  }
  if (place.move) transform(motion, *place.move);
  if (face_from_head_) transform(motion, *face_from_head_);
  roundToFloats(motion);
  return motion;
}

AudioClip FinishedTakes::loadAudio(TakeIndex take) const {
  const Place& place = places_.at(take.value);
  if (place.earlier != nullptr) return place.earlier->loadAudio(place.earlier_take);
  return parts_.load(place.key).audio;
}

}  // namespace mouthpiece
