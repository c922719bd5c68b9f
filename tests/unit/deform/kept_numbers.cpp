#include "tests/unit/deform/kept_numbers.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>

namespace mouthpiece::test {
namespace {

constexpr std::size_t kSums = 8;

std::filesystem::path keptFile() {
  return std::filesystem::path(MOUTHPIECE_SOURCE_DIR) / "tests/unit/deform/stored/kept_numbers.json";
}

nlohmann::json kept() {
  std::ifstream in(keptFile());
  return in ? nlohmann::json::parse(in) : nlohmann::json::object();
}

std::array<double, kSums> sumsOf(const std::vector<double>& numbers) {
  std::array<double, kSums> sums{};
  std::mt19937 random(1);  // whose numbers the standard tells
  for (const double number : numbers) {
    const auto signs = static_cast<std::uint32_t>(random());
    for (std::size_t k = 0; k < kSums; ++k) sums[k] += (signs >> (3 * k) & 1U) != 0 ? number : -number;
  }
  return sums;
}

}  // namespace

KeptNumbers::~KeptNumbers() {
  const std::array<double, kSums> sums = sumsOf(numbers_);
  nlohmann::json all = kept();
  if (std::getenv("MOUTHPIECE_KEEP") != nullptr) {
    all[name_] = {{"count", numbers_.size()}, {"sums", sums}};
    std::ofstream(keptFile()) << all.dump(1) << '\n';
    return;
  }
  if (!all.contains(name_)) {
    ADD_FAILURE() << name_ << " was never kept";
  } else if (const auto count = all[name_]["count"].get<std::size_t>(); count != numbers_.size()) {
    ADD_FAILURE() << name_ << ": " << count << " numbers were kept, now there are " << numbers_.size();
  } else {
    const double off = rms_ * std::sqrt(static_cast<double>(count));
    for (std::size_t k = 0; k < kSums; ++k) EXPECT_NEAR(sums[k], all[name_]["sums"][k].get<double>(), off) << name_;
  }
}

}  // namespace mouthpiece::test
