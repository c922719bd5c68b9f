// Where a unit of a line was taken from, as a performance of its own.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/errors.h"
#include "base/index.h"
#include "motion/resample.h"
#include "speaker/speaker_data.h"
#include "synthesis/lips.h"
#include "synthesis/tongue.h"

namespace mouthpiece {
namespace {

/// What the cameras did not see holds what they saw before.
void holdUnseen(const MarkerPositions& neutral_mm, PositionMatrix& positions_mm) {
  for (Eigen::Index column = 0; column < positions_mm.cols(); ++column) {
    double last = neutral_mm(column / 3, column % 3);
    for (double& mm : positions_mm.col(column)) last = mm = std::isnan(mm) ? last : mm;
  }
}

}  // namespace

Performance sourceOf(const Performance& line, std::size_t unit) {
  const Performance::Data& from = line.data();
  if (unit >= from.animation.units.size() || !from.corpus)
    throw InputError(fmt::format("there is no unit {}; the line has {}", unit, from.animation.units.size()));
  const PlacedUnit& placed = from.animation.units[unit];
  const Corpus& corpus = from.corpus->data().corpus;
  if (!placed.take_index) throw InputError("curves move the face there: it was taken from nowhere");
  const TakeIndex index = *placed.take_index;
  const CorpusTake& take = takeOf(corpus, index);

  auto made = std::make_shared<Performance::Data>();
  made->face = from.face;
  made->actor = from.actor;
  made->corpus = from.corpus;
  UtteranceAnimation& animation = made->animation;
  animation.text = take.text;
  animation.voice = "recorded with the motion";
  animation.corpus = corpus.name;
  animation.method = "as captured";
  animation.labels = take.labels;
  animation.audio = take.audio;
  if (animation.audio.samples.empty() && corpus.take_source) animation.audio = corpus.take_source->loadAudio(index);
  if (animation.audio.samples.empty()) {
    animation.audio.sample_rate_hz = 16'000;
    animation.warnings.push_back("the corpus keeps no sound of this take");
  }
  animation.motion = *from.corpus->data().units.motionOf(index);
  holdUnseen(corpus.neutral_pose_mm, animation.motion.positions_mm);
  const std::vector<Seconds> times = frameTimes(0, animation.motion.frameCount(), animation.motion.frame_rate_hz);
  animation.tongue = tongueFromPhones(animation.labels, times);
  animation.lips = lipsFromPhones(animation.labels, times);
  PlacedUnit shown = placed;
  const std::size_t phones = placed.phones.last.value - placed.phones.first.value;
  shown.phones = {placed.source_first, PhoneIndex(placed.source_first.value + phones)};
  shown.span = placed.source_span;
  shown.sound = {};
  animation.units = {shown};
  return Performance(std::move(made));
}

}  // namespace mouthpiece
