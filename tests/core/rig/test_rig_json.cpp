// rig.json: what is read, what is refused and how the message names it, what is kept on writing, mutated bytes.
#include <clocale>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>

#include "../../comma_locale.h"
#include "core/strict_json.inl"
#include "expect.hpp"
#include "rig/lenses.hpp"
#include "rig/rig.hpp"

namespace sgrt {
namespace {

using test::Draw;
using test::expect_error;

const char* const kRig = R"({
  "schema": "sgrt-rig/1",
  "id": "room 7",
  "room": "IEC 61217 fixed, mm",
  "cameras": [
    { "id": "pod1-left", "image_size": [1280, 1024], "model": "brown5",
      "intrinsics": [2412.7000000000003, 2409.1, 652.1, 498.3], "distortion": [-0.112, 0.173, 3.1e-4, -4.7e-4, -0.05],
      "camera_from_room": [[1, 0, 0, 120.25], [0, -1, 0, 0.1], [0, 0, -1, 2000], [0, 0, 0, 1]], "serial": "A-17" },
    { "id": "pod1-right", "image_size": [1280, 1024], "model": "pinhole", "intrinsics": [2400, 2400, 639.5, 511.5],
      "camera_from_room": [[0.6, 0.8, 0, -130], [-0.8, 0.6, 0, 7], [0, 0, 1, 2000.125], [0, 0, 0, 1]] }
  ],
  "pairs": [ { "id": "pod1", "left": "pod1-left", "right": "pod1-right", "note": "upper" } ],
  "lasers": [ { "id": "scanner", "anything": [1, 2.5, null] } ],
  "uncertainty": { "parameters": ["pod1-left.fx"], "modes": [[0.3]], "residual_px": 0.05 },
  "provenance": { "made": "by hand", "big": 18446744073709551615 }
})";

Rig read(const std::string& text) {
  return rig_from_json(text.data(), text.size());
}

std::string with(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  if (at == std::string::npos) throw std::logic_error("the test's text lacks " + from);
  return text.replace(at, from.size(), to);
}

void expect_refused(const std::string& from, const std::string& to, const std::string& words,
                    Status status = Status::kFormat) {
  SCOPED_TRACE(from + " -> " + to.substr(0, 100));
  const std::string text = with(kRig, from, to);
  expect_error(status, words, [&] { read(text); });
}

TEST(RigJson, ReadsEverything) {
  const Rig rig = read(kRig);
  EXPECT_EQ(rig.id, "room 7");
  EXPECT_EQ(rig.room, "IEC 61217 fixed, mm");
  ASSERT_EQ(rig.cameras.size(), 2U);
  const Camera& left = rig.cameras[0];
  EXPECT_EQ(left.id, "pod1-left");
  EXPECT_EQ(left.width, 1280);
  EXPECT_EQ(left.height, 1024);
  EXPECT_EQ(left.fx, 2412.7000000000003);
  EXPECT_EQ(left.fy, 2409.1);
  EXPECT_EQ(left.cx, 652.1);
  EXPECT_EQ(left.cy, 498.3);
  EXPECT_EQ(left.distortion_count, 5);
  EXPECT_EQ(left.distortion, (std::array<double, 8>{-0.112, 0.173, 3.1e-4, -4.7e-4, -0.05, 0, 0, 0}));
  EXPECT_EQ(left.camera_from_room.t, Vec3(120.25, 0.1, 2000));
  EXPECT_EQ(left.camera_from_room.R, Mat3(Vec3(1, -1, -1).asDiagonal()));
  EXPECT_GT(left.max_radius2, 0);
  EXPECT_EQ(rig.cameras[1].distortion_count, 0);
  EXPECT_EQ(rig.cameras[1].camera_from_room.R(0, 1), 0.8);
  ASSERT_EQ(rig.pairs.size(), 1U);
  EXPECT_EQ(rig.pairs[0].left, 0);
  EXPECT_EQ(rig.pairs[0].right, 1);
}

