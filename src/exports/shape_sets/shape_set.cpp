#include "exports/shape_sets/shape_set.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

#include "base/index.h"
#include "base/text_encoding.h"
#include "exports/shape_sets/shape_parts.h"
#include "motion/arkit_shapes.h"
#include "motion/lip_pose.h"
#include "motion/motion_clip.h"
#include "motion/tongue_pose.h"
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

/// Who moves the head: a rig fitted to this actor, the actor at rest, and the names of its markers.
struct Mover {
  const FaceRig* rig;
  const ActorPose* pose;
  const std::vector<std::string>* markers;

  [[nodiscard]] std::optional<Eigen::Index> rowOf(const std::string& marker) const {
    const auto found = std::find(markers->begin(), markers->end(), marker);
    if (found == markers->end()) return std::nullopt;
    return found - markers->begin();
  }
};

std::string lowerCamel(std::string_view name) { return lowerCase(name.substr(0, 1)) + std::string(name.substr(1)); }

/// The head as the one moves it whose shapes ARKit's were learnt from: what these do to markers is millimetres of that
/// face. Nothing where the head has other markers.
std::optional<FaceFile> fittedToArkit(const FaceFile& face) {
  const ArkitMarkerMoves& learnt = arkitMarkerMoves();
  FaceFile fitted = face;
  fitted.actor_closed_lips_mm = 0;
  fitted.actor_unseen = {};
  fitted.warp = {};
  for (std::size_t i = 0; i < face.marker_names.size(); ++i) {
    const auto found = std::find(learnt.markers.begin(), learnt.markers.end(), face.marker_names[i]);
    if (found == learnt.markers.end()) return std::nullopt;
    fitted.actor_neutral_mm.row(signedIndex(i)) = learnt.neutral_mm.row(found - learnt.markers.begin());
  }
  return fitted;
}

}  // namespace

struct ShapeMaker::Data {
  const FaceRig& rig;
  const ActorPose& actor;
  const std::vector<std::string>& actor_markers;
  const VisemePoses& poses;
  ShapeSkin skin;
  ActorPose arkit_actor{.neutral_mm = arkitMarkerMoves().neutral_mm};
  std::optional<FaceRig> arkit_rig = std::nullopt;

  [[nodiscard]] Mover captured() const { return {&rig, &actor, &actor_markers}; }
  [[nodiscard]] Mover arkit() const {
    if (!arkit_rig) return captured();
    return {&*arkit_rig, &arkit_actor, &arkitMarkerMoves().markers};
  }
};

namespace {

/// One pose of the markers, and how the mouth is told to lie.
struct ShapePose {
  MarkerPositions moves_mm;
  LipPose lips = {};
  TonguePose tongue = {};
  bool closes = false;
  bool by_jaw = false;                ///< teeth and tongue go as far as the chin
  std::vector<double> apart_mm = {};  ///< by how much further the lips of each pair are held apart
};

class ShapeSetMaker {
 public:
  ShapeSetMaker(const FaceRig& rig, const ShapeSkin& skin, const std::map<std::string, ShapeManner>& manners)
      : rig_(rig), skin_(skin), manners_(manners) {}

  void addArkit(const Mover& mover) {
    for (std::size_t k = 0; k < kArkitNames.size(); ++k) {
      const std::string_view name = kArkitNames[k];
      if (name == "MouthClose") {
        addMouthClose(mover, k);
        continue;
      }
      ShapePose pose{.moves_mm = markersOf(mover, k)};
      if (name.starts_with("EyeLook")) keepLids(mover, name, pose.moves_mm);
      pose.lips.seal = opensLips(name) ? 0.0F : 1.0F;
      if (name == "TongueOut") pose.tongue.tip_forward = 1;
      pose.by_jaw = name.starts_with("Jaw");
      add(mover, lowerCamel(name), pose);
      VertexPositions& added = set_.moves.back();
      if (name.starts_with("Eye")) eyes_.slideLids(added);
      eyes_.look(name, added);
    }
  }

  /// What a viseme of the capture looks like when it is fully reached.
  void addVisemes(const Mover& mover, std::span<const OculusRow> rows, const VisemePoses& poses) {
    for (const OculusRow& row : rows) {
      const Eigen::Index number = static_cast<Eigen::Index>(row.viseme);
      const Eigen::RowVectorXd all =
          poses.lips.row(number) + poses.jaw_drop[unsignedIndex(number)] * poses.jaw_direction;
      ShapePose pose{.moves_mm = MarkerPositions::Zero(mover.pose->neutral_mm.rows(), 3)};
      for (std::size_t i = 0; i < poses.marker_names.size(); ++i) {
        if (const auto marker = mover.rowOf(poses.marker_names[i]))
          pose.moves_mm.row(*marker) = all.segment<3>(3 * signedIndex(i));
      }
      pose.moves_mm *= mannerOf(std::string(row.name)).strength;
      const PhoneRow& phone = rowOf(row.phone);
      pose.closes = isBilabial(row.phone);
      pose.lips.seal = pose.closes ? 1.0F : 0.0F;
      pose.lips.parting = pose.closes ? 0.0F : phone.lips_parting;
      pose.lips.tuck = isLabiodental(row.phone) ? 1.0F : 0.0F;
      pose.lips.rounding = asFloat(std::max(0.0, rowOf(row.viseme).round));
      pose.tongue = {phone.tongue.tip_up, phone.tongue.tip_forward, phone.tongue.back_up};
      add(mover, std::string(row.name), pose);
    }
  }

