#include "retarget/rig/face_file.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "base/errors.h"
#include "base/files.h"
#include "base/json_fields.h"
#include "base/json_text.h"
#include "base/text_encoding.h"
#include "deform/mesh/mesh_files.h"
#include "deform/mesh/part_kind.h"
#include "retarget/rig/stored_mesh.h"

namespace mouthpiece {
namespace {

using nlohmann::json;

constexpr std::string_view kFormatName = "mouthpiece-face";
constexpr int kOldestFaceFormat = 2;  // its blobs stand where they belong
constexpr std::uint64_t kMaxFaceBytes = std::uint64_t{1} << 30;
constexpr std::size_t kMaxMarkers = 10'000;
constexpr int kMaxControlPoints = 100'000;
constexpr std::array<std::string_view, 3> kKernelNames{"inverse_multiquadric", "biharmonic", "triharmonic"};

/// rows x columns doubles, finite and of a size that a face can have.
template <typename MatrixType>
MatrixType matrixOf(const JsonField& field, std::size_t rows) {
  const std::vector<double> values = field.blob<double>();
  constexpr Eigen::Index kColumns = MatrixType::ColsAtCompileTime;
  if (values.size() != rows * unsignedIndex(kColumns))
    field.fail(fmt::format("found {} numbers; expected {} x {}", values.size(), rows, kColumns));
  if (!std::all_of(values.begin(), values.end(), [](double value) { return std::abs(value) <= 1e9; }))
    field.fail("found a coordinate that is no usable number");
  return Eigen::Map<const MatrixType>(values.data(), signedIndex(rows), kColumns);
}

/// One of an enumeration's values, which are counted from 0 to `last`.
template <typename Enumeration>
Enumeration choiceOf(const JsonField& field, Enumeration last) {
  return static_cast<Enumeration>(field.whole(0, static_cast<int>(last)));
}

std::vector<std::string> namesOf(const JsonField& field) {
  std::vector<std::string> names;
  std::set<std::string> seen;
  for (const JsonField& entry : field.list(0, kMaxMarkers)) {
    names.push_back(entry.text());
    if (names.back().empty()) entry.refuse("a name");
    if (!seen.insert(names.back()).second) entry.fail(fmt::format("found '{}' twice", printable(names.back(), 60)));
  }
  return names;
}

ControlPoint controlPointOf(const JsonField& field, std::size_t index) {
  ControlPoint point{.name = field["name"].text(),
                     .rule = choiceOf(field["rule"], PointRule::kInnerLip),
                     .side = choiceOf(field["side"], LipSide::kLower),
                     .drivers = {},
                     .opposite = static_cast<int>(field["opposite"].whole(-1, kMaxControlPoints)),
                     .fixed = field["fixed"].flag()};
  const auto drivers = field["driver_points"].blob<std::int32_t>();
  const auto weights = field["driver_weights"].blob<double>();
  if (drivers.size() != weights.size()) field["driver_weights"].fail("expected one weight a driver");
  for (std::size_t i = 0; i < drivers.size(); ++i) {
    if (drivers[i] < 0 || unsignedIndex(drivers[i]) >= index)
      field["driver_points"].fail("found a point that does not come before this one");
    if (!(std::abs(weights[i]) <= 1e6)) field["driver_weights"].fail("found a weight that is no usable number");
    point.drivers.push_back({drivers[i], weights[i]});
  }
  return point;
}

ControlMesh controlOf(const JsonField& field, std::size_t marker_count) {
  ControlMesh control;
  control.marker_count = marker_count;
  for (const JsonField& point : field["points"].list(0, kMaxControlPoints))
    control.points.push_back(controlPointOf(point, control.points.size()));
  const std::size_t count = control.points.size();
  control.mouth_width = field["mouth_width"].number(1e-9, 1e9);
  control.rest = matrixOf<MarkerPositions>(field["rest"], count);
  control.domain = matrixOf<decltype(control.domain)>(field["domain"], count);
  const auto corners = field["triangles"].blob<std::int32_t>();
  if (corners.size() % 3 != 0) field["triangles"].fail("expected three corners a triangle");
  for (std::size_t i = 0; i < corners.size(); i += 3)
    control.triangles.push_back({corners[i], corners[i + 1], corners[i + 2]});
  control.rest_slopes = matrixOf<MarkerPositions>(field["rest_slopes"], field["is_fitted"].flag() ? 2 * count : 0);
  checkControlMesh(control, field.file());
  return control;
}

FaceBinding bindingOf(const JsonField& field) {
  FaceBinding binding{.patch = field["patch"].blob<std::int32_t>(),
                      .u = field["u"].blob<float>(),
                      .v = field["v"].blob<float>(),
                      .d = field["d"].blob<float>(),
                      .skin_weight = field["skin_weight"].blob<float>(),
                      .jaw_weight = field["jaw_weight"].blob<float>()};
  if (field["carried"].exists()) binding.carried = field["carried"].blob<std::uint32_t>();
  if (field["pressed"].exists()) binding.pressed = field["pressed"].blob<float>();
  if (field["meets"].exists()) binding.meets = field["meets"].flag();
  if (field["tuck"].exists()) binding.tuck = asFloat(field["tuck"].number());
  if (const JsonField levelled = field["levelled"]; levelled.exists())
    binding.levelled = {levelled["vertices"].blob<std::uint32_t>(), levelled["ways"].blob<float>()};
  if (const JsonField relaxed = field["relaxed"]; relaxed.exists()) {
    binding.relaxed = {.vertices = relaxed["vertices"].blob<std::uint32_t>(),
                       .ends = relaxed["ends"].blob<std::uint32_t>(),
                       .from = relaxed["from"].blob<std::uint32_t>(),
                       .weights = relaxed["weights"].blob<float>()};
  }
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
          {"rest", blobOf(control.rest)},
          {"domain", blobOf(control.domain)},
          {"triangles", blobOf(corners)},
          {"is_fitted", control.rest_slopes.rows() > 0},
          {"rest_slopes", blobOf(control.rest_slopes)}};
}

void expectFace(std::string_view bytes, const std::string& file) {
  if (beginsAsFace(bytes)) return;
  std::string_view kind = kindOfNoText(bytes);
  if (kind.empty())
    kind = bytes.starts_with('{') ? "JSON, as a head's anchors are" : bytes.empty() ? "empty" : "no face";
  throw InputError(file, "", fmt::format("is {}; expected what `retarget fit` makes of a head and its anchors", kind));
}

}  // namespace

