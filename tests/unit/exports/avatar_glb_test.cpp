// What stays of a game's avatar when speech is written into it, and the ways in which one may be stored.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "base/errors.h"
#include "base/index.h"
#include "deform/mesh/glb_chunks.h"
#include "deform/mesh/glb_scene.h"
#include "deform/mesh/mesh_reader.h"
#include "exports/gltf/glb.h"
#include "made_up_avatar.h"
#include "support/glb_file.h"

namespace mouthpiece {
namespace {

using nlohmann::json;
using test::AvatarStyle;
using test::GlbFile;
using test::madeUpAvatar;

constexpr float kWithin = 2e-6F;  ///< metres; floats through a bone

bool isMoved(const FaceMesh& mesh, Eigen::Index v) {
  return std::abs(mesh.vertices(v, 0)) < 0.04F && mesh.vertices(v, 1) > 1.4F && mesh.vertices(v, 1) < 1.51F &&
         mesh.vertices(v, 2) > 0.02F;
}

/// Two shapes of the face's lower half; the second also moves what is over the eyes. Nothing else.
PrincipalShapes speechFor(const FaceMesh& mesh) {
  PrincipalShapes shapes;
  shapes.frame_rate_hz = 50;
  shapes.rest = Eigen::Map<const Eigen::RowVectorXf>(mesh.vertices.data(), mesh.vertices.size());
  shapes.shapes = RowMajorMatrixF::Zero(2, mesh.vertices.size());
  for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v) {
    if (!isMoved(mesh, v)) continue;
    shapes.shapes.block<1, 3>(0, 3 * v) << 0.001F, -0.002F, 0.003F;
    shapes.shapes.block<1, 3>(1, 3 * v) << 0, 0.001F * mesh.vertices(v, 0), 0.004F;
  }
  shapes.weights = RowMajorMatrixF::Zero(5, 2);
  shapes.weights.col(0).setLinSpaced(0, 1);
  shapes.weights(2, 1) = 1;
  return shapes;
}

std::string spoken(const std::string& given, std::string_view object = {}, const OwnShapeWeights* own = nullptr) {
  const PrincipalShapes shapes = speechFor(parseGlb(given, "avatar.glb", object));
  const auto made = glbWithShapes(given, "avatar.glb", shapes, Eigen::Matrix3d::Identity(), object, own);
  EXPECT_TRUE(made);
  return made.value_or(std::string());
}

const json* named(const json& list, const std::string& name) {
  for (const json& entry : list) {
    if (entry.value("name", "") == name) return &entry;
  }
  return nullptr;
}

/// `mesh` without what speech has added to it.
json withoutSpeech(json mesh, const json& given) {
  for (std::size_t p = 0; p < mesh["primitives"].size(); ++p) {
    json& targets = mesh["primitives"][p]["targets"];
    const std::size_t own = given["primitives"][p].value("targets", json::array()).size();
    while (targets.size() > own) targets.erase(targets.size() - 1);
    if (own == 0) mesh["primitives"][p].erase("targets");
  }
  const std::size_t own = given.value("weights", json::array()).size();
  while (mesh.contains("weights") && mesh["weights"].size() > own) mesh["weights"].erase(mesh["weights"].size() - 1);
  json& names = mesh["extras"]["targetNames"];
  while (names.size() > own) names.erase(names.size() - 1);
  return mesh;
}

TEST(Avatar, KeepsWhateverItHad) {
  const std::string given_bytes = madeUpAvatar({.vrm = 1});
  const GlbFile given(given_bytes), after(spoken(given_bytes));
  for (const char* key : {"asset", "scene", "scenes", "extensionsUsed", "extensions", "extras", "images", "textures",
                          "materials", "nodes", "skins"})
    EXPECT_EQ(after.root[key], given.root[key]) << key;
  ASSERT_EQ(after.root["meshes"].size(), given.root["meshes"].size());
  for (std::size_t m = 0; m < given.root["meshes"].size(); ++m) {
    const json &was = given.root["meshes"][m], &is = after.root["meshes"][m];
    if (was["name"] == "AnnFace")
      EXPECT_EQ(withoutSpeech(is, was), was);
    else
      EXPECT_EQ(is, was) << "nothing moves it, so nothing is added";
  }
  // By value: every accessor that was there, but the keys of weights that had to make room.
  const std::size_t widened = given.root["animations"][0]["samplers"][1]["output"];
  for (std::size_t a = 0; a < given.root["accessors"].size(); ++a) {
    if (a == widened || given.root["accessors"][a]["type"] == "MAT4") continue;
    EXPECT_EQ(after.root["accessors"][a]["type"], given.root["accessors"][a]["type"]);
    if (given.root["accessors"][a]["componentType"] == 5121) continue;  // joints: their views are compared
    EXPECT_EQ(after.accessor(a), given.accessor(a)) << a;
  }
}

/// The bytes of the file's pictures that lie in its binary chunk, by their names.
std::map<std::string, std::string> picturesOf(const GlbFile& glb) {
  std::map<std::string, std::string> pictures;
  for (const json& image : glb.root["images"]) {
    if (!image.contains("bufferView")) continue;
    const json& view = glb.root["bufferViews"].at(image["bufferView"].get<std::size_t>());
    pictures[image["name"]] = glb.binary.substr(view.value("byteOffset", std::size_t{0}), view["byteLength"]);
  }
  return pictures;
}

/// An avatar whose textures are WebP with a PNG for those who cannot read it, WebP alone and KTX2 alone.
GlbFile paintedAvatar() {
  GlbFile glb(madeUpAvatar());
  const auto addPicture = [&](const std::string& name, const std::string& mime, const std::string& bytes) {
    glb.binary.append((4 - glb.binary.size() % 4) % 4, '\0');
    glb.root["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", glb.binary.size()}, {"byteLength", bytes.size()}});
    glb.binary += bytes;
    const std::size_t view = glb.root["bufferViews"].size() - 1;
    glb.root["images"].push_back({{"bufferView", view}, {"mimeType", mime}, {"name", name}});
    return glb.root["images"].size() - 1;
  };
  // The writer has to leave the bytes alone, so that it does not matter that no reader could take them.
  const std::size_t png = addPicture("png", "image/png", "\x89PNG, of an odd length.");
  const std::size_t webp = addPicture("webp", "image/webp", "RIFF WEBP");
  const std::size_t ktx2 = addPicture("ktx2", "image/ktx2", std::string("\xabKTX 20\0\0", 9));
  glb.root["samplers"] = {{{"magFilter", 9729}, {"wrapS", 33071}}, {{"minFilter", 9987}, {"name", "soft"}}};
  const auto of = [](const char* extension, std::size_t source) { return json{{extension, {{"source", source}}}}; };
  for (const json& texture : {json{{"source", png}, {"sampler", 0}, {"extensions", of("EXT_texture_webp", webp)}},
                              json{{"sampler", 1}, {"extensions", of("EXT_texture_webp", webp)}},
                              json{{"sampler", 0}, {"name", "basis"}, {"extensions", of("KHR_texture_basisu", ktx2)}}})
    glb.root["textures"].push_back(texture);
  const std::size_t first = glb.root["textures"].size() - 3;
  for (std::size_t m = 1; m < 4; ++m)
    glb.root["materials"][m]["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", first + m - 1}, {"texCoord", 0}};
  glb.root["extensionsUsed"].push_back("EXT_texture_webp");
  glb.root["extensionsRequired"] = {"EXT_texture_webp", "KHR_texture_basisu"};
  glb.root["buffers"][0]["byteLength"] = glb.binary.size();
  return glb;
}