TEST(RigJson, SmallestRig) {
  const Rig rig = read(R"({"schema":"sgrt-rig/1","id":"x","room":"camera c","cameras":[{"id":"c","image_size":[64,48],)"
                       R"("model":"pinhole","distortion":[],"intrinsics":[100,100,31.5,23.5],)"
                       R"("camera_from_room":[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}]})");
  EXPECT_TRUE(rig.pairs.empty());
}

TEST(RigJson, NotJson) {
  for (const char* text : {"", " ", "{", "nonsense", "{\"schema\": \"sgrt-rig/1\",}", "[1, 2", "{} {}", "{\"a\" 1}",
                           "// {}", "{\"a\": 01}", "{\"a\": NaN}", "\xff\xfe", "{\"a\": \"\xff\"}"}) {
    expect_error(Status::kFormat, "rig: not JSON, syntax error near byte", [&] { read(text); });
  }
  expect_error(Status::kFormat, "not JSON", [] { rig_from_json(nullptr, 0); });
  expect_error(Status::kFormat, "not JSON", [] { rig_from_json(kRig, std::strlen(kRig) - 1); });  // cut short
  expect_error(Status::kFormat, "a NUL at byte", [] { rig_from_json(kRig, std::strlen(kRig) + 1); });
  for (const char* text : {"3", "null", "[]", "\"sgrt-rig/1\""})
    expect_error(Status::kFormat, "rig: expected an object", [&] { read(text); });
  for (const char* text : {"[1e999]", "[-1e999]", "[1e-999]"})
    expect_error(Status::kFormat, "out of range", [&] { read(text); });
}

// REQ-RIG-003
TEST(RigJson, Limits) {
  std::string deep = with(kRig, "\"by hand\"", std::string(14, '[') + std::string(14, ']'));
  EXPECT_NO_THROW(read(deep));  // 2 + 14
  deep = with(kRig, "\"by hand\"", std::string(15, '[') + std::string(15, ']'));
  expect_error(Status::kLimit, "deeper than 16", [&] { read(deep); });
  expect_error(Status::kLimit, "deeper than 16", [&] { read(std::string(1'000'000, '[')); });
  std::string wide = kRig;
  wide.resize((16 << 20) + 1, ' ');
  expect_error(Status::kLimit, "16 MiB", [&] { read(wide); });
  wide.resize(16 << 20);
  EXPECT_NO_THROW(read(wide));
  std::string many = "\"cameras\": [";
  for (int i = 0; i < 65; ++i) many += "{},";
  expect_refused("\"cameras\": [", many, "at most 64", Status::kLimit);
  expect_refused("[1280, 1024]", "[1280, 32769]", "cameras[0].image_size: expected at most 32768, got 32769",
                 Status::kLimit);
}

TEST(RigJson, HundredThousandKeysAreReadAtOnce) {
  std::string keys;
  for (int i = 0; i < 100000; ++i) keys += "\"k" + std::to_string(i) + "\": 1, ";
  EXPECT_NO_THROW(read(with(kRig, "\"made\"", keys + "\"made\"")));
}

// Of two rows for one parameter the second would not count.
TEST(RigJson, ParametersStandOnce) {
  expect_refused("\"parameters\": [\"pod1-left.fx\"], \"modes\": [[0.3]]",
                 "\"parameters\": [\"pod1-left.fx\", \"pod1-left.fx\"], \"modes\": [[0.3, 0.4]]",
                 "uncertainty.parameters[1]: 'pod1-left.fx' stands twice");
}

TEST(RigJson, KeysStandOnce) {
  expect_refused("\"id\": \"room 7\"", "\"id\": \"a\", \"id\": \"b\"", "the key 'id' stands twice");
  expect_refused("\"note\": \"upper\"", "\"note\": 1, \"note\": 1", "the key 'note' stands twice");
}

