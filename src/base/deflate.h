#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace mouthpiece {

/// `bytes` as a zlib stream (RFC 1950). `effort`: 1, the fastest, to 12, the smallest.
std::string deflated(std::string_view bytes, int effort);

/// The check that ZIP and gzip have (CRC-32, ISO 3309).
std::uint32_t crc32Of(std::string_view bytes);

/// What a zlib stream, or bare deflate (RFC 1951), holds, when that is `expected` bytes and nothing comes after it;
/// else nothing. Never takes more memory than `packed` could make.
enum class DeflateWrapper { kZlib, kNone };
std::optional<std::string> inflated(std::string_view packed, std::size_t expected,
                                    DeflateWrapper wrapper = DeflateWrapper::kZlib);

/// The first `count` bytes that a zlib stream holds, without the work of unpacking the rest, which is not looked at;
/// nothing where it holds fewer. Never takes more memory than `packed` could make.
std::optional<std::string> inflatedStart(std::string_view packed, std::size_t count);

}  // namespace mouthpiece