TEST(Avatar, PicturesOfEveryKindPassThroughUnopened) {
  const GlbFile given = paintedAvatar();
  const std::string once = spoken(given.toBytes());
  // The second time the first one's shapes are taken out again, and with them their data.
  for (const GlbFile& after : {GlbFile(once), GlbFile(spoken(once))}) {
    for (const char* key : {"textures", "samplers", "materials", "extensionsUsed", "extensionsRequired"})
      EXPECT_EQ(after.root[key], given.root[key]) << key;
    ASSERT_EQ(picturesOf(given).size(), 3U);
    EXPECT_EQ(picturesOf(after), picturesOf(given));
    json images = after.root["images"], were = given.root["images"];
    for (json* list : {&images, &were})
      for (json& image : *list) image.erase("bufferView");  // a view's number may change
    EXPECT_EQ(images, were);
  }
}

TEST(Avatar, PagesShowWhatABrowserReads) {
  const std::map<int, GlbPicture> pictures = glbPictures(paintedAvatar().toBytes(), "avatar.glb");
  ASSERT_EQ(pictures.size(), 4U);
  EXPECT_EQ(pictures.at(1).mime, "image/png") << "what any reader knows comes first";
  EXPECT_EQ(pictures.at(2).mime, "image/webp");
  EXPECT_EQ(pictures.at(2).bytes, "RIFF WEBP");
  for (const int told : {0, 3}) {
    EXPECT_EQ(pictures.at(told).mime, "image/ktx2") << "so that a page can say what it does not show";
    EXPECT_EQ(pictures.at(told).bytes, "");
  }
}