// 2.6 MB of text that promise a matrix of 320 GB.
TEST(RigJson, NoMemoryForWhatIsOnlyPromised) {
  std::string names = "\"0\"", modes = "[]";
  for (int i = 1; i < 200'000; ++i) {
    names += ",\"" + std::to_string(i) + "\"";
    modes += ",[]";
  }
  expect_refused("\"parameters\": [\"pod1-left.fx\"], \"modes\": [[0.3]]",
                 "\"parameters\": [" + names + "], \"modes\": [" + modes + "]",
                 "uncertainty.modes[0]: expected 200000 finite numbers, got 0");
}

// REQ-RIG-001
TEST(RigJson, EachFieldIsNamed) {
  expect_refused("sgrt-rig/1", "sgrt-rig/2", "schema: expected 'sgrt-rig/1', got 'sgrt-rig/2'");
  expect_refused("\"schema\": \"sgrt-rig/1\",", "", "schema: missing");
  expect_refused("\"sgrt-rig/1\"", "1", "schema: expected a text, got number");
  expect_refused("\"id\": \"room 7\",", "", "id: missing");
  expect_refused("\"room 7\"", "\"\"", "id: expected a text, got an empty one");
  expect_refused("\"room\": \"IEC 61217 fixed, mm\",", "", "room: missing");
  expect_refused("\"cameras\"", "\"camera\"", "cameras: missing");
  expect_refused("[ { \"id\": \"pod1\"", "[ 4, { \"id\": \"pod1\"", "pairs[0]: expected an object, got number");
  expect_refused("\"brown5\"", "\"fisheye\"", "cameras[0].model: expected pinhole, brown5 or rational8, got 'fisheye'");
  expect_refused("\"model\": \"brown5\",", "", "cameras[0].model: missing");
  expect_refused("\"brown5\"", "\"pinhole\"", "cameras[0].distortion: expected 0 finite numbers, got 5");
  expect_refused("\"brown5\"", "\"rational8\"", "cameras[0].distortion: expected 8 finite numbers, got 5");
  expect_refused("\"pinhole\"", "\"brown5\"", "cameras[1].distortion: missing");
  expect_refused("639.5, 511.5", "639.5", "cameras[1].intrinsics: expected 4 finite numbers, got 3");
  expect_refused("[2400, 2400, 639.5, 511.5]", "{}", "cameras[1].intrinsics: expected 4 finite numbers, got object");
  expect_refused("639.5", "\"639.5\"", "cameras[1].intrinsics: expected 4 finite numbers, got a string");
  expect_refused("639.5", "null", "cameras[1].intrinsics: expected 4 finite numbers, got a null");
  expect_refused("[2400,", "[-2400,", "cameras[1].intrinsics: expected fx and fy from 1 to 1e7 px, got -2400");
  expect_refused("[1280, 1024]", "[1280]", "cameras[0].image_size: expected 2 finite numbers, got 1");
  for (const char* bad : {"0", "-5", "1024.5"}) {
    expect_refused("[1280, 1024]", std::string("[1280, ") + bad + "]",
                   "cameras[0].image_size: expected 2 positive integers");
  }
  expect_refused("-0.112", "-30", "cameras[0].distortion: folds inside the image");
  expect_refused(", [0, 0, 0, 1]]", "]", "cameras[0].camera_from_room: expected 4 rows");
  expect_refused("[0, -1, 0, 0.1]", "[0, -1, 0]", "cameras[0].camera_from_room[1]: expected 4 finite numbers, got 3");
  expect_refused("[0, -1, 0, 0.1]", "[0, -1.00001, 0, 0.1]", "cameras[0].camera_from_room: not a rigid motion");
  expect_refused("[0, -1, 0, 0.1]", "[0, 1, 0, 0.1]",
                 "cameras[0].camera_from_room: not a rigid motion but a reflection");
  expect_refused("[[1, 0, 0, 120.25]", "[[0, 0, 0, 120.25]", "cameras[0].camera_from_room: not a rigid motion");
  expect_refused("\"pod1-right\", \"image", "\"pod1-left\", \"image", "cameras[1].id: 'pod1-left' stands twice");
  expect_refused("\"left\": \"pod1-left\"", "\"left\": \"pod9\"",
                 "pairs[0].left: camera 'pod9' is not in the rig, which has 'pod1-left', 'pod1-right'");
  expect_refused("\"left\": \"pod1-left\"", "\"left\": 0", "pairs[0].left: expected a text, got number");
  expect_refused("\"right\": \"pod1-right\"", "\"right\": \"pod1-left\"", "pairs[0].right: the same camera as left");
  expect_refused("\"note\": \"upper\" }",
                 "\"note\": \"upper\" }, { \"id\": \"pod1\", \"left\": \"pod1-right\", \"right\": \"pod1-left\" }",
                 "pairs[1].id: 'pod1' stands twice");
  expect_refused("\"pairs\": [", "\"pairs\": {}, \"x\": [", "pairs: expected an array, got object");
}

