#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "base/errors.h"
#include "base/index.h"
#include "deform/mesh/face_mesh.h"
#include "exports/scenes/fbx_nodes.h"
#include "exports/scenes/scene_files.h"
#include "exports/scenes/scene_shape.h"

namespace mouthpiece {
namespace {

constexpr double kTicksPerSecond = 46'186'158'000.0;
constexpr std::string_view kUvMap = "UVMap";
constexpr std::int64_t kGeometry = 1000, kModel = 1001, kBlendShape = 1002, kStack = 1003, kLayer = 1004;
constexpr std::int64_t kFirstMaterial = 10'000, kFirstVideo = 20'000, kFirstTexture = 30'000, kFirstShape = 100'000;
/// Numbers of what belongs to one shape, from kFirstShape on.
constexpr std::int64_t kIdsPerShape = 4;
enum ShapeId : std::int64_t { kChannel, kShapeGeometry, kCurveNode, kCurve };

std::int64_t idOf(std::size_t shape, ShapeId what) {
  return kFirstShape + kIdsPerShape * static_cast<std::int64_t>(shape) + what;
}

class FbxScene {
 public:
  FbxScene(const FaceMesh& mesh, const PrincipalShapes& shapes, std::string_view name, const SceneTextures& textures,
           std::span<const std::string> shape_names)
      : mesh_(mesh),
        shapes_(shapes),
        textures_(textures),
        normals_(shapeNormals(mesh.triangles, shapes)),
        name_(name),
        cm_per_unit_(100 * mesh.metres_per_unit) {
    for (std::size_t k = 0; k < unsignedIndex(shapes.shapeCount()); ++k)
      shape_names_.push_back(k < shape_names.size() ? shape_names[k] : fmt::format("shape_{:02}", k));
    for (const MeshPart& part : mesh.parts) {
      if (part.triangle_count > 0) materials_.push_back(&part);
    }
  }

  std::string toBytes() && {
    addHeader();
    FbxNode objects("Objects"), connections("Connections");
    addGeometry(objects);
    addPictures(objects);
    addMaterials(objects, connections);
    addDefinitions();
    const auto connect = [&](std::int64_t from, std::int64_t to) {
      connections.child("C").add("OO").add(from).add(to);
    };
    connect(kModel, 0);
    connect(kGeometry, kModel);
    FbxNode& deformer = objects.child("Deformer");
    deformer.add(kBlendShape).add(fbxName("Speech", "Deformer")).add("BlendShape");
    deformer.child("Version", std::int32_t{100});
    connect(kBlendShape, kGeometry);
    for (std::size_t k = 0; k < shape_names_.size(); ++k) {
      addShape(objects, k);
      connect(idOf(k, kChannel), kBlendShape);
      connect(idOf(k, kShapeGeometry), idOf(k, kChannel));
    }
    if (shapes_.frameCount() > 0) addAnimation(objects, connections);
    records_.push_back(std::move(objects));
    records_.push_back(std::move(connections));
    return fbxFile(records_);
  }

 private:
  [[nodiscard]] std::int64_t lastTick() const { return tickOf(std::max<Eigen::Index>(0, shapes_.frameCount() - 1)); }
  [[nodiscard]] std::int64_t tickOf(Eigen::Index frame) const {
    return std::llround(asReal(frame) / std::max(shapes_.frame_rate_hz, 1e-9) * kTicksPerSecond);
  }

  void addHeader() {
    FbxNode header("FBXHeaderExtension");
    header.child("FBXHeaderVersion", std::int32_t{1003});
    header.child("FBXVersion", std::int32_t{7400});
    header.child("EncryptionType", std::int32_t{0});
    header.child("Creator", std::string_view("Mouthpiece"));
    records_.push_back(std::move(header));
    FbxNode id("FileId");
    id.addBytes("\x28\xB3\x2A\xEB\xB6\x24\xCC\xC2\xBF\xC8\xB0\x2A\xA9\x2B\xFC\xF1");
    records_.push_back(std::move(id));
    FbxNode time("CreationTime");
    time.add("1970-01-01 10:00:00:000");
    records_.push_back(std::move(time));
    FbxNode settings("GlobalSettings");
    settings.child("Version", std::int32_t{1000});
    FbxNode& list = settings.child("Properties70");
    const auto whole = [&](std::string_view key, std::int32_t value) {
      list.property(key, "int", "Integer", "").add(value);
    };
    whole("UpAxis", 1);
    whole("UpAxisSign", 1);
    whole("FrontAxis", 2);
    whole("FrontAxisSign", 1);
    whole("CoordAxis", 0);
    whole("CoordAxisSign", 1);
    list.property("UnitScaleFactor", "double", "Number", "").add(1.0);
    list.property("TimeMode", "enum", "", "").add(std::int32_t{14});  // a rate of its own
    list.property("TimeSpanStart", "KTime", "Time", "").add(std::int64_t{0});
    list.property("TimeSpanStop", "KTime", "Time", "").add(lastTick());
    list.property("CustomFrameRate", "double", "Number", "").add(shapes_.frame_rate_hz);
    records_.push_back(std::move(settings));
  }

