// A GLB's accessors as numbers.
#include "deform/mesh/glb_views.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "base/errors.h"
#include "base/index.h"
#include "deform/mesh/mesh_limits.h"

namespace mouthpiece {
namespace {

std::uint32_t unsignedWord(int number) { return static_cast<std::uint32_t>(number); }
int componentSize(int component) { return tinygltf::GetComponentSizeInBytes(unsignedWord(component)); }

/// Reads a number that may stand anywhere.
template <typename Number>
Number numberAt(const unsigned char* place) {
  Number value{};
  std::memcpy(&value, place, sizeof value);
  return value;
}

/// glTF 2.0, 3.6.2.2: the equations of normalised integers.
float realAt(const unsigned char* place, int component, bool is_normalized) {
  const auto share = [&](auto value, float largest) {
    const float real = static_cast<float>(value);
    return is_normalized ? std::max(real / largest, -1.0F) : real;
  };
  switch (component) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
      return share(numberAt<std::int8_t>(place), 127.0F);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return share(*place, 255.0F);
    case TINYGLTF_COMPONENT_TYPE_SHORT:
      return share(numberAt<std::int16_t>(place), 32767.0F);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return share(numberAt<std::uint16_t>(place), 65535.0F);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
      return share(numberAt<std::uint32_t>(place), 4294967295.0F);
    default:
      return numberAt<float>(place);
  }
}

}  // namespace

void GlbViews::fail(std::string_view what) const { throw InputError(std::string(file_), "", what); }

const tinygltf::Accessor& GlbViews::accessorAt(int index) const {
  if (index < 0 || unsignedIndex(index) >= model_.accessors.size()) fail("names an accessor that it does not hold");
  return model_.accessors[unsignedIndex(index)];
}

const tinygltf::Accessor& GlbViews::checked(int index, std::initializer_list<int> types) const {
  const tinygltf::Accessor& wanted = accessorAt(index);
  if (std::find(types.begin(), types.end(), wanted.type) == types.end()) fail("found an accessor of the wrong type");
  if (wanted.count > kMaxMeshVertices * 8) fail(fmt::format("accessor {} holds more than a head has", index));
  // Without this a few bytes of JSON could ask for gigabytes of zeros.
  std::size_t held = 0;
  for (const tinygltf::Buffer& buffer : model_.buffers) held += buffer.data.size();
  if (wanted.bufferView < 0 && wanted.count > 4096 + held)
    fail(fmt::format("accessor {} reaches beyond its data", index));
  return wanted;
}

std::span<const unsigned char> GlbViews::bytesOf(int view_index) const {
  if (view_index < 0 || unsignedIndex(view_index) >= model_.bufferViews.size())
    fail("names a buffer view that it does not hold");
  const tinygltf::BufferView& view = model_.bufferViews[unsignedIndex(view_index)];
  if (view.buffer < 0 || unsignedIndex(view.buffer) >= model_.buffers.size())
    fail("names a buffer that it does not hold");
  const std::vector<unsigned char>& data = model_.buffers[unsignedIndex(view.buffer)].data;
  if (view.byteOffset > data.size() || view.byteLength > data.size() - view.byteOffset)
    fail(fmt::format("buffer view {} reaches beyond its buffer of {} bytes", view_index, data.size()));
  return {data.data() + view.byteOffset, view.byteLength};
}

GlbViews::Elements GlbViews::plain(const tinygltf::Accessor& accessor) const {
  const std::span<const unsigned char> bytes = bytesOf(accessor.bufferView);
  const std::size_t declared = model_.bufferViews[unsignedIndex(accessor.bufferView)].byteStride;
  const int size = componentSize(accessor.componentType);
  const int components = tinygltf::GetNumComponentsInType(unsignedWord(accessor.type));
  if (size <= 0 || components <= 0) fail("found an accessor of an unknown type");
  const std::size_t element = unsignedIndex(size * components);
  const std::size_t stride = declared == 0 ? element : declared;
  // Each factor is bounded before it is multiplied, so the product cannot wrap.
  const bool fits =
      accessor.byteOffset <= bytes.size() && stride >= element && stride <= 4096 &&
      (accessor.count == 0 || (accessor.count - 1) * stride + element <= bytes.size() - accessor.byteOffset);
  if (!fits) {
    fail(fmt::format("accessor {} reaches beyond its buffer of {} bytes", &accessor - model_.accessors.data(),
                     bytes.size()));
  }
  return {bytes.data() + accessor.byteOffset, accessor.count, stride, accessor.componentType};
}

