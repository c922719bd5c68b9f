#include "base/deflate.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <limits>
#include <random>

namespace mouthpiece {
namespace {

std::string someBytes(std::size_t count, int kinds) {
  std::mt19937 generator(7);  // NOLINT(cert-msc32-c,cert-msc51-cpp): the same each time
  std::string bytes(count, '\0');
  for (char& byte : bytes) byte = static_cast<char>(generator() % static_cast<unsigned>(kinds));
  return bytes;
}

/// The same as inflated(), by zlib.
std::optional<std::string> byZlib(const std::string& packed, std::size_t expected) {
  std::string bytes(expected, '\0');
  uLongf size = expected;
  uLong taken = packed.size();
  const int code =
      uncompress2(reinterpret_cast<Bytef*>(bytes.data()), &size, reinterpret_cast<const Bytef*>(packed.data()), &taken);
  const bool is_whole = code == Z_OK && size == expected && taken == packed.size();
  return is_whole ? std::optional(bytes) : std::nullopt;
}

TEST(Deflate, ZlibReadsWhatWasWritten) {
  for (const std::size_t count : {0U, 1U, 1000U, 300'000U}) {
    const std::string bytes = someBytes(count, 5), packed = deflated(bytes, 6);
    EXPECT_EQ(byZlib(packed, count), bytes);
    EXPECT_EQ(inflated(packed, count), bytes);
  }
}

TEST(Deflate, WhatZlibWroteIsRead) {
  const std::string bytes = someBytes(70'000, 200);
  std::string packed(compressBound(bytes.size()), '\0');
  uLongf size = packed.size();
  ASSERT_EQ(compress(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(bytes.data()),
                     bytes.size()),
            Z_OK);
  packed.resize(size);
  EXPECT_EQ(inflated(packed, bytes.size()), bytes);
}

TEST(Deflate, NothingComesOfAStreamThatIsNotWhole) {
  const std::string bytes = someBytes(2000, 3), packed = deflated(bytes, 4);
  EXPECT_FALSE(inflated(packed, bytes.size() - 1));
  EXPECT_FALSE(inflated(packed, bytes.size() + 1));
  EXPECT_FALSE(inflated(packed + '\0', bytes.size()));
  EXPECT_FALSE(inflated("", 10));
  EXPECT_FALSE(inflated(packed, std::size_t{1} << 60)) << "more than any stream of that length makes";
  for (std::size_t length = 0; length < packed.size(); length += 7)
    EXPECT_FALSE(inflated(packed.substr(0, length), bytes.size())) << length;
  for (std::size_t at = 0; at < packed.size(); ++at) {
    std::string changed = packed;
    changed[at] = static_cast<char>(changed[at] ^ 0x10);
    EXPECT_EQ(inflated(changed, bytes.size()), byZlib(changed, bytes.size())) << at;
  }
}

TEST(Deflate, TheBeginningOfAStreamIsReadAlone) {
  const std::string bytes = someBytes(5000, 3), packed = deflated(bytes, 4);
  for (const std::size_t count : {0U, 1U, 999U, 5000U}) EXPECT_EQ(inflatedStart(packed, count), bytes.substr(0, count));
  EXPECT_EQ(inflatedStart(packed.substr(0, packed.size() / 2), 1000), bytes.substr(0, 1000)) << "the rest is not read";
  EXPECT_FALSE(inflatedStart(packed, 5001));
  EXPECT_FALSE(inflatedStart(packed.substr(0, packed.size() / 2), 5000));
  EXPECT_FALSE(inflatedStart("", 1));
  EXPECT_FALSE(inflatedStart("neither zlib nor anything like it", 100));
  EXPECT_FALSE(inflatedStart(packed, std::numeric_limits<std::size_t>::max() / 16))
      << "more than any stream of that length makes";
}

}  // namespace
}  // namespace mouthpiece
