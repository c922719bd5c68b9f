#pragma once

#include <cstddef>
#include <functional>

namespace mouthpiece {

/// The number of threads the machine offers, at least 1.
std::size_t defaultThreadCount();

/// Calls body(0) ... body(count - 1), each once, on up to `thread_count` threads (the caller's among them); returns
/// when all are done. Which thread takes which index is open, so a body writes only to places of its own index: then
/// the result is the same for any thread count. When bodies throw, the exception of the lowest index is rethrown;
/// indices above it may not have run. Where a body is one of several threads' its own parallelFor() stays on
/// its thread.
void parallelFor(std::size_t count, std::size_t thread_count, const std::function<void(std::size_t)>& body);

inline void parallelFor(std::size_t count, const std::function<void(std::size_t)>& body) {
  parallelFor(count, defaultThreadCount(), body);
}

}  // namespace mouthpiece
