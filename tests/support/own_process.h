#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <functional>

namespace mouthpiece {

/// Expects `holds` in a process that begins anew. eSpeak's library goes on from where its last line left its noise and
/// phases: what it says is the same only there.
inline void expectInOwnProcess(const std::function<bool()>& holds) {
  constexpr int kHolds = 3;
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(std::_Exit(holds() ? kHolds : 0), testing::ExitedWithCode(kHolds), "");
}

}  // namespace mouthpiece
