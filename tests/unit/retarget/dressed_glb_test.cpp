// A GLB with texture, texture coordinates and a skin goes through `retarget` and comes out with them, talking; a
// flat-shaded mesh fits as the smooth one does.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "base/files.h"
#include "base/zip.h"
#include "deform/mesh/face_mesh.h"
#include "deform/topology/welding.h"
#include "exports/gltf/glb.h"
#include "motion/formats/motion_file.h"
#include "retarget/rig/face_rig.h"
#include "support/allocations.h"
#include "support/glb_file.h"
#include "support/run_program.h"
#include "test_face.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::GlbFile;
using test::runProgram;

/// Two by two pixels.
constexpr std::array<unsigned char, 76> kPng{
    0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a, 0x00, 0x00, 0x00, 0x0d, 0x49, 0x48, 0x44, 0x52, 0x00, 0x00, 0x00,
    0x02, 0x00, 0x00, 0x00, 0x02, 0x08, 0x02, 0x00, 0x00, 0x00, 0xfd, 0xd4, 0x9a, 0x73, 0x00, 0x00, 0x00, 0x13, 0x49,
    0x44, 0x41, 0x54, 0x78, 0xda, 0x63, 0xb8, 0xb0, 0xa0, 0xe1, 0xc0, 0x84, 0x02, 0x06, 0x20, 0x06, 0xb2, 0x00, 0x34,
    0xee, 0x07, 0x61, 0x16, 0xaf, 0xe5, 0x32, 0x00, 0x00, 0x00, 0x00, 0x49, 0x45, 0x4e, 0x44, 0xae, 0x42, 0x60, 0x82};

/// A new bufferView over `bytes`, at the end of the first buffer.
std::size_t addView(GlbFile& glb, std::string_view bytes) {
  glb.binary.resize((glb.binary.size() + 3) / 4 * 4, '\0');
  glb.root["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", glb.binary.size()}, {"byteLength", bytes.size()}});
  glb.binary += bytes;
  glb.binary.resize((glb.binary.size() + 3) / 4 * 4, '\0');
  glb.root["buffers"][0]["byteLength"] = glb.binary.size();
  return glb.root["bufferViews"].size() - 1;
}

template <typename T>
std::size_t addAccessor(GlbFile& glb, const std::vector<T>& values, const char* type, int component,
                        std::size_t count) {
  const auto* bytes = reinterpret_cast<const char*>(values.data());
  const std::size_t view = addView(glb, {bytes, values.size() * sizeof(T)});
  constexpr int kVertexData = 34962;
  if (type != std::string_view("MAT4")) glb.root["bufferViews"][view]["target"] = kVertexData;
  glb.root["accessors"].push_back(
      {{"bufferView", view}, {"componentType", component}, {"type", type}, {"count", count}});
  return glb.root["accessors"].size() - 1;
}

std::string_view viewBytes(const GlbFile& glb, std::size_t view) {
  const json& found = glb.root["bufferViews"][view];
  return std::string_view(glb.binary).substr(found.value("byteOffset", std::size_t{0}), found["byteLength"]);
}

std::string_view accessorBytes(const GlbFile& glb, const json& accessor) {
  return viewBytes(glb, glb.root["accessors"][accessor.get<std::size_t>()]["bufferView"]);
}

