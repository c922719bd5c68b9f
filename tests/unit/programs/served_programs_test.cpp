// What `synth serve` and `corpus studio` cannot serve with is told before they listen.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <filesystem>

#include "local_server/local_server.h"
#include "support/run_program.h"

namespace mouthpiece::test {
namespace {

namespace fs = std::filesystem;
constexpr std::chrono::seconds kLongest{60};  // a server that listens does not end

class ServedPrograms : public testing::Test {
 protected:
  void SetUp() override {
    for (const char* file : {"clock.corpus", "default.face", "serve.html", "studio.html"}) {
      if (!fs::exists(fs::path(MOUTHPIECE_BUILD_SHARE_DIR) / file)) GTEST_SKIP() << "no " << file;
    }
  }
  void expectRefused(const std::string& program, const std::vector<std::string>& arguments,
                     const std::string& expected) {
    const ProgramResult result = runProgram(program, arguments, folder_.path(), kLongest);
    EXPECT_EQ(result.exit_code, 1) << testing::PrintToString(arguments);
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_NE(result.err.find(expected), std::string::npos) << result.err;
    EXPECT_EQ(result.out, "");
  }
  ScratchFolder folder_;
};

TEST_F(ServedPrograms, RefuseWhatNoLineCouldBeMadeWith) {
  static_cast<void>(folder_.write("no.face", "no face\n"));
  static_cast<void>(folder_.write("no.corpus", "no corpus\n"));
  const LocalServer other;
  const std::string address = other.address();
  const std::string port = address.substr(address.find(':', 5) + 1, address.find('/', 8) - address.find(':', 5) - 1);
  const auto serve = [&](std::vector<std::string> more, const std::string& expected) {
    more.insert(more.begin(), "serve");
    if (more[1] != "--corpus") more.insert(more.end(), {"--corpus", "clock"});
    expectRefused("synth", more, expected);
  };
  serve({"--corpus", "missing.corpus"}, "missing.corpus");
  serve({"--corpus", "no.corpus"}, "no.corpus");
  serve({"--face", "missing.face"}, "missing.face");
  serve({"--face", "no.face"}, "no.face");
  serve({"--voice", "nobody"}, "found voice 'nobody'");
  serve({"--language", "xx"}, "found language 'xx'");
  serve({"--lexicon", "missing.txt"}, "missing.txt");
  serve({"--mood", "hungry"}, "hungry");
  serve({"--port", port}, "127.0.0.1:" + port + " cannot be listened at");
  serve({"--out", "no.face"}, "is no folder");
  serve({"--out", "/proc/lines"}, "cannot be written");
  expectRefused("corpus", {"studio", "me", "--face", "no.face"}, "no.face");
  expectRefused("corpus", {"studio", "me", "--face", "missing.face"}, "missing.face");
  EXPECT_FALSE(fs::exists(folder_.path() / "me")) << "nothing is made for what cannot be";
  expectRefused("corpus", {"studio", "me", "--port", port}, "127.0.0.1:" + port + " cannot be listened at");
  expectRefused("corpus", {"studio", "no.face"}, "no.face");
}

}  // namespace
}  // namespace mouthpiece::test
