// build/bin/retarget, as its users call it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <tuple>

#include "base/files.h"
#include "deform/mesh/face_mesh.h"
#include "exports/gltf/glb.h"
#include "motion/formats/motion_file.h"
#include "motion/marker_layout.h"
#include "retarget/placing/anchors.h"
#include "retarget/placing/face_page.h"
#include "retarget/rig/face_file.h"
#include "support/glb_file.h"
#include "support/run_program.h"
#include "test_face.h"
#include "units/file/corpus.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::ProgramResult;
using test::runProgram;
using test::ScratchFolder;

class RetargetProgram : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!test::canonicalFace()) GTEST_SKIP() << test::kNoCanonicalFace;
    writeCorpus(corpus_, madeUpCorpus());
  }

  static Corpus madeUpCorpus() {
    const test::MadeUpActor actor = test::madeUpActor();
    Corpus corpus;
    corpus.name = "madeup";
    corpus.layout = defaultLayout();
    corpus.neutral_pose_mm = actor.neutral_mm;
    corpus.takes.push_back(test::openingTake(actor));
    return corpus;
  }

  ProgramResult sample() {
    return runProgram("retarget", {"sample", "--out", folder_.path().string(), "--canonical",
                                   test::canonicalFace()->string(), "--corpus", corpus_.string()});
  }

  ScratchFolder folder_;
  fs::path corpus_ = folder_.path() / "madeup.corpus";
  fs::path face_ = folder_.path() / "default.face";
};

TEST_F(RetargetProgram, SampleMakesAFaceThatCheckPasses) {
  const ProgramResult made = sample();
  ASSERT_EQ(made.exit_code, 0) << made.err << made.out;
  const ProgramResult check = runProgram("retarget", {"check", face_.string(), "--json"});
  ASSERT_EQ(check.exit_code, 0) << check.err << check.out;
  const json facts = json::parse(check.out);
  EXPECT_EQ(facts["markers"], 66);
  EXPECT_EQ(facts["fold_overs"], 0);
  EXPECT_EQ(facts["lip_side_errors"], 0);
  EXPECT_LT(facts["landmark_max_mm"].get<double>(), 1e-6);
  EXPECT_LT(facts["marker_to_surface_max_mm"].get<double>(), 0.5);
}

TEST_F(RetargetProgram, ApplyMovesTheMouth) {
  ASSERT_EQ(sample().exit_code, 0);
  const fs::path motion = folder_.path() / "motion.c3d";
  writeMotion(motion, test::openingTake(test::madeUpActor()).motion);
  for (const char* name : {"talk.glb", "talk.pc2", "talk.mdd", "frames"}) {
    const ProgramResult applied = runProgram("retarget", {"apply", "--face", face_.string(), "--motion",
                                                          motion.string(), "--out", (folder_.path() / name).string()});
    ASSERT_EQ(applied.exit_code, 0) << applied.err;
    EXPECT_TRUE(fs::exists(folder_.path() / name));
  }
  const FaceMesh open = readFaceMesh(folder_.path() / "frames" / "default.0006.obj");
  const FaceMesh rest = readFaceMesh(folder_.path() / "frames" / "default.0000.obj");
  EXPECT_LT(rest.vertices(13, 1) - rest.vertices(14, 1), 0.3F);
  EXPECT_GT(open.vertices(13, 1) - open.vertices(14, 1), 4.0F);
}

/// The default face's skin alone, its mouth a hole, and all of its markers.
struct BareHead {
  FaceMesh whole, bare;
  Anchors anchors;

  BareHead() : whole(readFaceMesh(fs::path(MOUTHPIECE_BUILD_SHARE_DIR) / "default.obj")) {
    bare.vertices = whole.vertices;
    for (const MeshPart& part : whole.parts) {
      if (!isSkin(part.kind) || part.stands_off) continue;
      MeshPart& kept = bare.parts.emplace_back(part);
      kept.first_triangle = bare.triangles.size();
      const auto own = trianglesOf(whole, part);
      bare.triangles.insert(bare.triangles.end(), own.begin(), own.end());
    }
    const FaceFile face = readFaceFile(fs::path(MOUTHPIECE_BUILD_SHARE_DIR) / "default.face");
    for (std::size_t i = 0; i < face.marker_names.size(); ++i)
      anchors.markers[face.marker_names[i]] = Eigen::Vector3d(face.marker_targets.row(signedIndex(i)).transpose());
  }
};

