#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <iterator>

#include "base/index.h"
#include "base/zip.h"
#include "deform/mesh/face_mesh.h"
#include "exports/scenes/scene_files.h"
#include "exports/scenes/scene_shape.h"

namespace mouthpiece {
namespace {

/// What USD takes as the name of a prim: letters, digits, `_`, not starting with a digit.
std::string primName(std::string_view name) {
  std::string prim;
  for (const char c : name) {
    const bool is_kept = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
    prim.push_back(is_kept ? c : '_');
  }
  if (prim.empty() || (prim.front() >= '0' && prim.front() <= '9')) prim.insert(prim.begin(), '_');
  return prim;
}

template <typename Values>
std::string listed(const Values& values) {
  return fmt::format("[{}]", fmt::join(values, ", "));
}

std::string point(const float* values, double scale) {
  return fmt::format("({:.7g}, {:.7g}, {:.7g})", scale * static_cast<double>(values[0]),
                     scale * static_cast<double>(values[1]), scale * static_cast<double>(values[2]));
}

/// A text between quotes: any name but for control characters.
std::string usdString(std::string_view text) {
  std::string marked = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') marked.push_back('\\');
    marked.push_back(static_cast<unsigned char>(c) < ' ' ? ' ' : c);
  }
  return marked + '"';
}

/// A prim of what shape `k` moves and turns.
std::string blendShape(const PrincipalShapes& shapes, const ShapeNormals& normals, Eigen::Index k,
                       const std::string& name, double metres_per_unit) {
  const SceneShape shape = sceneShape(shapes, normals, k);
  std::vector<std::string> offsets, turns;
  for (std::size_t i = 0; i < shape.vertices.size(); ++i) {
    offsets.push_back(point(&shape.moves[3 * i], metres_per_unit));
    turns.push_back(point(&shape.turns[3 * i], 1));
  }
  return fmt::format(
      "        def BlendShape \"{}\"\n        {{\n            uniform vector3f[] offsets = {}\n            uniform "
      "vector3f[] normalOffsets = {}\n            uniform int[] pointIndices = {}\n        }}\n",
      name, listed(offsets), listed(turns), listed(shape.vertices));
}

std::string_view wrapName(SceneTexture::Wrap wrap) {
  switch (wrap) {
    case SceneTexture::Wrap::kClamp:
      return "clamp";
    case SceneTexture::Wrap::kMirror:
      return "mirror";
    default:
      return "repeat";
  }
}

/// A shader `name` of the material `path` that reads a picture; `inputs`: how its numbers are taken.
std::string textureShader(std::string_view name, std::string_view path, const SceneTexture& shown,
                          const SceneTextures& textures, std::string_view inputs) {
  return fmt::format(
      R"(
            def Shader "{0}"
            {{
                uniform token info:id = "UsdUVTexture"
                asset inputs:file = @{1}@
                float2 inputs:st.connect = </{2}/st.outputs:result>
                token inputs:wrapS = "{3}"
                token inputs:wrapT = "{4}"
{5}
                float3 outputs:rgb
                float outputs:a
            }}
)",
      name, textures.pictures[shown.picture].name, path, wrapName(shown.u), wrapName(shown.v), inputs);
}

