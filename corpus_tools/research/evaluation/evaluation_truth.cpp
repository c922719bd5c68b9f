// readTruth of evaluation.h.
#include <fmt/format.h>

#include "base/errors.h"
#include "corpus_tools/research/evaluation/evaluation.h"
#include "motion/cleaning/rigid.h"
#include "motion/formats/motion_file.h"

namespace mouthpiece {
namespace {

/// Columns in the order of the corpus' layout.
MotionClip inLayoutOrder(const MotionClip& clip, const MarkerLayout& layout, const std::string& file) {
  MotionClip ordered{clip.frame_rate_hz, layout.markerNames(), {}};
  ordered.positions_mm.resize(clip.positions_mm.rows(), signedIndex(3 * layout.markers.size()));
  for (std::size_t marker = 0; marker < layout.markers.size(); ++marker) {
    const auto found = clip.findMarker(layout.markers[marker].name);
    if (!found) throw InputError(file, "", fmt::format("lacks the marker {}", layout.markers[marker].name));
    ordered.positions_mm.middleCols<3>(signedIndex(3 * marker)) =
        clip.positions_mm.middleCols<3>(signedIndex(3 * found->value));
  }
  return ordered;
}

/// All markers of all frames as rows.
MarkerPositions asPoints(const PositionMatrix& positions) {
  return Eigen::Map<const MarkerPositions>(positions.data(), positions.size() / 3, 3);
}

/// `truth` turned and moved onto the take, whose frame is the corpus' own.
MotionClip inFrameOf(const MotionClip& take, MotionClip truth, const std::string& file) {
  if (truth.frame_rate_hz != take.frame_rate_hz || truth.frameCount() != take.frameCount()) {
    throw InputError(file, "",
                     fmt::format("found {} frames at {:g} Hz; expected {} at {:g} Hz, as its take has",
                                 truth.frameCount(), truth.frame_rate_hz, take.frameCount(), take.frame_rate_hz));
  }
  const auto fit = fitRigidMotion(asPoints(truth.positions_mm), asPoints(take.positions_mm));
  if (!fit) throw InputError(file, "", "has no three markers that its take has, too");
  Eigen::Map<MarkerPositions> points(truth.positions_mm.data(), truth.positions_mm.size() / 3, 3);
  points = (points * fit->rotation.transpose()).rowwise() + fit->translation_mm.transpose();
  return truth;
}

}  // namespace

std::map<std::string, MotionClip> readTruth(const Corpus& corpus, const std::filesystem::path& folder) {
  std::map<std::string, MotionClip> truth;
  for (const CorpusTake& take : corpus.takes) {
    const std::filesystem::path file = folder / (take.name + ".c3d");
    truth[take.name] =
        inFrameOf(take.motion, inLayoutOrder(readMotion(file), corpus.layout, file.string()), file.string());
  }
  return truth;
}

}  // namespace mouthpiece