/// Two joints that share the vertices of each primitive.
void addSkin(GlbFile& glb) {
  for (json& primitive : glb.root["meshes"][0]["primitives"]) {
    const json& positions = glb.root["accessors"][primitive["attributes"]["POSITION"].get<std::size_t>()];
    const std::size_t count = positions["count"];
    std::vector<std::uint8_t> joints(4 * count, 0);
    std::vector<float> weights(4 * count, 0);
    for (std::size_t v = 0; v < count; ++v) {
      joints[4 * v + 1] = 1;
      weights[4 * v] = v % 2 == 0 ? 0.25F : 1.0F;
      weights[4 * v + 1] = 1 - weights[4 * v];
      if (weights[4 * v + 1] == 0) joints[4 * v + 1] = 0;
    }
    primitive["attributes"]["JOINTS_0"] = addAccessor(glb, joints, "VEC4", 5121, count);
    primitive["attributes"]["WEIGHTS_0"] = addAccessor(glb, weights, "VEC4", 5126, count);
  }
  const std::vector<float> binds{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0,     0, 1,
                                 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, -0.1F, 0, 1};
  const std::size_t accessor = addAccessor(glb, binds, "MAT4", 5126, 2);
  glb.root["nodes"].push_back({{"name", "neck"}, {"children", {2}}});
  glb.root["nodes"].push_back({{"name", "head"}, {"translation", {0, 0.1, 0}}});
  glb.root["scenes"][0]["nodes"] = {0, 1};
  glb.root["nodes"][0]["skin"] = 0;
  glb.root["skins"] = json::array({{{"joints", {1, 2}}, {"inverseBindMatrices", accessor}, {"name", "bones"}}});
}

/// The default face as a GLB that something else has dressed.
std::string dressedGlb() {
  FaceMesh mesh = test::defaultFace().mesh;
  for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v)
    mesh.texture_coordinates.push_back({0.5F + mesh.vertices(v, 0) / 300, 0.5F - mesh.vertices(v, 1) / 500});
  PrincipalShapes none;
  none.frame_rate_hz = 60;
  none.rest = Eigen::Map<const Eigen::RowVectorXf>(mesh.vertices.data(), mesh.vertices.size());
  none.shapes.resize(0, mesh.vertices.size());
  none.weights.resize(2, 0);
  GlbFile glb(glbBytes(mesh, none, "head"));
  const std::size_t image = addView(glb, {reinterpret_cast<const char*>(kPng.data()), kPng.size()});
  glb.root["images"] = json::array({{{"bufferView", image}, {"mimeType", "image/png"}, {"name", "skin colour"}}});
  glb.root["textures"] = json::array({{{"source", 0}}});
  glb.root["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", 0}};
  addSkin(glb);
  return glb.toBytes();
}

/// Places of all markers in metres: the GLB counts its vertices otherwise than the mesh.
std::string anchorsInMetres() {
  const DefaultFace& face = test::defaultFace();
  json markers;
  for (const auto& [name, vertex] : face.anchors.markers) {
    const Eigen::Vector3d p = 0.001 * *placeOf(face.anchors, name, face.mesh, "default face");
    markers[name] = {p.x(), p.y(), p.z()};
  }
  return json{{"markers", markers}, {"metres_per_unit", 1}}.dump();
}

/// Materials, picture, skeleton and the vertices' own are as they were.
void expectDressed(const GlbFile& after, const GlbFile& before) {
  for (const char* list : {"materials", "textures", "skins", "nodes", "scenes"})
    EXPECT_EQ(after.root[list], before.root[list]) << list;
  ASSERT_EQ(after.root["images"].size(), 1U);
  EXPECT_EQ(viewBytes(after, after.root["images"][0]["bufferView"]),
            std::string_view(reinterpret_cast<const char*>(kPng.data()), kPng.size()));
  const json &primitives = after.root["meshes"][0]["primitives"], &were = before.root["meshes"][0]["primitives"];
  ASSERT_EQ(primitives.size(), were.size());
  for (std::size_t p = 0; p < primitives.size(); ++p) {
    for (const char* attribute : {"POSITION", "TEXCOORD_0", "JOINTS_0", "WEIGHTS_0"}) {
      EXPECT_EQ(accessorBytes(after, primitives[p]["attributes"][attribute]),
                accessorBytes(before, were[p]["attributes"][attribute]))
          << p << " " << attribute;
    }
    EXPECT_EQ(primitives[p]["material"], were[p]["material"]);
    EXPECT_FALSE(primitives[p]["targets"].empty());
  }
}