  void addDefinitions() {
    const auto shapes = static_cast<std::int32_t>(shape_names_.size());
    const bool moves = shapes_.frameCount() > 0;
    const std::vector<std::pair<std::string_view, std::int32_t>> kinds = {
        {"GlobalSettings", 1},
        {"Geometry", 1 + shapes},
        {"Model", 1},
        {"Material", static_cast<std::int32_t>(materials_.size())},
        {"Video", static_cast<std::int32_t>(textures_.pictures.size())},
        {"Texture", texture_count_},
        {"Deformer", 1 + shapes},
        {"AnimationStack", moves ? 1 : 0},
        {"AnimationLayer", moves ? 1 : 0},
        {"AnimationCurveNode", moves ? shapes : 0},
        {"AnimationCurve", moves ? shapes : 0}};
    FbxNode definitions("Definitions");
    definitions.child("Version", std::int32_t{100});
    std::int32_t all = 0;
    for (const auto& [kind, count] : kinds) all += count;
    definitions.child("Count", all);
    for (const auto& [kind, count] : kinds) {
      if (count > 0) definitions.child("ObjectType", kind).child("Count", count);
    }
    records_.push_back(std::move(definitions));
  }

  void addGeometry(FbxNode& objects) {
    FbxNode& geometry = objects.child("Geometry");
    geometry.add(kGeometry).add(fbxName(name_, "Geometry")).add("Mesh");
    std::vector<double> positions;
    for (Eigen::Index i = 0; i < mesh_.vertices.size(); ++i)
      positions.push_back(cm_per_unit_ * static_cast<double>(mesh_.vertices.data()[i]));
    std::vector<std::int32_t> corners, materials;
    std::int32_t material = 0;
    for (const MeshPart* part : materials_) {
      for (const Triangle& triangle : trianglesOf(mesh_, *part)) {
        for (const std::uint32_t vertex : triangle) corners.push_back(static_cast<std::int32_t>(vertex));
        corners.back() = -corners.back() - 1;  // the polygon's last
        materials.push_back(material);
      }
      ++material;
    }
    geometry.child("Vertices", positions);
    geometry.child("PolygonVertexIndex", corners);
    geometry.child("GeometryVersion", std::int32_t{124});
    const bool is_textured = !mesh_.texture_coordinates.empty();
    addLayerElement(geometry, "LayerElementNormal", 101, "", "ByVertice", "Direct")
        .child("Normals", std::vector<double>(normals_.rest.begin(), normals_.rest.end()));
    // One smoothing group: no edge is hard.
    addLayerElement(geometry, "LayerElementSmoothing", 102, "", "ByPolygon", "Direct")
        .child("Smoothing", std::vector<std::int32_t>(materials.size(), 1));
    if (is_textured) addTextureCoordinates(geometry, corners);
    addLayerElement(geometry, "LayerElementMaterial", 101, "", "ByPolygon", "IndexToDirect")
        .child("Materials", materials);
    FbxNode& layers = geometry.child("Layer", std::int32_t{0});
    layers.child("Version", std::int32_t{100});
    const auto addLayer = [&](std::string_view kind) {
      FbxNode& element = layers.child("LayerElement");
      element.child("Type", kind);
      element.child("TypedIndex", std::int32_t{0});
    };
    addLayer("LayerElementNormal");
    addLayer("LayerElementSmoothing");
    addLayer("LayerElementMaterial");
    if (is_textured) addLayer("LayerElementUV");
    FbxNode& model = objects.child("Model");
    model.add(kModel).add(fbxName(name_, "Model")).add("Mesh");
    model.child("Version", std::int32_t{232});
    model.child("Properties70").property("DefaultAttributeIndex", "int", "Integer", "").add(std::int32_t{0});
    model.child("Shading", std::string_view("T"));
    model.child("Culling", std::string_view("CullingOff"));
  }