// REQ-RIG-004
TEST(RigJson, EachFieldOfATimeOfFlightUnitIsNamed) {
  const std::string unit = R"({"id": "t", "camera": "pod1-left", "modulation_hz": [2e7, 3e7],
    "tap_phase_rad": [0, 1.5, 3, 4.5], "taps": "single", "electrons_per_count": 2, "pixel_offset_mm": "offset.npy",
    "range_correction": {"range_mm": [500, 1000], "error_mm": [1, -1]},
    "amplitude_correction": {"amplitude": [100, 200], "error_mm": [0.5, 0]}})";
  const std::string text = with(kRig, "\"lasers\":", "\"tofs\": [" + unit + "], \"lasers\":");
  const Rig rig = read(text);
  ASSERT_EQ(rig.tofs.size(), 1U);
  EXPECT_EQ(rig.tofs[0].modulation_hz, (std::vector<double>{2e7, 3e7}));
  EXPECT_EQ(rig.tofs[0].amplitude_error_mm, (std::vector<double>{0.5, 0}));
  EXPECT_EQ(rig.tofs[0].pixel_offset_file, "offset.npy");
  const auto refused = [&](const std::string& from, const std::string& to, const std::string& words) {
    SCOPED_TRACE(from + " -> " + to);
    expect_error(Status::kFormat, words, [&] { read(with(text, from, to)); });
  };
  refused("[2e7, 3e7]", "[]", "tofs[0].modulation_hz: expected 1 to 8 numbers, got 0");
  refused("[2e7, 3e7]", "2e7", "tofs[0].modulation_hz: expected numbers, got number");
  refused("[2e7, 3e7]", "[2e7, 2e7]", "tofs[0].modulation_hz: 2e+07 twice");
  refused("[2e7, 3e7]", "[2e7, -1]", "tofs[0].modulation_hz: -1");
  refused("[0, 1.5, 3, 4.5]", "[0, 1.5]", "tofs[0].tap_phase_rad: expected 3 to 32 numbers, got 2");
  refused("[0, 1.5, 3, 4.5]", "[0, 0, 0, 0]", "tofs[0].tap_phase_rad: phases that do not span the circle");
  refused("\"single\"", "\"double\"", "tofs[0].taps: expected single or differential, got 'double'");
  refused("\"electrons_per_count\": 2", "\"electrons_per_count\": \"2\"",
          "tofs[0].electrons_per_count: expected a number, got string");
  refused("\"electrons_per_count\": 2", "\"electrons_per_count\": 0", "tofs[0].electrons_per_count: 0");
  for (const char* name : {"/etc/passwd", "../offset.npy", "c:offset.npy", "a\\\\b"})
    refused("offset.npy", name, "tofs[0].pixel_offset_mm: expected the name of a file beside the rig");
  refused("[500, 1000]", "[1000, 500]", "tofs[0].range_correction.range_mm[1]: 500, expected more than 1000 before it");
  refused("[1, -1]", "[1]", "tofs[0].range_correction.error_mm: expected 2 finite numbers, got 1");
  refused("{\"amplitude\": [100, 200], \"error_mm\": [0.5, 0]}", "[]",
          "tofs[0].amplitude_correction: expected an object, got array");
  refused("\"tofs\": [", "\"tofs\": [" + unit + ", ", "tofs[1].id: 't' stands twice");
  // What is changed is written, what is switched off is gone.
  Rig changed = rig;
  changed.tofs[0].range_mm.clear(), changed.tofs[0].range_error_mm.clear();
  changed.tofs[0].pixel_offset_file.clear();
  const Rig again = read(rig_to_json(changed));
  EXPECT_TRUE(again.tofs[0].range_mm.empty() && again.tofs[0].pixel_offset_file.empty());
  EXPECT_EQ(again.tofs[0].amplitude, rig.tofs[0].amplitude);
  changed.tofs.clear();
  EXPECT_EQ(rig_to_json(changed).find("tofs"), std::string::npos);
}

