#include "support/repeated_corpus.h"

#include <cmath>

namespace mouthpiece::samples {
namespace {

/// The original's takes in turn, each as long as its labels want it.
class RepeatedMotion : public TakeSource {
 public:
  RepeatedMotion(const Corpus& original, std::vector<double> paces) : original_(original), paces_(std::move(paces)) {}

  /// A slower take has the same frames at a lower frame rate.
  [[nodiscard]] MotionClip load(TakeIndex take) const override {
    MotionClip clip = original_.takes[take.value % original_.takes.size()].motion;
    clip.frame_rate_hz /= paces_[take.value / original_.takes.size()];
    return clip;
  }
  [[nodiscard]] AudioClip loadAudio(TakeIndex /*take*/) const override { return {}; }

 private:
  const Corpus& original_;
  std::vector<double> paces_;
};

}  // namespace

Corpus repeatedCorpus(const Corpus& original, std::size_t times) {
  Corpus corpus;
  corpus.name = original.name;
  corpus.layout = original.layout;
  corpus.neutral_pose_mm = original.neutral_pose_mm;
  corpus.trajectory_model = original.trajectory_model;
  corpus.lattice_weights = original.lattice_weights;
  corpus.sound_cut_weights = original.sound_cut_weights;
  corpus.motion_settings = original.motion_settings;
  corpus.viseme_poses = original.viseme_poses;
  std::vector<double> paces;
  for (std::size_t round = 0; round < times; ++round) {
    const double pace = 1 + 0.1 * std::sin(static_cast<double>(round));  // within 10 %: a speaker's own range
    paces.push_back(pace);
    for (const CorpusTake& take : original.takes) {
      CorpusTake& copy = corpus.takes.emplace_back();
      copy.name = take.name + "_" + std::to_string(round);
      copy.text = take.text;
      copy.labels = take.labels;
      for (LabelledPhone& phone : copy.labels.phones) {
        phone.span.start *= pace;
        phone.span.end *= pace;
      }
      copy.motion.frame_rate_hz = take.motion.frame_rate_hz / pace;
    }
  }
  corpus.take_source = std::make_shared<RepeatedMotion>(original, std::move(paces));
  return corpus;
}

}  // namespace mouthpiece::samples