TEST(Avatar, PagesShowPicturesInDataUris) {
  GlbFile glb = paintedAvatar();
  const std::size_t texture = glb.root["materials"][1]["pbrMetallicRoughness"]["baseColorTexture"]["index"];
  const auto shown = [&](const char* uri) {
    glb.root["images"].push_back({{"uri", uri}});
    glb.root["textures"][texture] = {{"source", glb.root["images"].size() - 1}};
    return glbPictures(glb.toBytes(), "avatar.glb");
  };
  const auto pictures = shown("data:image/webp;base64,UklGRiBXRUJQ");
  ASSERT_TRUE(pictures.contains(1));
  EXPECT_EQ(pictures.at(1).mime, "image/webp");
  EXPECT_EQ(pictures.at(1).bytes, "RIFF WEBP");
  EXPECT_EQ(shown("data:image/png;base64,iQ==").at(1).bytes, "\x89");
  for (const char* none : {"data:image/png;base64,?", "data:image/svg+xml;base64,iQ==", "data:image/png,x", "skin.png"})
    EXPECT_FALSE(shown(none).contains(1)) << none;
}

TEST(Avatar, OwnShapesAndAnimationsStayAndSpeechIsAdded) {
  const std::string given_bytes = madeUpAvatar();
  const GlbFile given(given_bytes), after(spoken(given_bytes));
  const json& face = *named(after.root["meshes"], "AnnFace");
  EXPECT_EQ(face["extras"]["targetNames"], (json{"jawOpen", "eyeBlinkLeft", "speech_00", "speech_01"}));
  EXPECT_EQ(face["weights"], (json{0.0, 0.25, 0.0, 0.0}));
  ASSERT_EQ(after.root["animations"].size(), 2U);
  EXPECT_EQ(after.root["animations"][0]["name"], "Ann idle");
  EXPECT_EQ(after.root["animations"][0]["extras"], given.root["animations"][0]["extras"]);
  EXPECT_EQ(after.root["animations"][0]["channels"], given.root["animations"][0]["channels"]);
  const json& samplers = after.root["animations"][0]["samplers"];
  EXPECT_EQ(after.accessor(samplers[0]["output"]),
            given.accessor(given.root["animations"][0]["samplers"][0]["output"]));
  EXPECT_EQ(after.accessor(samplers[1]["output"]), (std::vector<double>{0, 0.25, 0, 0, 0.5, 1, 0, 0, 0, 0.25, 0, 0}));
  const json& speech = after.root["animations"][1];
  EXPECT_EQ(speech["name"], "speech");
  ASSERT_EQ(speech["channels"].size(), 1U) << "boots, eyes and teeth do not move";
  const std::vector<double> keys = after.accessor(speech["samplers"][0]["output"]);
  ASSERT_EQ(keys.size(), 20U);
  EXPECT_EQ(keys[9], 0.25) << "own shapes rest where the file has them rest";
  EXPECT_EQ(keys[10], 0.5);
  EXPECT_EQ(keys[11], 1);
}

