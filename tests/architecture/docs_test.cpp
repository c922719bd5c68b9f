// The docs name what there is: links lead somewhere, the ways of docs/architecture.md name functions that exist, every
// public header has its page.
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;
const fs::path kRoot = MOUTHPIECE_SOURCE_DIR;

std::string textOf(const fs::path& path) {
  std::ifstream stream(path);
  return {std::istreambuf_iterator<char>(stream), {}};
}

std::vector<fs::path> pages() {
  std::vector<fs::path> found;
  for (const auto& entry : fs::directory_iterator(kRoot)) {
    if (entry.path().extension() == ".md") found.push_back(entry.path());
  }
  for (const auto& entry : fs::recursive_directory_iterator(kRoot / "docs")) {
    if (entry.path().extension() == ".md") found.push_back(entry.path());
  }
  return found;
}

/// What a page's headings are called in links, as GitHub makes them: letters and digits in lower case, blanks as
/// hyphens.
std::set<std::string> anchorsOf(const std::string& text) {
  std::set<std::string> anchors;
  std::istringstream lines(text);
  bool is_code = false;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("```")) is_code = !is_code;
    if (is_code || !line.starts_with('#')) continue;
    std::string anchor;
    for (const char c : line.substr(std::min(line.find_first_not_of("# "), line.size()))) {
      if (c == ' ') anchor += '-';
      if (std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' || c == '_' || (c & 0x80) != 0)
        anchor += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
    anchors.insert(anchor);
  }
  return anchors;
}

/// Links to a heading: the page ("" for the same one) and the heading's name.
std::vector<std::pair<std::string, std::string>> anchorLinksOf(const std::string& text) {
  static const std::regex pattern(R"(\]\(([^)#\s]*)#([^)\s]+)\))");
  std::vector<std::pair<std::string, std::string>> links;
  for (std::sregex_iterator link(text.begin(), text.end(), pattern), end; link != end; ++link) {
    if (!(*link)[1].str().starts_with("http")) links.emplace_back((*link)[1], (*link)[2]);
  }
  return links;
}

/// The targets of a page's links to other files of the tree.
std::vector<std::string> linksOf(const std::string& text) {
  static const std::regex pattern(R"(\]\(([^)#\s]+)(#[^)]*)?\))");
  std::vector<std::string> links;
  for (std::sregex_iterator link(text.begin(), text.end(), pattern), end; link != end; ++link) {
    if (!(*link)[1].str().starts_with("http")) links.push_back((*link)[1]);
  }
  return links;
}

/// A step of a way: "`perform()` (`src/speaker/speaker.cpp`)".
struct Step {
  std::string function, file;
};
std::vector<Step> stepsOf(const std::string& text) {
  static const std::regex pattern(R"(`([A-Za-z:]+)\(\)` \(`([^`]+)`\))");
  std::vector<Step> steps;
  for (std::sregex_iterator step(text.begin(), text.end(), pattern), end; step != end; ++step)
    steps.push_back({(*step)[1], (*step)[2]});
  return steps;
}

TEST(Docs, LinksLeadSomewhere) {
  std::size_t checked = 0;
  for (const fs::path& page : pages()) {
    for (const std::string& link : linksOf(textOf(page))) {
      ++checked;
      EXPECT_TRUE(fs::exists(page.parent_path() / link)) << page << " links to " << link;
    }
  }
  EXPECT_GT(checked, 80U) << "the pattern no longer finds the links";
}

TEST(Docs, LinksToHeadingsFindThem) {
  for (const fs::path& page : pages()) {
    for (const auto& [file, heading] : anchorLinksOf(textOf(page))) {
      const fs::path target = file.empty() ? page : page.parent_path() / file;
      if (target.extension() != ".md") continue;
      EXPECT_TRUE(anchorsOf(textOf(target)).contains(heading)) << page << " links to " << file << "#" << heading;
    }
  }
  EXPECT_TRUE(anchorsOf("# A\n\n## How it is drawn, and why\n").contains("how-it-is-drawn-and-why"));
  EXPECT_EQ(anchorLinksOf("see [this](a/b.md#c) and [that](#d), not [those](https://x.org/#e)"),
            (std::vector<std::pair<std::string, std::string>>{{"a/b.md", "c"}, {"", "d"}}));
}

TEST(Docs, TheWaysNameFunctionsThatExist) {
  const std::vector<Step> steps = stepsOf(textOf(kRoot / "docs" / "architecture.md"));
  EXPECT_GT(steps.size(), 25U) << "the pattern no longer finds the steps";
  for (const Step& step : steps) {
    const std::string code = textOf(kRoot / step.file);
    const std::string name = step.function.substr(step.function.rfind(':') + 1);
    EXPECT_TRUE(std::regex_search(code, std::regex("\\b" + name + "\\("))) << step.file << " has no " << step.function;
  }
}

TEST(Docs, EveryPublicHeaderHasAPageWithAnExample) {
  std::size_t checked = 0;
  for (const auto& header : fs::directory_iterator(kRoot / "include" / "mouthpiece")) {
    const fs::path page = kRoot / "docs" / "mouthpiece" / (header.path().stem().string() + ".md");
    const std::string text = textOf(page);
    EXPECT_NE(text.find("`mouthpiece/" + header.path().filename().string() + "`"), std::string::npos) << page;
    EXPECT_TRUE(text.find("```c") != std::string::npos) << page << " shows no example";
    ++checked;
  }
  EXPECT_GE(checked, 12U);
}

TEST(Docs, ABrokenLinkAndAMissingStepAreSeen) {
  EXPECT_EQ(linksOf("see [this](a/b.md#c), [that](https://x.org/y.md) and ![it](p.png)"),
            (std::vector<std::string>{"a/b.md", "p.png"}));
  const auto steps = stepsOf("1. `RbfWarp::fit()` (`retarget/warp/rbf_warp.cpp`): so.");
  ASSERT_EQ(steps.size(), 1U);
  EXPECT_EQ(steps[0].function, "RbfWarp::fit");
}

}  // namespace