TEST(DressedGlb, ComesOutWholeAndTalking) {
  if (!test::canonicalFace()) GTEST_SKIP() << test::kNoCanonicalFace;
  // The validator's and Blender's tests go on with these files.
  const fs::path folder = fs::path(MOUTHPIECE_BIN_DIR) / "../tests/dressed";
  const fs::path given = folder / "head.glb", corpus = folder / "madeup.corpus", motion = folder / "motion.c3d";
  const fs::path face = folder / "head.face", talking = folder / "talk.glb";
  fs::remove_all(folder);
  fs::create_directories(folder);
  const test::MadeUpActor actor = test::madeUpActor();
  const CorpusTake take = test::openingTake(actor);
  Corpus made;
  made.name = "madeup";
  made.layout = defaultLayout();
  made.neutral_pose_mm = actor.neutral_mm;
  made.takes.push_back(take);
  writeCorpus(corpus, made);
  writeMotion(motion, take.motion);
  writeFileAtomically(given, dressedGlb());
  writeFileAtomically(folder / "anchors.json", anchorsInMetres());
  const auto run = [](const std::vector<std::string>& arguments) {
    const test::ProgramResult result = runProgram("retarget", arguments);
    ASSERT_EQ(result.exit_code, 0) << result.err << result.out;
  };
  // The made-up head's lips are two bare tubes: whether the judge finds faults has nothing to do with the GLB.
  runProgram("retarget", {"fit", "--mesh", given.string(), "--anchors", (folder / "anchors.json").string(), "--corpus",
                          corpus.string(), "--out", face.string(), "--quiet", "--even-if-faulty"});
  ASSERT_TRUE(fs::exists(face));
  run({"apply", "--face", face.string(), "--motion", motion.string(), "--out", talking.string(), "--quiet"});
  for (const char* other : {"frames.pc2", "talk.fbx", "talk.usdz"})
    run({"apply", "--face", face.string(), "--motion", motion.string(), "--out", (folder / other).string(), "--quiet"});

  const std::string given_bytes = readFile(given), talking_bytes = readFile(talking);
  const GlbFile before(given_bytes), after(talking_bytes);
  expectDressed(after, before);

  const std::string_view picture(reinterpret_cast<const char*>(kPng.data()), kPng.size());
  EXPECT_NE(readFile(folder / "talk.fbx").find(picture), std::string::npos);
  EXPECT_EQ(unzipped(readFile(folder / "talk.usdz"), "texture_0.png", "talk.usdz"), picture);

  // The animation is the point cache's motion.
  ASSERT_EQ(after.root["animations"].size(), 1U);
  const json& animation = after.root["animations"][0];
  EXPECT_EQ(animation["channels"][0]["target"]["path"], "weights");
  const FaceMesh mesh = parseFaceMesh(talking_bytes, "talk.glb");
  const FaceShapes shapes = parseFaceShapes(talking_bytes, "talk.glb");
  std::vector<float> weights(accessorBytes(after, animation["samplers"][0]["output"]).size() / sizeof(float));
  const std::string_view output = accessorBytes(after, animation["samplers"][0]["output"]);
  std::memcpy(weights.data(), output.data(), output.size());
  const std::string cache = readFile(folder / "frames.pc2");
  constexpr std::size_t kPc2Header = 32;
  const std::size_t frame_floats = 3 * static_cast<std::size_t>(mesh.vertices.rows());
  ASSERT_EQ(weights.size() % shapes.moves.size(), 0U);
  ASSERT_EQ(cache.size(), kPc2Header + weights.size() / shapes.moves.size() * frame_floats * sizeof(float));
  float farthest = 0, moved = 0;
  for (std::size_t f = 0; f < weights.size() / shapes.moves.size(); ++f) {
    VertexPositions shown = mesh.vertices, wanted = mesh.vertices;
    for (std::size_t k = 0; k < shapes.moves.size(); ++k)
      shown += weights[f * shapes.moves.size() + k] * shapes.moves[k];
    std::memcpy(wanted.data(), cache.data() + kPc2Header + f * frame_floats * sizeof(float),
                frame_floats * sizeof(float));
    farthest = std::max(farthest, (shown - wanted).rowwise().norm().maxCoeff());
    moved = std::max(moved, (wanted - mesh.vertices).rowwise().norm().maxCoeff());
  }
  EXPECT_LT(farthest, 1e-4F);  // metres
  EXPECT_GT(moved, 5e-3F);
}

