// Changes words of a C3D's header, what one parameter holds, or samples, and leaves the rest of the file as it lies.
#include <vector>

#include "mutator.h"

namespace {

using namespace mouthpiece::fuzz;

constexpr std::size_t kBlock = 512;

struct Range {
  std::size_t first, size;
};

/// What lies behind the name of each group and parameter of a file of Intel's byte order.
std::vector<Range> entriesOf(std::string_view file) {
  std::vector<Range> entries;
  std::size_t at = kBlock * (numberAt<std::uint8_t>(file, 0) - 1U) + 4;
  while (at + 4 <= file.size() && entries.size() < 1000) {
    const int signed_length = numberAt<std::int8_t>(file, at);
    const auto name = static_cast<std::size_t>(signed_length < 0 ? -signed_length : signed_length);
    const std::size_t next_at = at + 2 + name, step = numberAt<std::uint16_t>(file, next_at);
    if (name == 0 || step < 3 || next_at + step > file.size()) break;
    entries.push_back({next_at + 2, step - 2});
    at = next_at + step;
  }
  return entries;
}

}  // namespace

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t most, unsigned seed) {
  std::mt19937 random(seed);
  std::string file(reinterpret_cast<const char*>(data), size);
  const std::vector<Range> entries = size > kBlock ? entriesOf(file) : std::vector<Range>();
  if (entries.empty() || random() % 8 == 0) return LLVMFuzzerMutate(data, size, most);
  switch (random() % 4) {
    case 0:  // the first 12 words tell how much there is and where
      putNumber(file, 2 * (random() % 12), static_cast<std::uint16_t>(awkwardNumber(random)));
      break;
    case 1: {
      const std::size_t word = random() % (size / 4);
      putNumber(file, 4 * word, awkwardNumber(random));
      break;
    }
    default: {
      const Range entry = entries[random() % entries.size()];
      std::string changed = mutated(file.substr(entry.first, entry.size), entry.size);
      changed.resize(entry.size);
      file.replace(entry.first, entry.size, changed);
    }
  }
  return put(file, data, most);
}
