// The user's language changes no byte: neither of what programs write nor of what the library makes in a program that
// has set a locale of its own.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <clocale>
#include <locale>

#include "mouthpiece/speaker.h"
#include "support/run_program.h"

namespace mouthpiece::test {
namespace {

namespace fs = std::filesystem;

/// Turkish has other capitals of i, German another decimal sign; C has no UTF-8.
const std::vector<std::string> kLocales = {"tr_TR.UTF-8", "de_DE.UTF-8", "C.UTF-8", "C"};

class Locales : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists("/usr/share/i18n/locales/tr_TR")) GTEST_SKIP() << "no locales to make (Debian package locales)";
    for (const std::string& name : {kLocales[0], kLocales[1]}) {
      const ProgramResult made = runProgram("/usr/bin/localedef", {"--no-archive", "-i", name.substr(0, 5), "-f",
                                                                   "UTF-8", (folder_.path() / name).string()});
      ASSERT_EQ(made.exit_code, 0) << made.err;
    }
    ::setenv("LOCPATH", folder_.path().c_str(), 1);
  }
  void TearDown() override {
    for (const char* name : {"LOCPATH", "LC_ALL"}) ::unsetenv(name);
    std::locale::global(std::locale::classic());
    std::setlocale(LC_ALL, "C");
  }
  ScratchFolder folder_;
};

std::string spokenBytes(const fs::path& folder) {
  SpeakerOptions options;
  options.with_face = false;
  Speaker speaker(options);
  const Performance performance = speaker.perform("It is 1.5 INCHES, isn't it?");
  std::string bytes;
  for (const char* name : {"a.TextGrid", "a.csv", "a.curves.json", "a.c3d"}) {
    save(performance, folder / name);
    bytes += readAll(folder / name);
  }
  return bytes;
}

TEST_F(Locales, TheLibraryHeedsNoneOfItsProgram) {
  const std::string expected = spokenBytes(folder_.path());
  for (const std::string& name : kLocales) {
    ASSERT_NE(std::setlocale(LC_ALL, name.c_str()), nullptr) << name;
    std::locale::global(std::locale(name));
    EXPECT_TRUE(spokenBytes(folder_.path()) == expected) << name;
  }
}

TEST_F(Locales, ProgramsHeedNone) {
  std::string expected;
  for (const std::string& name : kLocales) {
    ::setenv("LC_ALL", name.c_str(), 1);
    const fs::path curves = folder_.path() / "a.csv", labels = folder_.path() / "a.TextGrid";
    const ProgramResult spoken = runProgram(
        "synth", {"--text", "It is 1.5 INCHES, isn't it?", "-o", curves.string(), "-o", labels.string(), "--json"});
    ASSERT_EQ(spoken.exit_code, 0) << spoken.err;
    const ProgramResult refused = runProgram("synth", {"--text", "a", "--voice", "ışık"});
    const ProgramResult facts =
        runProgram("corpus", {"info", (fs::path(MOUTHPIECE_BUILD_SHARE_DIR) / "sample.corpus").string()});
    const std::string told =
        fmt::format("{}{}{}{}{}", readAll(curves), readAll(labels), refused.exit_code, refused.err, facts.out);
    if (expected.empty()) expected = told;
    EXPECT_EQ(told, expected) << name;
  }
}

}  // namespace
}  // namespace mouthpiece::test
