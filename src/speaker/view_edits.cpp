// What the page needs to be an editor: other units, and what the curves move.
#include <algorithm>
#include <utility>

#include "base/index.h"
#include "base/matrix_solvers.h"
#include "deform/mesh/mesh_files.h"
#include "page_engine/line_package.h"
#include "speaker/speaker_data.h"
#include "units/selection/selection.h"
#include "vocal/viseme_poses.h"

namespace mouthpiece {
namespace {

constexpr std::size_t kMostOffers = 6;

std::vector<std::vector<UnitOffer>> offersFor(const UtteranceAnimation& animation, const UnitDatabase& database) {
  const TakeIndex nowhere(takeCount(database.corpus()));
  std::vector<SelectedUnit> units;
  for (const PlacedUnit& unit : animation.units) {
    const PhonePlace source{unit.take_index.value_or(nowhere), unit.source_first};
    units.push_back({unit.phones, source, 0, 0, false, {}});
  }
  std::vector<std::vector<UnitOffer>> offers;
  for (const std::vector<SelectedUnit>& others : otherUnits(animation.labels, database, units, kMostOffers)) {
    std::vector<UnitOffer>& own = offers.emplace_back();
    for (const SelectedUnit& other : others) {
      const CorpusTake& from = database.takeOf(other.source);
      own.push_back({other.phones, from.name, other.source.take,
                     from.labels.phones[other.source.phone.value].span.start, other.target_cost});
    }
  }
  return offers;
}

/// Displacements of the markers, a row a pose: each curve's lip part, then one mm of the jaw.
PositionMatrix posesOf(const VisemePoses& poses, std::vector<std::string>& names, std::vector<double>& jaw_drop) {
  PositionMatrix rows(signedIndex(kVisemeCount), poses.lips.cols());
  for (std::size_t v = 1; v < kVisemeCount; ++v) {
    names.emplace_back(visemeName(static_cast<Viseme>(v)));
    jaw_drop.push_back(poses.jaw_drop[v]);
    rows.row(signedIndex(v - 1)) = poses.lips.row(signedIndex(v));
  }
  rows.row(rows.rows() - 1) = poses.jaw_direction;
  return rows;
}

/// A few of `count` vertices tell enough: each so many'th of them, many times as many numbers as there are shapes.
std::size_t strideOver(std::size_t count) {
  constexpr std::size_t kEnough = 2000;
  return std::max<std::size_t>(1, count / kEnough);
}

/// Least squares: the shapes' weights that come nearest to each row of displacements, of each `stride`'th vertex.
RowMajorMatrixF weightsOf(const RowMajorMatrixF& moves, const PrincipalShapes& shapes, std::size_t stride) {
  constexpr double kRidge = 1e-4;
  Eigen::MatrixXd basis(shapes.shapeCount(), moves.cols());
  for (Eigen::Index i = 0; i < moves.cols() / 3; ++i)
    basis.middleCols<3>(3 * i) = shapes.shapes.middleCols<3>(3 * i * signedIndex(stride)).cast<double>();
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(basis.rows(), basis.rows());
  normal.selfadjointView<Eigen::Lower>().rankUpdate(basis);
  const Eigen::MatrixXd target = basis * moves.cast<double>().transpose();
  normal.diagonal().array() += kRidge * std::max(1e-12, normal.diagonal().maxCoeff());
  return solveSymmetric(std::move(normal), target).transpose().cast<float>();
}

}  // namespace

std::optional<ViewEdits> Performance::Data::viewEdits() const {
  const std::scoped_lock lock(mutex_);
  if (!corpus) return std::nullopt;
  ViewEdits made;
  made.edits = edits;
  made.offers = offersFor(animation, corpus->data().units);
  if (!corpus->data().curve_model.isPossible() || shapes().shapeCount() == 0) return made;

  CurvePoses& drawn = made.poses;
  const PositionMatrix rows = posesOf(corpus->data().curve_model.poses(), drawn.names, drawn.jaw_drop);
  const MarkerPositions& neutral = corpus->data().corpus.neutral_pose_mm;
  MotionClip clip;
  clip.frame_rate_hz = 60;
  clip.marker_names = corpus->data().corpus.layout.markerNames();
  clip.positions_mm = PositionMatrix::Zero(rows.rows() + 1, rows.cols());
  clip.positions_mm.topRows(rows.rows()) = rows;
  clip.positions_mm.rowwise() += Eigen::Map<const Eigen::RowVectorXd>(neutral.data(), neutral.size());
  const FaceRig& rig = needFace().rig();
  const FaceMotion posed = rig.retarget(clip, actor ? &*actor : nullptr);
  const std::vector<std::uint32_t> vertices = shapes().columnVertices();
  const std::size_t stride = strideOver(vertices.size());
  RowMajorMatrixF moves(rows.rows() + 1, 3 * signedIndex((vertices.size() + stride - 1) / stride));
  VertexPositions all;
  for (FrameIndex frame; frame.row() < moves.rows(); ++frame) {
    rig.deform(posed.pose(frame), TonguePose{}, all);
    for (Eigen::Index i = 0; i < moves.cols() / 3; ++i)
      moves.row(frame.row()).segment<3>(3 * i) = all.row(vertices[unsignedIndex(i) * stride]);
  }
  const Eigen::RowVectorXf at_rest = moves.row(moves.rows() - 1);
  moves.rowwise() -= at_rest;
  const RowMajorMatrixF weights = weightsOf(moves.topRows(rows.rows()), shapes(), stride);
  drawn.lips = weights.topRows(weights.rows() - 1);
  drawn.jaw = weights.row(weights.rows() - 1);
  return made;
}

std::string Performance::Data::packedLine(const ViewEdits& view) const {
  const std::scoped_lock lock(mutex_);
  if (!to_make_again || !corpus || !actor || !ownShapes().names.empty()) return {};
  SynthesisRequest request = *to_make_again;
  request.audio = animation.audio;
  std::vector<TakeIndex> takes;
  for (const std::vector<UnitOffer>& of_unit : view.offers) {
    for (const UnitOffer& offer : of_unit) takes.push_back(offer.take_index);
  }
  for (const PlacedUnit& unit : animation.units) {
    if (unit.take_index) takes.push_back(*unit.take_index);
  }
  const UnitDatabase& database = corpus->data().units;
  const SynthesisPlan plan = planLine(animation.labels, database, request.options);
  const SharedFace::Data& own = needFace();
  return packLine({request, plan, database, takes, own.file, own.rig().mesh(), *actor, shapes()});
}

}  // namespace mouthpiece
