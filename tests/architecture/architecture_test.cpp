// The tree's one-way includes (docs/architecture.md) and the promise that libraries neither print nor exit.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;

const fs::path kRoot = MOUTHPIECE_SOURCE_DIR;

/// Which folders a folder may include, besides itself.
const std::map<std::string, std::set<std::string>> kAllowedIncludes = {
    {"base", {}},
    {"motion", {"base"}},
    {"audio", {"base"}},
    {"phonetics", {"base"}},
    {"units", {"base", "motion", "audio", "phonetics"}},
    {"voices", {"base", "audio", "phonetics", "units"}},
    {"vocal", {"base", "motion", "audio", "phonetics"}},
    {"synthesis", {"base", "motion", "audio", "phonetics", "units", "voices", "vocal"}},
    {"deform", {"base", "motion"}},
    {"retarget", {"base", "motion", "deform"}},
    {"exports", {"base", "motion", "audio", "phonetics", "synthesis", "deform"}},
    {"corpus_tools", {"base", "motion", "audio", "phonetics", "units", "voices", "vocal", "synthesis"}},
};

struct SourceFile {
  fs::path path;
  std::string folder;
  bool is_program = false;  ///< *_main.cpp, src/programs, corpus_tools/commands: may print, exit and include everything
};

std::vector<SourceFile> sourceFiles() {
  std::vector<SourceFile> files;
  for (const char* top : {"src", "deform", "retarget", "corpus_tools"}) {
    for (const auto& entry : fs::recursive_directory_iterator(kRoot / top)) {
      const std::string extension = entry.path().extension().string();
      if (extension != ".h" && extension != ".cpp") continue;
      const fs::path relative = fs::relative(entry.path(), kRoot);
      const auto first = relative.begin();
      SourceFile file{entry.path(), (*first == "src" ? *std::next(first) : *first).string(), false};
      const std::string parent = relative.parent_path().filename().string();
      file.is_program =
          parent == "programs" || parent == "commands" || relative.filename().string().ends_with("_main.cpp");
      files.push_back(file);
    }
  }
  return files;
}

std::vector<std::string> linesOf(const fs::path& path) {
  std::ifstream stream(path);
  std::vector<std::string> lines;
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

/// The folder named by `#include "folder/file.h"`, "" for anything else.
std::string includedFolder(const std::string& line) {
  static const std::regex pattern(R"re(^\s*#\s*include\s*"([a-z_]+)/[^"]+")re");
  std::smatch match;
  return std::regex_search(line, match, pattern) ? match[1].str() : "";
}

bool isAllowed(const std::string& from, const std::string& to) {
  const auto row = kAllowedIncludes.find(from);
  return row != kAllowedIncludes.end() && (from == to || row->second.contains(to));
}

TEST(Architecture, IncludesRunOneWay) {
  std::size_t checked = 0;
  for (const SourceFile& file : sourceFiles()) {
    if (file.is_program) continue;
    ASSERT_TRUE(kAllowedIncludes.contains(file.folder)) << file.path << ": folder has no row in the table";
    for (const std::string& line : linesOf(file.path)) {
      const std::string to = includedFolder(line);
      if (to.empty()) continue;
      ++checked;
      EXPECT_TRUE(isAllowed(file.folder, to)) << file.path << " includes " << to << "/: " << line;
    }
  }
  EXPECT_GT(checked, 50U) << "the pattern no longer finds the includes";
}

TEST(Architecture, TheTableHasNoCycle) {
  for (const auto& [from, allowed] : kAllowedIncludes) {
    for (const std::string& to : allowed) {
      ASSERT_TRUE(kAllowedIncludes.contains(to)) << to;
      EXPECT_FALSE(kAllowedIncludes.at(to).contains(from)) << from << " and " << to << " include each other";
    }
  }
}

TEST(Architecture, AnIncludeAgainstTheDirectionIsSeen) {
  EXPECT_EQ(includedFolder(R"(#include "synthesis/pipeline.h")"), "synthesis");
  EXPECT_FALSE(isAllowed("base", "synthesis"));
  EXPECT_FALSE(isAllowed("exports", "retarget"));
  EXPECT_TRUE(isAllowed("retarget", "deform"));
}

const std::regex& printsOrExits() {
  static const std::regex pattern(
      R"(std::cout|std::cerr|std::clog|\bprintf\s*\(|\bfprintf\s*\(|\bputs\s*\(|fmt::print|\b(std::|::)?(exit|abort|quick_exit|terminate)\s*\(\s*[^)]*\)\s*;)");
  return pattern;
}

TEST(Architecture, LibrariesNeitherPrintNorExit) {
  for (const SourceFile& file : sourceFiles()) {
    if (file.is_program) continue;
    std::size_t number = 0;
    for (const std::string& line : linesOf(file.path)) {
      ++number;
      const std::string code = line.substr(0, line.find("//"));
      // A forked child that cannot exec has to leave through _exit; that is no exit of ours.
      if (code.find("_exit(") != std::string::npos) continue;
      EXPECT_FALSE(std::regex_search(code, printsOrExits())) << file.path << ":" << number << ": " << line;
    }
  }
}

TEST(Architecture, ThePrintPatternFindsPrints) {
  EXPECT_TRUE(std::regex_search(std::string("  std::cerr << 1;"), printsOrExits()));
  EXPECT_TRUE(std::regex_search(std::string("  std::exit(1);"), printsOrExits()));
  EXPECT_FALSE(std::regex_search(std::string("  fmt::format(\"x\");"), printsOrExits()));
}

/// Headers that another folder includes: "motion/c3d_file.h".
std::set<std::string> publicHeaders() {
  static const std::regex pattern(R"re(^\s*#\s*include\s*"([a-z_]+)/([^"]+)")re");
  std::set<std::string> headers;
  for (const SourceFile& file : sourceFiles()) {
    for (const std::string& line : linesOf(file.path)) {
      std::smatch match;
      if (std::regex_search(line, match, pattern) && match[1] != file.folder)
        headers.insert(match[1].str() + "/" + match[2].str());
    }
  }
  return headers;
}

TEST(Architecture, HeavyHeadersStayOutOfPublicHeaders) {
  const std::regex heavy(R"(#\s*include\s*[<"](CGAL|CLI/|nlohmann/json\.hpp|OpenMesh|sqlite3|spdlog|tiny_gltf))");
  const std::set<std::string> headers = publicHeaders();
  ASSERT_GT(headers.size(), 20U);
  for (const SourceFile& file : sourceFiles()) {
    if (!headers.contains(file.folder + "/" + file.path.filename().string())) continue;
    for (const std::string& line : linesOf(file.path))
      EXPECT_FALSE(std::regex_search(line, heavy)) << file.path << ": " << line;
  }
}

}  // namespace
