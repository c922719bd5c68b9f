#include "synthesis/curve_model.h"

#include <algorithm>

#include "base/errors.h"
#include "base/index.h"

namespace mouthpiece {
namespace {

/// `unknown`: where the sound is asked and says nothing.
StyleSignal signalFor(const StyleWish& wish, bool automatic_by_default, const PhoneValues& found,
                      const SpeechLabels& labels, double unknown) {
  if (wish.given) return *wish.given;
  if (wish.automatic || automatic_by_default) return smoothedOverPhones(found, labels, unknown);
  return StyleSignal(0.0);
}

}  // namespace

bool CurveModel::isPossible() const { return database_.lips().hasLips() && database_.lips().has(MarkerRole::kChin); }

const VisemePoses& CurveModel::poses() const {
  std::call_once(learnt_, [this] {
    std::optional<VisemePoses> stored = storedPoses(database_.corpus());
    poses_ = stored ? std::move(*stored) : learnPoses(database_.corpus());
  });
  return poses_;
}

VisemePoses learnPoses(const Corpus& corpus) {
  constexpr std::size_t kTakesTell = 5000;  // how long takes are
  double frames = 1;
  const std::vector<TakeIndex> some = evenlySpreadTakes(corpus, kTakesTell);
  for (const TakeIndex index : some) {
    const CorpusTake& take = takeOf(corpus, index);
    frames += take.labels.duration() * take.motion.frame_rate_hz;
  }
  const double takes_at_once = kPoseFrames / frames * asReal(some.size());
  const auto most = static_cast<std::size_t>(std::clamp(takes_at_once, 1.0, asReal(kPoseTakes)));
  const std::size_t stride = std::max<std::size_t>(1, (takeCount(corpus) + most - 1) / most);
  std::vector<MotionClip> loaded;
  loaded.reserve(most);
  std::vector<PoseTake> takes;
  for (std::size_t i = 0; i < takeCount(corpus); i += stride) {
    const bool is_elsewhere = corpus.take_source != nullptr;
    if (is_elsewhere) loaded.push_back(corpus.take_source->load(TakeIndex(i)));
    const CorpusTake& take = takeOf(corpus, TakeIndex(i));
    takes.push_back({&take.labels, is_elsewhere ? &loaded.back() : &take.motion});
  }
  return fitVisemePoses(takes, corpus.neutral_pose_mm, corpus.layout, &genericPoses());
}

std::optional<VisemePoses> storedPoses(const Corpus& corpus) {
  if (corpus.viseme_poses.empty()) return std::nullopt;
  const std::string place = corpus.name + ".corpus";
  VisemePoses poses = parsePoses(corpus.viseme_poses, place);
  if (poses.marker_names != corpus.layout.markerNames())
    throw InputError(place, "viseme poses", "found other markers than the layout's; expected the same");
  poses.mouth = LipGauge(corpus.layout);
  return poses;
}

VocalStyle styleFor(const CurveOptions& options, const SpeechLabels& labels, const AudioTags& tags) {
  const bool sings = options.alone == CurveStyle::kSing;
  VocalStyle style;
  style.ma = signalFor(options.ma, sings, melodicAccents(labels, tags), labels, kUnknownAccent);
  style.ps = signalFor(options.ps, sings, pitchSensitivities(labels), labels, kSpokenSensitivity);
  if (options.ja.given) style.ja = *options.ja.given;
  if (options.li.given) style.li = *options.li.given;
  return style;
}

}  // namespace mouthpiece