TEST(Avatar, ShapesByNameAreThereOnceEach) {
  const std::string given_bytes = madeUpAvatar();
  PrincipalShapes shapes = speechFor(parseGlb(given_bytes, "avatar.glb"));
  shapes.shapes.conservativeResizeLike(RowMajorMatrixF::Zero(3, shapes.shapes.cols()));
  shapes.weights.resize(0, 3);
  const std::vector<std::string> names{"jawOpen", "mouthFunnel", "tongueOut"};
  const auto made = glbWithShapes(given_bytes, "avatar.glb", shapes, Eigen::Matrix3d::Identity(), {}, nullptr, names);
  ASSERT_TRUE(made);
  const GlbFile given(given_bytes), after(*made);
  const json& face = *named(after.root["meshes"], "AnnFace");
  EXPECT_EQ(face["extras"]["targetNames"], (json{"jawOpen", "eyeBlinkLeft", "mouthFunnel", "tongueOut"}))
      << "its own jawOpen stays, and what moves nothing is there to be found";
  const json& targets = face["primitives"][0]["targets"];
  const json& were = (*named(given.root["meshes"], "AnnFace"))["primitives"][0]["targets"];
  EXPECT_EQ(after.accessor(targets[0]["POSITION"]), given.accessor(were[0]["POSITION"]));
  const auto largest = [&](std::size_t target) {
    double most = 0;
    for (const double value : after.accessor(targets[target]["POSITION"])) most = std::max(most, std::abs(value));
    return most;
  };
  EXPECT_NEAR(largest(2), 0.004, kWithin);
  EXPECT_EQ(largest(3), 0);
  for (const json& mesh : after.root["meshes"]) {
    if (mesh["name"] == "AnnFace") continue;
    EXPECT_EQ(mesh, *named(given.root["meshes"], mesh["name"])) << "nothing moves it, so nothing is added";
  }
  EXPECT_EQ(after.root["animations"].size(), given.root["animations"].size()) << "shapes alone";
}

TEST(Avatar, SaysItAgainWithoutLeavingTheFirstBehind) {
  const std::string given = madeUpAvatar();
  const std::string once = spoken(given), twice = spoken(once);
  EXPECT_EQ(GlbFile(twice).root["meshes"][0]["extras"], GlbFile(once).root["meshes"][0]["extras"]);
  for (const char* list : {"accessors", "bufferViews", "animations"})
    EXPECT_EQ(GlbFile(twice).root[list].size(), GlbFile(once).root[list].size()) << list;
  EXPECT_NEAR(asReal(twice.size()), asReal(once.size()), 64) << "but for alignment";
  // Nothing in the chunk that no view shows, but what alignment asks for.
  const GlbFile file(twice);
  std::size_t shown = 0;
  for (const json& view : file.root["bufferViews"]) shown += view["byteLength"].get<std::size_t>();
  EXPECT_LE(file.binary.size(), shown + 8 * file.root["bufferViews"].size());
  // Each accessor is named by something.
  std::set<std::size_t> used;
  for (const json& mesh : file.root["meshes"]) {
    for (const json& primitive : mesh["primitives"]) {
      used.insert(primitive["indices"].get<std::size_t>());
      for (const json& attribute : primitive["attributes"]) used.insert(attribute.get<std::size_t>());
      for (const json& target : primitive.value("targets", json::array()))
        used.insert(target["POSITION"].get<std::size_t>());
    }
  }
  used.insert(file.root["skins"][0]["inverseBindMatrices"].get<std::size_t>());
  for (const json& animation : file.root["animations"]) {
    for (const json& sampler : animation["samplers"])
      used.insert({sampler["input"].get<std::size_t>(), sampler["output"].get<std::size_t>()});
  }
  EXPECT_EQ(used.size(), file.root["accessors"].size());
}

