// Each rule on a made-up house: silent while it is whole, and one line for one breach.
#include <gtest/gtest.h>

#include "house.h"

namespace mouthpiece::architecture {
namespace {

using Lines = std::vector<std::string>;

/// Two rooms, a program and a test that keep every rule.
Files soundHouse() {
  return {
      {"CMakeLists.txt", "foreach(wing src/base src/motion src/programs)\nendforeach()"},
      {"src/base/CMakeLists.txt",
       "mouthpiece_library(base\n  PUBLIC_HEADERS text.h # what others see\n"
       "  SOURCES text.cpp\n  LINKS PRIVATE fmt::fmt)\n"},
      {"src/base/text.h", "#pragma once\n#include <string>\n"},
      {"src/base/text.cpp", "#include \"base/text.h\"\n#include <fmt/format.h>\n#include <unistd.h>\n"},
      {"src/motion/CMakeLists.txt",
       "mouthpiece_library(motion PUBLIC_HEADERS clip.h SOURCES clip.cpp\n"
       "  LINKS PUBLIC Eigen3::Eigen PRIVATE mouthpiece::base)\n"},
      {"src/motion/clip.h", "#include <Eigen/Core>\n#include \"motion/inner.h\"\n"},
      {"src/motion/inner.h", "#include <vector>\n"},
      {"src/motion/clip.cpp", "#include \"motion/clip.h\"\n#include \"base/text.h\"\n"},
      {"src/programs/play/CMakeLists.txt",
       "mouthpiece_program(play SOURCES play_main.cpp LINKS CLI11::CLI11 mouthpiece::motion)\n"},
      {"src/programs/play/play_main.cpp",
       "#include <CLI/CLI.hpp>\n#include \"motion/clip.h\"\nint main() { std::puts(\"--speed\"); }\n"},
      {"tests/unit/base/text_test.cpp", "#include \"base/text.h\"\n"},
  };
}

Lines allBreaches(const Files& files) {
  const House house(files);
  Lines all;
  for (const Lines& lines :
       {house.unlistedFiles(), house.headerBreaches(), house.linkBreaches(), house.circles(), house.talkingLibraries(),
        house.heavyHeaders(), house.misplacedMains(), house.typesOfOneName()}) {
    all.insert(all.end(), lines.begin(), lines.end());
  }
  return all;
}

/// `files` breaks one rule, and the line that says so holds `expected`.
void expectOneBreach(const Lines& lines, const std::string& expected) {
  ASSERT_EQ(lines.size(), 1U) << testing::PrintToString(lines);
  EXPECT_NE(lines[0].find(expected), std::string::npos) << lines[0];
}

TEST(Rules, ASoundHouseKeepsAll) { EXPECT_EQ(allBreaches(soundHouse()), Lines{}); }

TEST(Rules, CMakeListsAreRead) {
  Lines breaches;
  const auto targets = parseTargets("a/b/CMakeLists.txt",
                                    "# mouthpiece_library(none SOURCES x.cpp)\nset(x \"a b\")\n"
                                    "mouthpiece_library(a_b\n  PUBLIC_HEADERS one.h two.h\n  SOURCES one.cpp  # two\n"
                                    "  LINKS PUBLIC Eigen3::Eigen PRIVATE fmt::fmt mouthpiece::base)\n"
                                    "if(WIN)\n  target_sources(mouthpiece_a_b PRIVATE ../wide.cpp)\nendif()\n",
                                    breaches);
  ASSERT_EQ(targets.size(), 1U);
  EXPECT_EQ(targets[0].name, "mouthpiece::a_b");
  EXPECT_EQ(targets[0].headers, (std::set<std::string>{"a/b/one.h", "a/b/two.h"}));
  EXPECT_EQ(targets[0].public_links, std::set<std::string>{"Eigen3::Eigen"});
  EXPECT_EQ(targets[0].private_links, (std::set<std::string>{"fmt::fmt", "mouthpiece::base"}));
  EXPECT_TRUE(targets[0].sources.contains("a/b/one.cpp"));
  EXPECT_TRUE(targets[0].sources.contains("a/wide.cpp"));
  EXPECT_TRUE(breaches.empty());
}

TEST(Rules, ASourceThatNobodyLists) {
  Files files = soundHouse();
  files["src/motion/lost.cpp"] = "";
  expectOneBreach(House(files).unlistedFiles(), "lost.cpp");
}

TEST(Rules, AFolderMayListAllItsSources) {
  Files files = soundHouse();
  files["src/base/CMakeLists.txt"] =
      "file(GLOB all CONFIGURE_DEPENDS *.cpp)\n"
      "mouthpiece_library(base PUBLIC_HEADERS text.h SOURCES ${all} LINKS PRIVATE fmt::fmt)";
  files["src/base/more.cpp"] = "#include \"base/text.h\"\n";
  EXPECT_EQ(allBreaches(files), Lines{});
}

TEST(Rules, AListedSourceThatIsNotThere) {
  Files files = soundHouse();
  files.erase("src/base/text.cpp");
  expectOneBreach(House(files).unlistedFiles(), "src/base/text.cpp, which is not there");
}

TEST(Rules, LinksBesideTheList) {
  Files files = soundHouse();
  files["src/motion/CMakeLists.txt"] += "target_link_libraries(mouthpiece_motion PRIVATE m)\n";
  expectOneBreach(House(files).unlistedFiles(), "target_link_libraries");
  files = soundHouse();
  files["src/base/CMakeLists.txt"] = "mouthpiece_library(base PUBLIC_HEADERS text.h SOURCES text.cpp LINKS fmt::fmt)";
  expectOneBreach(House(files).unlistedFiles(), "neither PUBLIC nor PRIVATE");
}

TEST(Rules, WhatIsCompiledApartIsASource) {
  Files files = soundHouse();
  files["src/base/CMakeLists.txt"] =
      "mouthpiece_library(base PUBLIC_HEADERS text.h SOURCES text.cpp APART other.cpp LINKS PRIVATE fmt::fmt)";
  expectOneBreach(House(files).unlistedFiles(), "other.cpp is compiled apart");
}

TEST(Rules, APrivateHeaderOfAnotherRoom) {
  Files files = soundHouse();
  files["src/programs/play/play_main.cpp"] += "#include \"motion/inner.h\"\n";
  expectOneBreach(House(files).headerBreaches(), "motion/inner.h, which is not among mouthpiece::motion's");
  files = soundHouse();
  files["src/programs/play/play_main.cpp"] += "#include \"../../motion/inner.h\"\n";
  expectOneBreach(House(files).headerBreaches(), "motion/inner.h");
}

TEST(Rules, APublicHeaderThatNobodyElseIncludes) {
  Files files = soundHouse();
  files["src/motion/CMakeLists.txt"] =
      "mouthpiece_library(motion PUBLIC_HEADERS clip.h inner.h SOURCES clip.cpp\n"
      "  LINKS PUBLIC Eigen3::Eigen PRIVATE mouthpiece::base)\n";
  expectOneBreach(House(files).headerBreaches(), "src/motion/inner.h is public");
  files["tests/unit/motion/inner_test.cpp"] = "#include \"motion/inner.h\"\n";
  EXPECT_EQ(House(files).headerBreaches(), Lines{});
}

TEST(Rules, TheFrontDoorIsOpenToAllAndShowsNothing) {
  Files files = soundHouse();
  files["include/mouthpiece/errors.h"] = "#include <string>\n";
  files["include/mouthpiece/speaker.h"] = "#include \"mouthpiece/errors.h\"\n";
  files["src/base/text.h"] += "#include \"mouthpiece/errors.h\"\n";
  EXPECT_EQ(allBreaches(files), Lines{});
  files["src/programs/play/play_main.cpp"] += "#include \"mouthpiece/speaker.h\"\n";
  expectOneBreach(House(files).linkBreaches(), "play: LINKS lack mouthpiece::speaker");
  files = soundHouse();
  files["include/mouthpiece/text.h"] = "#include \"base/text.h\"\n";
  expectOneBreach(House(files).headerBreaches(), "include/mouthpiece/text.h: shows src/base/text.h of the inside");
}

TEST(Rules, ALinkTooFewOrTooMany) {
  Files files = soundHouse();
  files["src/motion/clip.cpp"] += "#include <fmt/ranges.h>\n";
  expectOneBreach(House(files).linkBreaches(), "lack PRIVATE fmt::fmt");
  files = soundHouse();
  files["src/motion/clip.cpp"] = "#include \"motion/clip.h\"\n";
  expectOneBreach(House(files).linkBreaches(), "name PRIVATE mouthpiece::base");
  files = soundHouse();
  files["src/programs/play/play_main.cpp"] = "#include \"motion/clip.h\"\nint main() {}\n";
  expectOneBreach(House(files).linkBreaches(), "play: LINKS name CLI11::CLI11");
}

TEST(Rules, ALinkOnTheWrongSide) {
  Files files = soundHouse();
  files["src/motion/inner.h"] += "#include \"base/text.h\"\n";
  const Lines lines = House(files).linkBreaches();
  ASSERT_EQ(lines.size(), 2U) << testing::PrintToString(lines);
  EXPECT_NE(lines[0].find("lack PUBLIC mouthpiece::base"), std::string::npos) << lines[0];
  EXPECT_NE(lines[1].find("name PRIVATE mouthpiece::base"), std::string::npos) << lines[1];
}

TEST(Rules, AnUnknownLibrary) {
  Files files = soundHouse();
  files["src/motion/clip.cpp"] += "#include <newlib/things.h>\n";
  expectOneBreach(House(files).linkBreaches(), "<newlib/things.h> has no row");
}

TEST(Rules, ACircle) {
  Files files = soundHouse();
  files["src/base/text.cpp"] += "#include \"motion/clip.h\"\n";
  const Lines lines = House(files).circles();
  ASSERT_EQ(lines.size(), 2U) << testing::PrintToString(lines);
  EXPECT_EQ(lines[0], "mouthpiece::base -> mouthpiece::motion -> mouthpiece::base");
  EXPECT_NE(lines[1].find("of a later wing"), std::string::npos);
}

TEST(Rules, ALongCircleWithinOneWing) {
  Files files;
  const std::vector<std::string> rooms{"a", "b", "c"};
  for (std::size_t i = 0; i < rooms.size(); ++i) {
    const std::string folder = "corpus_tools/" + rooms[i], next = rooms[(i + 1) % rooms.size()];
    files[folder + "/CMakeLists.txt"] = "mouthpiece_library(" + rooms[i] +
                                        " PUBLIC_HEADERS x.h SOURCES x.cpp\n"
                                        "  LINKS PRIVATE mouthpiece::" +
                                        next + ")";
    files[folder + "/x.h"] = "";
    files[folder + "/x.cpp"] = "#include \"corpus_tools/" + next + "/x.h\"\n";
  }
  expectOneBreach(allBreaches(files), "mouthpiece::a -> mouthpiece::b -> mouthpiece::c -> mouthpiece::a");
}

TEST(Rules, ALibraryThatTalks) {
  for (const std::string talk :
       {"std::cerr << 1;", "std::exit(1);", "  exit(2);", "std::printf(\"x\");", "fmt::print(\"x\");", "perror(name);",
        "std::terminate();", "#include <CLI/CLI.hpp>"}) {
    Files files = soundHouse();
    files["src/motion/clip.cpp"] += talk + "\n";
    expectOneBreach(House(files).talkingLibraries(), "clip.cpp: prints");
  }
  for (const std::string quiet : {"// std::exit(1);", "/* puts(x); */", "::_exit(127);", "fmt::format(\"x\");",
                                  "bool exits(int);", "const char* text = \"std::cerr\";"}) {
    Files files = soundHouse();
    files["src/motion/clip.cpp"] += quiet + "\n";
    EXPECT_EQ(House(files).talkingLibraries(), Lines{}) << quiet;
  }
}

TEST(Rules, ALibraryThatKnowsAnOption) {
  for (const std::string option : {"fail(\"--folds\");", "fail(\"found 3 (--fps)\");",
                                   "fail(\"say \\\"x\\\", or --hold-out\");", "auto text = R\"(use --hold-out)\";"}) {
    Files files = soundHouse();
    files["src/motion/clip.cpp"] += "\n" + option + "\n";
    expectOneBreach(House(files).talkingLibraries(), "clip.cpp:4: names an option");
  }
  for (const std::string other : {"runChild(program,\n {\"--heap\", \"100\"});", "// --folds", "auto css = \"a -- b\";",
                                  "auto rule = \"<!-- mark -->\";", "--count;", "int big = 1'000; char c = '\"';"}) {
    Files files = soundHouse();
    files["src/motion/clip.cpp"] += other + "\n";
    EXPECT_EQ(House(files).talkingLibraries(), Lines{}) << other;
  }
}

TEST(Rules, AHeavyHeaderTakenAlong) {
  for (const std::string heavy : {"CGAL/AABB_tree.h", "CLI/CLI.hpp", "nlohmann/json.hpp",
                                  "OpenMesh/Core/IO/IOManager.hh", "sqlite3.h", "tiny_gltf.h", "spdlog/spdlog.h"}) {
    Files files = soundHouse();
    files["src/motion/inner.h"] += "#include <" + heavy + ">\n";
    expectOneBreach(House(files).heavyHeaders(), "through src/motion/inner.h");
  }
  Files files = soundHouse();
  files["src/motion/clip.h"] += "#include <nlohmann/json_fwd.hpp>\n";
  EXPECT_EQ(House(files).heavyHeaders(), Lines{});
}

TEST(Rules, AMainOutOfPlace) {
  Files files = soundHouse();
  files["src/motion/clip.cpp"] += "int main() {}\n";
  expectOneBreach(House(files).misplacedMains(), "clip.cpp: holds a main");
  files = soundHouse();
  files["src/programs/play/play_main.cpp"] = "int play();\n";
  expectOneBreach(House(files).misplacedMains(), "holds no main");
  files = soundHouse();
  files["src/programs/play/list.cpp"] = "\nint main(int argc, char** argv) {}\n";
  expectOneBreach(House(files).misplacedMains(), "list.cpp: holds a main");
}

TEST(Rules, TwoTypesOfOneName) {
  const std::string type = "struct Stretch {\n  int first;\n};\n", end = "}  // namespace mouthpiece\n";
  Files files = soundHouse();
  files["src/motion/clip.h"] += "namespace mouthpiece {\n" + type + end;
  files["src/motion/clip.cpp"] += "namespace mouthpiece {\nnamespace {\n" + type + "}  // namespace\n" + end;
  files["src/base/text.cpp"] += "namespace mouthpiece::text {\n" + type + end;
  EXPECT_EQ(House(files).typesOfOneName(), Lines{});
  files["src/base/text.h"] += "namespace mouthpiece {\n" + type + end;
  expectOneBreach(House(files).typesOfOneName(), "defines mouthpiece::Stretch, as src/base/text.h does");
}

}  // namespace
}  // namespace mouthpiece::architecture