  void addLids(const Mover& mover) {
    const auto left = unsignedIndex(arkitIndex("EyeBlinkLeft")), right = unsignedIndex(arkitIndex("EyeBlinkRight"));
    add(mover, "blink", {.moves_mm = markersOf(mover, left) + markersOf(mover, right)});
    eyes_.slideLids(set_.moves.back());
    add(mover, "blinkLeft", {.moves_mm = markersOf(mover, left)});
    eyes_.slideLids(set_.moves.back());
    add(mover, "blinkRight", {.moves_mm = markersOf(mover, right)});
    eyes_.slideLids(set_.moves.back());
  }

  ShapeSet take() && { return std::move(set_); }

 private:
  [[nodiscard]] const ShapeManner& mannerOf(const std::string& name) const {
    static const ShapeManner as_it_is;
    const auto found = manners_.find(name);
    return found == manners_.end() ? as_it_is : found->second;
  }

  [[nodiscard]] MarkerPositions markersOf(const Mover& mover, std::size_t shape) const {
    MarkerPositions moves(signedIndex(mover.markers->size()), 3);
    for (std::size_t i = 0; i < mover.markers->size(); ++i)
      moves.row(signedIndex(i)) = arkit_.of(shape, (*mover.markers)[i]);
    return moves * mannerOf(lowerCamel(kArkitNames[shape])).strength;
  }

  /// Lids follow eyes that look up and down; nothing else does, and nothing eyes that look aside.
  static void keepLids(const Mover& mover, std::string_view look, MarkerPositions& moves) {
    const bool is_upright = look.starts_with("EyeLookUp") || look.starts_with("EyeLookDown");
    for (std::size_t i = 0; i < mover.markers->size(); ++i) {
      if (!is_upright || !(*mover.markers)[i].starts_with("LID_")) moves.row(signedIndex(i)).setZero();
    }
  }

  /// The mesh with its markers moved so far from neutral.
  [[nodiscard]] VertexPositions deformed(const Mover& mover, const ShapePose& pose) const {
    MotionClip one;
    one.frame_rate_hz = 60;
    one.marker_names = *mover.markers;
    const MarkerPositions places = mover.pose->neutral_mm + pose.moves_mm;
    one.positions_mm = Eigen::Map<const Eigen::RowVectorXd>(places.data(), places.size());
    FaceMotion motion = mover.rig->retarget(one, mover.pose, std::span(&pose.lips, 1));
    const FrameIndex frame{0};
    for (std::size_t pair = 0; pair < motion.pose(frame).lips.size(); ++pair) {
      LipGap gap = motion.pose(frame).lips[pair];
      if (pose.closes) gap = {.opened = 0};
      if (!pose.apart_mm.empty() && pose.apart_mm[pair] > 0) {
        gap.least = std::max(gap.least, 0.001 * pose.apart_mm[pair] / mover.rig->mesh().metres_per_unit);
      }
      motion.setLipGap(frame, pair, gap);
    }
    VertexPositions vertices;
    mover.rig->deform(motion.pose(frame), pose.tongue, vertices);
    if (pose.by_jaw) skin_.carryByChin(motion.pose(frame), vertices);
    return vertices;
  }

  /// What `pose` does to the vertices, with skin as a shape has it. What the deformer does at rest (lips that it brings
  /// together, or parts) belongs to no shape, but to those that say how the lips lie.
  [[nodiscard]] VertexPositions movesOf(const Mover& mover, const std::string& name, const ShapePose& pose) const {
    VertexPositions moves = deformed(mover, pose);
    if (pose.closes) {
      moves -= rig_.mesh().vertices;
    } else {
      ShapePose still{.moves_mm = MarkerPositions::Zero(pose.moves_mm.rows(), 3)};
      still.lips.seal = pose.lips.seal;
      moves -= deformed(mover, still);
    }
    skin_.spreadBelowJaw(moves);
    for (const auto& [torn, reach] : mannerOf(name).relaxed) skin_.relax(torn, reach, moves);
    return moves;
  }

  void add(const Mover& mover, std::string name, const ShapePose& given) {
    const ShapePose pose = withLipsThatMeet(mover, name, given);
    keep(name, movesOf(mover, name, pose), pose.closes);
  }

  void keep(std::string name, VertexPositions moves, bool closes) {
    quieten(moves);
    set_.names.push_back(std::move(name));
    set_.moves.push_back(std::move(moves));
    set_.closes.push_back(closes);
  }

