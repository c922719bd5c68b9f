// contextMean of unit_database.h.
#include <algorithm>
#include <cmath>

#include "units/prediction/phone_shapes.h"
#include "units/selection/unit_database.h"

namespace mouthpiece {
namespace {

constexpr float kLikeMm2 = 0.3F;
constexpr float kHeldBack = 1.0F;
constexpr std::size_t kMostPlaces = 500;  ///< of a pair; more say no more

class Mean {
 public:
  Mean(const UnitDatabase& database, Eigen::Index columns)
      : database_(database), sum_(Eigen::RowVectorXf::Zero(columns)) {}

  void add(const PhonePlace& place, const Eigen::RowVectorXf& line) {
    const PhoneShape shape = database_.shapeOf(place);
    const float distance = (shape.predicted() - line).squaredNorm() / static_cast<float>(PhoneShapes::kPoints);
    const float weight = std::exp(-distance / kLikeMm2);
    constexpr float kNothing = 1e-4F;
    if (weight < kNothing || !shape.captured().allFinite()) return;
    sum_ += weight * (shape.captured() - shape.predicted());
    weight_ += weight;
  }
  [[nodiscard]] Eigen::RowVectorXf value() const { return sum_ / (weight_ + kHeldBack); }

 private:
  const UnitDatabase& database_;
  Eigen::RowVectorXf sum_;
  float weight_ = 0;
};

}  // namespace

Eigen::MatrixXd contextMean(const SpeechLabels& target, const UnitDatabase& database,
                            const PhoneShapes::Matrix& predicted) {
  const Eigen::Index components = shapeComponents(*database.corpus().trajectory_model);
  Eigen::MatrixXd means(predicted.rows() * PhoneShapes::kPoints, components);
  for (std::size_t phone = 0; phone < target.phones.size(); ++phone) {
    const auto row = signedIndex(phone);
    Mean mean(database, predicted.cols());
    for (const std::size_t side : {0U, 1U}) {  // the pair that it begins, the pair that it ends
      if (phone < side || phone + 1 - side >= target.phones.size()) continue;
      const std::size_t first = phone - side;
      for (const PhonePlace& place :
           database.diphones(target.phones[first].phone, target.phones[first + 1].phone, kMostPlaces))
        mean.add(advance(place, side), predicted.row(row));
    }
    const Eigen::RowVectorXf value = mean.value();
    for (Eigen::Index point = 0; point < PhoneShapes::kPoints; ++point) {
      means.row(row * PhoneShapes::kPoints + point) = value.segment(point * components, components).cast<double>();
    }
  }
  return means;
}

}  // namespace mouthpiece
