#include "tests/unit/deform/sample_face.h"
#include "deform/mesh/face_mesh.h"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>

namespace mouthpiece::samples {
namespace {

struct FlatMarker {
  const char* name;
  double x, y;
};
/// Markers of face66 seen from the front, mm; every one lies on the egg.
constexpr FlatMarker kMarkers[] = {
    {"FOREHEAD_TOP", 0, 83},     {"FOREHEAD_MID", 0, 65},        {"FOREHEAD_LOW", 0, 49},
    {"FOREHEAD_IN_R", -35, 80},  {"FOREHEAD_IN_L", 35, 80},      {"FOREHEAD_OUT_R", -45, 63},
    {"FOREHEAD_OUT_L", 45, 63},  {"TEMPLE_R", -76, 24},          {"TEMPLE_L", 76, 24},
    {"BROW_OUT_R", -57, 43},     {"BROW_MIDOUT_R", -50, 48},     {"BROW_MID_R", -40, 51},
    {"BROW_MIDIN_R", -28, 51},   {"BROW_IN_R", -14, 50},         {"BROW_OUT_L", 57, 43},
    {"BROW_MIDOUT_L", 50, 48},   {"BROW_MID_L", 40, 51},         {"BROW_MIDIN_L", 28, 51},
    {"BROW_IN_L", 14, 50},       {"LID_UP_R", -32, 30},          {"LID_UP_L", 32, 30},
    {"LID_LO_R", -32, 22},       {"LID_LO_L", 32, 22},           {"CANTHUS_OUT_R", -47, 26.5},
    {"CANTHUS_OUT_L", 47, 26.5}, {"NOSE_ROOT", 0, 25},           {"NOSE_BRIDGE", 0, 15},
    {"NOSE_TIP", 0, -5},         {"NOSE_BASE", 0, -21},          {"NOSE_ALA_R", -16.5, -6},
    {"NOSE_ALA_L", 16.5, -6},    {"NOSTRIL_R", -14, -17},        {"NOSTRIL_L", 14, -17},
    {"CHEEK_HIGH_R", -53, 9},    {"CHEEK_HIGH_L", 53, 9},        {"CHEEK_BONE_R", -48, -7},
    {"CHEEK_BONE_L", 48, -7},    {"CHEEK_MID_R", -38, -15},      {"CHEEK_MID_L", 38, -15},
    {"CHEEK_LOW_R", -53, -22},   {"CHEEK_LOW_L", 53, -22},       {"CHEEK_NOSE_R", -28, -7},
    {"CHEEK_NOSE_L", 28, -7},    {"CHEEK_MOUTH_R", -35, -32},    {"CHEEK_MOUTH_L", 35, -32},
    {"LIP_CORNER_R", -25, -43},  {"LIP_CORNER_L", 25, -43},      {"LIP_UP_OUT_R", -19, -38},
    {"LIP_UP_OUT_L", 19, -38},   {"LIP_UP_IN_R", -7, -33},       {"LIP_UP_IN_L", 7, -33},
    {"LIP_UP_MID", 0, -34},      {"LIP_LO_OUT_R", -18.5, -48.5}, {"LIP_LO_OUT_L", 18.5, -48.5},
    {"LIP_LO_IN_R", -7, -53},    {"LIP_LO_IN_L", 7, -53},        {"LIP_LO_MID", 0, -53.6},
    {"CHIN_UP", 0, -61},         {"CHIN_MID", 0, -79},           {"CHIN_LOW", 0, -94},
    {"JAW_FRONT_R", -32, -85},   {"JAW_FRONT_L", 32, -85},       {"JAW_MID_R", -59, -62},
    {"JAW_MID_L", 59, -62},      {"JAW_BACK_R", -72, -29},       {"JAW_BACK_L", 72, -29},
};

constexpr double kSlitY = -43;
constexpr double kSlitHalf = 22;

double eggDepth(double x, double y) {
  const double inside = 1 - std::pow(x / 84, 2) - std::pow((y + 5) / 135, 2);
  return 75 * std::sqrt(std::max(inside, 1e-4));
}

Eigen::Vector3d onEgg(double x, double y) { return {x, y, eggDepth(x, y)}; }

/// Adds a part of triangles over a rows x columns grid of points, two a cell, facing +Z.
class Builder {
 public:
  explicit Builder(SampleFace& face) : face_(face) {}