TEST_F(RetargetProgram, FitsAMouthIntoAHeadThatHasNone) {
  Corpus unheard = madeUpCorpus();  // fitted without being judged
  unheard.takes.clear();
  writeCorpus(corpus_, unheard);
  const BareHead given;
  const FaceMesh &whole = given.whole, &bare = given.bare;
  const fs::path head = folder_.path() / "bare.obj", mouth = folder_.path() / "mouth.obj";
  writeObj(head, bare);
  const fs::path clicks = folder_.path() / "bare.anchors.json";
  writeFileAtomically(clicks, anchorsBytes(given.anchors));
  const std::vector<std::string> asked{"fit",
                                       "--mesh",
                                       head.string(),
                                       "--anchors",
                                       clicks.string(),
                                       "--corpus",
                                       corpus_.string(),
                                       "--out",
                                       (folder_.path() / "bare.face").string(),
                                       "--even-if-faulty"};
  const ProgramResult empty = runProgram("retarget", asked);
  EXPECT_NE(empty.err.find("has no teeth and no tongue; --mouth-parts FILE.obj"), std::string::npos) << empty.err;
  std::vector<std::string> with_mouth = asked;
  with_mouth.insert(with_mouth.end(), {"--mouth-parts", mouth.string()});
  const ProgramResult fit = runProgram("retarget", with_mouth);
  EXPECT_EQ(fit.err.find("has no teeth"), std::string::npos) << fit.err;
  ASSERT_TRUE(fs::exists(mouth)) << fit.err;
  const FaceMesh made = readFaceMesh(mouth);
  EXPECT_EQ(made.vertices.topRows(bare.vertices.rows()), bare.vertices);
  for (const PartKind kind : {PartKind::kUpperTeeth, PartKind::kLowerTeeth, PartKind::kTongue, PartKind::kMouthInside})
    EXPECT_FALSE(trianglesOf(made, {kind}).empty()) << nameOf(kind);
  // The bag is one piece with the lips, which touch at rest: none of its edges is open.
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> sides;
  for (const Triangle& t : trianglesOf(made, {PartKind::kSkin, PartKind::kLips, PartKind::kMouthInside})) {
    for (std::size_t k = 0; k < 3; ++k) ++sides[std::minmax(t[k], t[(k + 1) % 3])];
  }
  for (const Triangle& t : trianglesOf(made, {PartKind::kMouthInside})) {
    for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(sides[std::minmax(t[k], t[(k + 1) % 3])], 2) << t[k];
  }
  // Warped onto itself the mouth comes to lie where it was, or a little further back: behind the front of the bag.
  for (const PartKind kind : {PartKind::kUpperTeeth, PartKind::kLowerTeeth, PartKind::kTongue}) {
    const auto middleOf = [&](const FaceMesh& mesh) {
      Eigen::RowVector3f sum = Eigen::RowVector3f::Zero();
      const auto triangles = trianglesOf(mesh, {kind});
      for (const Triangle& t : triangles) sum += mesh.vertices(t, Eigen::all).colwise().mean();
      return Eigen::RowVector3f(sum / asFloat(triangles.size()));
    };
    const Eigen::RowVector3f moved = middleOf(made) - middleOf(whole);
    EXPECT_LT(moved.head<2>().norm(), 0.1F) << nameOf(kind);
    EXPECT_LT(std::abs(moved.z() + 3), 3) << nameOf(kind);
  }
  EXPECT_EQ(readFaceFile(folder_.path() / "bare.face").mesh_file, "mouth.obj");
  const ProgramResult again =
      runProgram("retarget", {"fit", "--mesh", mouth.string(), "--anchors", clicks.string(), "--corpus",
                              corpus_.string(), "--out", (folder_.path() / "again.face").string(), "--mouth-parts",
                              (folder_.path() / "more.obj").string(), "--even-if-faulty"});
  EXPECT_FALSE(fs::exists(folder_.path() / "more.obj")) << "it has all of them";
  EXPECT_NE(again.err.find("has teeth"), std::string::npos) << again.err;
}