TEST(RigJson, TextsThatAreNoNames) {
  expect_refused("\"id\": \"pod1-right\"", "\"id\": \"pod1\\u0000right\"", "cameras[1].id: has a control character");
  expect_refused("\"room 7\"", "\"room\\n7\"", "id: has a control character");
  expect_refused("\"room 7\"", "\"" + std::string(2000, 'x') + "\"", "id: expected at most 1000 bytes");
  expect_refused("\"brown5\"", "\"a\\nb" + std::string(500, '\xc3') + "\"", "not JSON");
  EXPECT_EQ(read(with(kRig, "room 7", "Saal \xc3\xa4")).id, "Saal \xc3\xa4");
}

TEST(RigJson, NoCamera) {
  expect_error(Status::kFormat, "cameras: expected at least one",
               [] { read(R"({"schema":"sgrt-rig/1","id":"x","room":"r","cameras":[]})"); });
}

TEST(RigJson, UnchangedTheTextStays) {
  const Rig rig = read(kRig);
  EXPECT_EQ(rig.document, kRig);
  EXPECT_EQ(rig_to_json(rig), kRig);
}

// REQ-RIG-002
TEST(RigJson, AChangedRigKeepsWhatItDoesNotKnow) {
  Rig rig = read(kRig);
  rig.cameras[1].fx = std::nextafter(2400, 3000);
  rig.cameras.push_back(rig.cameras[0]);
  rig.cameras[2].id = "third";
  const std::string text = rig_to_json(rig);
  for (const char* kept : {"\"serial\": \"A-17\"", "\"note\": \"upper\"", "\"scanner\"", "18446744073709551615",
                           "\"by hand\"", "pod1-left.fx", "2400.0000000000005", "\"model\": \"pinhole\""}) {
    EXPECT_NE(text.find(kept), std::string::npos) << kept << " is lost in\n" << text;
  }
  const Rig again = read(text);
  ASSERT_EQ(again.cameras.size(), 3U);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(again.cameras[i].id, rig.cameras[i].id);
    EXPECT_EQ(again.cameras[i].fx, rig.cameras[i].fx);
    EXPECT_EQ(again.cameras[i].distortion, rig.cameras[i].distortion);
    EXPECT_EQ(again.cameras[i].camera_from_room.matrix(), rig.cameras[i].camera_from_room.matrix());
  }
  EXPECT_LT(text.find("schema"), text.find("cameras"));  // in the order that was read
}

// REQ-RIG-002
TEST(RigJson, NumbersToTheLastBit) {
  Draw draw(1);
  for (int repeat = 0; repeat < 200; ++repeat) {
    Rig rig;
    rig.id = "made";
    rig.room = "IEC 61217 fixed, mm";
    for (Camera camera : test::real_lenses()) {
      Vec6 twist;
      twist << draw.vec3(3), draw.vec3(2000);
      camera.camera_from_room = se3_exp(twist);
      camera.fx *= 1 + draw.uniform(0, 1e-3);
      camera.cx += draw.uniform(-1, 1);
      rig.cameras.push_back(make_camera(camera));
    }
    rig.pairs = {{"a", 0, 1}, {"b", 3, 2}};
    const Rig again = read(rig_to_json(rig));
    for (std::size_t i = 0; i < rig.cameras.size(); ++i) {
      const Camera &a = rig.cameras[i], &b = again.cameras[i];
      EXPECT_EQ(a.fx, b.fx);
      EXPECT_EQ(a.cx, b.cx);
      EXPECT_EQ(a.distortion, b.distortion);
      EXPECT_EQ(a.max_radius2, b.max_radius2);
      EXPECT_EQ(a.camera_from_room.matrix(), b.camera_from_room.matrix());
    }
    EXPECT_EQ(again.pairs[1].left, 3);
    EXPECT_EQ(rig_to_json(again), again.document);
  }
}

