#include "support/tiny_model.h"

namespace mouthpiece::samples {

std::shared_ptr<const TrajectoryModel> tinyModel(const Corpus& corpus) {
  auto model = std::make_shared<TrajectoryModel>();
  const auto columns = static_cast<Eigen::Index>(3 * corpus.layout.markers.size());
  const auto y = [&](const char* marker) {
    return 3 * static_cast<Eigen::Index>(corpus.layout.indexOf(marker).value) + 1;
  };
  model->analysis = Eigen::MatrixXd::Zero(columns, 2);
  model->analysis(y("LIP_UP_MID"), 0) = 1;
  model->analysis(y("LIP_LO_MID"), 0) = -1;
  model->analysis(y("CHIN"), 1) = 1;
  model->shapes = Eigen::MatrixXd::Zero(2, columns);
  model->shapes(0, y("LIP_UP_MID")) = 0.5;
  model->shapes(0, y("LIP_LO_MID")) = -0.5;
  model->shapes(1, y("CHIN")) = 1;
  model->dynamics = {{0.02, 0}, {0.03, 0.01}};
  model->level = Eigen::RowVector2d(4, -1);
  model->closing = model->shapes.row(0);
  model->closed_opening_mm = 0.5;
  for (const char* vowel : {"Ah", "Eh", "Ee", "Ih", "Oh", "Oo", "Uh"})
    model->targets[std::string("viseme ") + vowel] = Eigen::Vector2d(5, -3);
  model->targets["viseme MBP"] = Eigen::Vector2d(-4, 1);
  model->targets["length viseme Ah"] = Eigen::Vector2d(1, 0);
  return model;
}

}  // namespace mouthpiece::samples