/// The same head as a GLB whose node is turned and three times as large, with a shape that opens the jaw.
TEST_F(RetargetProgram, FitsAMouthIntoAGlbThatKeepsAllItHas) {
  Corpus unheard = madeUpCorpus();
  unheard.takes.clear();
  writeCorpus(corpus_, unheard);
  BareHead given;
  PrincipalShapes jaw;
  jaw.frame_rate_hz = 60;
  jaw.rest = Eigen::Map<const Eigen::RowVectorXf>(given.bare.vertices.data(), given.bare.vertices.size());
  jaw.shapes = Eigen::RowVectorXf::Zero(jaw.rest.size());
  const Eigen::Vector3d chin = std::get<Eigen::Vector3d>(given.anchors.markers.at("CHIN_LOW"));
  for (Eigen::Index v = 0; v < given.bare.vertices.rows(); ++v) {
    if (given.bare.vertices(v, 1) < asFloat(chin.y()) + 5) jaw.shapes(3 * v + 1) = -10;
  }
  jaw.weights = Eigen::MatrixXf::Zero(2, 1);
  test::GlbFile dressed(glbBytes(given.bare, jaw, "head"));
  dressed.root["nodes"][0]["rotation"] = {std::sqrt(0.5), 0, 0, std::sqrt(0.5)};  // y to z
  dressed.root["nodes"][0]["scale"] = {3, 3, 3};
  dressed.root["extras"] = {{"mine", 1}};
  writeFileAtomically(folder_.path() / "bare.glb", dressed.toBytes());
  const auto inScene = [&](const Eigen::Vector3d& p) -> Eigen::Vector3d {
    return 0.003 * Eigen::Vector3d(p.x(), -p.z(), p.y());
  };
  for (auto& [name, place] : given.anchors.markers) place = inScene(std::get<Eigen::Vector3d>(place));
  const fs::path clicks = folder_.path() / "bare.anchors.json", mouth = folder_.path() / "mouth.glb";
  writeFileAtomically(clicks, anchorsBytes(given.anchors));
  const ProgramResult fit =
      runProgram("retarget", {"fit", "--mesh", (folder_.path() / "bare.glb").string(), "--anchors", clicks.string(),
                              "--corpus", corpus_.string(), "--out", (folder_.path() / "bare.face").string(),
                              "--mouth-parts", mouth.string(), "--even-if-faulty"});
  ASSERT_TRUE(fs::exists(mouth)) << fit.err;
  const fs::path validated = fs::path(MOUTHPIECE_BIN_DIR) / "../tests/grown";  // by browser.grown_glb
  fs::create_directories(validated);
  fs::copy_file(mouth, validated / "mouth.glb", fs::copy_options::overwrite_existing);
  EXPECT_EQ(readFaceFile(folder_.path() / "bare.face").mesh_file, "mouth.glb");
  const FaceMesh made = readFaceMesh(mouth);
  const test::GlbFile file(readFile(mouth));
  for (const char* key : {"nodes", "scenes", "animations", "extras"})
    EXPECT_EQ(file.root[key], dressed.root[key]) << key;
  const json &primitives = file.root["meshes"][0]["primitives"], &old = dressed.root["meshes"][0]["primitives"];
  for (std::size_t p = 0; p < old.size(); ++p) {
    for (const auto& [name, accessor] : old[p]["attributes"].items()) {
      const auto values = dressed.accessor(accessor);
      auto kept = file.accessor(primitives[p]["attributes"][name]);
      kept.resize(values.size());
      EXPECT_EQ(kept, values) << name << " of primitive " << p;
    }
  }
  // Teeth lie where the default head has its own, or little further back; what the jaw carries goes down with it.
  const auto moves = file.accessor(primitives[0]["targets"][0]["POSITION"]);
  for (const PartKind kind : {PartKind::kUpperTeeth, PartKind::kLowerTeeth, PartKind::kTongue}) {
    const auto triangles = trianglesOf(made, {kind});
    ASSERT_FALSE(triangles.empty()) << nameOf(kind);
    Eigen::RowVector3f at = Eigen::RowVector3f::Zero();
    for (const Triangle& t : triangles) at += made.vertices(t, Eigen::all).colwise().mean() / asFloat(triangles.size());
    Eigen::RowVector3f wanted = Eigen::RowVector3f::Zero();
    const auto donor = trianglesOf(given.whole, {kind});
    for (const Triangle& t : donor)
      wanted += given.whole.vertices(t, Eigen::all).colwise().mean() / asFloat(donor.size());
    const Eigen::RowVector3f off = at - inScene(wanted.cast<double>().transpose()).cast<float>().transpose();
    EXPECT_LT(off.norm(), 0.003F * 7) << nameOf(kind);
    const double down = moves[3 * triangles[0][0] + 1];
    EXPECT_NEAR(down, kind == PartKind::kUpperTeeth ? 0 : -0.01, 1e-4) << nameOf(kind);
  }
  for (std::size_t p = 1; p < primitives.size(); ++p)
    EXPECT_TRUE(file.root["materials"][primitives[p]["material"].get<std::size_t>()].contains("name")) << p;
}