  std::uint32_t vertex(const Eigen::Vector3d& p) {
    points_.push_back(p);
    return static_cast<std::uint32_t>(points_.size() - 1);
  }
  void beginPart(const std::string& name, PartKind kind) {
    face_.mesh.parts.push_back({.name = name, .kind = kind, .first_triangle = face_.mesh.triangles.size()});
  }
  void triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    face_.mesh.triangles.push_back({a, b, c});
    ++face_.mesh.parts.back().triangle_count;
  }
  void box(const std::string& name, PartKind kind, const Eigen::Vector3d& low, const Eigen::Vector3d& high, int steps) {
    beginPart(name, kind);
    std::vector<std::uint32_t> ids;
    for (int i = 0; i <= steps; ++i) {
      for (int j = 0; j <= steps; ++j) {
        const Eigen::Vector3d share(static_cast<double>(i) / steps, (i + j) % 2, static_cast<double>(j) / steps);
        ids.push_back(vertex(low + share.cwiseProduct(high - low)));
      }
    }
    for (int i = 0; i < steps; ++i) {
      for (int j = 0; j < steps; ++j) {
        const auto at = [&](int a, int b) { return ids[static_cast<std::size_t>(a * (steps + 1) + b)]; };
        triangle(at(i, j), at(i + 1, j), at(i, j + 1));
        triangle(at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
      }
    }
  }
  void finish() {
    face_.mesh.vertices.resize(static_cast<Eigen::Index>(points_.size()), 3);
    for (std::size_t i = 0; i < points_.size(); ++i)
      face_.mesh.vertices.row(static_cast<Eigen::Index>(i)) = points_[i].transpose().cast<float>();
  }
  [[nodiscard]] std::size_t vertexCount() const { return points_.size(); }

 private:
  SampleFace& face_;
  std::vector<Eigen::Vector3d> points_;
};

/// Rows of vertices from the bottom up; the row on the slit is doubled between the mouth's corners.
void addSkin(SampleFace& face, Builder& builder, double spacing) {
  builder.beginPart("skin", PartKind::kSkin);
  const int below = static_cast<int>(std::floor((kSlitY + 115) / spacing));
  const int rows = below + static_cast<int>(std::floor((105 - kSlitY) / spacing)) + 1;
  const int half = static_cast<int>(std::floor(78 / spacing));
  struct Pair {
    std::int64_t lower = -1, upper = -1;
  };
  std::vector<std::vector<Pair>> grid(static_cast<std::size_t>(rows),
                                      std::vector<Pair>(static_cast<std::size_t>(2 * half + 1)));
  for (int r = 0; r < rows; ++r) {
    for (int c = -half; c <= half; ++c) {
      const double x = c * spacing, y = kSlitY + (r - below) * spacing;
      if (std::pow(x / 80, 2) + std::pow((y + 5) / 125, 2) > 1) continue;
      Pair& pair = grid[static_cast<std::size_t>(r)][static_cast<std::size_t>(c + half)];
      pair.lower = builder.vertex(onEgg(x, y));
      face.is_above_slit.push_back(r > below);
      pair.upper = pair.lower;
      if (r == below && std::abs(x) < kSlitHalf) {
        pair.upper = builder.vertex(onEgg(x, y));
        face.is_above_slit.push_back(true);
      }
    }
  }
  for (int r = 0; r + 1 < rows; ++r) {
    for (int c = 0; c < 2 * half; ++c) {
      const auto& low = grid[static_cast<std::size_t>(r)];
      const auto& high = grid[static_cast<std::size_t>(r + 1)];
      const auto k = static_cast<std::size_t>(c);
      // The upper of a doubled row belongs to the cells above it, the lower to those below.
      const std::int64_t a = low[k].upper, b = low[k + 1].upper, d = high[k].lower, e = high[k + 1].lower;
      if (a < 0 || b < 0 || d < 0 || e < 0) continue;
      builder.triangle(static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b), static_cast<std::uint32_t>(e));
      builder.triangle(static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(e), static_cast<std::uint32_t>(d));
    }
  }
  face.skin_vertices = builder.vertexCount();
}

void addKnown(SampleFace& face) {
  for (const auto& [end, x] :
       {std::pair("OUT_R", -15.0), {"IN_R", -6.0}, {"MID", 0.0}, {"IN_L", 6.0}, {"OUT_L", 15.0}}) {
    face.known[std::string("RIM_UP_") + end] = face.known[std::string("RIM_LO_") + end] = onEgg(x, kSlitY);
  }
  face.known["RIM_CORNER_R"] = onEgg(-21.5, kSlitY);
  face.known["RIM_CORNER_L"] = onEgg(21.5, kSlitY);
}

}  // namespace

SampleFace makeSampleFace(double spacing_mm) {
  SampleFace face;
  face.rest.resize(std::size(kMarkers), 3);
  for (std::size_t i = 0; i < std::size(kMarkers); ++i) {
    face.names.emplace_back(kMarkers[i].name);
    face.rest.row(static_cast<Eigen::Index>(i)) = onEgg(kMarkers[i].x, kMarkers[i].y).transpose();
  }
  addKnown(face);
  Builder builder(face);
  addSkin(face, builder, spacing_mm);
  builder.box("upper_teeth", PartKind::kUpperTeeth, {-20, -42, 35}, {20, -34, 52}, 8);
  builder.box("lower_teeth", PartKind::kLowerTeeth, {-20, -52, 35}, {20, -44, 50}, 8);
  builder.box("tongue", PartKind::kTongue, {-15, -50, 5}, {15, -45, 45}, 10);
  builder.box("eye", PartKind::kEye, {-42, 16, 40}, {-22, 36, 52}, 4);
  builder.finish();
  return face;
}

