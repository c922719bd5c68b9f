#include "exports/shape_sets/shape_set.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>

#include "base/index.h"
#include "base/text_encoding.h"
#include "exports/arkit.h"
#include "motion/arkit_shapes.h"
#include "phonetics/language/phone.h"

namespace mouthpiece {
namespace {

/// "..._L" for "..._R" and the other way round; the name itself on the midline.
std::string mirrorMarker(std::string name) {
  if (name.ends_with("_L")) {
    name.back() = 'R';
  } else if (name.ends_with("_R")) {
    name.back() = 'L';
  }
  return name;
}

/// The number of the shape that does the same on the other side; its own where it does it on both.
std::size_t mirrorShape(std::size_t shape) {
  std::string name(kArkitNames[shape]);
  if (name.ends_with("Left")) {
    name.replace(name.size() - 4, 4, "Right");
  } else if (name.ends_with("Right")) {
    name.replace(name.size() - 5, 5, "Left");
  }
  return unsignedIndex(arkitIndex(name));
}

/// What ARKit's shape does to a marker, the mean of both sides; zero for a marker that no such head has shown.
class ArkitMoves {
 public:
  ArkitMoves() {
    const ArkitMarkerMoves& learnt = arkitMarkerMoves();
    for (std::size_t i = 0; i < learnt.markers.size(); ++i) rows_[learnt.markers[i]] = signedIndex(i);
  }
  [[nodiscard]] Eigen::RowVector3d of(std::size_t shape, const std::string& marker) const {
    const auto own = rows_.find(marker), other = rows_.find(mirrorMarker(marker));
    if (own == rows_.end() || other == rows_.end()) return Eigen::RowVector3d::Zero();
    const std::vector<MarkerPositions>& moves = arkitMarkerMoves().moves_mm;
    const Eigen::RowVector3d mirrored =
        moves[mirrorShape(shape)].row(other->second).cwiseProduct(Eigen::RowVector3d(-1, 1, 1));
    return 0.5 * (moves[shape].row(own->second) + mirrored);
  }