TEST_F(RetargetProgram, ApplyMovesTheTongueWithThePhones) {
  ASSERT_EQ(sample().exit_code, 0);
  const fs::path motion = folder_.path() / "motion.c3d";
  writeMotion(motion, test::openingTake(test::madeUpActor()).motion);
  const fs::path phones = folder_.write("phones.lab", "0 100000 sil\n100000 30000000 th\n30000000 30100000 sil\n");
  const auto apply = [&](const std::string& out, const fs::path& labels) {
    return runProgram("retarget", {"apply", "--face", face_.string(), "--motion", motion.string(), "--out",
                                   (folder_.path() / out).string(), "--phones", labels.string()});
  };
  ASSERT_EQ(apply("th", phones).exit_code, 0);
  const fs::path silent = folder_.write("silent.lab", "0 30100000 sil\n");
  ASSERT_EQ(apply("sil", silent).exit_code, 0);
  const FaceMesh th = readFaceMesh(folder_.path() / "th" / "default.0006.obj");
  const FaceMesh sil = readFaceMesh(folder_.path() / "sil" / "default.0006.obj");
  EXPECT_GT((th.vertices - sil.vertices).rowwise().norm().maxCoeff(), 2.0F);
  const ProgramResult refused = apply("none", folder_.path() / "none.lab");
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_NE(refused.err.find("none.lab"), std::string::npos) << refused.err;
}

TEST_F(RetargetProgram, FitNamesTheMarkersThatLack) {
  const fs::path anchors = folder_.write("few.json", R"({"markers": {"LIP_UP_MID": 0, "CHIN_LOW": 152}})");
  const ProgramResult fitted =
      runProgram("retarget", {"fit", "--mesh", test::canonicalFace()->string(), "--anchors", anchors.string(),
                              "--corpus", corpus_.string(), "--out", (folder_.path() / "x.face").string()});
  EXPECT_EQ(fitted.exit_code, 1);
  EXPECT_NE(fitted.err.find("has 2 anchors; expected all 66 markers, or at least 8 with LIP_CORNER_R"),
            std::string::npos)
      << fitted.err;
  EXPECT_EQ(std::count(fitted.err.begin(), fitted.err.end(), '\n'), 1);
  EXPECT_FALSE(fs::exists(folder_.path() / "x.face"));
}

/// An OBJ has no end mark: cut among its faces, at a line's end, it is a head with holes.
TEST_F(RetargetProgram, AHeadWithManyLooseVerticesIsTold) {
  const std::string whole = test::readAll(fs::path(MOUTHPIECE_BUILD_SHARE_DIR) / "default.obj");
  const fs::path cut = folder_.write("cut.obj", whole.substr(0, 1 + whole.rfind('\n', whole.size() * 19 / 20)));
  const fs::path anchors = folder_.write("few.json", R"({"markers": {"LIP_UP_MID": 0, "CHIN_LOW": 152}})");
  const auto fitted = [&](const fs::path& mesh) {
    return runProgram("retarget", {"fit", "--mesh", mesh.string(), "--anchors", anchors.string(), "--corpus",
                                   corpus_.string(), "--out", (folder_.path() / "x.face").string()})
        .err;
  };
  EXPECT_NE(fitted(cut).find("vertices have no face: is the file whole?"), std::string::npos) << fitted(cut);
  EXPECT_EQ(fitted(fs::path(MOUTHPIECE_BUILD_SHARE_DIR) / "default.obj").find("have no face"), std::string::npos);
}