GlbViews::Elements GlbViews::packed(int view_index, int offset, int component, std::size_t width,
                                    std::size_t count) const {
  const std::span<const unsigned char> bytes = bytesOf(view_index);
  if (componentSize(component) <= 0) fail("found an accessor of an unknown type");
  const std::size_t element = width * unsignedIndex(componentSize(component));
  if (offset < 0 || unsignedIndex(offset) > bytes.size() || count > (bytes.size() - unsignedIndex(offset)) / element)
    fail("found a sparse accessor that reaches beyond its buffer");
  return {bytes.data() + offset, count, element, component};
}

std::size_t GlbViews::indexAt(const Elements& elements, std::size_t i) const {
  const unsigned char* place = elements.data + i * elements.stride;
  if (elements.component == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT) return numberAt<std::uint32_t>(place);
  if (elements.component == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT) return numberAt<std::uint16_t>(place);
  if (elements.component != TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE) fail("found indices that are no whole numbers");
  return *place;
}

template <typename Take>
void GlbViews::each(const tinygltf::Accessor& accessor, const Take& take) const {
  const std::size_t width = unsignedIndex(tinygltf::GetNumComponentsInType(unsignedWord(accessor.type)));
  const std::size_t size = unsignedIndex(componentSize(accessor.componentType));
  if (accessor.bufferView >= 0) {
    const Elements elements = plain(accessor);
    for (std::size_t i = 0; i < elements.count; ++i) {
      for (std::size_t k = 0; k < width; ++k) take(i, k, elements.data + i * elements.stride + k * size);
    }
  }
  const auto& sparse = accessor.sparse;
  if (!sparse.isSparse) return;
  if (sparse.count < 0 || unsignedIndex(sparse.count) > accessor.count) fail("found a damaged sparse accessor");
  const std::size_t replaced = unsignedIndex(sparse.count);
  const Elements at =
      packed(sparse.indices.bufferView, sparse.indices.byteOffset, sparse.indices.componentType, 1, replaced);
  const Elements values =
      packed(sparse.values.bufferView, sparse.values.byteOffset, accessor.componentType, width, replaced);
  for (std::size_t i = 0; i < replaced; ++i) {
    const std::size_t element = indexAt(at, i);
    if (element >= accessor.count) fail("found a sparse accessor with an index out of range");
    for (std::size_t k = 0; k < width; ++k) take(element, k, values.data + i * values.stride + k * size);
  }
}

GlbViews::Numbers GlbViews::numbers(int index, std::initializer_list<int> types) const {
  const tinygltf::Accessor& wanted = checked(index, types);
  if (componentSize(wanted.componentType) <= 0 || wanted.componentType == TINYGLTF_COMPONENT_TYPE_DOUBLE ||
      wanted.componentType == TINYGLTF_COMPONENT_TYPE_INT)
    fail("found an accessor of an unknown type");
  Numbers numbers =
      Numbers::Zero(signedIndex(wanted.count), tinygltf::GetNumComponentsInType(unsignedWord(wanted.type)));
  each(wanted, [&](std::size_t element, std::size_t k, const unsigned char* place) {
    numbers(signedIndex(element), signedIndex(k)) = realAt(place, wanted.componentType, wanted.normalized);
  });
  return numbers;
}

std::vector<std::uint32_t> GlbViews::wholes(int index, std::initializer_list<int> types) const {
  const tinygltf::Accessor& wanted = checked(index, types);
  const std::size_t width = unsignedIndex(tinygltf::GetNumComponentsInType(unsignedWord(wanted.type)));
  if (wanted.componentType != TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT &&
      wanted.componentType != TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT &&
      wanted.componentType != TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE)
    fail("found indices that are no whole numbers");
  std::vector<std::uint32_t> wholes(wanted.count * width, 0);
  each(wanted, [&](std::size_t element, std::size_t k, const unsigned char* place) {
    wholes[element * width + k] = static_cast<std::uint32_t>(indexAt({place, 1, 0, wanted.componentType}, 0));
  });
  return wholes;
}

}  // namespace mouthpiece
