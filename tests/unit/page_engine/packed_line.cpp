#include "packed_line.h"

#include <algorithm>

#include "motion/marker_layout.h"
#include "page_engine/line_package.h"
#include "support/tiny_corpus.h"
#include "synthesis/curve_model.h"
#include "tests/unit/deform/sample_face.h"

namespace mouthpiece::samples {
namespace {

bool isLowLip(const std::string& name) { return name.starts_with("LIP_LO") || name.starts_with("CHIN"); }

/// The face's markers, of which lower lip and chin fall as far as the lips of tinyTake() part.
CorpusTake movingTake(const std::string& name, std::string_view words, const SampleFace& face) {
  CorpusTake take = tinyTake(name, words, 1, 12);
  const std::vector<double> opening = lipOpening(take.motion);
  const Eigen::Map<const Eigen::RowVectorXd> rest(face.rest.data(), face.rest.size());
  take.motion.marker_names = face.names;
  take.motion.positions_mm = rest.replicate(std::ssize(opening), 1);
  for (std::size_t marker = 0; marker < face.names.size(); ++marker) {
    if (!isLowLip(face.names[marker])) continue;
    for (std::size_t frame = 0; frame < opening.size(); ++frame)
      take.motion.positions_mm(static_cast<Eigen::Index>(frame), static_cast<Eigen::Index>(3 * marker + 1)) -=
          opening[frame];
  }
  return take;
}

/// One component: lower lip and chin.
std::shared_ptr<const TrajectoryModel> openingModel(const std::vector<std::string>& names) {
  auto model = std::make_shared<TrajectoryModel>();
  const auto columns = static_cast<Eigen::Index>(3 * names.size());
  model->analysis = Eigen::MatrixXd::Zero(columns, 1);
  model->shapes = Eigen::MatrixXd::Zero(1, columns);
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto y = static_cast<Eigen::Index>(3 * i + 1);
    if (names[i] == "LIP_LO_MID") model->analysis(y, 0) = -1;
    if (isLowLip(names[i])) model->shapes(0, y) = -1;
  }
  model->dynamics = {{0.02, 0}};
  model->level = Eigen::RowVectorXd::Constant(1, 4);
  model->closing = model->shapes.row(0);
  model->closed_opening_mm = 20;
  model->targets["viseme MBP"] = Eigen::VectorXd::Constant(1, -4);
  model->targets["viseme Ah"] = Eigen::VectorXd::Constant(1, 6);
  return model;
}

Corpus movingCorpus(const SampleFace& face) {
  Corpus corpus;
  corpus.name = "moving";
  const MarkerLayout usual = defaultLayout();
  corpus.layout.name = "moving";
  for (const std::string& name : face.names) {
    LayoutMarker marker = usual.markers[usual.indexOf(name).value];
    const auto partner = std::find(face.names.begin(), face.names.end(), usual.markers[marker.mirror.value].name);
    marker.mirror = MarkerIndex(static_cast<std::size_t>(partner - face.names.begin()));
    corpus.layout.markers.push_back(marker);
  }
  corpus.neutral_pose_mm = face.rest;
  corpus.takes = {movingTake("a", "DH-AH T-AY-M", face), movingTake("b", "AH M-AE-N", face),
                  movingTake("c", "N-AW AY", face)};
  corpus.trajectory_model = openingModel(face.names);
  return corpus;
}

std::string packed() {
  SampleFace face = makeSampleFace(20);
  FaceFile file;
  file.name = "egg";
  file.mesh_file = "egg.obj";
  file.marker_names = face.names;
  file.marker_targets = file.actor_neutral_mm = face.rest;
  file.warp.shape_factor = 1;
  file.control = buildControlMesh(face.names, face.rest, face.known, &face.mesh);
  file.binding = bindFace(face.mesh, file.control);
  const Corpus corpus = movingCorpus(face);
  const UnitDatabase database(corpus);
  const CurveModel curves(database);
  SynthesisRequest request;
  request.text = "a man now";
  request.labels = tinyLabels("AH M-AE-N N-AW", 5);
  request.audio = {8000, std::vector<float>(static_cast<std::size_t>(8000 * request.labels.duration()))};
  request.options.frame_rate_hz = 25;
  request.options.curves.fill_gaps = true;
  request.options.curves.model = &curves;
  const SynthesisPlan plan = planLine(request.labels, database, request.options);
  // Two shapes of a few vertices do: what the weights mean is the page's tests' matter.
  PrincipalShapes shapes;
  for (std::uint32_t vertex = 0; vertex < 20; ++vertex) shapes.vertices.push_back(vertex);
  shapes.shapes = RowMajorMatrixF::Random(2, 60);
  const ActorPose actor{corpus.neutral_pose_mm, 20, {}};
  return packLine({request, plan, database, {}, file, face.mesh, actor, shapes});
}

}  // namespace

const std::string& packedLine() {
  static const std::string bytes = packed();
  return bytes;
}

}  // namespace mouthpiece::samples