TEST(Avatar, DrivesItsOwnShapes) {
  const OwnShapeWeights own{RowMajorMatrixF::Constant(5, 1, 0.75F),
                            [](std::string_view name) { return name == "eyeBlinkLeft" ? 0 : -1; }};
  const GlbFile after(spoken(madeUpAvatar(), {}, &own));
  const std::vector<double> keys = after.accessor(after.root["animations"][1]["samplers"][0]["output"]);
  EXPECT_EQ(keys[0], 0);
  for (std::size_t f = 0; f < 5; ++f) EXPECT_EQ(keys[4 * f + 1], 1) << "from 0.25 on, where it rests";
}

TEST(Avatar, ItsShapesAreNamedByMeshPrimitiveOrExpression) {
  const auto speech = [](const AvatarStyle& style) {
    const OwnShapeWeights own{RowMajorMatrixF::Constant(5, 1, 0.75F), [](std::string_view name) {
                                return name == "eyeBlinkLeft" || name == "blinkLeft" || name == "blink_l" ? 0 : -1;
                              }};
    return GlbFile(spoken(madeUpAvatar(style), {}, &own));
  };
  using Names = std::vector<std::string>;
  const auto namesOf = [](const AvatarStyle& style) { return parseGlbShapes(madeUpAvatar(style), "avatar.glb").names; };
  using test::ShapesNamedBy;
  const AvatarStyle by_primitive{.vrm = 0, .named = ShapesNamedBy::kPrimitive},
      by_vrm0{.vrm = 0, .named = ShapesNamedBy::kExpressions}, by_vrm1{.vrm = 1, .named = ShapesNamedBy::kExpressions};
  EXPECT_EQ(namesOf(by_primitive), (Names{"jawOpen", "eyeBlinkLeft"}));
  EXPECT_EQ(namesOf(by_vrm0), (Names{"a", "blink_l"}));
  EXPECT_EQ(namesOf(by_vrm1), (Names{"aa", "blinkLeft"}));
  for (const AvatarStyle& style : {by_primitive, by_vrm0, by_vrm1}) {
    const GlbFile given(madeUpAvatar(style)), after = speech(style);
    EXPECT_EQ(after.root["extensions"], given.root["extensions"]);
    const json& face = *named(after.root["meshes"], "AnnFace");
    const json was =
        style.named == ShapesNamedBy::kPrimitive ? json{"jawOpen", "eyeBlinkLeft"} : json{"あ", "ウィンク"};
    EXPECT_EQ(face["extras"]["targetNames"], (json{was[0], was[1], "speech_00", "speech_01"}))
        << "as the file has them";
    EXPECT_EQ(face["primitives"][0]["extras"], (*named(given.root["meshes"], "AnnFace"))["primitives"][0]["extras"]);
    const std::vector<double> keys = after.accessor(after.root["animations"][1]["samplers"][0]["output"]);
    EXPECT_EQ(keys[1], 1) << "the blink is driven, from 0.25 on";
  }
}

