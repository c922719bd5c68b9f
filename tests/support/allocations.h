#pragma once

#include <cstddef>
#include <functional>

namespace mouthpiece::test {

/// How often `work` asks for memory on this thread, through malloc and its kin (Eigen) or new (std). Sees what the test
/// links statically; CMake's mouthpiece_count_allocations() puts the counters before these functions.
std::size_t allocationsIn(const std::function<void()>& work);

}  // namespace mouthpiece::test