TEST(DressedGlb, TakesShapesBesideAllThatItHas) {
  const fs::path corpus = fs::path(MOUTHPIECE_BUILD_SHARE_DIR) / "clock.corpus";
  if (!test::canonicalFace()) GTEST_SKIP() << test::kNoCanonicalFace;
  if (!fs::exists(corpus)) GTEST_SKIP() << "no sample corpus; make it with `make data`";
  // The validator's test goes on with shaped.glb.
  const fs::path folder = fs::path(MOUTHPIECE_BIN_DIR) / "../tests/shaped";
  fs::remove_all(folder);
  fs::create_directories(folder);
  writeFileAtomically(folder / "head.glb", dressedGlb());
  writeFileAtomically(folder / "anchors.json", anchorsInMetres());
  const auto shapesOn = [&](const std::string& head, const std::string& out) {
    const fs::path face = folder / (head + ".face");
    const test::ProgramResult fit = runProgram(
        "retarget", {"fit", "--mesh", (folder / head).string(), "--anchors", (folder / "anchors.json").string(),
                     "--corpus", corpus.string(), "--out", face.string(), "--quiet", "--even-if-faulty"});
    EXPECT_TRUE(fs::exists(face)) << fit.err;
    return runProgram("retarget", {"shapes", face.string(), "--set", "arkit", "--corpus", corpus.string(), "--out",
                                   (folder / out).string(), "--quiet"});
  };
  const test::ProgramResult made = shapesOn("head.glb", "shaped.glb");
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const std::string given_bytes = readFile(folder / "head.glb"), shaped_bytes = readFile(folder / "shaped.glb");
  const GlbFile before(given_bytes), shaped(shaped_bytes);
  expectDressed(shaped, before);
  EXPECT_EQ(shaped.root["meshes"][0]["extras"]["targetNames"].size(), 52U) << "those of what it has not, too";
  EXPECT_FALSE(shaped.root.contains("animations"));

  // Once they are there, by whichever of their names, there is nothing to add.
  GlbFile own(shaped_bytes);
  for (json& name : own.root["meshes"][0]["extras"]["targetNames"]) {
    if (name == "mouthSmileLeft") name = "mouthSmile_L";
  }
  writeFileAtomically(folder / "own.glb", own.toBytes());
  const test::ProgramResult again = shapesOn("own.glb", "again.glb");
  EXPECT_EQ(again.exit_code, 1);
  EXPECT_NE(again.err.find("own.glb: has all shapes of arkit already"), std::string::npos) << again.err;
  EXPECT_FALSE(fs::exists(folder / "again.glb"));
}

/// Every triangle on corners of its own.
FaceMesh flatShaded(const FaceMesh& smooth) {
  FaceMesh flat = smooth;
  flat.texture_coordinates.clear();
  flat.vertex_colors.clear();
  flat.vertices.resize(static_cast<Eigen::Index>(3 * smooth.triangles.size()), 3);
  for (std::uint32_t t = 0; t < smooth.triangles.size(); ++t) {
    for (std::uint32_t k = 0; k < 3; ++k) {
      flat.vertices.row(3 * t + k) = smooth.vertices.row(smooth.triangles[t][k]);
      flat.triangles[t][k] = 3 * t + k;
    }
  }
  return flat;
}

