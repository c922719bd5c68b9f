#include "retarget/rig/face_file.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <set>

#include "base/errors.h"
#include "base/files.h"
#include "retarget/rig/face_fields.h"

namespace mouthpiece {
namespace {

using nlohmann::json;

constexpr std::string_view kFormatName = "mouthpiece-face";
constexpr std::uint64_t kMaxFaceBytes = std::uint64_t{1} << 30;
constexpr std::size_t kMaxMarkers = 10'000;
constexpr std::size_t kMaxControlPoints = 100'000;
constexpr std::array<std::string_view, 3> kKernelNames{"inverse_multiquadric", "biharmonic", "triharmonic"};

std::vector<std::string> readNames(const FaceFields& fields, const char* key) {
  std::vector<std::string> names;
  std::set<std::string> seen;
  for (const json& entry : fields.array(key, kMaxMarkers)) {
    if (!entry.is_string() || entry.get_ref<const std::string&>().empty() ||
        entry.get_ref<const std::string&>().size() > kMaxFaceText)
      fields.fail(key, "expected a list of names");
    names.push_back(entry.get<std::string>());
    if (!seen.insert(names.back()).second)
      fields.fail(key, fmt::format("found '{}' twice", printable(names.back(), 60)));
  }
  return names;
}

WarpOptions readWarp(const FaceFields& fields) {
  WarpOptions options;
  const std::string kernel = fields.text("kernel");
  std::size_t index = 0;
  while (index < kKernelNames.size() && kKernelNames[index] != kernel) ++index;
  if (index == kKernelNames.size())
    fields.fail("kernel", fmt::format("found '{}'; expected {}", printable(kernel, 40), kKernelNames[0]));
  options.kernel = static_cast<RbfKernel>(index);
  options.shape_factor = fields.number("shape_factor", 1e-3, 1e3);
  options.regularization = fields.number("regularization", 0, 1e6);
  return options;
}

ControlPoint readControlPoint(const FaceFields& fields, std::size_t point_index) {
  ControlPoint point;
  point.name = fields.text("name");
  point.rule = static_cast<PointRule>(fields.whole("rule", 0, static_cast<int>(PointRule::kInnerLip)));
  point.side = static_cast<LipSide>(fields.whole("side", 0, static_cast<int>(LipSide::kLower)));
  point.opposite = static_cast<int>(fields.whole("opposite", -1, static_cast<std::int64_t>(kMaxControlPoints)));
  point.fixed = fields.flag("fixed");
  const std::vector<std::int32_t> drivers = fields.blob<std::int32_t>("driver_points");
  const std::vector<double> weights = fields.blob<double>("driver_weights");
  if (drivers.size() != weights.size()) fields.fail("driver_weights", "expected one weight a driver");
  for (std::size_t i = 0; i < drivers.size(); ++i) {
    if (drivers[i] < 0 || static_cast<std::size_t>(drivers[i]) >= point_index) {
      fields.fail("driver_points", "found a point that does not come before this one");
    }
    if (!(std::abs(weights[i]) <= 1e6)) fields.fail("driver_weights", "found a weight that is no usable number");
    point.drivers.push_back({drivers[i], weights[i]});
  }
  return point;
}

ControlMesh readControl(const FaceFields& fields, std::size_t marker_count) {
  ControlMesh control;
  control.marker_count = marker_count;
  const json& points = fields.array("points", kMaxControlPoints);
  for (const json& point : points) {
    control.points.push_back(
        readControlPoint(FaceFields(point, fields.file(), "control.points"), control.points.size()));
  }
  control.mouth_width = fields.number("mouth_width", 1e-9, 1e9);
  control.rest = fields.matrix<MarkerPositions>("rest", control.points.size());
  control.domain = fields.matrix<decltype(control.domain)>("domain", control.points.size());
  const std::vector<std::int32_t> corners = fields.blob<std::int32_t>("triangles");
  if (corners.size() % 3 != 0) fields.fail("triangles", "expected three corners a triangle");
  for (std::size_t i = 0; i < corners.size(); i += 3)
    control.triangles.push_back({corners[i], corners[i + 1], corners[i + 2]});
  control.rest_slopes =
      fields.matrix<MarkerPositions>("rest_slopes", fields.flag("is_fitted") ? 2 * control.points.size() : 0);
  checkControlMesh(control, fields.file());
  return control;
}

FaceBinding readBinding(const FaceFields& fields) {
  FaceBinding binding{.patch = fields.blob<std::int32_t>("patch"),
                      .u = fields.blob<float>("u"),
                      .v = fields.blob<float>("v"),
                      .d = fields.blob<float>("d"),
                      .skin_weight = fields.blob<float>("skin_weight"),
                      .jaw_weight = fields.blob<float>("jaw_weight")};
  if (fields.has("carried")) binding.carried = fields.blob<std::uint32_t>("carried");
  return binding;
}

json controlToJson(const ControlMesh& control) {
  json points = json::array();
  for (const ControlPoint& point : control.points) {
    std::vector<std::int32_t> drivers;
    std::vector<double> weights;
    for (const PointDriver& driver : point.drivers) {
      drivers.push_back(driver.point);
      weights.push_back(driver.weight);
    }
    points.push_back({{"name", point.name},
                      {"rule", static_cast<int>(point.rule)},
                      {"side", static_cast<int>(point.side)},
                      {"opposite", point.opposite},
                      {"fixed", point.fixed},
                      {"driver_points", blobOf(drivers)},
                      {"driver_weights", blobOf(weights)}});
  }
  std::vector<std::int32_t> corners;
  for (const auto& triangle : control.triangles) corners.insert(corners.end(), triangle.begin(), triangle.end());
  return {{"mouth_width", control.mouth_width},
          {"points", std::move(points)},
          {"rest", blobOfMatrix(control.rest)},
          {"domain", blobOfMatrix(control.domain)},
          {"triangles", blobOf(corners)},
          {"is_fitted", control.rest_slopes.rows() > 0},
          {"rest_slopes", blobOfMatrix(control.rest_slopes)}};
}

}  // namespace

std::string_view nameOf(RbfKernel kernel) { return kKernelNames[static_cast<std::size_t>(kernel)]; }

std::optional<RbfKernel> kernelFromName(std::string_view name) {
  for (std::size_t i = 0; i < kKernelNames.size(); ++i) {
    if (kKernelNames[i] == name) return static_cast<RbfKernel>(i);
  }
  return std::nullopt;
}

FaceFile parseFaceFile(std::string_view bytes, const std::string& file) {
  const json tree = parseFaceTree(bytes, file);
  const FaceFields fields(tree, file, "");
  if (fields.text("format") != kFormatName)
    fields.fail("format", "is no face file; expected what `retarget fit` writes");
  const std::int64_t version = fields.whole("version", 0, 1'000'000);
  if (version != kFaceFormatVersion) {
    fields.fail("version", fmt::format("found {}; expected {} (fit the face again with this program)", version,
                                       kFaceFormatVersion));
  }
  FaceFile face;
  face.name = fields.text("name");
  face.corpus = fields.text("corpus");
  const FaceFields mesh = fields.map("mesh");
  face.mesh_file = mesh.text("file");
  face.mesh_sha256 = mesh.text("sha256");
  if (face.mesh_file.empty() || face.mesh_file.find('\0') != std::string::npos)
    mesh.fail("file", "expected the name of a mesh");
  face.metres_per_unit = mesh.number("metres_per_unit", 1e-9, 1e3);
  using RowMajor3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  face.upright_from_mesh = mesh.matrix<RowMajor3>("upright", 3);
  if (!(face.upright_from_mesh * face.upright_from_mesh.transpose()).isIdentity(1e-6) ||
      !(face.upright_from_mesh.determinant() > 0)) {
    mesh.fail("upright", "is no rotation");
  }
  for (const json& entry : mesh.array("part_kinds", kMaxMarkers)) {
    const FaceFields part(entry, file, "mesh.part_kinds");
    const auto kind = partKindFromName(part.text("kind"));
    if (!kind) part.fail("kind", "is unknown");
    face.part_kinds[part.text("name")] = *kind;
  }
  face.marker_names = readNames(fields, "markers");
  face.marker_targets = fields.matrix<MarkerPositions>("marker_targets", face.marker_names.size());
  face.actor_neutral_mm = fields.matrix<MarkerPositions>("actor_neutral_mm", face.marker_names.size());
  if (tree.contains("actor_closed_lips_mm")) face.actor_closed_lips_mm = fields.number("actor_closed_lips_mm", 0, 1e3);
  face.warp = readWarp(fields.map("warp"));
  face.control = readControl(fields.map("control"), face.marker_names.size());
  face.binding = readBinding(fields.map("binding"));
  return face;
}

FaceFile readFaceFile(const std::filesystem::path& path) {
  return parseFaceFile(readFile(path, kMaxFaceBytes), path.string());
}

std::string faceFileToBytes(const FaceFile& face) {
  json kinds = json::array();
  for (const auto& [name, kind] : face.part_kinds) kinds.push_back({{"name", name}, {"kind", nameOf(kind)}});
  const json tree{{"format", kFormatName},
                  {"version", kFaceFormatVersion},
                  {"name", face.name},
                  {"corpus", face.corpus},
                  {"mesh",
                   {{"file", face.mesh_file},
                    {"sha256", face.mesh_sha256},
                    {"metres_per_unit", face.metres_per_unit},
                    {"upright", blobOfMatrix(Eigen::Matrix<double, 3, 3, Eigen::RowMajor>(face.upright_from_mesh))},
                    {"part_kinds", std::move(kinds)}}},
                  {"markers", face.marker_names},
                  {"marker_targets", blobOfMatrix(face.marker_targets)},
                  {"actor_neutral_mm", blobOfMatrix(face.actor_neutral_mm)},
                  {"actor_closed_lips_mm", face.actor_closed_lips_mm},
                  {"warp",
                   {{"kernel", kKernelNames[static_cast<std::size_t>(face.warp.kernel)]},
                    {"shape_factor", face.warp.shape_factor},
                    {"regularization", face.warp.regularization}}},
                  {"control", controlToJson(face.control)},
                  {"binding",
                   {{"patch", blobOf(face.binding.patch)},
                    {"u", blobOf(face.binding.u)},
                    {"v", blobOf(face.binding.v)},
                    {"d", blobOf(face.binding.d)},
                    {"skin_weight", blobOf(face.binding.skin_weight)},
                    {"jaw_weight", blobOf(face.binding.jaw_weight)},
                    {"carried", blobOf(face.binding.carried)}}}};
  std::string bytes;
  json::to_cbor(tree, bytes);
  return bytes;
}

void writeFaceFile(const std::filesystem::path& path, const FaceFile& face) {
  writeFileAtomically(path, faceFileToBytes(face));
}

void turnMesh(const Eigen::Matrix3d& turn, FaceMesh& mesh) {
  if (turn.isIdentity(0)) return;
  mesh.vertices = (mesh.vertices.cast<double>() * turn.transpose()).cast<float>().eval();
}

FaceMesh readMeshOf(const FaceFile& face, const std::filesystem::path& face_path) {
  const std::filesystem::path mesh_path = face_path.parent_path() / face.mesh_file;
  std::error_code error;
  if (!std::filesystem::is_regular_file(mesh_path, error)) {
    throw InputError(
        face_path.string(), "mesh.file",
        fmt::format("names {}, which is not there; expected the mesh of the fit", printable(mesh_path.string(), 300)));
  }
  const std::string bytes = readFile(mesh_path, kMaxFaceBytes);
  const std::string hash = sha256Hex(bytes);
  if (hash != face.mesh_sha256) {
    throw InputError(
        mesh_path.string(), "",
        fmt::format("has changed since {} was fitted to it (SHA-256 {}..., expected {}...); run `retarget fit` again",
                    face_path.filename().string(), hash.substr(0, 12), printable(face.mesh_sha256, 12)));
  }
  FaceMesh mesh = parseFaceMesh(bytes, mesh_path);
  mesh.metres_per_unit = face.metres_per_unit;
  turnMesh(face.upright_from_mesh, mesh);
  for (MeshPart& part : mesh.parts) {
    if (const auto kind = face.part_kinds.find(part.name); kind != face.part_kinds.end()) part.kind = kind->second;
  }
  return mesh;
}

}  // namespace mouthpiece