TEST_F(RetargetProgram, AFaceWhoseMeshChangedIsRefused) {
  ASSERT_EQ(sample().exit_code, 0);
  std::ignore = folder_.write("default.obj", test::readAll(folder_.path() / "default.obj") + "# another line\n");
  const ProgramResult check = runProgram("retarget", {"check", face_.string()});
  EXPECT_EQ(check.exit_code, 1);
  EXPECT_NE(check.err.find("has changed since default.face was fitted"), std::string::npos) << check.err;
  EXPECT_EQ(check.err.find("SHA"), std::string::npos) << "a stranger's face may name any file: " << check.err;
}

/// The lips of an actor who says silence with the mouth five times as wide open as speech needs are torn apart.
TEST_F(RetargetProgram, AFaultyFaceIsRefusedWithAPicture) {
  Corpus gaping = madeUpCorpus();
  PositionMatrix& motion = gaping.takes[0].motion.positions_mm;
  const Eigen::RowVectorXd closed = motion.row(0);
  motion = (10 * (motion.rowwise() - closed)).rowwise() + closed;
  motion.row(0) = motion.row(4);
  motion.bottomRows(1) = motion.row(8);
  for (Eigen::Index f : {1, 2, 3, 9, 10, 11}) motion.row(f) = motion.row(f < 6 ? 4 : 8);
  const fs::path corpus = folder_.path() / "gaping.corpus", face = folder_.path() / "x.face";
  writeCorpus(corpus, gaping);
  const fs::path anchors = folder_.path() / "all.json", mesh = fs::path(MOUTHPIECE_BUILD_SHARE_DIR) / "default.obj";
  writeFileAtomically(anchors, anchorsBytes(BareHead().anchors));
  std::vector<std::string> fit{"fit",      "--mesh",        mesh.string(), "--anchors",  anchors.string(),
                               "--corpus", corpus.string(), "--out",       face.string()};
  const ProgramResult refused = runProgram("retarget", fit);
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_NE(refused.err.find("not written, see --even-if-faulty"), std::string::npos) << refused.err << refused.out;
  EXPECT_EQ(std::count(refused.err.begin(), refused.err.end(), '\n'), 1);
  EXPECT_FALSE(fs::exists(face));
  EXPECT_NE(test::readAll(folder_.path() / "x.faults.html").find("\"fault\""), std::string::npos);
  EXPECT_EQ(refused.err.find("found, not clicked"), std::string::npos) << "its anchors were given";
  // Without takes it is not judged, so that nothing is tried to mend it, and that is told to whom nothing else is.
  Corpus unheard = gaping;
  unheard.takes.clear();
  writeCorpus(corpus, unheard);
  std::vector<std::string> silent = fit;
  silent.insert(silent.end(), "-q");
  const ProgramResult passed = runProgram("retarget", silent);
  EXPECT_EQ(passed.exit_code, 0);
  EXPECT_EQ(passed.err,
            "retarget: default: not judged in motion: the corpus 'gaping' holds no take to move the face by\n");
  EXPECT_TRUE(fs::exists(face));
  // Few vertices lie within a degree of their patch.
  const bool are_found = fs::exists(fs::path(MOUTHPIECE_BUILD_SHARE_DIR) / "face_tracker");
  const fs::path loose = folder_.path() / "loose.face";
  fit.back() = loose.string();
  if (are_found) fit.erase(fit.begin() + 3, fit.begin() + 5);
  fit.insert(fit.end(), {"--max-angle", "1", "--even-if-faulty"});
  const ProgramResult written = runProgram("retarget", fit);
  EXPECT_EQ(written.exit_code, 1);
  EXPECT_EQ(written.err.find("found, not clicked") != std::string::npos, are_found) << written.err;
  EXPECT_TRUE(fs::exists(loose));
  // Twice as wide it has several faults, each on the page.
  motion = (2 * (motion.rowwise() - closed)).rowwise() + closed;
  writeCorpus(corpus, gaping);
  const fs::path shown = folder_.path() / "check.html";
  const ProgramResult checked =
      runProgram("retarget", {"check", face.string(), "--corpus", corpus.string(), "--json", "--show", shown.string()});
  EXPECT_EQ(checked.exit_code, 1);
  const std::string page = test::readAll(shown);
  const json facts = json::parse(checked.out);
  std::size_t seen = 0;
  for (const auto& fault : facts["faults"]) {
    const auto text = fault.get<std::string>();
    if (text.starts_with("the skin moves ")) continue;  // which is so in no one place
    ++seen;
    EXPECT_NE(page.find(text), std::string::npos) << text;
  }
  EXPECT_GT(seen, 1U) << facts;
}

