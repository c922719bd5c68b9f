// Changes what is in a GLB's chunks and makes lengths and padding right again, so that more than the header is reached.
#include <cctype>
#include <vector>

#include "mutator.h"

namespace {

using namespace mouthpiece::fuzz;

struct Chunk {
  std::uint32_t type;
  std::string bytes;
};

std::vector<Chunk> chunksOf(std::string_view glb) {
  std::vector<Chunk> chunks;
  for (std::size_t at = 12; at + 8 <= glb.size();) {
    const std::size_t length = numberAt<std::uint32_t>(glb, at);
    if (length > glb.size() - at - 8) break;
    chunks.push_back({numberAt<std::uint32_t>(glb, at + 4), std::string(glb.substr(at + 8, length))});
    at += 8 + length;
  }
  return chunks;
}

void appendNumber(std::string& bytes, std::size_t number) {
  const auto narrow = static_cast<std::uint32_t>(number);
  bytes.append(reinterpret_cast<const char*>(&narrow), sizeof narrow);
}

std::string glbOf(const std::vector<Chunk>& chunks) {
  std::string body;
  for (std::size_t i = 0; i < chunks.size(); ++i) {
    std::string padded = chunks[i].bytes;
    padded.resize((padded.size() + 3) / 4 * 4, i == 0 ? ' ' : '\0');
    appendNumber(body, padded.size());
    appendNumber(body, chunks[i].type);
    body += padded;
  }
  std::string glb = "glTF";
  appendNumber(glb, 2);
  appendNumber(glb, 12 + body.size());
  return glb + body;
}

/// One of the numbers of a JSON text becomes another.
void changeNumber(std::string& json, std::mt19937& random) {
  if (json.empty()) return;
  std::size_t at = random() % json.size();
  while (at < json.size() && std::isdigit(static_cast<unsigned char>(json[at])) == 0) ++at;
  std::size_t end = at;
  while (end < json.size() && std::isdigit(static_cast<unsigned char>(json[end])) != 0) ++end;
  if (at < end) json.replace(at, end - at, std::to_string(awkwardNumber(random)));
}

}  // namespace

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t most, unsigned seed) {
  std::mt19937 random(seed);
  const std::string_view all(reinterpret_cast<const char*>(data), size);
  // mesh_fuzz takes a GLB behind a byte that says so.
  if (size < 14 || data[0] % 3 != 2 || all.substr(1, 4) != "glTF" || random() % 8 == 0)
    return LLVMFuzzerMutate(data, size, most);
  std::vector<Chunk> chunks = chunksOf(all.substr(1));
  if (chunks.empty()) return LLVMFuzzerMutate(data, size, most);
  const std::size_t which = random() % 4 == 0 ? random() % chunks.size() : 0;
  std::string& bytes = chunks[which].bytes;
  if (which == 0 && random() % 2 == 0)
    changeNumber(bytes, random);
  else
    bytes = mutated(bytes, bytes.size() + (most > size ? most - size : 0));
  return put(all.front() + glbOf(chunks), data, most);
}