TEST(Avatar, AMeshOfTwoNodesMovesInOneOfThem) {
  const std::string given = madeUpAvatar({.shared_lash = true});
  const FaceMesh mesh = parseGlb(given, "avatar.glb");
  PrincipalShapes shapes = speechFor(mesh);
  Eigen::Index in_lash = -1;
  for (const GlbRun& run : glbRuns(given, "avatar.glb")) {
    if (GlbFile(given).root["nodes"][unsignedIndex(run.node)]["name"] == "AnnLashR")
      in_lash = signedIndex(run.first_vertex);
  }
  ASSERT_GE(in_lash, 0);
  shapes.shapes(0, 3 * in_lash) = 0.5F;
  const auto made = glbWithShapes(given, "avatar.glb", shapes, Eigen::Matrix3d::Identity());
  ASSERT_TRUE(made);
  const FaceShapes read = parseGlbShapes(*made, "avatar.glb");
  const auto speech = std::find(read.names.begin(), read.names.end(), "speech_00") - read.names.begin();
  const Eigen::RowVectorXf row = shapes.shapes.row(0);
  EXPECT_LT((read.moves[unsignedIndex(speech)] - Eigen::Map<const VertexPositions>(row.data(), row.size() / 3, 3))
                .cwiseAbs()
                .maxCoeff(),
            kWithin);
}

/// Each way to store the same person.
class AvatarStyles : public ::testing::TestWithParam<std::pair<const char*, AvatarStyle>> {};

TEST_P(AvatarStyles, ReadsAsThePlainOneDoesAndSpeaksLikeIt) {
  const std::string plain = madeUpAvatar(), styled = madeUpAvatar(GetParam().second);
  const FaceMesh wanted = parseGlb(plain, "plain.glb"), mesh = parseGlb(styled, "avatar.glb");
  const float within = GetParam().second.quantised ? 5e-5F : kWithin;
  ASSERT_EQ(mesh.vertices.rows(), wanted.vertices.rows());
  EXPECT_LT((mesh.vertices - wanted.vertices).cwiseAbs().maxCoeff(), within);
  EXPECT_EQ(mesh.triangles, wanted.triangles);
  ASSERT_EQ(mesh.parts.size(), wanted.parts.size());
  for (std::size_t p = 0; p < mesh.parts.size(); ++p)
    EXPECT_EQ(mesh.parts[p].kind, wanted.parts[p].kind) << mesh.parts[p].name;
  const FaceShapes own = parseGlbShapes(styled, "avatar.glb"), wanted_own = parseGlbShapes(plain, "plain.glb");
  ASSERT_EQ(own.names, wanted_own.names);
  for (std::size_t s = 0; s < own.moves.size(); ++s)
    EXPECT_LT((own.moves[s] - wanted_own.moves[s]).cwiseAbs().maxCoeff(), within);
  // What is written reads back as what was asked for, in the scene's own space, and the file stays as it is stored.
  const PrincipalShapes shapes = speechFor(mesh);
  const std::string made = spoken(styled);
  const FaceShapes read = parseGlbShapes(made, "avatar.glb");
  ASSERT_EQ(read.names.size(), own.names.size() + 2);
  for (Eigen::Index k = 0; k < 2; ++k) {
    const Eigen::RowVectorXf row = shapes.shapes.row(k);
    EXPECT_LT((read.moves[own.names.size() + unsignedIndex(k)] -
               Eigen::Map<const VertexPositions>(row.data(), row.size() / 3, 3))
                  .cwiseAbs()
                  .maxCoeff(),
              kWithin);
  }
  EXPECT_EQ(parseGlb(made, "avatar.glb").vertices, mesh.vertices);
  EXPECT_EQ(GlbFile(made).root["extensionsUsed"], GlbFile(styled).root["extensionsUsed"]);
  // As a page holds it, to which Draco is no help.
  const std::string shown = withoutDraco(made, "avatar.glb");
  EXPECT_EQ(shown == made, !GetParam().second.draco);
  EXPECT_EQ(parseGlb(shown, "avatar.glb").vertices, mesh.vertices);
}

