#include "motion/marker_layout.h"

#include <gtest/gtest.h>

#include <string>

#include "base/errors.h"
#include "base/files.h"

namespace mouthpiece {
namespace {

std::string messageOf(const std::string& json) {
  try {
    parseLayout(json, "bad.json");
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

std::string layoutWith(const std::string& markers) { return R"({"name":"t","markers":[)" + markers + "]}"; }

TEST(MarkerLayout, DefaultIsTheFaceOf66Markers) {
  const MarkerLayout& layout = defaultLayout();
  EXPECT_EQ(layout.name, "face66");
  ASSERT_EQ(layout.markers.size(), 66U);
  ASSERT_EQ(layout.jig_names.size(), 7U);
  EXPECT_EQ(layout.jig_names.front(), "JIG_1");
  EXPECT_EQ(layout.markers[layout.indexOf("LIP_UP_MID").value].region, "lip");
  EXPECT_THROW((void)layout.indexOf("NO_SUCH"), InputError);
  EXPECT_EQ(layout.markerNames()[5], layout.markers[5].name);
}

TEST(MarkerLayout, DefaultMirrorsAreSymmetric) {
  const MarkerLayout& layout = defaultLayout();
  for (std::size_t i = 0; i < layout.markers.size(); ++i) {
    const LayoutMarker& marker = layout.markers[i];
    EXPECT_EQ(layout.markers[marker.mirror.value].mirror, MarkerIndex(i)) << marker.name;
    EXPECT_EQ(marker.side == Side::kMiddle, marker.mirror == MarkerIndex(i)) << marker.name;
  }
}

TEST(MarkerLayout, SurvivesWritingAndReading) {
  const std::string once = layoutToJson(defaultLayout());
  const MarkerLayout back = parseLayout(once, "again.json");
  EXPECT_EQ(layoutToJson(back), once);
  for (std::size_t i = 0; i < 66; ++i) {
    EXPECT_EQ(back.markers[i].name, defaultLayout().markers[i].name);
    EXPECT_EQ(back.markers[i].mirror, defaultLayout().markers[i].mirror);
    EXPECT_EQ(back.markers[i].stable, defaultLayout().markers[i].stable);
    EXPECT_EQ(back.markers[i].mediapipe_landmark, defaultLayout().markers[i].mediapipe_landmark);
  }
}

TEST(MarkerLayout, LipsAndTrianglesAreTheFiles) {
  const std::string text =
      R"({"name":"t","markers":[{"name":"LIP_UP_A","region":"lip","side":"M","mirror":"LIP_UP_A"},
          {"name":"B","region":"lip","side":"M","mirror":"B","lip":"lower"},
          {"name":"LIP_LO_C","region":"lip","side":"M","mirror":"LIP_LO_C","lip":"none"}],
          "triangles":[["B","LIP_LO_C","RIM_LO_MID"]]})";
  for (const MarkerLayout& layout :
       {parseLayout(text, "t.json"), parseLayout(layoutToJson(parseLayout(text, "t")), "t")}) {
    EXPECT_EQ(layout.markers[0].lip, LipSide::kUpper) << "by its name";
    EXPECT_EQ(layout.markers[1].lip, LipSide::kLower);
    EXPECT_EQ(layout.markers[2].lip, LipSide::kNone);
    ASSERT_EQ(layout.triangles.size(), 1U);
    EXPECT_EQ(layout.triangles[0][2], "RIM_LO_MID");
  }
  const std::string marker = R"({"name":"A","region":"lip","side":"M","mirror":"A")";
  EXPECT_NE(messageOf(layoutWith(marker + R"(,"lip":"left"})")).find("one of none, upper, lower"), std::string::npos);
  for (const char* triangles : {"5", "[5]", R"([["A","B"]])", R"([["A","A","B"]])", R"([["A","B",3]])"}) {
    EXPECT_NE(messageOf(R"({"name":"t","markers":[)" + marker + "}],\"triangles\":" + triangles + "}"), "")
        << triangles;
  }
}

TEST(MarkerLayout, NamesWhatIsWrong) {
  const std::string middle = R"({"name":"A","region":"lip","side":"M","mirror":"A"})";
  EXPECT_EQ(messageOf(layoutWith(middle)), "");
  EXPECT_EQ(messageOf("{"), "bad.json:1:2: is no valid JSON; expected a marker layout");
  EXPECT_NE(messageOf("[]"), "");
  EXPECT_NE(messageOf(R"({"name":"t"})").find("expected a list of 1 to"), std::string::npos);
  EXPECT_NE(messageOf(R"({"name":"t","markers":5})"), "");
  EXPECT_NE(messageOf(layoutWith("5")).find("markers[0]"), std::string::npos);
  EXPECT_NE(messageOf(layoutWith(middle + "," + middle)).find("found A twice"), std::string::npos);
  EXPECT_NE(messageOf(layoutWith(R"({"name":"A","region":"lip","side":"Q","mirror":"A"})"))
                .find("side: found \"Q\"; expected one of R, M, L"),
            std::string::npos);
  EXPECT_NE(
      messageOf(layoutWith(R"({"name":"A","region":"lip","side":"M","mirror":"B"})")).find("found mirror \"B\" of A"),
      std::string::npos);
  EXPECT_NE(
      messageOf(layoutWith(R"({"name":7,"region":"lip","side":"M","mirror":"A"})")).find("markers[0].name: found 7"),
      std::string::npos);
  EXPECT_NE(messageOf(layoutWith(R"({"region":"lip","side":"M","mirror":"A"})")).find("markers[0].name: is missing"),
            std::string::npos);
  for (const std::size_t letters : {127U, 128U}) {
    const std::string name(letters, 'A');
    EXPECT_EQ(
        messageOf(layoutWith(R"({"name":")" + name + R"(","region":"lip","side":"M","mirror":")" + name + R"("})"))
            .empty(),
        letters == 127)
        << "a C3D label holds 127";
  }
  EXPECT_NE(messageOf(R"({"name":"t","markers":[)" + middle + R"(],"triangles":[["A","B","C","D"]]})"), "");
  EXPECT_NE(messageOf(R"({"name":"t","markers":[)" + middle + R"(],"jig":["A"]})").find("found A twice"),
            std::string::npos);
}

TEST(MarkerLayout, RefusesMirrorsThatDisagree) {
  const std::string one_sided = layoutWith(
      R"({"name":"A","region":"lip","side":"L","mirror":"B"},{"name":"B","region":"lip","side":"R","mirror":"B"})");
  EXPECT_NE(messageOf(one_sided).find("found A mirrored by B"), std::string::npos);
  const std::string same_side = layoutWith(
      R"({"name":"A","region":"lip","side":"L","mirror":"B"},{"name":"B","region":"lip","side":"L","mirror":"A"})");
  EXPECT_NE(messageOf(same_side), "");
}

TEST(MarkerLayout, AgreesWithTheRealCapture) {
  const std::string path = MOUTHPIECE_SOURCE_DIR "/../shared/capture/grid_s1/markers.json";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "no real capture at " << path;
  const std::string text = readFile(path);
  for (const LayoutMarker& marker : defaultLayout().markers) {
    EXPECT_NE(text.find("\"" + marker.name + "\""), std::string::npos) << marker.name;
  }
}

}  // namespace
}  // namespace mouthpiece
