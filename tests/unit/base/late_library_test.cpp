#include "base/late_library.h"

#include <gtest/gtest.h>

#include "support/error_of.h"

namespace mouthpiece {
namespace {

TEST(LateLibrary, CallsAFunctionOfALibraryThatIsNotLinked) {
  constexpr LateLibrary kZstd("libzstd.so.1", "libzstd1");
  const LateFunction<unsigned()> version(kZstd, "ZSTD_versionNumber");
  EXPECT_GT(version(), 10'000U);
  EXPECT_EQ(version(), version());
}

TEST(LateLibrary, WhatIsMissingIsNamedWithItsPackage) {
  constexpr LateLibrary kNone("libnothing_like_it.so.1", "libnothing1"), kZstd("libzstd.so.1", "libzstd1");
  const std::string no_library = errorOf([&] { LateFunction<void()>(kNone, "do_it")(); });
  EXPECT_NE(no_library.find("libnothing_like_it.so.1: cannot be used: "), std::string::npos) << no_library;
  EXPECT_NE(no_library.find("sudo apt-get install libnothing1"), std::string::npos) << no_library;
  const std::string no_function = errorOf([&] { LateFunction<void()>(kZstd, "do_it")(); });
  EXPECT_NE(no_function.find("do_it"), std::string::npos) << no_function;
}

}  // namespace
}  // namespace mouthpiece
