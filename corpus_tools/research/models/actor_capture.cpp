#include "corpus_tools/research/models/actor_fit.h"
#include "corpus_tools/takes/head_tracking.h"
#include "corpus_tools/takes/neutral_pose.h"
#include "corpus_tools/takes/pose_fit.h"
#include "corpus_tools/takes/take_files.h"

namespace mouthpiece {

ActorCapture readActorCapture(const std::filesystem::path& folder, std::size_t stride) {
  ActorCapture capture{defaultLayout(), {}, {}};
  std::vector<RawTake> raw;
  const std::vector<TakeFiles> files = findTakes(folder).takes;
  for (std::size_t i = 0; i < files.size(); i += stride) raw.push_back(readTake(files[i], capture.layout, Lexicon()));

  const HeadReference reference = estimateHeadReference(raw, capture.layout);
  for (const RawTake& take : raw) {
    const HeadTrack track = trackHead(take, reference, capture.layout);
    capture.takes.push_back({take.name, take.text, take.labels, withoutHeadMotion(take.face, track), {}});
  }
  capture.neutral_mm = neutralPose(capture.takes, capture.layout).pose_mm;
  const RigidMotion face_from_head = faceFromHead(capture.neutral_mm, capture.layout);
  transform(capture.neutral_mm, face_from_head);
  for (CorpusTake& take : capture.takes) transform(take.motion, face_from_head);
  return capture;
}

}  // namespace mouthpiece
