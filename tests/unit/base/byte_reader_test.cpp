#include "base/byte_reader.h"

#include <gtest/gtest.h>

#include <string>

#include "base/errors.h"

namespace mouthpiece {
namespace {

using namespace std::string_literals;

TEST(ByteReader, ReadsBothByteOrders) {
  const std::string bytes = "\x01\x02\x03\x04"s;
  ByteReader little(bytes, "f", ByteOrder::kLittle);
  EXPECT_EQ(little.readU32(), 0x04030201U);
  ByteReader big(bytes, "f", ByteOrder::kBig);
  EXPECT_EQ(big.readU16(), 0x0102U);
  EXPECT_EQ(big.readU16(), 0x0304U);
}

TEST(ByteReader, ReadsSignsAndFloats) {
  const std::string bytes = "\xFF\xFE\xFF\x00\x00\x80\xBF\x00\x00\x00\x00\x00\x00\xF0\x3F"s;
  ByteReader reader(bytes, "f");
  EXPECT_EQ(reader.readI8(), -1);
  EXPECT_EQ(reader.readI16(), -2);
  EXPECT_EQ(reader.readF32(), -1.0F);
  EXPECT_EQ(reader.readF64(), 1.0);
  EXPECT_EQ(reader.remaining(), 0U);
}

TEST(ByteReader, NamesThePlaceWhereTheBytesEnd) {
  ByteReader reader("abcde", "take.c3d");
  reader.skip(3);
  try {
    reader.readU32();
    FAIL() << "read four bytes out of two";
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(), "take.c3d:byte 3: found 2 more bytes; expected 4");
  }
  EXPECT_EQ(reader.position(), 3U) << "a refused read moves nothing";
}

TEST(ByteReader, RefusesCountsThatWouldOverflow) {
  ByteReader reader("abcde", "f");
  reader.skip(2);
  EXPECT_THROW(reader.readBytes(static_cast<std::size_t>(-1)), InputError);
  EXPECT_THROW(reader.seek(6), InputError);
  EXPECT_NO_THROW(reader.seek(5));
}

TEST(ByteWriter, WritesWhatTheReaderReads) {
  ByteWriter writer;
  writer.writeU8(7);
  writer.writeU16(0xBEEF);
  writer.writeU32(0xDEADBEEF);
  writer.writeF32(2.5F);
  writer.padTo(16);
  writer.patchU16(1, 0x1234);
  ByteReader reader(writer.bytes(), "f");
  EXPECT_EQ(reader.size(), 16U);
  EXPECT_EQ(reader.readU8(), 7);
  EXPECT_EQ(reader.readU16(), 0x1234);
  EXPECT_EQ(reader.readU32(), 0xDEADBEEFU);
  EXPECT_EQ(reader.readF32(), 2.5F);
  EXPECT_THROW(writer.padTo(3), InternalError);
  EXPECT_THROW(writer.patchU16(15, 0), InternalError);
}

}  // namespace
}  // namespace mouthpiece