 private:
  std::map<std::string, Eigen::Index> rows_;
};

bool opensLips(std::string_view arkit) {
  constexpr std::array<std::string_view, 5> kOpen{"JawOpen", "MouthFunnel", "MouthLowerDown", "MouthUpperUp",
                                                  "TongueOut"};
  return std::any_of(kOpen.begin(), kOpen.end(), [&](std::string_view name) { return arkit.starts_with(name); });
}

/// Turns of the eyes: up and to the subject's left, degrees.
std::optional<std::pair<double, double>> gazeOf(std::string_view arkit, bool left_eye) {
  constexpr double kWhole = double{kWholeLook} * 180 / std::numbers::pi;
  if (!arkit.starts_with("EyeLook") || arkit.ends_with("Left") != left_eye) return std::nullopt;
  if (arkit.starts_with("EyeLookUp")) return std::pair(kWhole, 0.0);
  if (arkit.starts_with("EyeLookDown")) return std::pair(-kWhole, 0.0);
  const bool to_nose = arkit.starts_with("EyeLookIn");
  return std::pair(0.0, to_nose == left_eye ? -kWhole : kWhole);
}

/// The vertices of one eye, and the middle of the ball that they lie on.
struct Eyeball {
  std::vector<Eigen::Index> vertices;
  Eigen::RowVector3f middle = Eigen::RowVector3f::Zero();
};

Eyeball eyeballOf(const FaceMesh& mesh, bool is_left) {
  std::vector<bool> is_eye(mesh.vertexCount(), false);
  for (const Triangle& triangle : trianglesOf(mesh, {PartKind::kEye})) {
    for (const std::uint32_t vertex : triangle) is_eye[vertex] = true;
  }
  Eyeball eye;
  for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v) {
    if (is_eye[unsignedIndex(v)] && (mesh.vertices(v, 0) > 0) == is_left) eye.vertices.push_back(v);
  }
  if (eye.vertices.size() < 4) return {};
  // |p - m|^2 = r^2 is linear in m and r^2 - |m|^2.
  Eigen::MatrixX4d left(signedIndex(eye.vertices.size()), 4);
  Eigen::VectorXd right(left.rows());
  for (Eigen::Index i = 0; i < left.rows(); ++i) {
    const Eigen::RowVector3d place = mesh.vertices.row(eye.vertices[unsignedIndex(i)]).cast<double>();
    left.row(i) << 2 * place, 1;
    right(i) = place.squaredNorm();
  }
  const Eigen::Vector4d solution = left.colPivHouseholderQr().solve(right);
  eye.middle = solution.head<3>().transpose().cast<float>();
  return eye;
}

void turnEye(const FaceMesh& mesh, const Eyeball& eye, const std::pair<double, double>& degrees,
             VertexPositions& moves) {
  constexpr double kRadians = std::numbers::pi / 180;
  const Eigen::Matrix3f turn = (Eigen::AngleAxisd(degrees.second * kRadians, Eigen::Vector3d::UnitY()) *
                                Eigen::AngleAxisd(-degrees.first * kRadians, Eigen::Vector3d::UnitX()))
                                   .toRotationMatrix()
                                   .cast<float>();
  for (const Eigen::Index v : eye.vertices) {
    const Eigen::RowVector3f from_middle = mesh.vertices.row(v) - eye.middle;
    moves.row(v) = from_middle * turn.transpose() - from_middle;
  }
}

/// One viseme of Oculus and the class and phone that show it.
struct OculusRow {
  std::string_view name;
  Viseme viseme;
  Phone phone;
};
constexpr std::array<OculusRow, 14> kOculusRows{{{"PP", Viseme::kMBP, Phone::kP},
                                                 {"FF", Viseme::kFV, Phone::kF},
                                                 {"TH", Viseme::kTh, Phone::kTH},
                                                 {"DD", Viseme::kLNTD, Phone::kD},
                                                 {"kk", Viseme::kGK, Phone::kK},
                                                 {"CH", Viseme::kShChJ, Phone::kCH},
                                                 {"SS", Viseme::kS, Phone::kS},
                                                 {"nn", Viseme::kLNTD, Phone::kN},
                                                 {"RR", Viseme::kR, Phone::kR},
                                                 {"aa", Viseme::kAh, Phone::kAA},
                                                 {"E", Viseme::kEh, Phone::kEH},
                                                 {"ih", Viseme::kIh, Phone::kIH},
                                                 {"oh", Viseme::kOh, Phone::kAO},
                                                 {"ou", Viseme::kOo, Phone::kUW}}};
constexpr std::array<OculusRow, 5> kVrmRows{{{"aa", Viseme::kAh, Phone::kAA},
                                             {"ih", Viseme::kEe, Phone::kIY},
                                             {"ou", Viseme::kOo, Phone::kUW},
                                             {"ee", Viseme::kEh, Phone::kEH},
                                             {"oh", Viseme::kOh, Phone::kAO}}};

class ShapeSetMaker {
 public:
  ShapeSetMaker(const FaceRig& rig, const ActorPose& actor, const std::vector<std::string>& actor_markers,
                const std::map<std::string, double>& strengths)
      : rig_(rig), actor_(actor), strengths_(strengths) {
    set_.poses.frame_rate_hz = 60;
    set_.poses.marker_names = actor_markers;
  }

  void addArkit() {
    const Eyeball left = eyeballOf(rig_.mesh(), true), right = eyeballOf(rig_.mesh(), false);
    for (std::size_t k = 0; k < kArkitNames.size(); ++k) {
      const std::string_view name = kArkitNames[k];
      MarkerPositions moves = markersOf(k);
      if (name.starts_with("EyeLook")) keepLids(name, moves);
      LipPose lips;
      lips.seal = opensLips(name) ? 0.0F : 1.0F;
      TonguePose tongue;
      if (name == "TongueOut") tongue.tip_forward = 1;
      if (name == "MouthClose") {
        addMouthClose(k, moves);
        continue;
      }
      add(lowerCamel(name), moves, lips, tongue, false);
      VertexPositions& added = set_.moves.back();
      if (const auto gaze = gazeOf(name, true)) turnEye(rig_.mesh(), left, *gaze, added);
      if (const auto gaze = gazeOf(name, false)) turnEye(rig_.mesh(), right, *gaze, added);
    }
  }

  /// Lids follow eyes that look up and down; nothing else does, and nothing eyes that look aside.
  void keepLids(std::string_view look, MarkerPositions& moves) const {
    const bool is_upright = look.starts_with("EyeLookUp") || look.starts_with("EyeLookDown");
    for (std::size_t i = 0; i < set_.poses.marker_names.size(); ++i) {
      if (!is_upright || !set_.poses.marker_names[i].starts_with("LID_")) moves.row(signedIndex(i)).setZero();
    }
  }

