// Borrowed images of every type and stride; texts of error messages.
#include "core/image.hpp"

#include <cmath>
#include <cstdlib>
#include <limits>
#include <vector>

#include "expect.hpp"

namespace sgrt {
namespace {

using test::expect_error;
using Type = ImageView::Type;

template <class T>
ImageView view_of(const std::vector<T>& pixels, Type type, int height, int width) {
  return {pixels.data(), type, height, width, static_cast<std::int64_t>(width * sizeof(T)), sizeof(T)};
}

template <class T>
std::vector<T> ramp(int n, double step) {
  std::vector<T> v(static_cast<std::size_t>(n));
  for (int i = 0; i < n; ++i) v[static_cast<std::size_t>(i)] = static_cast<T>(i * step);
  return v;
}

template <class T>
void check(Type type, double step) {
  const std::vector<T> pixels = ramp<T>(12, step);
  const ImageView whole = view_of(pixels, type, 3, 4);
  Image image;
  load(whole, image);
  ASSERT_EQ(image.height, 3);
  ASSERT_EQ(image.width, 4);
  for (int y = 0; y < 3; ++y) {
    for (int x = 0; x < 4; ++x) {
      EXPECT_EQ(image.row(y)[x], static_cast<float>(pixels[static_cast<std::size_t>(y * 4 + x)]));
      EXPECT_EQ(whole.at(y, x), image.row(y)[x]);
    }
  }
  // Every second column, rows from below: negative and wide strides.
  const ImageView turned{pixels.data() + 8, type, 3, 2, -whole.row_stride, 2 * whole.column_stride};
  load(turned, image);
  EXPECT_EQ(image.row(0)[1], static_cast<float>(pixels[10]));
  EXPECT_EQ(image.row(2)[0], static_cast<float>(pixels[0]));
  EXPECT_EQ(turned.at(2, 1), static_cast<float>(pixels[2]));
}

TEST(Image, EveryTypeAndStride) {
  check<std::uint8_t>(Type::kU8, 20);
  check<std::uint16_t>(Type::kU16, 5000);
  check<float>(Type::kF32, -0.37);
}

TEST(Image, WhatIsNoGreyLevelCountsAsClipped) {
  const float inf = std::numeric_limits<float>::infinity();
  const std::vector<float> pixels = {1, std::nanf(""), inf, -inf, -3, 1e38F, 1e9F};
  const ImageView view = view_of(pixels, Type::kF32, 1, 7);
  Image image;
  load(view, image);
  EXPECT_EQ(image.pixels, (std::vector<float>{1, inf, inf, inf, -3, inf, 1e9F}));
  for (int x = 0; x < 7; ++x) EXPECT_EQ(view.at(0, x), image.row(0)[x]);
}

TEST(Image, Clip) {
  EXPECT_EQ((ImageView{nullptr, Type::kU8}).clip(), 255);
  EXPECT_EQ((ImageView{nullptr, Type::kU16}).clip(), 65535);
  EXPECT_EQ((ImageView{nullptr, Type::kF32}).clip(), std::numeric_limits<float>::infinity());
}

TEST(Image, Nonsense) {
  Image image;
  expect_error(Status::kInvalidArgument, "NULL", [&] { load({nullptr, Type::kU8, 1, 1, 1, 1}, image); });
  const std::uint8_t pixel = 3;
  expect_error(Status::kInvalidArgument, "one pixel", [&] { load({&pixel, Type::kU8, 0, 1, 1, 1}, image); });
  expect_error(Status::kInvalidArgument, "one pixel", [&] { load({&pixel, Type::kU8, 1, -1, 1, 1}, image); });
}

TEST(Text, Numbers) {
  EXPECT_EQ(text_of(0.1), "0.1");
  EXPECT_EQ(text_of(-3), "-3");
  EXPECT_EQ(text_of(std::numeric_limits<double>::quiet_NaN()), "nan");
  EXPECT_EQ(text_of(-std::numeric_limits<double>::infinity()), "-inf");
  for (double value :
       {1.0 / 3, -std::numeric_limits<double>::max(), std::numeric_limits<double>::denorm_min(), 6.02e23}) {
    EXPECT_EQ(std::strtod(text_of(value).c_str(), nullptr), value);
  }
}

// REQ-ABI-003
TEST(Text, OfTheCaller) {
  EXPECT_EQ(in_quotes("pod1"), "'pod1'");
  EXPECT_EQ(in_quotes("a\nb\x01\xc3\xa4"), "'a?b\?\?\?'");
  EXPECT_EQ(in_quotes(std::string(1000, 'x')), "'" + std::string(80, 'x') + "...'");
  EXPECT_EQ(in_quotes(std::string("a\0b", 3)), "'a?b'");
}

TEST(Text, EigensPreconditionThrows) {
  expect_error(Status::kInternal, "Eigen", [] { fail_eigen("rows == cols"); });
}

}  // namespace
}  // namespace sgrt