std::string_view nameOf(RbfKernel kernel) { return kKernelNames[static_cast<std::size_t>(kernel)]; }

std::optional<RbfKernel> kernelFromName(std::string_view name) {
  const auto found = std::find(kKernelNames.begin(), kKernelNames.end(), name);
  if (found == kKernelNames.end()) return std::nullopt;
  return static_cast<RbfKernel>(found - kKernelNames.begin());
}

bool beginsAsFace(std::string_view bytes) {
  const int first = bytes.empty() ? -1 : static_cast<std::uint8_t>(bytes.front());
  return bytes.starts_with(std::string_view("[\0", 2)) || (first >= 0xA0 && first < 0xC0);
}

FaceFile parseFaceFile(std::string_view bytes, const std::string& file) {
  expectFace(bytes, file);
  const JsonField root = parseCbor(bytes, file, "a face, as `retarget fit` writes it");
  if (root["format"].text() != kFormatName) root["format"].fail("is no face file; expected what `retarget fit` writes");
  const std::int64_t version = root["version"].whole(0, 1'000'000);
  if (version < kOldestFaceFormat || version > kFaceFormatVersion) {
    root["version"].fail(fmt::format("found {}; expected {} or {} (fit the face again with this program)", version,
                                     kOldestFaceFormat, kFaceFormatVersion));
  }
  FaceFile face;
  face.name = root["name"].text();
  face.corpus = root["corpus"].text();
  const JsonField mesh = root["mesh"];
  face.mesh_file = mesh["file"].text();
  face.mesh_sha256 = mesh["sha256"].text();
  if (face.mesh_file.empty() || face.mesh_file.find('\0') != std::string::npos ||
      std::filesystem::path(face.mesh_file).is_absolute())
    mesh["file"].refuse("the name of a mesh, from the face file's folder");
  face.metres_per_unit = mesh["metres_per_unit"].number(1e-9, 1e3);
  face.upright_from_mesh = matrixOf<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(mesh["upright"], 3);
  if (!(face.upright_from_mesh * face.upright_from_mesh.transpose()).isIdentity(1e-6) ||
      !(face.upright_from_mesh.determinant() > 0))
    mesh["upright"].fail("is no rotation");
  if (const JsonField object = mesh["object"]; object.exists()) face.mesh_object = object.text();
  for (const JsonField& part : mesh["part_kinds"].list(0, kMaxMarkers)) {
    const auto kind = partKindFromName(part["kind"].text());
    if (!kind) part["kind"].fail("is unknown");
    face.part_kinds[part["name"].text()] = *kind;
  }
  if (const JsonField stored = mesh["stored"]; stored.exists()) face.mesh = meshFrom(stored);
  face.marker_names = namesOf(root["markers"]);
  face.marker_targets = matrixOf<MarkerPositions>(root["marker_targets"], face.marker_names.size());
  face.actor_neutral_mm = matrixOf<MarkerPositions>(root["actor_neutral_mm"], face.marker_names.size());
  if (const JsonField closed = root["actor_closed_lips_mm"]; closed.exists())
    face.actor_closed_lips_mm = closed.number(0, 1e3);
  if (const JsonField unseen = root["actor_unseen_rounding"]; unseen.exists())
    face.actor_unseen = {unseen["narrowing"].number(0, 1), unseen["protrusion"].number(0, 1)};
  const JsonField warp = root["warp"];
  face.warp.kernel = static_cast<RbfKernel>(warp["kernel"].choice(kKernelNames));
  face.warp.shape_factor = warp["shape_factor"].number(1e-3, 1e3);
  face.warp.regularization = warp["regularization"].number(0, 1e6);
  face.control = controlOf(root["control"], face.marker_names.size());
  face.binding = bindingOf(root["binding"]);
  if (root["guard"].exists()) face.guard = root["guard"].blob<std::uint32_t>();
  return face;
}

