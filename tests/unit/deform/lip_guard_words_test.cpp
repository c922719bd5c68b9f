// What of a guard is kept in a .face (LipGuard::words()), read and damaged.
#include <gtest/gtest.h>

#include <random>
#include <span>
#include <vector>

#include "base/errors.h"
#include "deform/mouth/lip_guard.h"
#include "tests/unit/deform/rolled_lips.h"

namespace mouthpiece {
namespace {

using samples::lips;
using samples::sampleControl;
using samples::withTeeth;

class GuardWords : public samples::Guards {};

/// A guard with teeth, so that it has something of all that is kept.
struct KeptGuard {
  FaceMesh mesh = withTeeth(PartKind::kUpperTeeth, -1, 8, -5.2F);
  FaceBinding binding = bindFace(mesh, sampleControl());
  LipGuard found{mesh, mesh.vertices, sampleControl(), binding};
  std::vector<std::uint32_t> words = found.words();

  [[nodiscard]] LipGuard readFrom(std::span<const std::uint32_t> kept) const {
    return {mesh, mesh.vertices, sampleControl(), binding, kept};
  }
};
constexpr std::size_t kVersionWord = 0, kFirstVertexWord = 2;

TEST_F(GuardWords, DoTheSameFromWhatWasKept) {
  const KeptGuard kept;
  const LipGuard read = kept.readFrom(kept.words);
  EXPECT_EQ(read.words(), kept.words);
  VertexPositions by_found = kept.mesh.vertices;
  for (Eigen::Index v = 0; v < rest().rows(); ++v) by_found(v, 1) += lips().side[unsignedIndex(v)] == 1 ? -1.0F : 0.5F;
  const VertexPositions pressed = by_found;
  VertexPositions by_read = by_found;
  kept.found.separate(pointsApart(0), allPairs({.opened = 0}), {}, by_found.data());
  read.separate(pointsApart(0), allPairs({.opened = 0}), {}, by_read.data());
  EXPECT_EQ(by_read, by_found);
  EXPECT_GT((by_read - pressed).cwiseAbs().maxCoeff(), 0.1F);
}

TEST_F(GuardWords, FindAnewWhatAnotherVersionKept) {
  const KeptGuard kept;
  std::vector<std::uint32_t> changed = kept.words;
  changed[kFirstVertexWord] ^= 1U;
  EXPECT_EQ(kept.readFrom(changed).words(), changed);
  ++changed[kVersionWord];
  EXPECT_EQ(kept.readFrom(changed).words(), kept.words);
}

TEST_F(GuardWords, RefuseWhatWasKeptOfAnotherMesh) {
  const KeptGuard kept;
  std::vector<std::uint32_t> words = kept.words;
  words[kFirstVertexWord] = static_cast<std::uint32_t>(kept.mesh.vertexCount());
  EXPECT_THROW(kept.readFrom(words), InputError);
  words = kept.words;
  words.push_back(0);
  EXPECT_THROW(kept.readFrom(words), InputError);
}

TEST_F(GuardWords, DamagedWordsNeverDoMoreThanThrow) {
  const KeptGuard kept;
  std::mt19937 random(24);
  int refused = 0;
  for (int i = 0; i < 300; ++i) {
    std::vector<std::uint32_t> damaged = kept.words;
    if (i % 4 == 0) damaged.resize(2 + random() % (damaged.size() - 2));
    for (int k = 0; k < 3; ++k) {
      const auto bits = static_cast<std::uint32_t>(random());
      damaged[1 + random() % (damaged.size() - 1)] = i % 2 == 0 ? bits : bits >> (random() % 32);
    }
    try {
      VertexPositions moved = kept.mesh.vertices;
      kept.readFrom(damaged).separate(pointsApart(0), allPairs({.opened = 0}), {}, moved.data());
    } catch (const InputError&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 100);
}

}  // namespace
}  // namespace mouthpiece
