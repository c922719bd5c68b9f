#include "page_engine/line_package.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "base/files.h"
#include "packed_line.h"
#include "page_engine/page_engine.h"
#include "support/cbor_tree.h"
#include "support/error_of.h"

namespace mouthpiece {
namespace {

using nlohmann::json;
using samples::packedLine;

std::string bytesOf(const json& package) {
  std::string bytes;
  json::to_cbor(package, bytes);
  return bytes;
}

/// `numbers` as a blob.
template <typename Scalar>
json blob(const std::vector<Scalar>& numbers) {
  std::vector<std::uint8_t> bytes(numbers.size() * sizeof(Scalar));
  if (!bytes.empty()) std::memcpy(bytes.data(), numbers.data(), bytes.size());
  return json::binary(bytes);
}

/// What a blob holds.
template <typename Scalar>
std::vector<Scalar> numbersOf(const json& node) {
  const auto& bytes = node.get_binary();
  std::vector<Scalar> numbers(bytes.size() / sizeof(Scalar));
  std::memcpy(numbers.data(), bytes.data(), bytes.size());
  return numbers;
}

TEST(LinePackage, AnUntouchedLineIsReadAndMadeAgain) {
  const LinePackage line = parseLinePackage(packedLine(), "line");
  EXPECT_EQ(line.request.text, "a man now");
  EXPECT_TRUE(line.request.audio.samples.empty());
  EXPECT_NEAR(line.request.sound_lasts, line.request.labels.duration(), 1.0 / 8000);
  PageEngine engine(packedLine());
  engine.render("[]");
  EXPECT_EQ(engine.frameCount(), static_cast<std::size_t>(std::ceil(25 * line.request.labels.duration() - 1e-6)));
  EXPECT_TRUE(engine.weights().allFinite());
  EXPECT_TRUE(engine.markers().allFinite());
  // The mouth opens and shuts.
  EXPECT_GT((engine.markers().colwise().maxCoeff() - engine.markers().colwise().minCoeff()).maxCoeff(), 0.004);
}

TEST(LinePackage, TheSeedOfItsFuzzTargetIsALine) {
  const std::string seed =
      readFile(std::filesystem::path(MOUTHPIECE_SOURCE_DIR) / "tests/fuzz/findings/line_package/line", 1 << 20);
  EXPECT_NO_THROW(parseLinePackage(seed, "seed"));
}

TEST(LinePackage, EveryCutIsAnInputError) {
  const std::string& whole = packedLine();
  for (std::size_t size = 0; size < whole.size(); size += 1 + whole.size() / 97) {
    EXPECT_THROW(parseLinePackage(whole.substr(0, size), "cut"), InputError) << size;
  }
  EXPECT_THROW(parseLinePackage(whole + "x", "long"), InputError);
}

/// What somebody changed, and what is said of it.
struct Damage {
  const char* name;
  std::function<void(json&)> change;
  const char* told;
};
std::ostream& operator<<(std::ostream& stream, const Damage& damage) { return stream << damage.name; }

class DamagedLine : public ::testing::TestWithParam<Damage> {};

TEST_P(DamagedLine, IsAnInputErrorThatNamesThePlace) {
  json package = test::cborTree(packedLine());
  GetParam().change(package);
  const std::string bytes = bytesOf(package);
  const std::string error = errorOf([&] { parseLinePackage(bytes, "line"); });
  EXPECT_TRUE(error.starts_with("line:")) << error;
  EXPECT_NE(error.find(GetParam().told), std::string::npos) << error;
}

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr auto kHuge = std::numeric_limits<std::int64_t>::max();

template <typename Scalar>
std::function<void(json&)> withNumber(std::string place, std::size_t index, Scalar value) {
  return [=](json& package) {
    json& node = package.at(json::json_pointer(place));
    std::vector<Scalar> numbers = numbersOf<Scalar>(node);
    numbers.at(index) = value;
    node = blob(numbers);
  };
}

std::function<void(json&)> with(std::string place, json value) {
  return [=](json& package) { package.at(json::json_pointer(place)) = value; };
}

/// As many as before, less one.
template <typename Scalar>
std::function<void(json&)> oneLess(std::string place) {
  return [=](json& package) {
    json& node = package.at(json::json_pointer(place));
    std::vector<Scalar> numbers = numbersOf<Scalar>(node);
    numbers.pop_back();
    node = blob(numbers);
  };
}

INSTANTIATE_TEST_SUITE_P(
    Counts, DamagedLine,
    ::testing::Values(Damage{"sound", with("/sound/count", kHuge), "sound.count"},
                      Damage{"sound_rate", with("/sound/rate_hz", 0), "sound.rate_hz"},
                      Damage{"sound_for_ever",
                             [](json& line) {
                               line["sound"] = {{"count", 1'000'000'000}, {"rate_hz", 1}};
                             },
                             "frames"},
                      Damage{"shapes", with("/sample/count", 99'999), "sample.shapes"},
                      Damage{"shapes_negative", with("/sample/count", -1), "sample.count"},
                      Damage{"components", with("/corpus/model/components", kHuge), "components"},
                      Damage{"part", with("/mesh/parts/0/triangles", kHuge), "triangles"},
                      Damage{"parts_too_few", with("/mesh/parts/0/triangles", 1), "hold all triangles"},
                      Damage{"no_parts", with("/mesh/parts", json::array()), "hold all triangles"},
                      Damage{"no_vertices",
                             [](json& line) {
                               line["mesh"]["vertices"] = blob<float>({});
                               line["mesh"]["triangles"] = blob<std::uint32_t>({});
                             },
                             "vertex"},
                      Damage{"phones", with("/labels/phones", blob<std::uint8_t>({})), "labels.phones"},
                      Damage{"phones_fewer", oneLess<std::uint8_t>("/labels/phones"), "labels"},
                      Damage{"times_fewer", oneLess<double>("/labels/times_s"), "labels"},
                      Damage{"motion_not_whole", oneLess<float>("/corpus/takes/0/motion_mm"), "motion_mm"},
                      Damage{"motion_none", with("/corpus/takes/0/motion_mm", blob<float>({})), "no frame"},
                      Damage{"neutral_short", oneLess<double>("/actor/neutral_mm"), "actor.neutral_mm"},
                      Damage{"markers_none", with("/corpus/layout", "{}"), "line:"},
                      Damage{"version", with("/version", 2), "version"}));

INSTANTIATE_TEST_SUITE_P(
    Indices, DamagedLine,
    ::testing::Values(
        Damage{"phone", withNumber<std::uint8_t>("/labels/phones", 1, 255), "labels.phones"},
        Damage{"word", withNumber<std::int32_t>("/labels/word", 1, 1 << 30), "labels.word"},
        Damage{"word_beyond_the_last", withNumber<std::int32_t>("/labels/word", 1, 3),
               "labels.word: found 3; expected -1 or an index below 3"},
        Damage{"word_of_silence", withNumber<std::int32_t>("/labels/word", 0, 0), "silence names a word"},
        Damage{"syllable", withNumber<std::int32_t>("/labels/syllables", 1, 1000), "labels.syllables"},
        Damage{"word_elsewhere", with("/labels/words/0/1", 2), "labels"},
        Damage{"corner", withNumber<std::uint32_t>("/mesh/triangles", 0, 0xFFFFFFFF), "mesh.triangles"},
        Damage{"sampled_vertex", withNumber<std::uint32_t>("/sample/vertices", 0, 0xFFFFFFFF), "sample.vertices"},
        Damage{"take", with("/plan/0/take", 3), "plan[0].take"},
        Damage{"fragment", with("/plan/0/phone", 100), "plan[0].phone"},
        Damage{"segment", with("/plan/0/last", 100), "plan[0].last"},
        Damage{"segment_lacks", with("/plan", json::array()), "cover the line"},
        Damage{"shape", withNumber<std::uint32_t>("/corpus/takes/0/shapes/phones", 0, 10'000), "shapes.phones"},
        Damage{"method", with("/options/method", 17), "options.method"}));

INSTANTIATE_TEST_SUITE_P(
    Numbers, DamagedLine,
    ::testing::Values(Damage{"time_nan", withNumber<double>("/labels/times_s", 2, kNan), "labels"},
                      Damage{"time_back", withNumber<double>("/labels/times_s", 3, 0), "follow one another"},
                      Damage{"time_far", withNumber<double>("/labels/times_s", 2 * 8 - 1, 1e300), "labels"},
                      Damage{"vertex_nan", withNumber<float>("/mesh/vertices", 0, std::nanf("")), "mesh.vertices"},
                      Damage{"pose_infinite", withNumber<double>("/actor/neutral_mm", 0, INFINITY), "actor.neutral_mm"},
                      Damage{"motion_infinite", withNumber<float>("/corpus/takes/0/motion_mm", 0, INFINITY),
                             "motion_mm"},
                      Damage{"model_nan", withNumber<float>("/corpus/model/analysis", 0, std::nanf("")), "analysis"},
                      Damage{"time_constant", withNumber<double>("/corpus/model/dynamics", 0, 0), "dynamics"},
                      Damage{"setting", with("/corpus/settings/0", -1), "settings[0]"},
                      Damage{"shape_nan", withNumber<float>("/sample/shapes", 0, std::nanf("")), "sample.shapes"},
                      Damage{"rate", with("/options/frame_rate_hz", kNan), "frame_rate_hz"},
                      Damage{"unit", with("/mesh/metres_per_unit", 0), "metres_per_unit"}));

}  // namespace
}  // namespace mouthpiece