  static FbxNode& addLayerElement(FbxNode& geometry, std::string kind, std::int32_t version, std::string_view name,
                                  std::string_view mapping, std::string_view reference) {
    FbxNode& layer = geometry.child(std::move(kind), std::int32_t{0});
    layer.child("Version", version);
    layer.child("Name", name);
    layer.child("MappingInformationType", mapping);
    layer.child("ReferenceInformationType", reference);
    return layer;
  }

  void addTextureCoordinates(FbxNode& geometry, const std::vector<std::int32_t>& corners) const {
    FbxNode& layer = addLayerElement(geometry, "LayerElementUV", 101, kUvMap, "ByPolygonVertex", "IndexToDirect");
    std::vector<double> places;
    for (const auto& [u, v] : mesh_.texture_coordinates) {
      places.push_back(static_cast<double>(u));
      places.push_back(1 - static_cast<double>(v));  // from the lower edge up
    }
    std::vector<std::int32_t> indices;
    for (const std::int32_t corner : corners) indices.push_back(corner < 0 ? -corner - 1 : corner);
    layer.child("UV", places);
    layer.child("UVIndex", indices);
  }

  void addPictures(FbxNode& objects) const {
    for (std::size_t i = 0; i < textures_.pictures.size(); ++i) {
      const ScenePicture& picture = textures_.pictures[i];
      FbxNode& video = objects.child("Video");
      video.add(kFirstVideo + static_cast<std::int64_t>(i)).add(fbxName(picture.name, "Video")).add("Clip");
      video.child("Type", std::string_view("Clip"));
      video.child("Properties70").property("Path", "KString", "XRefUrl", "").add(picture.name);
      video.child("UseMipMap", std::int32_t{0});
      video.child("Filename", std::string_view(picture.name));
      video.child("RelativeFilename", std::string_view(picture.name));
      video.child("Content").addBytes(picture.bytes);
    }
  }

  void addMaterials(FbxNode& objects, FbxNode& connections) {
    for (std::size_t m = 0; m < materials_.size(); ++m) {
      const std::int64_t id = kFirstMaterial + static_cast<std::int64_t>(m);
      const SceneTextures::Material shown = textures_.of(materials_[m]->material);
      FbxNode& material = objects.child("Material");
      material.add(id).add(fbxName(materials_[m]->name, "Material")).add("");
      material.child("Version", std::int32_t{102});
      material.child("ShadingModel", std::string_view("phong"));
      FbxNode& colour = material.child("Properties70").property("DiffuseColor", "Color", "", "A");
      const std::array<float, 4> mean = shown.color ? materials_[m]->base_color : meanColor(mesh_, *materials_[m]);
      for (std::size_t c = 0; c < 3; ++c) colour.add(static_cast<double>(mean[c]));
      connections.child("C").add("OO").add(id).add(kModel);
      if (shown.color) {
        const bool is_seen_through = shown.alpha != SceneTextures::Material::Alpha::kOpaque;
        const std::int64_t texture = addTexture(objects, connections, *shown.color, is_seen_through);
        connections.child("C").add("OP").add(texture).add(id).add("DiffuseColor");
        if (is_seen_through) connections.child("C").add("OP").add(texture).add(id).add("TransparentColor");
      }
      if (shown.normal)
        connections.child("C")
            .add("OP")
            .add(addTexture(objects, connections, *shown.normal, false))
            .add(id)
            .add("NormalMap");
    }
  }

  /// Gives its number.
  std::int64_t addTexture(FbxNode& objects, FbxNode& connections, const SceneTexture& shown, bool is_seen_through) {
    const std::int64_t id = kFirstTexture + texture_count_++;
    const std::string& name = textures_.pictures[shown.picture].name;
    FbxNode& texture = objects.child("Texture");
    texture.add(id).add(fbxName(name, "Texture")).add("");
    texture.child("Type", std::string_view("TextureVideoClip"));
    texture.child("Version", std::int32_t{202});
    texture.child("TextureName", std::string_view(fbxName(name, "Texture")));
    FbxNode& list = texture.child("Properties70");
    list.property("UVSet", "KString", "", "").add(kUvMap);
    list.property("UseMaterial", "bool", "", "").add(std::int32_t{1});
    const auto wrap = [&](std::string_view key, SceneTexture::Wrap how) {
      list.property(key, "enum", "", "").add(std::int32_t{how == SceneTexture::Wrap::kClamp ? 1 : 0});
    };
    wrap("WrapModeU", shown.u);
    wrap("WrapModeV", shown.v);
    texture.child("Media", std::string_view(fbxName(name, "Video")));
    texture.child("FileName", std::string_view(name));
    texture.child("RelativeFilename", std::string_view(name));
    texture.child("Texture_Alpha_Source", std::string_view(is_seen_through ? "Alpha_Black" : "None"));
    connections.child("C").add("OO").add(kFirstVideo + static_cast<std::int64_t>(shown.picture)).add(id);
    return id;
  }

