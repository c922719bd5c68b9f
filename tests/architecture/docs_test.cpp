// The docs name what there is: links lead somewhere, the ways of docs/architecture.md name functions that exist, every
// public header has its page.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
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
