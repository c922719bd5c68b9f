#include "page_engine/page_engine.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <optional>
#include <utility>

#include "base/errors.h"
#include "base/index.h"
#include "motion/resample.h"
#include "page_engine/line_package.h"
#include "synthesis/line_edits.h"

namespace mouthpiece {
namespace {

/// Least squares over the sampled vertices. The first shape is where the others start from: its weight stays 1.
class WeightFinder {
 public:
  explicit WeightFinder(const ShapeSample& sample) : shapes_(sample.shapes.cast<double>()) {
    if (shapes_.rows() < 2) return;
    constexpr double kRidge = 1e-9;
    const auto free = shapes_.bottomRows(shapes_.rows() - 1);
    Eigen::MatrixXd normal = free * free.transpose();
    normal.diagonal().array() += kRidge * normal.diagonal().maxCoeff();
    solver_.compute(normal);
  }
  /// `moves`: 1 x (3 * sampled vertices), from rest.
  [[nodiscard]] Eigen::RowVectorXf of(const Eigen::RowVectorXd& moves) const {
    Eigen::RowVectorXf weights = Eigen::RowVectorXf::Ones(shapes_.rows());
    if (shapes_.rows() < 2) return weights;
    const auto free = shapes_.bottomRows(shapes_.rows() - 1);
    const Eigen::VectorXd target = free * (moves - shapes_.row(0)).transpose();
    weights.tail(weights.size() - 1) = solver_.solve(target).transpose().cast<float>();
    return weights;
  }

 private:
  Eigen::MatrixXd shapes_;
  Eigen::LDLT<Eigen::MatrixXd> solver_;
};

struct MadeLine {
  UtteranceAnimation animation;
  FaceMotion motion;
  std::vector<double> larynx;
  FrameMaker frames;
  RowMajorMatrixF weights, markers;
  std::string warnings;
};

}  // namespace

struct PageEngine::Data {
  explicit Data(LinePackage given)
      : package(std::move(given)),
        units(package.corpus),
        curve_model(units),
        rig(FaceRig::of(std::move(package.face), std::move(package.mesh), "the page")),
        finder(package.sample) {
    package.request.options.curves.model = &curve_model;
  }

  LinePackage package;  ///< without face and mesh
  UnitDatabase units;
  CurveModel curve_model;
  FaceRig rig;
  WeightFinder finder;
  std::unique_ptr<MadeLine> made;
  std::vector<float> vertices;

  void findWeights(MadeLine& line) const;
};

void PageEngine::Data::findWeights(MadeLine& line) const {
  const VertexPositions& rest = rig.restVertices();
  std::vector<Eigen::Index> columns(package.sample.vertices.size(), -1);
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const auto& moving = line.frames.vertices;
    const auto found = std::lower_bound(moving.begin(), moving.end(), package.sample.vertices[i]);
    if (found != moving.end() && *found == package.sample.vertices[i]) columns[i] = 3 * (found - moving.begin());
  }
  line.weights.resize(line.frames.frame_count, package.sample.shapes.rows());
  std::vector<float> frame(unsignedIndex(line.frames.width));
  Eigen::RowVectorXd moves = Eigen::RowVectorXd::Zero(package.sample.shapes.cols());
  for (Eigen::Index row = 0; row < line.frames.frame_count; ++row) {
    line.frames.make(row, frame);
    for (std::size_t i = 0; i < columns.size(); ++i) {
      if (columns[i] < 0) continue;
      const Eigen::RowVector3f at = Eigen::Map<const Eigen::RowVector3f>(frame.data() + columns[i]);
      moves.segment<3>(3 * signedIndex(i)) =
          (at - rest.row(signedIndex(std::size_t{package.sample.vertices[i]}))).cast<double>();
    }
    line.weights.row(row) = finder.of(moves);
  }
}

PageEngine::PageEngine(std::string_view package)
    : data_(std::make_unique<Data>(parseLinePackage(package, "the page"))) {}
PageEngine::~PageEngine() = default;

void PageEngine::render(std::string_view edits_json) {
  LineEdits edits = parseLineEdits(edits_json, "edits");
  std::vector<std::string> warnings;
  SynthesisRequest request = data_->package.request;
  request.labels = withBorders(std::move(request.labels), edits.borders, warnings);
  const SynthesisPlan plan = withUnits(data_->package.plan, request.labels, data_->units, edits.units, warnings);
  request.options.edits = std::move(edits);

  auto line = std::make_unique<MadeLine>();
  line->animation = renderPlan(plan, request, data_->units);
  const UtteranceAnimation& animation = line->animation;
  warnings.insert(warnings.end(), animation.warnings.begin(), animation.warnings.end());
  for (const std::string& warning : warnings) line->warnings += warning + '\n';
  line->motion = data_->rig.retarget(animation.motion, &data_->package.actor, animation.lips, animation.gaze);
  const double rate = animation.motion.frame_rate_hz;
  if (const AnimationCurve* curve = findCurve(animation.curves, "larynx"))
    line->larynx = sampleCurve(*curve, frameTimes(0, animation.motion.frameCount(), rate));
  line->frames = data_->rig.movingFrames(line->motion, animation.tongue, rate, line->larynx, animation.gaze);
  const double metres = data_->rig.metresPerUnit();
  line->markers = (line->motion.markers() * metres).cast<float>();
  data_->findWeights(*line);
  data_->made = std::move(line);
}

std::size_t PageEngine::frameCount() const { return unsignedIndex(data_->made->frames.frame_count); }
const RowMajorMatrixF& PageEngine::weights() const { return data_->made->weights; }
const RowMajorMatrixF& PageEngine::markers() const { return data_->made->markers; }
const std::string& PageEngine::warnings() const { return data_->made->warnings; }

const std::vector<float>& PageEngine::vertices(std::size_t frame) {
  const FrameMaker& frames = data_->made->frames;
  MOUTHPIECE_EXPECT(frame < frameCount());
  std::vector<float> moving(unsignedIndex(frames.width));
  frames.make(signedIndex(frame), moving);
  const VertexPositions& rest = data_->rig.restVertices();
  data_->vertices.assign(rest.data(), rest.data() + rest.size());
  for (std::size_t i = 0; i < frames.vertices.size(); ++i)
    std::copy_n(moving.begin() + signedIndex(3 * i), 3,
                data_->vertices.begin() + signedIndex(3 * std::size_t{frames.vertices[i]}));
  return data_->vertices;
}

}  // namespace mouthpiece