/// The material of a part, at `path`.
std::string materialOf(const FaceMesh& mesh, const MeshPart& part, const std::string& path,
                       const SceneTextures& textures) {
  using Alpha = SceneTextures::Material::Alpha;
  const SceneTextures::Material shown = textures.of(part.material);
  std::string surface, shaders;
  if (shown.color) {
    surface += fmt::format("                color3f inputs:diffuseColor.connect = </{}/color.outputs:rgb>\n", path);
    if (shown.alpha != Alpha::kOpaque)
      surface += fmt::format("                float inputs:opacity.connect = </{}/color.outputs:a>\n", path);
    if (shown.alpha == Alpha::kCutOut)
      surface += fmt::format("                float inputs:opacityThreshold = {:.4g}\n", shown.cut_off);
    shaders += textureShader("color", path, *shown.color, textures,
                             fmt::format("                token inputs:sourceColorSpace = \"sRGB\"\n                "
                                         "float4 inputs:scale = ({:.4g})",
                                         fmt::join(part.base_color, ", ")));
  } else {
    const std::array<float, 4> color = meanColor(mesh, part);
    surface += fmt::format("                color3f inputs:diffuseColor = ({:.4g}, {:.4g}, {:.4g})\n", color[0],
                           color[1], color[2]);
  }
  if (shown.normal) {
    surface += fmt::format("                normal3f inputs:normal.connect = </{}/normal.outputs:rgb>\n", path);
    shaders += textureShader("normal", path, *shown.normal, textures,
                             "                token inputs:sourceColorSpace = \"raw\"\n                float4 "
                             "inputs:scale = (2, 2, 2, 1)\n                float4 inputs:bias = (-1, -1, -1, 0)");
  }
  if (!shaders.empty())
    shaders += R"(
            def Shader "st"
            {
                uniform token info:id = "UsdPrimvarReader_float2"
                string inputs:varname = "st"
                float2 outputs:result
            }
)";
  return fmt::format(
      R"(        def Material "{0}" (
            displayName = {1}
        )
        {{
            token outputs:surface.connect = </{2}/surface.outputs:surface>

            def Shader "surface"
            {{
                uniform token info:id = "UsdPreviewSurface"
{3}                float inputs:roughness = {4:.4g}
                token outputs:surface
            }}
{5}        }}
)",
      path.substr(path.rfind('/') + 1), usdString(part.name), path, surface, part.roughness, shaders);
}