  /// What a viseme of the capture looks like when it is fully reached.
  void addVisemes(std::span<const OculusRow> rows, const VisemePoses& poses) {
    for (const OculusRow& row : rows) {
      const Eigen::Index number = static_cast<Eigen::Index>(row.viseme);
      const Eigen::RowVectorXd all =
          poses.lips.row(number) + poses.jaw_drop[unsignedIndex(number)] * poses.jaw_direction;
      MarkerPositions moves = MarkerPositions::Zero(actor_.neutral_mm.rows(), 3);
      for (std::size_t i = 0; i < poses.marker_names.size(); ++i) {
        if (const auto marker = set_.poses.findMarker(poses.marker_names[i]))
          moves.row(marker->row()) = all.segment<3>(3 * signedIndex(i));
      }
      moves *= strengthOf(std::string(row.name));
      const PhoneRow& phone = rowOf(row.phone);
      LipPose lips;
      lips.seal = isBilabial(row.phone) ? 1.0F : 0.0F;
      lips.parting = isBilabial(row.phone) ? 0.0F : phone.lips_parting;
      lips.tuck = isLabiodental(row.phone) ? 1.0F : 0.0F;
      lips.rounding = asFloat(std::max(0.0, rowOf(row.viseme).round));
      add(std::string(row.name), moves, lips, {phone.tongue.tip_up, phone.tongue.tip_forward, phone.tongue.back_up},
          isBilabial(row.phone));
    }
  }

  void addLids() {
    const auto left = unsignedIndex(arkitIndex("EyeBlinkLeft")), right = unsignedIndex(arkitIndex("EyeBlinkRight"));
    add("blink", markersOf(left) + markersOf(right), {}, {}, false);
    add("blinkLeft", markersOf(left), {}, {}, false);
    add("blinkRight", markersOf(right), {}, {}, false);
  }

  ShapeSet take() && {
    set_.poses.positions_mm.resize(signedIndex(rows_.size()), 3 * actor_.neutral_mm.rows());
    for (std::size_t i = 0; i < rows_.size(); ++i) set_.poses.positions_mm.row(signedIndex(i)) = rows_[i];
    return std::move(set_);
  }

 private:
  static std::string lowerCamel(std::string_view name) {
    return lowerCase(name.substr(0, 1)) + std::string(name.substr(1));
  }

  [[nodiscard]] double strengthOf(const std::string& name) const {
    const auto found = strengths_.find(name);
    return found == strengths_.end() ? 1.0 : found->second;
  }

  [[nodiscard]] MarkerPositions markersOf(std::size_t shape) const {
    MarkerPositions moves(actor_.neutral_mm.rows(), 3);
    for (std::size_t i = 0; i < set_.poses.marker_names.size(); ++i)
      moves.row(signedIndex(i)) = arkit_.of(shape, set_.poses.marker_names[i]);
    return moves * strengthOf(lowerCamel(kArkitNames[shape]));
  }

  /// The mesh with its markers moved so far from neutral.
  VertexPositions posed(const MarkerPositions& moves, const LipPose& lips, const TonguePose& tongue) {
    MotionClip one;
    one.frame_rate_hz = 60;
    one.marker_names = set_.poses.marker_names;
    const MarkerPositions places = actor_.neutral_mm + moves;
    one.positions_mm = Eigen::Map<const Eigen::RowVectorXd>(places.data(), places.size());
    const FaceMotion motion = rig_.retarget(one, &actor_, std::span(&lips, 1));
    VertexPositions vertices;
    rig_.deform(motion.pose(FrameIndex{0}), tongue, vertices);
    return vertices;
  }

  void keep(std::string name, const MarkerPositions& moves, VertexPositions vertex_moves, const LipPose& lips,
            const TonguePose& tongue, bool closes) {
    set_.names.push_back(std::move(name));
    set_.moves.push_back(std::move(vertex_moves));
    set_.closes.push_back(closes);
    set_.lips.push_back(lips);
    set_.tongue.push_back(tongue);
    const MarkerPositions places = actor_.neutral_mm + moves;
    rows_.emplace_back(Eigen::Map<const Eigen::RowVectorXd>(places.data(), places.size()));
  }

  /// What the deformer does at rest (lips that it brings together, or parts) belongs to no shape, but to those that say
  /// how the lips lie.
  void add(std::string name, const MarkerPositions& moves, const LipPose& lips, const TonguePose& tongue, bool closes) {
    const VertexPositions pose = posed(moves, lips, tongue);
    const MarkerPositions still = MarkerPositions::Zero(moves.rows(), 3);
    LipPose resting;
    resting.seal = lips.seal;
    VertexPositions vertex_moves =
        closes ? VertexPositions(pose - rig_.mesh().vertices) : VertexPositions(pose - posed(still, resting, {}));
    quieten(vertex_moves);
    keep(std::move(name), moves, std::move(vertex_moves), lips, tongue, closes);
  }