  /// Apple's mouthClose takes back what jawOpen does to the lips: both go the same way, the mean of theirs.
  void addMouthClose(const Mover& mover, std::size_t shape) {
    const std::string name = lowerCamel(kArkitNames[shape]);
    const MarkerPositions open = markersOf(mover, unsignedIndex(arkitIndex("JawOpen")));
    ShapePose pose{.moves_mm = open + mannerOf("jawOpen").strength * markersOf(mover, shape)};
    pose.closes = pose.by_jaw = true;
    for (const auto& [upper, lower] : skin_.pairMarkers()) {
      const auto above = mover.rowOf(upper), below = mover.rowOf(lower);
      if (!above || !below) continue;
      const Eigen::RowVector3d both = 0.5 * (pose.moves_mm.row(*above) + pose.moves_mm.row(*below));
      pose.moves_mm.row(*above) = pose.moves_mm.row(*below) = both;
    }
    pose = withLipsThatMeet(mover, name, pose);
    const auto jaw = std::find(set_.names.begin(), set_.names.end(), "jawOpen") - set_.names.begin();
    keep(name, movesOf(mover, name, pose) - set_.moves[unsignedIndex(jaw)], true);
  }

  /// `pose` with lips that lie against each other on the mesh and before the teeth: lips that shall meet are drawn
  /// together, lips that are in each other held apart, half of the way each, also beside where the pose parts them, and
  /// both brought forward out of the teeth.
  [[nodiscard]] ShapePose withLipsThatMeet(const Mover& mover, const std::string& name, ShapePose pose) const {
    constexpr int kRounds = 16;
    constexpr double kMeetWithin = 0.1, kMayOverlap = 0.25, kMayBeInTeeth = 0.35, kParted = 1;  // mm
    ShapePose best = pose;
    double least = std::numeric_limits<double>::infinity();
    bool is_parted = false;
    pose.apart_mm.assign(skin_.pairMarkers().size(), 0);
    for (int round = 0; round < kRounds; ++round) {
      const auto [apart, in_teeth] = skin_.lipsIn(movesOf(mover, name, pose));
      const double parted = pose.closes ? 0 : *std::max_element(apart.begin(), apart.end()) - kParted;
      if (round == 0) is_parted = parted > 0;
      const double forward = in_teeth > kMayBeInTeeth ? in_teeth - 0.5 * kMayBeInTeeth : 0;
      double wrong = is_parted ? forward : std::max(parted, forward);
      std::vector<double> further(apart.size(), 0);
      for (std::size_t i = 0; i < apart.size(); ++i) {
        if (apart[i] < -kMayOverlap) further[i] = -apart[i] - 0.5 * kMayOverlap;
        if (pose.closes && apart[i] > kMeetWithin) further[i] = -apart[i];
        wrong = std::max(wrong, std::abs(further[i]));
      }
      if (wrong < least) {
        least = wrong;
        best = pose;
      }
      if (wrong <= 0) break;
      for (std::size_t i = 0; i < apart.size(); ++i) {
        pose.apart_mm[i] += further[i];
        const auto& [upper, lower] = skin_.pairMarkers()[i];
        const Eigen::RowVector3d way(0, 0.5 * further[i], forward);
        if (const auto row = mover.rowOf(upper)) pose.moves_mm.row(*row) += way;
        if (const auto row = mover.rowOf(lower))
          pose.moves_mm.row(*row) += way.cwiseProduct(Eigen::RowVector3d(1, -1, 1));
      }
    }
    return best;
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
  const ShapeSkin& skin_;
  const std::map<std::string, ShapeManner>& manners_;
  ShapeEyes eyes_{rig_.mesh()};
  ArkitMoves arkit_;
  ShapeSet set_;
};

}  // namespace

ShapeMaker::ShapeMaker(const FaceRig& rig, const FaceFile& face, const ActorPose& actor,
                       const std::vector<std::string>& actor_markers, const VisemePoses& poses) {
  auto data = std::make_unique<Data>(Data{rig, actor, actor_markers, poses, {rig.mesh(), face.control, face.binding}});
  if (auto fitted = fittedToArkit(face)) data->arkit_rig = FaceRig::of(std::move(*fitted), rig.mesh(), rig.name());
  data_ = std::move(data);
}
ShapeMaker::ShapeMaker(ShapeMaker&&) noexcept = default;
ShapeMaker::~ShapeMaker() = default;

ShapeSet ShapeMaker::make(ShapeVocabulary vocabulary, const std::map<std::string, ShapeManner>& manners) const {
  ShapeSetMaker maker(data_->rig, data_->skin, manners);
  if (vocabulary == ShapeVocabulary::kArkit) maker.addArkit(data_->arkit());
  if (vocabulary == ShapeVocabulary::kOculus) maker.addVisemes(data_->captured(), kOculusRows, data_->poses);
  if (vocabulary == ShapeVocabulary::kVrm) {
    maker.addVisemes(data_->captured(), kVrmRows, data_->poses);
    maker.addLids(data_->arkit());
  }
  return std::move(maker).take();
}

VertexPositions ShapeSet::posed(const FaceMesh& mesh, std::size_t shape) const {
  VertexPositions vertices = mesh.vertices + moves[shape];
  if (names[shape] == "mouthClose") {
    const auto jaw = std::find(names.begin(), names.end(), "jawOpen");
    if (jaw != names.end()) vertices += moves[unsignedIndex(jaw - names.begin())];
  }
  return vertices;
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