const SampleFace& sampleFace() {
  static const SampleFace face = makeSampleFace(2);
  return face;
}

const ControlMesh& sampleControl() {
  static const ControlMesh control =
      buildControlMesh(sampleFace().names, sampleFace().rest, sampleFace().known, &sampleFace().mesh);
  return control;
}

const FaceBinding& sampleBinding() {
  static const FaceBinding binding = bindFace(sampleFace().mesh, sampleControl());
  return binding;
}

MarkerPositions openMouth(const SampleFace& face, double mm) {
  MarkerPositions pose = face.rest;
  for (std::size_t i = 0; i < face.names.size(); ++i) {
    const std::string& name = face.names[i];
    double share = 0;
    if (name.starts_with("LIP_LO") || name.starts_with("CHIN")) share = 1;
    if (name.starts_with("JAW_FRONT")) share = 0.8;
    if (name.starts_with("JAW_MID") || name.starts_with("LIP_CORNER")) share = 0.35;
    if (name.starts_with("CHEEK_MOUTH") || name.starts_with("CHEEK_LOW")) share = 0.2;
    pose(static_cast<Eigen::Index>(i), 1) -= share * mm;
    pose(static_cast<Eigen::Index>(i), 2) -= 0.25 * share * mm;
  }
  return pose;
}

MarkerPositions randomPose(const SampleFace& face, std::mt19937& random) {
  std::uniform_real_distribution<double> opening(-4, 20), spread(-5, 6), forward(-2, 6);
  std::normal_distribution<double> tremble(0, 0.8);
  MarkerPositions pose = openMouth(face, opening(random));
  const double wide = spread(random), out = forward(random);
  for (std::size_t i = 0; i < face.names.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    if (face.names[i].starts_with("LIP_")) {
      pose(row, 0) += wide * face.rest(row, 0) / 25;
      pose(row, 2) += out;
    }
    for (Eigen::Index axis = 0; axis < 3; ++axis) pose(row, axis) += tremble(random);
  }
  return pose;
}

namespace {

/// The points of a C3D file as grid_s1 has them: Intel floats, 66 markers. Frames x 198; empty when it is not such a
/// file.
std::vector<MarkerPositions> framesOf(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  const std::vector<char> bytes{std::istreambuf_iterator<char>(in), {}};
  const auto word = [&](std::size_t at) {
    std::uint16_t value = 0;
    std::memcpy(&value, bytes.data() + at, sizeof value);
    return static_cast<std::size_t>(value);
  };
  if (bytes.size() < 1024 || word(2) != std::size(kMarkers)) return {};
  const std::size_t frames = word(8) - word(6) + 1, begin = 512 * (word(16) - 1), stride = 4 * (4 * word(2) + word(4));
  std::vector<MarkerPositions> poses;
  for (std::size_t f = 0; f < frames && begin + (f + 1) * stride <= bytes.size(); ++f) {
    MarkerPositions pose(std::size(kMarkers), 3);
    bool is_whole = true;
    for (std::size_t m = 0; m < std::size(kMarkers); ++m) {
      std::array<float, 4> sample{};
      std::memcpy(sample.data(), bytes.data() + begin + f * stride + 16 * m, sizeof sample);
      is_whole = is_whole && sample[3] >= 0;
      pose.row(static_cast<Eigen::Index>(m)) = Eigen::RowVector3d(sample[0], sample[1], sample[2]);
    }
    if (is_whole) poses.push_back(pose);
  }
  return poses;
}

/// `pose` moved rigidly so that its markers fit `reference` best.
MarkerPositions aligned(const MarkerPositions& pose, const MarkerPositions& reference) {
  // The first nine markers sit on forehead and temples.
  const Eigen::RowVector3d from = pose.topRows(9).colwise().mean(), to = reference.topRows(9).colwise().mean();
  const Eigen::Matrix3d covariance =
      (pose.topRows(9).rowwise() - from).transpose() * (reference.topRows(9).rowwise() - to);
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d turn = svd.matrixU() * svd.matrixV().transpose();
  if (turn.determinant() < 0) turn = svd.matrixU() * Eigen::Vector3d(1, 1, -1).asDiagonal() * svd.matrixV().transpose();
  return ((pose.rowwise() - from) * turn).rowwise() + to;
}

}  // namespace

std::vector<MarkerPositions> capturedDisplacements(std::size_t takes, std::size_t every) {
  const std::filesystem::path folder =
      std::filesystem::path(MOUTHPIECE_SOURCE_DIR) / ".." / "shared" / "capture" / "grid_s1" / "takes";
  std::error_code absent;
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder, absent)) {
    if (entry.path().extension() == ".c3d") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  std::vector<MarkerPositions> displacements;
  for (std::size_t t = 0; t < std::min(takes, files.size()); ++t) {
    const std::vector<MarkerPositions> frames = framesOf(files[t]);
    if (frames.empty()) continue;
    for (std::size_t f = 0; f < frames.size(); f += every)
      displacements.push_back(aligned(frames[f], frames.front()) - frames.front());
  }
  return displacements;
}

}  // namespace mouthpiece::samples