/// The ten anchors that people click, of all of the default face's.
Anchors clicksOf(const Anchors& all) {
  Anchors ten;
  for (const AnchorToPick& wanted : suggestedAnchors()) {
    const auto found = all.markers.find(std::string(wanted.name));
    if (found != all.markers.end()) ten.markers.insert(*found);
  }
  return ten;
}

/// What a fit has placed is read again as it was saved, on a head that stands otherwise too, and what was dragged
/// stays.
TEST_F(RetargetProgram, SavedRimsStayWhereTheyArePut) {
  Corpus unheard = madeUpCorpus();  // fitted without being judged
  unheard.takes.clear();
  writeCorpus(corpus_, unheard);
  BareHead given;
  const auto turned = [](const Eigen::Vector3d& p) { return Eigen::Vector3d(p.z(), p.y(), -p.x()); };
  for (Eigen::Index v = 0; v < given.whole.vertices.rows(); ++v)
    given.whole.vertices.row(v) = turned(pointAt(given.whole.vertices, static_cast<std::uint32_t>(v))).cast<float>();
  Anchors clicks = clicksOf(given.anchors);
  for (auto& [name, place] : clicks.markers) place = turned(std::get<Eigen::Vector3d>(place));
  const fs::path head = folder_.path() / "turned.obj", first = folder_.path() / "first.json",
                 second = folder_.path() / "second.json", face = folder_.path() / "turned.face";
  writeObj(head, given.whole);
  const auto fitted = [&](const Anchors& anchors, const fs::path& saved) {
    const fs::path asked = folder_.path() / "asked.json";
    writeFileAtomically(asked, anchorsBytes(anchors));
    const ProgramResult fit =
        runProgram("retarget", {"fit", head.string(), "--anchors", asked.string(), "--corpus", corpus_.string(),
                                "--out", face.string(), "--save-anchors", saved.string(), "--even-if-faulty", "-q"});
    EXPECT_TRUE(fs::exists(saved)) << fit.err;
    return parseAnchors(readFile(saved), saved.string());
  };
  Anchors placed = fitted(clicks, first);
  ASSERT_TRUE(placed.markers.contains("RIM_UP_MID"));
  EXPECT_GE(placed.markers.size(), defaultLayout().markerNames().size() + 10);
  const auto at = [](const Anchors& anchors, const std::string& name) {
    return std::get<Eigen::Vector3d>(anchors.markers.at(name));
  };
  const Eigen::Vector3d dragged = at(placed, "RIM_UP_MID") + Eigen::Vector3d(0, 1.5, 0);
  placed.markers["RIM_UP_MID"] = dragged;
  const Anchors again = fitted(placed, second);
  ASSERT_EQ(again.markers.size(), placed.markers.size());
  for (const auto& [name, place] : again.markers) {
    if (!std::holds_alternative<Eigen::Vector3d>(place)) continue;
    EXPECT_LT((at(again, name) - at(placed, name)).norm(), 0.01) << name << ", mm";
  }
  const FaceFile file = readFaceFile(face);
  const auto rim = std::find_if(file.control.points.begin(), file.control.points.end(),
                                [](const ControlPoint& point) { return point.name == "RIM_UP_MID"; });
  ASSERT_NE(rim, file.control.points.end());
  const Eigen::Vector3d rest = file.control.rest.row(rim - file.control.points.begin());
  EXPECT_LT((file.upright_from_mesh.transpose() * rest - dragged).norm(), 0.01);
}

