#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "mouthpiece/version.h"

namespace mouthpiece {

/// A face made by `retarget fit` (docs/formats/face.md) with its mesh, opened. Immutable; copies share it, and so may
/// any number of speakers in any number of threads.
class MOUTHPIECE_API SharedFace {
 public:
  /// Opens `file` and the mesh that it names; the default face that Mouthpiece brings when it is empty. Throws
  /// InputError, also when the mesh has changed since the fit; where the file's parts contradict each other what asks
  /// for the mesh does.
  explicit SharedFace(const std::filesystem::path& file = {});

  [[nodiscard]] const std::string& name() const;
  [[nodiscard]] std::size_t vertexCount() const;
  /// At rest: x y z of each vertex, the mesh's unit, upright (Y up, looking along +Z), however its file lies.
  [[nodiscard]] std::span<const float> restVertices() const;
  /// Three vertices each.
  [[nodiscard]] std::vector<std::uint32_t> triangles() const;
  [[nodiscard]] double metresPerUnit() const;

  struct Data;
  [[nodiscard]] const Data& data() const { return *data_; }  ///< for the library itself

 private:
  std::shared_ptr<const Data> data_;
};

}  // namespace mouthpiece
