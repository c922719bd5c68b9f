#include "base/deflate.h"

#include <libdeflate.h>
#include <zlib.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <new>

#include "base/errors.h"

namespace mouthpiece {
namespace {

/// A stream makes no more than this of a byte.
constexpr std::size_t kMostInflation = 1032;

}  // namespace

std::string deflated(std::string_view bytes, int effort) {
  const std::unique_ptr<libdeflate_compressor, decltype(&libdeflate_free_compressor)> compressor(
      libdeflate_alloc_compressor(effort), &libdeflate_free_compressor);
  MOUTHPIECE_EXPECT(compressor != nullptr);
  std::string packed(libdeflate_zlib_compress_bound(compressor.get(), bytes.size()), '\0');
  packed.resize(libdeflate_zlib_compress(compressor.get(), bytes.data(), bytes.size(), packed.data(), packed.size()));
  MOUTHPIECE_EXPECT(!packed.empty());
  return packed;
}

std::uint32_t crc32Of(std::string_view bytes) { return libdeflate_crc32(0, bytes.data(), bytes.size()); }

std::optional<std::string> inflated(std::string_view packed, std::size_t expected, DeflateWrapper wrapper) {
  if (expected / kMostInflation > packed.size()) return std::nullopt;
  const std::unique_ptr<libdeflate_decompressor, decltype(&libdeflate_free_decompressor)> decompressor(
      libdeflate_alloc_decompressor(), &libdeflate_free_decompressor);
  MOUTHPIECE_EXPECT(decompressor != nullptr);
  std::string bytes(expected, '\0');
  std::size_t taken = 0;
  // Without a place for the size that was found, any other than the expected one is an error.
  const auto decompress =
      wrapper == DeflateWrapper::kZlib ? libdeflate_zlib_decompress_ex : libdeflate_deflate_decompress_ex;
  const libdeflate_result result =
      decompress(decompressor.get(), packed.data(), packed.size(), bytes.data(), bytes.size(), &taken, nullptr);
  if (result != LIBDEFLATE_SUCCESS || taken != packed.size()) return std::nullopt;
  return bytes;
}

std::optional<std::string> inflatedStart(std::string_view packed, std::size_t count) {
  if (count / kMostInflation > packed.size()) return std::nullopt;
  std::string bytes(count, '\0');
  if (count == 0) return bytes;
  // libdeflate unpacks whole streams alone.
  z_stream stream{};
  if (inflateInit(&stream) != Z_OK) throw std::bad_alloc();
  constexpr std::size_t kMost = std::numeric_limits<uInt>::max();
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
  stream.avail_in = static_cast<uInt>(std::min(packed.size(), kMost));
  stream.next_out = reinterpret_cast<Bytef*>(bytes.data());
  stream.avail_out = static_cast<uInt>(std::min(count, kMost));
  const int result = inflate(&stream, Z_SYNC_FLUSH);
  const bool is_whole = (result == Z_OK || result == Z_STREAM_END) && stream.total_out == count;
  inflateEnd(&stream);
  return is_whole ? std::optional(std::move(bytes)) : std::nullopt;
}

}  // namespace mouthpiece