INSTANTIATE_TEST_SUITE_P(All, AvatarStyles,
                         ::testing::Values(std::pair{"quantised", AvatarStyle{.quantised = true}},
                                           std::pair{"sparse", AvatarStyle{.sparse = true}},
                                           std::pair{"meshopt", AvatarStyle{.meshopt = true}},
                                           std::pair{"quantised_meshopt",
                                                     AvatarStyle{.quantised = true, .meshopt = true}},
                                           std::pair{"draco", AvatarStyle{.draco = true}},
                                           std::pair{"bind_scale", AvatarStyle{.bind_scale = 100}}),
                         [](const auto& test) { return std::string(test.param.first); });

TEST(Avatar, PartsAreWhatBonesAndShapesTell) {
  const FaceMesh mesh = parseGlb(madeUpAvatar(), "avatar.glb");
  std::map<std::string, PartKind> kinds;
  for (const MeshPart& part : mesh.parts) kinds[part.name] = part.kind;
  EXPECT_EQ(kinds.at("N00_000_00_HairBack_00"), PartKind::kSkin) << "what the mouth's own shapes move is the face";
  EXPECT_EQ(kinds.at("Iris"), PartKind::kEye);
  EXPECT_EQ(kinds.at("Boot_Skin"), PartKind::kOther) << "hangs on the hips";
}

TEST(Avatar, SeveralHeadsAreToldApart) {
  const std::string both = madeUpAvatar({.two_heads = true});
  const FaceMesh one = parseGlb(madeUpAvatar(), "avatar.glb");
  const FaceMesh ann = parseGlb(both, "avatar.glb", "Ann"), ben = parseGlb(both, "avatar.glb", "Ben");
  EXPECT_EQ(ann.vertices, one.vertices);
  EXPECT_EQ(parseGlb(both, "avatar.glb").vertices.rows(), 2 * one.vertices.rows());
  EXPECT_NEAR(ben.vertices(0, 0) - ann.vertices(0, 0), 2, 1e-5);
  const GlbFile after(spoken(both, "Ann"));
  EXPECT_FALSE((*named(after.root["meshes"], "BenFace"))["extras"].contains("speech"));
  EXPECT_EQ((*named(after.root["meshes"], "BenFace"))["primitives"],
            (*named(GlbFile(both).root["meshes"], "BenFace"))["primitives"]);
  // The shapes that both have move on the chosen one alone.
  const OwnShapeWeights own{RowMajorMatrixF::Constant(5, 1, 0.75F),
                            [](std::string_view name) { return name == "eyeBlinkLeft" || name == "jawOpen" ? 0 : -1; }};
  for (const std::string& made :
       {spoken(both, "Ann", &own), glbWithWeights(both, "avatar.glb", 50, own, "Ann").value_or("")}) {
    const GlbFile driven(made);
    std::vector<json> meshes;
    for (const json& channel : driven.root["animations"].back()["channels"]) {
      const json& node = driven.root["nodes"][channel["target"]["node"].get<std::size_t>()];
      meshes.push_back(driven.root["meshes"][node["mesh"].get<std::size_t>()]["name"]);
    }
    EXPECT_EQ(meshes, std::vector<json>{"AnnFace"});
  }
  try {
    (void)parseGlb(both, "avatar.glb", "Cem");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what()), "avatar.glb: shows no object named 'Cem'; its scene holds 'Ann' 'Ben'");
  }
}

TEST(Avatar, DamagedCompressionIsRefused) {
  for (const AvatarStyle& style : {AvatarStyle{.meshopt = true}, AvatarStyle{.draco = true}}) {
    const std::string whole = madeUpAvatar(style);
    const std::size_t json_end = whole.find("BIN");
    int refused = 0;
    for (std::size_t at = json_end + 8; at < whole.size(); at += 1 + whole.size() / 300) {
      std::string damaged = whole;
      damaged[at] = static_cast<char>(~damaged[at]);
      try {
        (void)parseGlb(damaged, "cut.glb");
      } catch (const InputError& error) {
        EXPECT_TRUE(std::string_view(error.what()).starts_with("cut.glb"));
        ++refused;
      }
    }
    EXPECT_GT(refused, 0);
  }
}

}  // namespace
}  // namespace mouthpiece
