#pragma once

#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

namespace mouthpiece {

enum class ByteOrder { kLittle, kBig };

/// Reads numbers out of bytes that nobody has checked. Every read is bounds-checked; going past the end throws
/// InputError that names the file, the offset and the size. Does not own the bytes.
class ByteReader {
 public:
  ByteReader(std::string_view bytes, std::string_view file_name, ByteOrder order = ByteOrder::kLittle)
      : bytes_(bytes), file_name_(file_name), order_(order) {}

  [[nodiscard]] std::size_t size() const { return bytes_.size(); }
  [[nodiscard]] std::size_t position() const { return position_; }
  [[nodiscard]] std::size_t remaining() const { return bytes_.size() - position_; }
  [[nodiscard]] ByteOrder order() const { return order_; }
  [[nodiscard]] const std::string& fileName() const { return file_name_; }
  void setOrder(ByteOrder order) { order_ = order; }

  /// Moves to `offset` from the start; the end itself is allowed.
  void seek(std::size_t offset);
  void skip(std::size_t count);

  std::uint8_t readU8();
  std::int8_t readI8() { return static_cast<std::int8_t>(readU8()); }
  std::uint16_t readU16();
  std::int16_t readI16() { return static_cast<std::int16_t>(readU16()); }
  std::uint32_t readU32();
  std::int32_t readI32() { return static_cast<std::int32_t>(readU32()); }
  std::uint64_t readU64();
  float readF32();
  double readF64();
  /// The next `count` bytes, a view into the reader's own.
  std::string_view readBytes(std::size_t count);

  /// Throws InputError at the present place ("byte 512").
  [[noreturn]] void fail(std::string_view what) const;

 private:
  std::string_view bytes_;
  std::string file_name_;
  std::size_t position_ = 0;
  ByteOrder order_;
};

/// Appends numbers to a string of bytes. A whole number gives its low bits; the caller sees to it that they are all.
class ByteWriter {
 public:
  explicit ByteWriter(ByteOrder order = ByteOrder::kLittle) : order_(order) {}

  [[nodiscard]] std::size_t size() const { return bytes_.size(); }
  [[nodiscard]] const std::string& bytes() const { return bytes_; }
  std::string takeBytes() { return std::move(bytes_); }
  void reserve(std::size_t count) { bytes_.reserve(count); }

  void writeU8(std::integral auto value) { bytes_.push_back(static_cast<char>(value)); }
  void writeU16(std::integral auto value) { write<std::uint16_t>(static_cast<std::uint16_t>(value)); }
  void writeU32(std::integral auto value) { write<std::uint32_t>(static_cast<std::uint32_t>(value)); }
  void writeU64(std::integral auto value) { write<std::uint64_t>(static_cast<std::uint64_t>(value)); }
  void writeF32(double value) { write(std::bit_cast<std::uint32_t>(static_cast<float>(value))); }
  void writeF64(double value) { write(std::bit_cast<std::uint64_t>(value)); }
  void writeBytes(std::string_view bytes) { bytes_ += bytes; }
  /// Zero bytes up to `size`; `size` is no less than the present one.
  void padTo(std::size_t size);
  /// Overwrites two bytes written before.
  void patchU16(std::size_t offset, std::integral auto value) { patch(offset, static_cast<std::uint16_t>(value)); }

 private:
  template <typename Unsigned>
  void write(Unsigned value) {
    for (std::size_t i = 0; i < sizeof(Unsigned); ++i) {
      const std::size_t byte = order_ == ByteOrder::kLittle ? i : sizeof(Unsigned) - 1 - i;
      bytes_.push_back(static_cast<char>(std::uint64_t{value} >> (8 * byte)));
    }
  }
  void patch(std::size_t offset, std::uint16_t value);

  std::string bytes_;
  ByteOrder order_;
};

}  // namespace mouthpiece
