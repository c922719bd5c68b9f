#include "synthesis/curve_model.h"

#include <algorithm>

#include "vocal/lip_markers.h"

namespace mouthpiece {

bool CurveModel::isPossible() const {
  const LipMarkers markers = findLipMarkers(database_.corpus().layout.markerNames());
  return markers.has_lips && markers.has_chin;
}

const VisemePoses& CurveModel::poses() const {
  std::call_once(learnt_, [this] {
    const Corpus& corpus = database_.corpus();
    const std::size_t stride = (corpus.takes.size() + kPoseTakes - 1) / kPoseTakes;
    std::vector<PoseTake> takes;
    for (std::size_t i = 0; i < corpus.takes.size(); i += std::max<std::size_t>(1, stride))
      takes.push_back({&corpus.takes[i].labels, &database_.motionOf(TakeIndex(i))});
    poses_ = fitVisemePoses(takes, corpus.neutral_pose_mm, corpus.layout, &genericPoses());
  });
  return poses_;
}

}  // namespace mouthpiece
