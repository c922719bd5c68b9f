// What the page's script calls. Bytes go in through room(), what was asked for lies where result() says; a call that
// returns 0 has left the reason there.
#include <cstdint>
#include <exception>
#include <memory>
#include <string>

#include "page_engine/page_engine.h"

#define MOUTHPIECE_EXPORT(name) extern "C" __attribute__((export_name(#name), visibility("default")))

namespace {

using mouthpiece::PageEngine;

std::string given, trouble;
std::unique_ptr<PageEngine> engine;
const void* result_at = nullptr;
std::uint32_t result_bytes = 0;

void give(const void* at, std::size_t bytes) {
  result_at = at;
  result_bytes = static_cast<std::uint32_t>(bytes);
}

int attempt(const auto& work) {
  try {
    work();
    return 1;
  } catch (const std::exception& error) {
    trouble = error.what();
    give(trouble.data(), trouble.size());
    return 0;
  }
}

void giveFloats(const mouthpiece::RowMajorMatrixF& matrix) {
  give(matrix.data(), static_cast<std::size_t>(matrix.size()) * sizeof(float));
}

}  // namespace

MOUTHPIECE_EXPORT(room) char* room(std::uint32_t bytes) {
  given.resize(bytes);
  return given.data();
}
MOUTHPIECE_EXPORT(result) const void* result() { return result_at; }
MOUTHPIECE_EXPORT(resultBytes) std::uint32_t resultBytes() { return result_bytes; }

/// `given`: a LinePackage.
MOUTHPIECE_EXPORT(open) int openPackage() {
  return attempt([] {
    engine = std::make_unique<PageEngine>(given);
    given = {};
  });
}
/// `given`: edits. The frames that were made.
MOUTHPIECE_EXPORT(render) int render() {
  int frames = 0;
  const int is_done = attempt([&] {
    engine->render(given);
    frames = static_cast<int>(engine->frameCount());
  });
  return is_done == 1 ? frames : 0;
}
MOUTHPIECE_EXPORT(weights) void weights() { giveFloats(engine->weights()); }
MOUTHPIECE_EXPORT(markers) void markers() { giveFloats(engine->markers()); }
MOUTHPIECE_EXPORT(warnings) void warnings() { give(engine->warnings().data(), engine->warnings().size()); }
MOUTHPIECE_EXPORT(vertices) int vertices(std::uint32_t frame) {
  return attempt([&] {
    const std::vector<float>& all = engine->vertices(frame);
    give(all.data(), all.size() * sizeof(float));
  });
}
