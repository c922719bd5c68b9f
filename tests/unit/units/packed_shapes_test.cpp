#include "units/prediction/phone_shapes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace mouthpiece {
namespace {

PhoneShapes madeUp(std::size_t phones, float reach_mm) {
  PhoneShapes shapes;
  const auto rows = static_cast<Eigen::Index>(phones);
  const Eigen::Index columns = PhoneShapes::kPoints * PhoneShapes::kMostComponents;
  std::mt19937 random(3);
  std::uniform_real_distribution<float> number(-reach_mm, reach_mm);
  shapes.captured = PhoneShapes::Matrix::NullaryExpr(rows, columns, [&] { return number(random); });
  shapes.predicted = PhoneShapes::Matrix::NullaryExpr(rows, columns, [&] { return number(random); });
  for (std::size_t i = 0; i < phones; ++i) shapes.tightest_mm.push_back(number(random));
  return shapes;
}

TEST(PackedShapes, KeepsNumbersToAShareOfTheirRange) {
  for (const float reach_mm : {1e-3F, 20.0F, 1e6F}) {
    const PhoneShapes shapes = madeUp(7, reach_mm);
    const PackedShapes packed(shapes);
    const float within = reach_mm / 65534.0F * 1.01F;  // half a step, and the rounding of floats
    for (std::size_t phone = 0; phone < 7; ++phone) {
      const PhoneShape shape = packed.unpacked(phone);
      const auto row = static_cast<Eigen::Index>(phone);
      EXPECT_LE((shape.captured() - shapes.captured.row(row)).cwiseAbs().maxCoeff(), within);
      EXPECT_LE((shape.predicted() - shapes.predicted.row(row)).cwiseAbs().maxCoeff(), within);
      EXPECT_EQ(packed.tightestMm(phone), shapes.tightest_mm[phone]);
    }
  }
}

TEST(PackedShapes, OfAFewPhonesAreThoseOfAll) {
  const PhoneShapes shapes = madeUp(7, 20);
  const PackedShapes all(shapes), few(shapes, 3, 2);
  for (const std::size_t phone : {0U, 1U}) {
    EXPECT_EQ(few.unpacked(phone).captured(), all.unpacked(3 + phone).captured());
    EXPECT_EQ(few.unpacked(phone).predicted(), all.unpacked(3 + phone).predicted());
    EXPECT_EQ(few.tightestMm(phone), all.tightestMm(3 + phone));
  }
}

TEST(PackedShapes, WhatWasNotSeenStaysNotSeen) {
  PhoneShapes shapes = madeUp(3, 10);
  shapes.captured(1, 4) = std::numeric_limits<float>::quiet_NaN();
  const PackedShapes packed(shapes);
  EXPECT_TRUE(packed.unpacked(0).captured().allFinite());
  const PhoneShape shape = packed.unpacked(1);
  for (Eigen::Index i = 0; i < shape.size; ++i) EXPECT_EQ(std::isnan(shape.captured()(i)), i == 4);
  EXPECT_TRUE(shape.predicted().allFinite());
}

TEST(PackedShapes, NothingAndNextToNothingAreZero) {
  for (const float reach_mm : {0.0F, 1e-40F}) {
    const PackedShapes packed(madeUp(2, reach_mm));
    EXPECT_LE(packed.unpacked(1).captured().cwiseAbs().maxCoeff(), 1e-20F);
  }
}

}  // namespace
}  // namespace mouthpiece