FaceFile readFaceFile(const std::filesystem::path& path) {
  const std::string bytes = readFile(path, kMaxFaceBytes);
  if (isHeadMesh(path))
    throw InputError(path.string(), "", "is a head, no face yet; expected what `retarget fit` makes of it");
  return parseFaceFile(bytes, path.string());
}

std::string faceFileToBytes(const FaceFile& face) {
  json kinds = json::array();
  for (const auto& [name, kind] : face.part_kinds) kinds.push_back({{"name", name}, {"kind", nameOf(kind)}});
  json tree{{"format", kFormatName},
            {"version", kFaceFormatVersion},
            {"name", face.name},
            {"corpus", face.corpus},
            {"mesh",
             {{"file", face.mesh_file},
              {"sha256", face.mesh_sha256},
              {"metres_per_unit", face.metres_per_unit},
              {"upright", blobOf(Eigen::Matrix<double, 3, 3, Eigen::RowMajor>(face.upright_from_mesh))},
              {"part_kinds", std::move(kinds)}}},
            {"markers", face.marker_names},
            {"marker_targets", blobOf(face.marker_targets)},
            {"actor_neutral_mm", blobOf(face.actor_neutral_mm)},
            {"actor_closed_lips_mm", face.actor_closed_lips_mm},
            {"warp",
             {{"kernel", nameOf(face.warp.kernel)},
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
  if (const LipRounding& unseen = face.actor_unseen; unseen.narrowing > 0 || unseen.protrusion > 0)
    tree["actor_unseen_rounding"] = {{"narrowing", unseen.narrowing}, {"protrusion", unseen.protrusion}};
  if (!face.guard.empty()) tree["guard"] = blobOf(face.guard);
  if (face.mesh != nullptr) tree["mesh"]["stored"] = meshToJson(*face.mesh, true);
  if (!face.mesh_object.empty()) tree["mesh"]["object"] = face.mesh_object;
  if (!face.binding.pressed.empty()) tree["binding"]["pressed"] = blobOf(face.binding.pressed);
  if (face.binding.meets) tree["binding"]["meets"] = true;
  if (face.binding.tuck < 1) tree["binding"]["tuck"] = face.binding.tuck;
  if (const FaceBinding::Levelled& levelled = face.binding.levelled; !levelled.vertices.empty())
    tree["binding"]["levelled"] = {{"vertices", blobOf(levelled.vertices)}, {"ways", blobOf(levelled.ways)}};
  if (const FaceBinding::Relaxed& relaxed = face.binding.relaxed; !relaxed.vertices.empty()) {
    tree["binding"]["relaxed"] = {{"vertices", blobOf(relaxed.vertices)},
                                  {"ends", blobOf(relaxed.ends)},
                                  {"from", blobOf(relaxed.from)},
                                  {"weights", blobOf(relaxed.weights)}};
  }
  return cborBytes(tree);
}

void writeFaceFile(const std::filesystem::path& path, const FaceFile& face) {
  writeFileAtomically(path, faceFileToBytes(face));
}

}  // namespace mouthpiece
