// A binding carried over to the mesh with its split vertices welded, and back.
#include <algorithm>
#include <utility>

#include "base/index.h"
#include "deform/surface/binding.h"
#include "deform/topology/welding.h"

namespace mouthpiece {
namespace {

/// `from`: the vertex before of each vertex; `to`: a vertex for each of those before.
FaceBinding::Relaxed relaxedOf(const FaceBinding::Relaxed& before, const std::vector<std::uint32_t>& from,
                               const std::vector<std::uint32_t>& to) {
  FaceBinding::Relaxed relaxed;
  for (std::uint32_t v = 0; v < from.size(); ++v) {
    const auto found = std::lower_bound(before.vertices.begin(), before.vertices.end(), from[v]);
    if (found == before.vertices.end() || *found != from[v]) continue;
    const auto row = unsignedIndex(found - before.vertices.begin());
    relaxed.vertices.push_back(v);
    for (std::size_t i = row > 0 ? before.ends[row - 1] : 0; i < before.ends[row]; ++i) {
      relaxed.from.push_back(to[before.from[i]]);
      relaxed.weights.push_back(before.weights[i]);
    }
    relaxed.ends.push_back(static_cast<std::uint32_t>(relaxed.from.size()));
  }
  return relaxed;
}

FaceBinding::Levelled levelledOf(const FaceBinding::Levelled& before, const std::vector<std::uint32_t>& from) {
  FaceBinding::Levelled levelled;
  for (std::uint32_t v = 0; v < from.size(); ++v) {
    const auto found = std::lower_bound(before.vertices.begin(), before.vertices.end(), from[v]);
    if (found == before.vertices.end() || *found != from[v]) continue;
    levelled.vertices.push_back(v);
    levelled.ways.push_back(before.ways[unsignedIndex(found - before.vertices.begin())]);
  }
  return levelled;
}

FaceBinding picked(const FaceBinding& binding, const std::vector<std::uint32_t>& from,
                   const std::vector<std::uint32_t>& to) {
  const auto pick = [&from](const auto& column) {
    std::decay_t<decltype(column)> values;
    values.reserve(from.size());
    for (const std::uint32_t v : from) values.push_back(column[v]);
    return values;
  };
  std::vector<std::uint32_t> carried;
  for (std::uint32_t v = 0; v < from.size(); ++v) {
    if (isCarried(binding, from[v])) carried.push_back(v);
  }
  return {pick(binding.patch),
          pick(binding.u),
          pick(binding.v),
          pick(binding.d),
          pick(binding.skin_weight),
          pick(binding.jaw_weight),
          std::move(carried),
          relaxedOf(binding.relaxed, from, to),
          binding.pressed,
          levelledOf(binding.levelled, from),
          binding.meets,
          binding.tuck};
}

}  // namespace

FaceBinding weldedBinding(const FaceBinding& given, const Welding& welding) {
  return picked(given, welding.given_of, welding.welded_of);
}
FaceBinding givenBinding(const FaceBinding& welded, const Welding& welding) {
  return picked(welded, welding.welded_of, welding.given_of);
}

bool isCarried(const FaceBinding& binding, std::size_t vertex) {
  return std::binary_search(binding.carried.begin(), binding.carried.end(), vertex);
}

}  // namespace mouthpiece