std::string usdText(const FaceMesh& mesh, const PrincipalShapes& shapes, std::string_view name,
                    const SceneTextures& textures, std::span<const std::string> shape_names) {
  const std::string head = primName(name);
  std::vector<std::string> names, tokens, targets;
  for (std::size_t k = 0; k < unsignedIndex(shapes.shapeCount()); ++k) {
    names.push_back(k < shape_names.size() ? primName(shape_names[k]) : fmt::format("shape_{:02}", k));
    tokens.push_back(usdString(names.back()));
    targets.push_back(fmt::format("</{}/Face/{}>", head, names.back()));
  }
  const ShapeNormals made = shapeNormals(mesh.triangles, shapes);
  std::vector<std::string> points, normals;
  std::vector<std::uint32_t> corners;
  for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v)
    points.push_back(point(mesh.vertices.row(v).data(), mesh.metres_per_unit));
  for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v) normals.push_back(point(made.rest.data() + 3 * v, 1));
  for (const Triangle& triangle : mesh.triangles) corners.insert(corners.end(), triangle.begin(), triangle.end());
  const std::vector<int> counts(mesh.triangles.size(), 3);
  constexpr std::string_view kIdentity = "( (1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1) )";

  std::string usd = fmt::format(
      "#usda 1.0\n(\n    defaultPrim = \"{}\"\n    doc = \"Mouthpiece\"\n    startTimeCode = 0\n    endTimeCode = {}\n "
      "   "
      "timeCodesPerSecond = {}\n    framesPerSecond = {}\n    metersPerUnit = 1\n    upAxis = \"Y\"\n)\n\ndef SkelRoot "
      "\"{}\" (\n    prepend apiSchemas = [\"SkelBindingAPI\"]\n    displayName = {}\n)\n{{\n",
      head, std::max<Eigen::Index>(0, shapes.frameCount() - 1), shapes.frame_rate_hz, shapes.frame_rate_hz, head,
      usdString(name));
  usd += fmt::format(
      "    def Skeleton \"Skeleton\" (\n        prepend apiSchemas = [\"SkelBindingAPI\"]\n    )\n    {{\n        "
      "uniform "
      "token[] joints = [\"head\"]\n        uniform matrix4d[] bindTransforms = [{0}]\n        uniform matrix4d[] "
      "restTransforms = [{0}]\n        rel skel:animationSource = </{1}/Speech>\n    }}\n\n",
      kIdentity, head);
  usd += fmt::format(
      "    def SkelAnimation \"Speech\"\n    {{\n        uniform token[] blendShapes = {}\n        float[] "
      "blendShapeWeights.timeSamples = {{\n",
      listed(tokens));
  for (Eigen::Index frame = 0; frame < shapes.frameCount(); ++frame) {
    const auto row = shapes.weights.row(frame);
    fmt::format_to(std::back_inserter(usd), "            {}: [{:.6g}],\n", frame,
                   fmt::join(row.data(), row.data() + row.size(), ", "));
  }
  usd +=
      "        }\n    }\n\n    def Mesh \"Face\" (\n        prepend apiSchemas = [\"SkelBindingAPI\", "
      "\"MaterialBindingAPI\"]\n    )\n    {\n";
  usd += fmt::format(
      "        uniform token subdivisionScheme = \"none\"\n        int[] faceVertexCounts = {}\n        int[] "
      "faceVertexIndices = {}\n        point3f[] points = {}\n        normal3f[] normals = {} (\n            "
      "interpolation = \"vertex\"\n        )\n        rel skel:skeleton = </{}/Skeleton>\n        "
      "uniform "
      "token[] skel:blendShapes = {}\n        rel skel:blendShapeTargets = {}\n",
      listed(counts), listed(corners), listed(points), listed(normals), head, listed(tokens), listed(targets));
  if (!mesh.texture_coordinates.empty()) {
    std::vector<std::string> places;
    for (const auto& [u, v] : mesh.texture_coordinates) places.push_back(fmt::format("({:.6g}, {:.6g})", u, 1 - v));
    usd += fmt::format("        texCoord2f[] primvars:st = {} (\n            interpolation = \"vertex\"\n        )\n",
                       listed(places));
  }
  // A part is a subset with a material of its own.
  std::size_t number = 0;
  for (const MeshPart& part : mesh.parts) {
    if (part.triangle_count == 0) continue;
    std::vector<std::size_t> faces(part.triangle_count);
    for (std::size_t i = 0; i < faces.size(); ++i) faces[i] = part.first_triangle + i;
    usd += fmt::format(
        "\n        def GeomSubset \"part_{0}\" (\n            prepend apiSchemas = [\"MaterialBindingAPI\"]\n        "
        ")\n     "
        "   {{\n            uniform token elementType = \"face\"\n            uniform token familyName = "
        "\"materialBind\"\n "
        "           int[] indices = {1}\n            rel material:binding = </{2}/Materials/part_{0}>\n        }}\n",
        number++, listed(faces), head);
  }
  for (Eigen::Index k = 0; k < shapes.shapeCount(); ++k)
    usd.append("\n").append(blendShape(shapes, made, k, names[unsignedIndex(k)], mesh.metres_per_unit));
  usd += "    }\n\n    def Scope \"Materials\"\n    {\n";
  number = 0;
  for (const MeshPart& part : mesh.parts) {
    if (part.triangle_count == 0) continue;
    usd += materialOf(mesh, part, fmt::format("{}/Materials/part_{}", head, number), textures);
    ++number;
  }
  return usd + "    }\n}\n";
}

}  // namespace

std::string usdaText(const FaceMesh& mesh, const PrincipalShapes& shapes, std::string_view name,
                     std::span<const std::string> shape_names) {
  return usdText(mesh, shapes, name, {}, shape_names);
}

std::string usdzBytes(const FaceMesh& mesh, const PrincipalShapes& shapes, std::string_view name,
                      const SceneTextures& textures, std::span<const std::string> shape_names) {
  constexpr std::size_t kAlignment = 64;  // a reader maps the file
  ZipWriter archive;
  archive.add("face.usda", usdText(mesh, shapes, name, textures, shape_names), kAlignment);
  for (const ScenePicture& picture : textures.pictures) archive.add(picture.name, picture.bytes, kAlignment);
  return std::move(archive).finish();
}

}  // namespace mouthpiece
