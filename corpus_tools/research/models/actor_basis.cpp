#include "corpus_tools/research/models/actor_fit.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/errors.h"
#include "base/matrix_solvers.h"
#include "motion/lip_gauge.h"

namespace mouthpiece {
namespace {

constexpr Seconds kRestMargin = 0.3;   ///< silence this far from speech may be rest
constexpr double kClosedShare = 0.15;  ///< of a take's range of openings, above its closed end
constexpr std::size_t kLeastRestFrames = 3;

Eigen::Index column(const MarkerLayout& layout, std::string_view marker, Eigen::Index axis) {
  return 3 * signedIndex(layout.indexOf(marker).value) + axis;
}

double quantile(std::vector<double> values, double share) {
  MOUTHPIECE_EXPECT(!values.empty());
  const auto at = static_cast<std::size_t>(share * asReal(values.size() - 1) + 0.5);
  std::nth_element(values.begin(), values.begin() + signedIndex(at), values.end());
  return values[at];
}

/// How much a marker counts in the components: what speech moves, and not the outline of the face or the brows.
double speechWeight(const LayoutMarker& marker) {
  if (marker.region == "lip") return 2;
  if (marker.region == "chin" || marker.region == "cheek" || marker.region == "nose") return 1;
  if (marker.region == "jaw") return 0.4;
  return 0;
}

/// What moves with speech there is head motion left over, blinks and the tracker's face model: not speech.
bool movesWithoutSpeech(const LayoutMarker& marker) {
  return marker.region == "forehead" || marker.region == "temple" || marker.region == "brow" ||
         marker.region == "lid" || marker.region == "canthus";
}

bool inSilence(const SpeechLabels& labels, Seconds time, Seconds margin) {
  return std::any_of(labels.phones.begin(), labels.phones.end(), [&](const LabelledPhone& phone) {
    return phone.phone == Phone::kSil && phone.span.start + (phone.span.start > 0 ? margin : 0) <= time &&
           time < phone.span.end - (phone.span.end < labels.duration() ? margin : 0);
  });
}

/// The median of the closed-mouth frames in silence; of all frames when there are too few.
Eigen::RowVectorXd takeNeutral(const CorpusTake& take, const MarkerLayout& layout, const Eigen::VectorXd& seen) {
  const PositionMatrix& positions = take.motion.positions_mm;
  const Eigen::VectorXd opening = LipGauge::whole(layout).verticalOpenings(positions);
  std::vector<double> openings;
  for (Eigen::Index frame = 0; frame < opening.size(); ++frame) {
    if (seen(frame) > 0) openings.push_back(opening(frame));
  }
  if (openings.size() < 10) throw InputError(take.name, "", "found too few complete frames; expected at least 10");
  const double closed = quantile(openings, 0.02), open = quantile(openings, 0.98);
  std::vector<Eigen::Index> rest, all;
  for (Eigen::Index frame = 0; frame < opening.size(); ++frame) {
    if (!(seen(frame) > 0)) continue;
    all.push_back(frame);
    const Seconds time = take.motion.timeOf(FrameIndex(unsignedIndex(frame)));
    if (inSilence(take.labels, time, kRestMargin) && opening(frame) < closed + kClosedShare * (open - closed)) {
      rest.push_back(frame);
    }
  }
  const std::vector<Eigen::Index>& frames = rest.size() >= kLeastRestFrames ? rest : all;
  Eigen::RowVectorXd neutral(positions.cols());
  for (Eigen::Index c = 0; c < positions.cols(); ++c) {
    std::vector<double> values;
    for (const Eigen::Index frame : frames) values.push_back(positions(frame, c));
    neutral(c) = quantile(values, 0.5);
  }
  return neutral;
}

/// Sum over the frames that count of row' * row of f(take, frame).
template <typename RowOf>
Eigen::MatrixXd scatter(const std::vector<ActorDisplacements>& takes, Eigen::Index columns, RowOf row_of) {
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(columns, columns);
  for (std::size_t take = 0; take < takes.size(); ++take) {
    Eigen::MatrixXd rows(takes[take].mm.rows(), columns);
    for (Eigen::Index frame = 0; frame < rows.rows(); ++frame) {
      rows.row(frame) = takes[take].seen(frame) > 0 ? row_of(take, frame) : Eigen::RowVectorXd::Zero(columns);
    }
    rows.rowwise() -= rows.colwise().sum() / std::max(1.0, takes[take].seen.sum());
    for (Eigen::Index frame = 0; frame < rows.rows(); ++frame) rows.row(frame) *= takes[take].seen(frame);
    sum += rows.transpose() * rows;
  }
  return sum;
}

}  // namespace

std::vector<ActorDisplacements> actorDisplacements(const ActorCapture& capture) {
  std::vector<ActorDisplacements> takes;
  for (const CorpusTake& take : capture.takes) {
    const auto frames = signedIndex(take.motion.frameCount());
    ActorDisplacements displacements{take.motion.positions_mm, Eigen::VectorXd(frames), Eigen::VectorXd(frames)};
    for (Eigen::Index frame = 0; frame < frames; ++frame) {
      const Seconds time = take.motion.timeOf(FrameIndex(unsignedIndex(frame)));
      displacements.seen(frame) = displacements.mm.row(frame).allFinite() ? 1 : 0;
      const bool speaking = time < take.labels.duration() && !inSilence(take.labels, time, 0);
      displacements.speech(frame) = speaking ? displacements.seen(frame) : 0;
    }
    displacements.mm.rowwise() -= takeNeutral(take, capture.layout, displacements.seen);
    for (Eigen::Index frame = 0; frame < frames; ++frame) {
      if (!(displacements.seen(frame) > 0)) displacements.mm.row(frame).setZero();
    }
    takes.push_back(std::move(displacements));
  }
  return takes;
}

Eigen::MatrixXd symmetrized(const Eigen::MatrixXd& rows, const MarkerLayout& layout) {
  Eigen::MatrixXd mirrored(rows.rows(), rows.cols());
  for (std::size_t marker = 0; marker < layout.markers.size(); ++marker) {
    const auto to = signedIndex(3 * marker);
    const auto from = signedIndex(3 * layout.markers[marker].mirror.value);
    mirrored.middleCols(to, 3) = rows.middleCols(from, 3);
    mirrored.col(to) *= -1;
  }
  return 0.5 * (rows + mirrored);
}

ActorBasis actorBasis(const std::vector<ActorDisplacements>& takes, const MarkerLayout& layout,
                      Eigen::Index components) {
  const auto columns = signedIndex(3 * layout.markers.size());
  Eigen::RowVectorXd weights(columns);
  for (std::size_t marker = 0; marker < layout.markers.size(); ++marker) {
    weights.segment(signedIndex(3 * marker), 3).setConstant(speechWeight(layout.markers[marker]));
  }
  std::vector<Eigen::MatrixXd> symmetric;
  for (const ActorDisplacements& take : takes) symmetric.push_back(symmetrized(take.mm, layout));
  const Eigen::MatrixXd covariance = scatter(takes, columns, [&](std::size_t take, Eigen::Index frame) {
    return Eigen::RowVectorXd(symmetric[take].row(frame).cwiseProduct(weights));
  });
  const Eigen::MatrixXd directions = symmetricEigen(covariance).vectors.rightCols(components).rowwise().reverse();

  ActorBasis basis;
  Eigen::MatrixXd in_speech = Eigen::VectorXd::Zero(components);
  double frames = 0;
  for (std::size_t take = 0; take < takes.size(); ++take) {
    basis.trajectories.push_back(takes[take].mm * weights.asDiagonal() * directions);
    const double count = takes[take].speech.sum();
    if (count < 2) continue;
    const Eigen::MatrixXd& rows = basis.trajectories.back();
    const Eigen::RowVectorXd mean = takes[take].speech.transpose() * rows / count;
    for (Eigen::Index frame = 0; frame < rows.rows(); ++frame) {
      in_speech += takes[take].speech(frame) * (rows.row(frame) - mean).transpose().cwiseAbs2();
    }
    frames += count - 1;
  }
  const Eigen::VectorXd deviation = (in_speech / std::max(1.0, frames)).cwiseSqrt().cwiseMax(1e-9);
  for (Eigen::MatrixXd& rows : basis.trajectories) rows = (rows * deviation.cwiseInverse().asDiagonal()).eval();

  // All speaking markers move with the components as far as they did in the capture.
  const Eigen::MatrixXd own = scatter(takes, components, [&](std::size_t take, Eigen::Index frame) {
    return Eigen::RowVectorXd(basis.trajectories[take].row(frame));
  });
  const Eigen::MatrixXd both = scatter(takes, components + columns, [&](std::size_t take, Eigen::Index frame) {
    Eigen::RowVectorXd row(components + columns);
    row << basis.trajectories[take].row(frame), symmetric[take].row(frame);
    return row;
  });
  basis.shapes = solveSymmetric(own, both.topRightCorner(components, columns));
  for (std::size_t marker = 0; marker < layout.markers.size(); ++marker) {
    if (movesWithoutSpeech(layout.markers[marker])) {
      basis.shapes.middleCols(signedIndex(3 * marker), 3).setZero();
    }
  }
  // Pointing so that the lips open.
  const Eigen::VectorXd opening = LipGauge::whole(layout).verticalOpenings(basis.shapes);
  for (Eigen::Index i = 0; i < components; ++i) {
    if (opening(i) >= 0) continue;
    basis.shapes.row(i) *= -1;
    for (Eigen::MatrixXd& rows : basis.trajectories) rows.col(i) *= -1;
  }
  return basis;
}

Eigen::RowVectorXd blinkShape(const std::vector<ActorDisplacements>& takes, const MarkerLayout& layout) {
  const auto columns = signedIndex(3 * layout.markers.size());
  Eigen::RowVectorXd shape = Eigen::RowVectorXd::Zero(columns);
  double squares = 0;
  std::vector<double> drops;
  for (const ActorDisplacements& take : takes) {
    const Eigen::VectorXd gap =
        0.5 * (take.mm.col(column(layout, "LID_UP_R", 1)) + take.mm.col(column(layout, "LID_UP_L", 1)) -
               take.mm.col(column(layout, "LID_LO_R", 1)) - take.mm.col(column(layout, "LID_LO_L", 1)));
    const double open = quantile({gap.data(), gap.data() + gap.size()}, 0.75);
    const Eigen::MatrixXd rows = symmetrized(take.mm, layout);
    for (Eigen::Index frame = 0; frame < gap.size(); ++frame) {
      const double drop = open - gap(frame);
      if (!(take.seen(frame) > 0)) continue;
      drops.push_back(drop);
      if (drop < 2) continue;  // mm; less is tracker noise and looking down
      shape += drop * rows.row(frame);
      squares += drop * drop;
    }
  }
  const double shut_mm = quantile(drops, 0.995);
  shape *= shut_mm / std::max(squares, 1e-9);
  for (std::size_t marker = 0; marker < layout.markers.size(); ++marker) {
    if (layout.markers[marker].region != "lid") shape.segment(signedIndex(3 * marker), 3).setZero();
  }
  return shape;
}

Eigen::RowVectorXd browShape(const std::vector<ActorDisplacements>& takes, const MarkerLayout& layout) {
  const auto columns = signedIndex(3 * layout.markers.size());
  Eigen::RowVectorXd brows = Eigen::RowVectorXd::Zero(columns);
  for (std::size_t marker = 0; marker < layout.markers.size(); ++marker) {
    if (layout.markers[marker].region == "brow") brows.segment(signedIndex(3 * marker), 3).setOnes();
  }
  double frames = 0;
  for (const ActorDisplacements& take : takes) frames += take.seen.sum();
  const Eigen::MatrixXd covariance = scatter(takes, columns, [&](std::size_t take, Eigen::Index frame) {
    return Eigen::RowVectorXd(symmetrized(takes[take].mm.row(frame), layout).cwiseProduct(brows));
  });
  const SymmetricEigen eigen = symmetricEigen(covariance);
  Eigen::RowVectorXd shape = eigen.vectors.rightCols(1).transpose() *
                             std::sqrt(std::max(0.0, eigen.values(columns - 1)) / std::max(frames, 1.0));
  if (shape(column(layout, "BROW_MID_R", 1)) < 0) shape *= -1;
  return shape;
}

}  // namespace mouthpiece
