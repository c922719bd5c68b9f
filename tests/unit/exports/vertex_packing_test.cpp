#include "exports/gltf/vertex_packing.h"

#include <gtest/gtest.h>
#include <meshoptimizer.h>

#include <cstdint>
#include <random>
#include <string>
#include <vector>

namespace mouthpiece {
namespace {

std::string packedByTheLibrary(const std::vector<std::uint8_t>& rows, std::size_t count, std::size_t stride) {
  std::string packed(meshopt_encodeVertexBufferBound(count, stride), '\0');
  packed.resize(meshopt_encodeVertexBuffer(reinterpret_cast<unsigned char*>(packed.data()), packed.size(), rows.data(),
                                           count, stride));
  return packed;
}

/// Rows of zeros, of anything, of small numbers, of few that are not zero, and of numbers that need some bits.
TEST(VertexPacking, GivesTheLibrarysBytes) {
  std::mt19937 random(4);
  const auto any = [&] { return static_cast<std::uint8_t>(random()); };
  const auto below = [&](unsigned most) { return static_cast<std::uint8_t>(random() % most); };
  for (const std::size_t stride : {4, 8, 12, 16, 24, 60, 64, 256}) {
    for (const std::size_t count : {0, 1, 15, 16, 17, 255, 256, 257, 1000}) {
      for (int kind = 0; kind < 5; ++kind) {
        std::vector<std::uint8_t> rows(count * stride);
        for (std::uint8_t& byte : rows) {
          byte = kind == 0 ? std::uint8_t{0} : kind == 1 ? any() : kind == 2 ? below(3) : kind == 3 ? below(20) : byte;
          if (kind == 4 && random() % 40 == 0) byte = any();
        }
        EXPECT_EQ(packedVertices(rows.data(), count, stride), packedByTheLibrary(rows, count, stride))
            << stride << " bytes, " << count << " rows, kind " << kind;
      }
    }
  }
}

}  // namespace
}  // namespace mouthpiece