/// Pages show the line between the lips before anything is fitted.
TEST_F(RetargetProgram, PickShowsTheLipLine) {
  const BareHead given;
  const fs::path head = folder_.path() / "head.obj", clicks = folder_.path() / "head.json",
                 page = folder_.path() / "pick.html";
  writeObj(head, given.whole);
  writeFileAtomically(clicks, anchorsBytes(clicksOf(given.anchors)));
  const auto dataOf = [&](const std::vector<std::string>& more) {
    std::vector<std::string> pick{"pick", head.string(), "-o", page.string()};
    pick.insert(pick.end(), more.begin(), more.end());
    EXPECT_EQ(runProgram("retarget", pick).exit_code, 0);
    const std::string text = test::readAll(page);
    const std::size_t from = text.find('{', text.find("id=\"data\">"));
    return json::parse(text.substr(from, text.find("</script>", from) - from));
  };
  EXPECT_TRUE(dataOf({})["lip_line"].empty()) << "nobody has told where the mouth is";
  const json data = dataOf({"--anchors", clicks.string()});
  EXPECT_GT(data["lip_line"].size(), 20U);
  EXPECT_FALSE(data["places"].contains("RIM_UP_MID")) << "a file without rims has none";
  for (const std::string side : {"R", "L"}) {
    const json& rim = data["traced"]["RIM_CORNER_" + side];
    const auto click = std::get<Eigen::Vector3d>(given.anchors.markers.at("LIP_CORNER_" + side));
    EXPECT_LT((Eigen::Vector3d(rim[0], rim[1], rim[2]) - click).norm(), 8) << side << ", mm";
  }
  EXPECT_LT(std::abs(data["traced"]["RIM_UP_MID"][1].get<double>() - data["traced"]["RIM_LO_MID"][1].get<double>()), 1);
}

/// Two of them side by side, with anchors that lie on both: `--object` says which is meant.
TEST_F(RetargetProgram, AnchorsOnTwoHeadsAreRefusedWithTheirNames) {
  const BareHead given;
  PrincipalShapes jaw;
  jaw.frame_rate_hz = 60;
  jaw.rest = Eigen::Map<const Eigen::RowVectorXf>(given.whole.vertices.data(), given.whole.vertices.size());
  jaw.shapes = Eigen::RowVectorXf::Zero(jaw.rest.size());
  jaw.shapes(1) = -10;
  const std::vector<std::string> names{"Vrc v-aa"};
  test::GlbFile pair(glbBytes(given.whole, jaw, "Ann", names));
  pair.root["nodes"].push_back({{"name", "Ben"}, {"mesh", 0}, {"translation", {0.4, 0, 0}}});
  pair.root["scenes"][0]["nodes"].push_back(pair.root["nodes"].size() - 1);
  const fs::path heads = folder_.path() / "pair.glb";
  writeFileAtomically(heads, pair.toBytes());
  Anchors clicks = clicksOf(given.anchors);
  const auto written = [&](const char* name) {
    writeFileAtomically(folder_.path() / name, anchorsBytes(clicks));
    return (folder_.path() / name).string();
  };
  for (auto& [name, place] : clicks.markers) place = Eigen::Vector3d(0.001 * std::get<Eigen::Vector3d>(place));
  const std::string ann = written("ann.json");
  for (auto& [name, place] : clicks.markers) {
    if (name.ends_with("_L")) std::get<Eigen::Vector3d>(place).x() += 0.4;
  }
  const std::string both = written("both.json");
  const std::string said = "both.json:markers: lie on several heads; expected one, which --object names: 'Ann' 'Ben'";
  const std::string face = (folder_.path() / "x.face").string(), cut = (folder_.path() / "x.glb").string();
  for (const std::vector<std::string>& asked :
       {std::vector<std::string>{"fit", heads.string(), "--anchors", both, "--corpus", corpus_.string(), "--out", face},
        {"cut", heads.string(), "--anchors", both, "--out", cut}}) {
    const ProgramResult refused = runProgram("retarget", asked);
    EXPECT_EQ(refused.exit_code, 1) << asked[0];
    EXPECT_NE(refused.err.find(said), std::string::npos) << refused.err;
  }
  const ProgramResult chosen =
      runProgram("retarget", {"cut", heads.string(), "--object", "Ann", "--anchors", ann, "--out", cut});
  EXPECT_NE(chosen.err.find("pair.glb:lips: "), std::string::npos) << "hers are apart already: " << chosen.err;
  // A shape's name is told by its letters and digits.
  const ProgramResult by_shape = runProgram(
      "retarget", {"anchors", heads.string(), "--object", "Ann", "--by", "shapes", "--out", written("found.json")});
  EXPECT_EQ(by_shape.err.find("has no shape that opens the jaw"), std::string::npos) << by_shape.err;
}

