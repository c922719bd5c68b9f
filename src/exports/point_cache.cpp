#include <fmt/format.h>

#include <bit>
#include <cstdint>
#include <iterator>
#include <limits>

#include "base/errors.h"
#include "base/file_parts.h"
#include "base/index.h"
#include "deform/mesh/face_mesh.h"
#include "exports/format_bytes.h"

namespace mouthpiece {
namespace {

void appendWord(std::string& bytes, std::uint32_t word, std::endian order) {
  for (int i = 0; i < 4; ++i) {
    const int shift = order == std::endian::little ? 8 * i : 8 * (3 - i);
    bytes.push_back(static_cast<char>(word >> shift));
  }
}

void appendFloats(std::string& bytes, const float* values, std::size_t count, std::endian order) {
  if (order == std::endian::native) {
    bytes.append(reinterpret_cast<const char*>(values), count * sizeof(float));
    return;
  }
  for (std::size_t i = 0; i < count; ++i) appendWord(bytes, std::bit_cast<std::uint32_t>(values[i]), order);
}

struct Counts {
  std::uint32_t frames = 0;
  std::uint32_t vertices = 0;
};

/// Both formats count in signed 32 bits.
Counts countsOf(const FrameMaker& frames) {
  MOUTHPIECE_EXPECT(frames.frame_rate_hz > 0 && frames.width % 3 == 0);
  MOUTHPIECE_EXPECT(frames.frame_count <= std::numeric_limits<std::int32_t>::max());
  MOUTHPIECE_EXPECT(frames.width / 3 <= std::numeric_limits<std::int32_t>::max());
  return {static_cast<std::uint32_t>(frames.frame_count), static_cast<std::uint32_t>(frames.width / 3)};
}

/// All frames' positions behind `header`.
void writeCache(const std::filesystem::path& path, const std::string& header, const FrameMaker& frames,
                std::endian order) {
  writeFileInParts(path, [&](const AppendBytes& append) {
    append(header);
    std::string bytes;
    frames.inBlocks([&](Eigen::Index, const RowMajorMatrixF& rows) {
      bytes.clear();
      appendFloats(bytes, rows.data(), unsignedIndex(rows.size()), order);
      append(bytes);
    });
  });
}

/// The same triangles, by part, after every frame's vertices.
std::string faceLines(const FaceMesh& mesh) {
  std::string lines;
  for (const MeshPart& part : mesh.parts) {
    fmt::format_to(std::back_inserter(lines), "usemtl {}\n", part.name);
    for (std::size_t t = part.first_triangle; t < part.first_triangle + part.triangle_count; ++t) {
      const auto& [a, b, c] = mesh.triangles[t];
      fmt::format_to(std::back_inserter(lines), "f {0}//{0} {1}//{1} {2}//{2}\n", a + 1, b + 1, c + 1);
    }
  }
  return lines;
}

}  // namespace

void writePc2(const std::filesystem::path& path, const FrameMaker& frames) {
  const Counts counts = countsOf(frames);
  std::string header("POINTCACHE2\0", 12);
  appendWord(header, 1, std::endian::little);  // version
  appendWord(header, counts.vertices, std::endian::little);
  const float start_and_step[2] = {0.0F, 1.0F};  // frames
  appendFloats(header, start_and_step, 2, std::endian::little);
  appendWord(header, counts.frames, std::endian::little);
  writeCache(path, header, frames, std::endian::little);
}

void writeMdd(const std::filesystem::path& path, const FrameMaker& frames) {
  const Counts counts = countsOf(frames);
  std::string header;
  appendWord(header, counts.frames, std::endian::big);
  appendWord(header, counts.vertices, std::endian::big);
  for (std::uint32_t frame = 0; frame < counts.frames; ++frame) {
    const auto time = asFloat(frame / frames.frame_rate_hz);
    appendFloats(header, &time, 1, std::endian::big);
  }
  writeCache(path, header, frames, std::endian::big);
}

void objFrames(const FaceMesh& mesh, const FrameMaker& frames,
               const std::function<void(std::size_t frame, const std::string& bytes)>& take) {
  const Counts counts = countsOf(frames);
  MOUTHPIECE_EXPECT(counts.vertices == unsignedIndex(mesh.vertices.rows()));
  const std::string faces = faceLines(mesh);
  std::vector<float> row(unsignedIndex(frames.width));
  for (std::uint32_t frame = 0; frame < counts.frames; ++frame) {
    frames.make(frame, row);
    const VertexPositions normals =
        vertexNormals(Eigen::Map<const VertexPositions>(row.data(), mesh.vertices.rows(), 3), mesh.triangles);
    std::string text;
    for (std::size_t v = 0; v < counts.vertices; ++v) {
      fmt::format_to(std::back_inserter(text), "v {} {} {}\n", row[3 * v], row[3 * v + 1], row[3 * v + 2]);
    }
    for (Eigen::Index v = 0; v < normals.rows(); ++v)
      fmt::format_to(std::back_inserter(text), "vn {:.4f} {:.4f} {:.4f}\n", normals(v, 0), normals(v, 1),
                     normals(v, 2));
    take(frame, text + faces);
  }
}

}  // namespace mouthpiece
