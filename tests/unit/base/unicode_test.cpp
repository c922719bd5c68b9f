#include "base/unicode.h"

#include <gtest/gtest.h>

namespace mouthpiece {
namespace {

TEST(SlugOf, IsAFilesNameWhateverTheText) {
  EXPECT_EQ(slugOf("The time is NOW!", 40), "the-time-is-now");
  EXPECT_EQ(slugOf("  ../..\\x  ", 40), "x");
  EXPECT_EQ(slugOf("Größe, ÜBER 12 Brücken", 40), "gro-e-uber-12-brucken");
  EXPECT_EQ(slugOf("\xFF broken", 40), "broken");
  EXPECT_EQ(slugOf("日本 …", 40), "");
  EXPECT_EQ(slugOf("one two three", 8), "one-two");
}

}  // namespace
}  // namespace mouthpiece
