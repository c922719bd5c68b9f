#include "deform/mesh/glb_views.h"

#include <fmt/format.h>
#include <tiny_gltf.h>

#include <cmath>
#include <cstdint>
#include <cstring>

#include "base/errors.h"
#include "deform/mesh/mesh_reader.h"

namespace mouthpiece {

float GlbView::channel(std::size_t i, std::size_t k) const {
  const unsigned char* at = data + i * stride;
  if (component == TINYGLTF_COMPONENT_TYPE_FLOAT) {
    float value = 0;
    std::memcpy(&value, at + 4 * k, 4);
    return std::isfinite(value) ? value : 0.0F;
  }
  if (component == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT) {
    std::uint16_t value = 0;
    std::memcpy(&value, at + 2 * k, 2);
    return static_cast<float>(value) / 65535.0F;
  }
  return static_cast<float>(at[k]) / 255.0F;
}

void GlbViews::fail(std::string_view what) const { throw InputError(file_, "", what); }

int GlbViews::typeOf(int index) const {
  if (index < 0 || static_cast<std::size_t>(index) >= model_.accessors.size())
    fail("names an accessor that it does not hold");
  return model_.accessors[static_cast<std::size_t>(index)].type;
}

/// The bytes of a buffer view.
std::span<const unsigned char> GlbViews::bytesOf(int view_index) const {
  if (view_index < 0 || static_cast<std::size_t>(view_index) >= model_.bufferViews.size())
    fail("names a buffer view that it does not hold");
  const tinygltf::BufferView& view = model_.bufferViews[static_cast<std::size_t>(view_index)];
  if (view.buffer < 0 || static_cast<std::size_t>(view.buffer) >= model_.buffers.size())
    fail("names a buffer that it does not hold");
  const std::vector<unsigned char>& data = model_.buffers[static_cast<std::size_t>(view.buffer)].data;
  if (view.byteOffset > data.size() || view.byteLength > data.size() - view.byteOffset)
    fail(fmt::format("buffer view {} reaches beyond its buffer of {} bytes", view_index, data.size()));
  return {data.data() + view.byteOffset, view.byteLength};
}

/// An accessor's own elements, whether or not a sparse part replaces some of them.
GlbView GlbViews::plainPart(int index) const {
  const tinygltf::Accessor& accessor = model_.accessors[static_cast<std::size_t>(index)];
  const std::span<const unsigned char> bytes = bytesOf(accessor.bufferView);
  const std::size_t declared = model_.bufferViews[static_cast<std::size_t>(accessor.bufferView)].byteStride;
  const int component_size = tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(accessor.componentType));
  const int components = tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(accessor.type));
  if (component_size <= 0 || components <= 0) fail("found an accessor of an unknown type");
  const auto element = static_cast<std::size_t>(component_size * components);
  const std::size_t stride = declared == 0 ? element : declared;
  // Each factor is bounded before it is multiplied, so the product cannot wrap.
  const bool fits =
      accessor.byteOffset <= bytes.size() && stride >= element && stride <= 4096 &&
      accessor.count <= kMaxMeshVertices * 8 &&
      (accessor.count == 0 || (accessor.count - 1) * stride + element <= bytes.size() - accessor.byteOffset);
  if (!fits) fail(fmt::format("accessor {} reaches beyond its buffer of {} bytes", index, bytes.size()));
  return {bytes.data() + accessor.byteOffset, accessor.count, stride, accessor.componentType};
}

GlbView GlbViews::accessor(int index, int type) const {
  const int found = typeOf(index);
  if (model_.accessors[static_cast<std::size_t>(index)].sparse.isSparse)
    fail("found a sparse accessor; expected plain ones");
  if (found != type) fail("found an accessor of the wrong type");
  return plainPart(index);
}

/// `count` tightly packed elements within a buffer view.
GlbView GlbViews::packed(int view_index, std::size_t offset, int component, std::size_t width,
                         std::size_t count) const {
  const std::span<const unsigned char> bytes = bytesOf(view_index);
  const int component_size = tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(component));
  if (component_size <= 0) fail("found an accessor of an unknown type");
  const std::size_t element = width * static_cast<std::size_t>(component_size);
  if (offset > bytes.size() || count > (bytes.size() - offset) / element)
    fail("found a sparse accessor that reaches beyond its buffer");
  return {bytes.data() + offset, count, element, component};
}

std::vector<float> GlbViews::mostlyZeroVec3(int index, std::size_t count) const {
  const int type = typeOf(index);
  const tinygltf::Accessor& wanted = model_.accessors[static_cast<std::size_t>(index)];
  if (wanted.count != count || type != TINYGLTF_TYPE_VEC3 || wanted.componentType != TINYGLTF_COMPONENT_TYPE_FLOAT)
    fail("found a shape that is no list of one move a vertex");
  std::vector<float> values(3 * count, 0.0F);
  if (wanted.bufferView >= 0) {
    const GlbView view = plainPart(index);
    for (std::size_t i = 0; i < count; ++i) std::memcpy(&values[3 * i], view.data + i * view.stride, 12);
  }
  const auto& sparse = wanted.sparse;
  if (!sparse.isSparse) return values;
  if (sparse.count < 0 || static_cast<std::size_t>(sparse.count) > count) fail("found a damaged sparse accessor");
  const auto replaced = static_cast<std::size_t>(sparse.count);
  const GlbView at =
      packed(sparse.indices.bufferView, sparse.indices.byteOffset, sparse.indices.componentType, 1, replaced);
  const GlbView moves =
      packed(sparse.values.bufferView, sparse.values.byteOffset, TINYGLTF_COMPONENT_TYPE_FLOAT, 3, replaced);
  for (std::size_t i = 0; i < replaced; ++i) {
    const std::size_t vertex = indexAt(at, i);
    if (vertex >= count) fail("found a sparse accessor with an index out of range");
    std::memcpy(&values[3 * vertex], moves.data + i * moves.stride, 12);
  }
  return values;
}

std::size_t GlbViews::indexAt(const GlbView& view, std::size_t i) const {
  const unsigned char* at = view.data + i * view.stride;
  if (view.component == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT) {
    std::uint32_t value = 0;
    std::memcpy(&value, at, 4);
    return value;
  }
  if (view.component == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT) {
    std::uint16_t value = 0;
    std::memcpy(&value, at, 2);
    return value;
  }
  if (view.component != TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE) fail("found indices that are no whole numbers");
  return *at;
}

}  // namespace mouthpiece