TEST_F(RetargetProgram, TheIctHeadFitsWithoutAFault) {
  const fs::path head = fs::path(MOUTHPIECE_SOURCE_DIR) / "../shared/faces/ict_head.obj";
  if (!fs::exists(head)) GTEST_SKIP() << "the ICT head is not beside the project (../shared/faces)";
  const fs::path anchors = fs::path(MOUTHPIECE_SOURCE_DIR) / "sample_data/anchors/ict_head.anchors.json";
  const fs::path face = folder_.path() / "ict.face";
  // By all sentences of the sample corpus a wide blink turns 4.6 mm2 of a lid, over the limit of 4.
  const std::string clock = (fs::path(MOUTHPIECE_BUILD_SHARE_DIR) / "clock.corpus").string();
  const ProgramResult fitted = runProgram("retarget", {"fit", "--mesh", head.string(), "--anchors", anchors.string(),
                                                       "--corpus", clock, "--out", face.string(), "--json"});
  ASSERT_EQ(fitted.exit_code, 0) << fitted.err << fitted.out;
  const json facts = json::parse(fitted.out);
  EXPECT_EQ(facts["metres_per_unit"], 0.001);
  EXPECT_EQ(facts["fold_overs"], 0);
  EXPECT_EQ(facts["lip_side_errors"], 0);
  EXPECT_GT(facts["coverage"].get<double>(), 0.95);
  const ProgramResult checked = runProgram("retarget", {"check", face.string(), "--corpus", clock});
  EXPECT_EQ(checked.exit_code, 0) << checked.err << checked.out;
}

/// The slack's constants were chosen on another corpus.
TEST(RetargetCheck, EveryClosureOfTheSampleCorpusClosesOnTheDefaultFace) {
  const fs::path share = MOUTHPIECE_BUILD_SHARE_DIR;
  if (!fs::exists(share / "default.face") || !fs::exists(share / "sample.corpus"))
    GTEST_SKIP() << "no default face and sample corpus in " << share << ": run `make data`";
  const ProgramResult check = runProgram("retarget", {"check", (share / "default.face").string(), "--corpus",
                                                      (share / "sample.corpus").string(), "--json"});
  ASSERT_EQ(check.exit_code, 0) << check.err << check.out;
  const json closures = json::parse(check.out)["captured_closures"];
  EXPECT_GT(closures["closures"], 50);
  EXPECT_EQ(closures["touching"], closures["closures"]);
  EXPECT_LT(closures["overlap_mm"].get<double>(), 0.3);
  EXPECT_LT(closures["in_teeth_mm"].get<double>(), 0.3);
}

TEST(RetargetUsage, HelpHasAnExampleAndMistakesExitWithTwo) {
  const ProgramResult help = runProgram("retarget", {"--help"});
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_NE(help.out.find("Example"), std::string::npos);
  EXPECT_EQ(runProgram("retarget", {}).exit_code, 2);
  EXPECT_EQ(runProgram("retarget", {"fit", "--mesh", "x.obj"}).exit_code, 2);
}

TEST(RetargetUsage, MissingFilesAreNamed) {
  const ProgramResult check = runProgram("retarget", {"check", "/nowhere/x.face"});
  EXPECT_EQ(check.exit_code, 1);
  EXPECT_NE(check.err.find("/nowhere/x.face"), std::string::npos);
}

}  // namespace
}  // namespace mouthpiece
