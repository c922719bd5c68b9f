#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <random>
#include <string>
#include <string_view>

// What the mutators that know a file's structure have in common; libFuzzer calls LLVMFuzzerCustomMutator() of a target
// that has one.

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

namespace mouthpiece::fuzz {

/// The bytes as libFuzzer changes any, no longer than `most`.
inline std::string mutated(std::string bytes, std::size_t most) {
  const std::size_t size = bytes.size();
  bytes.resize(most > size ? most : size);
  bytes.resize(LLVMFuzzerMutate(reinterpret_cast<std::uint8_t*>(bytes.data()), size, bytes.size()));
  return bytes;
}

/// A number at which readers break.
inline std::uint32_t awkwardNumber(std::mt19937& random) {
  constexpr std::array<std::uint32_t, 14> kNumbers{
      0, 1, 2, 3, 127, 128, 255, 0x7fff, 0x8000, 0xffff, 0x7fffffff, 0x80000000, 0xffffffff, 0x7fc00000};
  return kNumbers[random() % kNumbers.size()];
}

template <typename Number>
Number numberAt(std::string_view bytes, std::size_t place) {
  Number number{};
  if (place + sizeof(Number) <= bytes.size()) std::memcpy(&number, bytes.data() + place, sizeof(Number));
  return number;
}

template <typename Number>
void putNumber(std::string& bytes, std::size_t place, Number number) {
  if (place + sizeof(Number) <= bytes.size()) std::memcpy(bytes.data() + place, &number, sizeof(Number));
}

/// What a custom mutator returns: `bytes` in the place of what it was given, cut to `most`.
inline std::size_t put(const std::string& bytes, std::uint8_t* data, std::size_t most) {
  const std::size_t size = bytes.size() < most ? bytes.size() : most;
  std::memcpy(data, bytes.data(), size);
  return size;
}

}  // namespace mouthpiece::fuzz
