#include "base/byte_reader.h"

#include <fmt/format.h>

#include "base/errors.h"

namespace mouthpiece {
namespace {

/// Whole numbers are put together byte by byte, so the machine's own order does not matter.
template <typename Unsigned>
Unsigned assemble(std::string_view bytes, ByteOrder order) {
  Unsigned value = 0;
  for (std::size_t i = 0; i < sizeof(Unsigned); ++i) {
    const std::size_t from = order == ByteOrder::kBig ? i : sizeof(Unsigned) - 1 - i;
    value = static_cast<Unsigned>((std::uint64_t{value} << 8U) | static_cast<unsigned char>(bytes[from]));
  }
  return value;
}

}  // namespace

void ByteReader::fail(std::string_view what) const {
  throw InputError(file_name_, fmt::format("byte {}", position_), what);
}

void ByteReader::seek(std::size_t offset) {
  if (offset > bytes_.size()) {
    fail(fmt::format("points to byte {}; expected at most {}, the file's size", offset, bytes_.size()));
  }
  position_ = offset;
}

void ByteReader::skip(std::size_t count) { readBytes(count); }

std::string_view ByteReader::readBytes(std::size_t count) {
  if (count > remaining()) fail(fmt::format("found {} more bytes; expected {}", remaining(), count));
  const std::string_view result = bytes_.substr(position_, count);
  position_ += count;
  return result;
}

std::uint8_t ByteReader::readU8() { return static_cast<unsigned char>(readBytes(1)[0]); }
std::uint16_t ByteReader::readU16() { return assemble<std::uint16_t>(readBytes(2), order_); }
std::uint32_t ByteReader::readU32() { return assemble<std::uint32_t>(readBytes(4), order_); }
std::uint64_t ByteReader::readU64() { return assemble<std::uint64_t>(readBytes(8), order_); }
float ByteReader::readF32() { return std::bit_cast<float>(readU32()); }
double ByteReader::readF64() { return std::bit_cast<double>(readU64()); }

void ByteWriter::padTo(std::size_t size) {
  MOUTHPIECE_EXPECT(size >= bytes_.size());
  bytes_.resize(size, '\0');
}

void ByteWriter::patch(std::size_t offset, std::uint16_t value) {
  MOUTHPIECE_EXPECT(offset <= bytes_.size() && bytes_.size() - offset >= 2);
  ByteWriter two(order_);
  two.writeU16(value);
  bytes_.replace(offset, 2, two.bytes());
}

}  // namespace mouthpiece