TEST(RigJson, ARigThatCouldNotBeReadIsNotWritten) {
  Rig rig = read(kRig);
  rig.cameras[0].fy = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(rig_to_json(rig), Error);
  rig = read(kRig);
  rig.cameras[0].id = "pod1-right";
  expect_error(Status::kFormat, "stands twice", [&] { rig_to_json(rig); });
  rig = read(kRig);
  rig.id = "\xff";
  EXPECT_THROW(rig_to_json(rig), Error);
  rig = read(kRig);
  rig.pairs[0].left = 7;
  EXPECT_THROW(rig_to_json(rig), Error);
  EXPECT_THROW(rig_to_json(Rig{}), Error);
}

// Numbers are read, written and named alike where the decimal point is a comma.
// REQ-RIG-005
TEST(RigJson, AnyLocale) {
  const std::string before = std::setlocale(LC_ALL, nullptr);
  if (!enter_comma_locale()) GTEST_SKIP() << "no locale with a decimal comma, and no localedef that makes one";
  Rig rig = read(kRig);
  EXPECT_EQ(rig.cameras[0].fx, 2412.7000000000003);
  rig.cameras[0].fx = 2412.75;
  const std::string text = rig_to_json(rig);
  EXPECT_NE(text.find("2412.75,"), std::string::npos);
  EXPECT_EQ(read(text).cameras[0].fx, 2412.75);
  expect_error(Status::kFormat, "1024.5", [&] { read(with(kRig, "[2400,", "[-1024.5,")); });
  std::setlocale(LC_ALL, before.c_str());
}

// nlohmann-json hands over a number as it read it, the locale's decimal point in place of the point.
// REQ-RIG-005
TEST(RigJson, CommaOfALocale) {
  for (const char* token : {"2412,75",
                            "2412\xd9"
                            "75",
                            "241275E-2", "2412.75"}) {
    JsonBuilder builder("text");
    builder.number_float(0, token);
    EXPECT_EQ(builder.root.get<double>(), 2412.75);
  }
}

// Bytes changed, cut, doubled at random: a rig or an Error, nothing else, and one line of ASCII.
// REQ-RIG-004
TEST(RigJson, MutatedBytes) {
  Draw draw(2);
  int good = 0, bad = 0;
  const std::string source = kRig;
  for (int i = 0; i < 20000; ++i) {
    std::string text = source;
    const int changes = 1 + static_cast<int>(draw.bits() % 4);
    for (int k = 0; k < changes && !text.empty(); ++k) {
      const std::size_t at = draw.bits() % text.size(), length = 1 + draw.bits() % 12;
      switch (draw.bits() % 5) {
        case 0:
          text[at] = static_cast<char>(draw.bits());
          break;
        case 1:
          text[at] = "0123456789-+.eE[]{},:\" "[draw.bits() % 23];
          break;
        case 2:
          text.erase(at, length);
          break;
        case 3:
          text.insert(at, source.substr(draw.bits() % source.size(), length));
          break;
        default:
          text.resize(at + 1);
          break;
      }
    }
    try {
      const Rig rig = rig_from_json(text.data(), text.size());
      EXPECT_EQ(rig_to_json(rig), text);
      ++good;
    } catch (const Error& error) {
      ++bad;
      for (const char* c = error.what(); *c; ++c) ASSERT_TRUE(*c >= 0x20 && *c < 0x7f) << error.what();
      ASSERT_TRUE(error.status() == Status::kFormat || error.status() == Status::kLimit) << error.what();
    }
  }
  EXPECT_GT(good, 100);
  EXPECT_GT(bad, 10000);
}

}  // namespace
}  // namespace sgrt
