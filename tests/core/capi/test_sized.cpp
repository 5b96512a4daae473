// How a sized struct grows: a caller of either age against a library of either age.
#include "capi/sized.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace {

struct Old {
  std::uint32_t struct_size;
  std::int32_t count;
  double distance;
};

struct New {
  std::uint32_t struct_size;
  std::int32_t count;
  double distance;
  double angle;  // appended
};

// The defaults of the newer library.
constexpr New kDefaults = {sizeof(New), 5, 1.5, 60};

}  // namespace

template <>
constexpr std::size_t sgrt::kFirstSize<New> = sizeof(Old);

namespace sgrt {
namespace {

template <class Call>
Status status_of(Call&& call) {
  try {
    call();
  } catch (const Error& error) {
    return error.status();
  }
  return Status::kOk;
}

// The caller's struct as the library sees it.
New* as_new(Old* caller) {
  return reinterpret_cast<New*>(caller);
}

TEST(Sized, InitFillsNoMoreThanAnOlderCallerHas) {
  Old caller[2];
  std::memset(caller, 0xAB, sizeof caller);
  const Old untouched = caller[1];
  init_struct(as_new(caller), sizeof(Old), kDefaults, "options");
  EXPECT_EQ(caller[0].struct_size, sizeof(Old));
  EXPECT_EQ(caller[0].count, 5);
  EXPECT_EQ(caller[0].distance, 1.5);
  EXPECT_EQ(std::memcmp(&caller[1], &untouched, sizeof untouched), 0);
}

// REQ-ABI-007
TEST(Sized, AnOlderCallersOptionsTakeDefaultsForTheRest) {
  Old caller = {sizeof(Old), 9, 2.5};
  const New read = read_struct(static_cast<const New*>(as_new(&caller)), kDefaults, "options.struct_size");
  EXPECT_EQ(read.count, 9);
  EXPECT_EQ(read.distance, 2.5);
  EXPECT_EQ(read.angle, 60);
}

TEST(Sized, NoOptionsAreTheDefaults) {
  const New read = read_struct<New>(nullptr, kDefaults, "options.struct_size");
  EXPECT_EQ(read.count, 5);
  EXPECT_EQ(read.angle, 60);
}

// REQ-ABI-007
TEST(Sized, AResultIsWrittenAsFarAsTheCallerKnows) {
  Old caller[2];
  std::memset(caller, 0xAB, sizeof caller);
  caller[0].struct_size = sizeof(Old);
  const Old untouched = caller[1];
  write_struct(as_new(caller), New{0, 7, 3.5, 45});
  EXPECT_EQ(caller[0].struct_size, sizeof(Old));
  EXPECT_EQ(caller[0].count, 7);
  EXPECT_EQ(caller[0].distance, 3.5);
  EXPECT_EQ(std::memcmp(&caller[1], &untouched, sizeof untouched), 0);
  write_struct<New>(nullptr, New{});  // an optional result
}

// REQ-ABI-008
TEST(Sized, SizesNeverInAHeaderAreRefused) {
  for (const std::size_t size :
       {std::size_t{0}, std::size_t{4}, sizeof(Old) - 1, sizeof(New) + 1, std::size_t{1} << 40}) {
    New caller = kDefaults;
    EXPECT_EQ(status_of([&] { init_struct(&caller, size, kDefaults, "options"); }), Status::kInvalidArgument) << size;
    caller.struct_size = static_cast<std::uint32_t>(size);
    EXPECT_EQ(status_of([&] { read_struct(&caller, kDefaults, "options"); }), Status::kInvalidArgument) << size;
    EXPECT_EQ(status_of([&] { check_result(&caller, "info"); }), Status::kInvalidArgument) << size;
  }
}

TEST(Sized, SizesBetweenTwoVersionsAreAccepted) {
  New caller = kDefaults;
  EXPECT_EQ(status_of([&] { init_struct(&caller, sizeof(Old), kDefaults, "options"); }), Status::kOk);
  EXPECT_EQ(status_of([&] { init_struct(&caller, sizeof(New), kDefaults, "options"); }), Status::kOk);
}

TEST(Sized, TheMessageNamesTheSizesKnown) {
  New caller = {99, 0, 0, 0};
  try {
    check_result(&caller, "size");
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("size: 99, expected"), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("16 to 24"), std::string::npos);
  }
}

}  // namespace
}  // namespace sgrt
