// MovementParts and sharesOf of stages.h.
#include <algorithm>
#include <array>
#include <cmath>

#include "base/index.h"
#include "synthesis/stages.h"

namespace mouthpiece {
namespace {

double varianceOf(const PositionMatrix& rows) {
  return (rows.rowwise() - rows.colwise().mean()).squaredNorm() / asReal(std::max<Eigen::Index>(1, rows.rows()));
}

}  // namespace

MovementParts MovementParts::none(Eigen::Index frames, Eigen::Index columns) {
  const PositionMatrix nothing = PositionMatrix::Zero(frames, columns);
  return {nothing, nothing, nothing};
}

void MovementParts::lay(std::size_t first, const MovementParts& other) {
  const auto row = signedIndex(first);
  predicted_mm.middleRows(row, other.predicted_mm.rows()) = other.predicted_mm;
  captured_mm.middleRows(row, other.captured_mm.rows()) = other.captured_mm;
  contact_mm.middleRows(row, other.contact_mm.rows()) = other.contact_mm;
}

void MovementParts::scaleFrame(std::size_t frame, double share) {
  for (PositionMatrix* part : {&predicted_mm, &captured_mm, &contact_mm}) part->row(signedIndex(frame)) *= share;
}

std::vector<MovementShares> sharesOf(const StretchMotion& whole, const LineToRender& line) {
  const std::vector<Eigen::Index>& columns = line.database.lipColumns();
  const MovementParts& parts = whole.parts;
  PositionMatrix drawn(whole.positions_mm.rows(), std::ssize(columns));
  for (std::size_t i = 0; i < columns.size(); ++i)
    drawn.col(signedIndex(i)) = whole.positions_mm.col(columns[i]).array() - line.rest()(columns[i]);
  drawn -= parts.predicted_mm + parts.captured_mm + parts.contact_mm;

  const auto a_second = static_cast<Eigen::Index>(std::max(1.0, std::round(line.options.frame_rate_hz)));
  std::vector<MovementShares> shares;
  for (Eigen::Index first = 0; first < drawn.rows(); first += a_second) {
    const Eigen::Index count = std::min(a_second, drawn.rows() - first);
    const auto varianceIn = [&](const PositionMatrix& part) { return varianceOf(part.middleRows(first, count)); };
    constexpr double kStill = 1e-6;  // mm2, summed over columns: nothing is seen to move
    MovementShares second{line.times[unsignedIndex(first)], varianceIn(parts.captured_mm),
                          varianceIn(parts.predicted_mm), varianceIn(drawn), varianceIn(parts.contact_mm)};
    const double sum = second.capture + second.prediction + second.curves + second.contact;
    second.movement_mm = std::sqrt(sum / asReal(std::max<Eigen::Index>(1, drawn.cols() / 3)));
    for (double* share : {&second.capture, &second.prediction, &second.curves, &second.contact})
      *share = sum > kStill ? *share / sum : 0;
    shares.push_back(second);
  }
  return shares;
}

}  // namespace mouthpiece