  void addShape(FbxNode& objects, std::size_t k) const {
    const SceneShape shape = sceneShape(shapes_, normals_, signedIndex(k));
    const std::vector<std::int32_t> indices(shape.vertices.begin(), shape.vertices.end());
    std::vector<double> moves;
    for (const float move : shape.moves) moves.push_back(cm_per_unit_ * static_cast<double>(move));
    FbxNode& geometry = objects.child("Geometry");
    geometry.add(idOf(k, kShapeGeometry)).add(fbxName(shape_names_[k], "Geometry")).add("Shape");
    geometry.child("Version", std::int32_t{100});
    geometry.child("Indexes", indices);
    geometry.child("Vertices", moves);
    geometry.child("Normals", std::vector<double>(shape.turns.begin(), shape.turns.end()));
    FbxNode& channel = objects.child("Deformer");
    channel.add(idOf(k, kChannel)).add(fbxName(shape_names_[k], "SubDeformer")).add("BlendShapeChannel");
    channel.child("Version", std::int32_t{100});
    channel.child("DeformPercent", 0.0);
    channel.child("FullWeights", std::vector<double>{100.0});
  }

  void addAnimation(FbxNode& objects, FbxNode& connections) const {
    FbxNode& stack = objects.child("AnimationStack");
    stack.add(kStack).add(fbxName("speech", "AnimStack")).add("");
    FbxNode& times = stack.child("Properties70");
    times.property("LocalStop", "KTime", "Time", "").add(lastTick());
    times.property("ReferenceStop", "KTime", "Time", "").add(lastTick());
    objects.child("AnimationLayer").add(kLayer).add(fbxName("speech", "AnimLayer")).add("");
    connections.child("C").add("OO").add(kLayer).add(kStack);
    std::vector<std::int64_t> ticks;
    for (Eigen::Index frame = 0; frame < shapes_.frameCount(); ++frame) ticks.push_back(tickOf(frame));
    for (std::size_t k = 0; k < shape_names_.size(); ++k) {
      FbxNode& node = objects.child("AnimationCurveNode");
      node.add(idOf(k, kCurveNode)).add(fbxName("DeformPercent", "AnimCurveNode")).add("");
      node.child("Properties70").property("d|DeformPercent", "Number", "", "A").add(0.0);
      std::vector<float> values;
      for (Eigen::Index frame = 0; frame < shapes_.frameCount(); ++frame)
        values.push_back(100 * shapes_.weights(frame, signedIndex(k)));
      FbxNode& curve = objects.child("AnimationCurve");
      curve.add(idOf(k, kCurve)).add(fbxName("", "AnimCurve")).add("");
      curve.child("Default", 0.0);
      curve.child("KeyVer", std::int32_t{4008});
      curve.child("KeyTime", ticks);
      curve.child("KeyValueFloat", values);
      curve.child("KeyAttrFlags", std::vector<std::int32_t>{4});  // linear
      curve.child("KeyAttrDataFloat", std::vector<float>{0, 0, 0, 0});
      curve.child("KeyAttrRefCount", std::vector<std::int32_t>{static_cast<std::int32_t>(ticks.size())});
      connections.child("C").add("OO").add(idOf(k, kCurveNode)).add(kLayer);
      connections.child("C").add("OP").add(idOf(k, kCurveNode)).add(idOf(k, kChannel)).add("DeformPercent");
      connections.child("C").add("OP").add(idOf(k, kCurve)).add(idOf(k, kCurveNode)).add("d|DeformPercent");
    }
  }

  const FaceMesh& mesh_;
  const PrincipalShapes& shapes_;
  const SceneTextures& textures_;
  std::int32_t texture_count_ = 0;
  const ShapeNormals normals_;
  std::string name_;
  double cm_per_unit_;
  std::vector<std::string> shape_names_;
  std::vector<const MeshPart*> materials_;
  std::vector<FbxNode> records_;
};

}  // namespace

std::string fbxBytes(const FaceMesh& mesh, const PrincipalShapes& shapes, std::string_view name,
                     const SceneTextures& textures, std::span<const std::string> shape_names) {
  return FbxScene(mesh, shapes, name, textures, shape_names).toBytes();
}

}  // namespace mouthpiece