TEST(FlatShaded, FitsAsTheSewnMeshAndStaysTogether) {
  if (!test::canonicalFace()) GTEST_SKIP() << test::kNoCanonicalFace;
  const FaceMesh& smooth = test::defaultFace().mesh;
  Anchors anchors = test::defaultFace().anchors;
  for (auto& [name, place] : anchors.markers)
    place = *placeOf(test::defaultFace().anchors, name, test::defaultFace().mesh, "");
  FaceMesh flat = flatShaded(test::defaultFace().mesh);
  const test::MadeUpActor actor = test::madeUpActor();
  FitRequest request;
  request.name = "flat";
  request.marker_names = actor.names;
  request.actor_neutral_mm = actor.neutral_mm;
  const Welding welding = weldSplitTriangles(flat);
  ASSERT_FALSE(welding.isNothing());
  // Sewn together it is the smooth mesh again, though its lips touch at rest; only the numbers are others.
  std::set<std::pair<std::uint32_t, std::uint32_t>> pairs;
  for (std::uint32_t v = 0; v < welding.welded_of.size(); ++v)
    pairs.insert({smooth.triangles[v / 3][v % 3], welding.welded_of[v]});
  EXPECT_EQ(welding.mesh.vertices.rows(), smooth.vertices.rows());
  EXPECT_EQ(pairs.size(), static_cast<std::size_t>(smooth.vertices.rows()));

  const FaceFile face = fitFace(flat, anchors, "anchors", request);
  FaceMesh welded = welding.mesh;
  const FaceFile welded_face = fitFace(welded, anchors, "anchors", request);
  EXPECT_TRUE(faultsOf(checkFace(face, flat)).empty());
  EXPECT_EQ(face.control.rest, welded_face.control.rest);
  EXPECT_EQ(face.binding.patch, givenBinding(welded_face.binding, welding).patch);
  EXPECT_EQ(face.binding.d, givenBinding(welded_face.binding, welding).d);

  // Through the rig nothing that stood together comes apart.
  test::ScratchFolder folder;
  FaceMesh written = flatShaded(test::defaultFace().mesh);
  writeFileAtomically(folder.path() / "flat.obj", objBytes(written));
  FaceFile file = face;
  file.mesh_file = "flat.obj";
  file.mesh_sha256 = sha256Hex(objBytes(written));
  writeFaceFile(folder.path() / "flat.face", file);
  const FaceRig rig = FaceRig::load(folder.path() / "flat.face");
  const FaceMotion motion = rig.retarget(test::openingTake(actor).motion);
  VertexPositions out;
  rig.deform(motion.pose(FrameIndex{6}), {}, out);
  std::map<std::uint32_t, Eigen::RowVector3f> places;
  float moved_mm = 0;
  for (std::uint32_t v = 0; v < welding.welded_of.size(); ++v) {
    const auto [place, is_new] = places.emplace(welding.welded_of[v], out.row(v));
    EXPECT_EQ(place->second, out.row(v)) << v;
    moved_mm = std::max(moved_mm, (out.row(v) - flat.vertices.row(v)).norm());
  }
  EXPECT_GT(moved_mm, 5);
  const std::vector<TonguePose> tongues(motion.frameCount());
  const FaceAnimation animation = rig.movingFrames(motion, tongues, 60).all();
  for (std::size_t i = 0; i < animation.vertices.size(); ++i)
    EXPECT_EQ((animation.positions.block<1, 3>(6, static_cast<Eigen::Index>(3 * i))), out.row(animation.vertices[i]));
  EXPECT_EQ(test::allocationsIn([&] { rig.deform(motion.pose(FrameIndex{0}), {}, out); }), 0U);
}