  /// Apple's mouthClose takes back what jawOpen does to the lips.
  void addMouthClose(std::size_t shape, const MarkerPositions& moves) {
    const std::size_t jaw = unsignedIndex(arkitIndex("JawOpen"));
    const MarkerPositions open = markersOf(jaw);
    MarkerPositions shut = open + strengthOf("jawOpen") * moves;
    // The lips' outer edges are as far apart as at rest, where the mouth is closed.
    const auto upper = set_.poses.findMarker("LIP_UP_MID"), lower = set_.poses.findMarker("LIP_LO_MID");
    if (upper && lower) {
      const auto apartIn = [&](const MarkerPositions& places) {
        return places(upper->row(), 1) - places(lower->row(), 1);
      };
      const double apart = apartIn(shut);
      for (std::size_t i = 0; i < set_.poses.marker_names.size(); ++i) {
        const LipSide side = lipSideOf(set_.poses.marker_names[i]);
        const double share = middleShare(signedIndex(i));
        if (side == LipSide::kUpper) shut(signedIndex(i), 1) -= 0.5 * apart * share;
        if (side == LipSide::kLower) shut(signedIndex(i), 1) += 0.5 * apart * share;
      }
    }
    const LipPose sealed, parted{.seal = 0};
    VertexPositions vertex_moves = posed(shut, sealed, {}) - posed(open, parted, {});
    quieten(vertex_moves);
    keep(lowerCamel(kArkitNames[shape]), shut, std::move(vertex_moves), sealed, {}, true);
  }

  /// 1 in the middle of the lips, 0 at their corners.
  [[nodiscard]] double middleShare(Eigen::Index marker) const {
    const auto left = set_.poses.findMarker("LIP_CORNER_L"), right = set_.poses.findMarker("LIP_CORNER_R");
    if (!left || !right) return 1;
    const double half = 0.5 * (actor_.neutral_mm(left->row(), 0) - actor_.neutral_mm(right->row(), 0));
    const double middle = 0.5 * (actor_.neutral_mm(left->row(), 0) + actor_.neutral_mm(right->row(), 0));
    return std::clamp(1 - std::abs(actor_.neutral_mm(marker, 0) - middle) / std::max(half, 1e-6), 0.0, 1.0);
  }

  /// What nobody sees moves no vertex: files stay small.
  void quieten(VertexPositions& moves) const {
    constexpr double kUnseenMm = 0.01;
    const float unseen = asFloat(kUnseenMm / (1000 * rig_.mesh().metres_per_unit));
    for (Eigen::Index v = 0; v < moves.rows(); ++v) {
      if (moves.row(v).cwiseAbs().maxCoeff() < unseen) moves.row(v).setZero();
    }
  }

  const FaceRig& rig_;
  const ActorPose& actor_;
  const std::map<std::string, double>& strengths_;
  ArkitMoves arkit_;
  ShapeSet set_;
  std::vector<Eigen::RowVectorXd> rows_;
};

}  // namespace

ShapeSet makeShapeSet(const FaceRig& rig, const ActorPose& actor, const std::vector<std::string>& actor_markers,
                      const VisemePoses& poses, ShapeVocabulary vocabulary,
                      const std::map<std::string, double>& strengths) {
  ShapeSetMaker maker(rig, actor, actor_markers, strengths);
  if (vocabulary == ShapeVocabulary::kArkit) maker.addArkit();
  if (vocabulary == ShapeVocabulary::kOculus) maker.addVisemes(kOculusRows, poses);
  if (vocabulary == ShapeVocabulary::kVrm) {
    maker.addVisemes(kVrmRows, poses);
    maker.addLids();
  }
  return std::move(maker).take();
}

PrincipalShapes shapesWithoutMotion(const ShapeSet& set, const FaceMesh& mesh) {
  PrincipalShapes shapes;
  shapes.frame_rate_hz = 60;
  shapes.rest = Eigen::Map<const Eigen::RowVectorXf>(mesh.vertices.data(), mesh.vertices.size());
  shapes.shapes.resize(signedIndex(set.moves.size()), mesh.vertices.size());
  for (std::size_t k = 0; k < set.moves.size(); ++k)
    shapes.shapes.row(signedIndex(k)) = Eigen::Map<const Eigen::RowVectorXf>(set.moves[k].data(), set.moves[k].size());
  shapes.weights.resize(0, shapes.shapes.rows());
  return shapes;
}

}  // namespace mouthpiece