TEST(FlatShaded, ShapesCloseItsLips) {
  const fs::path corpus = fs::path(MOUTHPIECE_BUILD_SHARE_DIR) / "clock.corpus";
  if (!test::canonicalFace()) GTEST_SKIP() << test::kNoCanonicalFace;
  if (!fs::exists(corpus)) GTEST_SKIP() << "no sample corpus; make it with `make data`";
  test::ScratchFolder folder;
  const fs::path face = folder.path() / "flat.face";
  writeFileAtomically(folder.path() / "flat.obj", objBytes(flatShaded(test::defaultFace().mesh)));
  json markers;
  for (const auto& [name, vertex] : test::defaultFace().anchors.markers) {
    const Eigen::Vector3d p = *placeOf(test::defaultFace().anchors, name, test::defaultFace().mesh, "default face");
    markers[name] = {p.x(), p.y(), p.z()};
  }
  writeFileAtomically(folder.path() / "anchors.json", json{{"markers", markers}, {"metres_per_unit", 0.001}}.dump());
  runProgram("retarget", {"fit", "--mesh", (folder.path() / "flat.obj").string(), "--anchors",
                          (folder.path() / "anchors.json").string(), "--corpus", corpus.string(), "--out",
                          face.string(), "--quiet", "--even-if-faulty"});
  const test::ProgramResult made =
      runProgram("retarget", {"shapes", face.string(), "--set", "oculus", "--corpus", corpus.string(), "--out",
                              (folder.path() / "flat.fbx").string(), "--json"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  // Measured on triangles that stand apart, lips that meet seemed to be 2 mm apart.
  EXPECT_LT(json::parse(made.out)["closing_gap_mm"], 0.3);
}

TEST(FlatShaded, LipsThatTouchStayApart) {
  // Two upright slabs that stand on each other: wedges whose edges lie in one line.
  FaceMesh wedges;
  wedges.vertices.resize(12, 3);
  wedges.vertices << 0, 0, 0, 1, 0, 0, 0.5F, 1, 1, 0, 0, 0, 1, 0, 0, 0.5F, 1, -1,  // the upper lip's front and back
      0, 0, 0, 1, 0, 0, 0.5F, -1, 1, 0, 0, 0, 1, 0, 0, 0.5F, -1, -1;               // the lower one's
  wedges.triangles = {{0, 1, 2}, {4, 3, 5}, {7, 6, 8}, {9, 10, 11}};
  wedges.parts = {{.name = "skin", .triangle_count = 4}};
  const Welding welding = weldSplitTriangles(wedges);
  ASSERT_FALSE(welding.isNothing());
  EXPECT_EQ(welding.welded_of[0], welding.welded_of[3]);
  EXPECT_EQ(welding.welded_of[1], welding.welded_of[4]);
  EXPECT_EQ(welding.welded_of[6], welding.welded_of[9]);
  EXPECT_NE(welding.welded_of[0], welding.welded_of[6]);
  EXPECT_EQ(welding.mesh.vertices.rows(), 8);
}

/// Each part with vertices of its own, as a GLB's primitives have them.
FaceMesh partsApart(const FaceMesh& whole) {
  FaceMesh apart = whole;
  apart.texture_coordinates.clear();
  apart.vertex_colors.clear();
  std::vector<std::uint32_t> whole_of;
  for (const MeshPart& part : whole.parts) {
    std::map<std::uint32_t, std::uint32_t> number_of;
    for (std::size_t t = part.first_triangle; t < part.first_triangle + part.triangle_count; ++t) {
      for (std::uint32_t& v : apart.triangles[t]) {
        const auto [number, is_new] = number_of.try_emplace(v, static_cast<std::uint32_t>(whole_of.size()));
        if (is_new) whole_of.push_back(v);
        v = number->second;
      }
    }
  }
  apart.vertices = whole.vertices(whole_of, Eigen::all);
  return apart;
}

TEST(PartsApart, FitAsTheWholeMesh) {
  if (!test::canonicalFace()) GTEST_SKIP() << test::kNoCanonicalFace;
  const FaceMesh& whole = test::defaultFace().mesh;
  FaceMesh apart = partsApart(whole);
  ASSERT_GT(apart.vertices.rows(), whole.vertices.rows());
  const Welding welding = weldSplitTriangles(apart);
  ASSERT_FALSE(welding.isNothing());
  EXPECT_EQ(welding.mesh.vertices.rows(), whole.vertices.rows());
  EXPECT_TRUE(weldSplitTriangles(welding.mesh).isNothing());
  Anchors anchors = test::defaultFace().anchors;
  for (auto& [name, place] : anchors.markers) place = *placeOf(test::defaultFace().anchors, name, whole, "");
  const test::MadeUpActor actor = test::madeUpActor();
  FitRequest request;
  request.name = "apart";
  request.marker_names = actor.names;
  request.actor_neutral_mm = actor.neutral_mm;
  const FaceFile face = fitFace(apart, anchors, "anchors", request);
  const std::vector<std::string> faults = faultsOf(checkFace(face, apart));
  EXPECT_TRUE(faults.empty()) << faults.front();
}

TEST(FlatShaded, SeamsAreLeftAlone) {
  if (!test::canonicalFace()) GTEST_SKIP() << test::kNoCanonicalFace;
  EXPECT_TRUE(weldSplitTriangles(test::defaultFace().mesh).isNothing());
}

}  // namespace
}  // namespace mouthpiece
