// A run that a signal ends leaves nothing behind: no child, no folder, no temporary file.
#include <gtest/gtest.h>

#include "support/run_program.h"

namespace mouthpiece::test {
namespace {

namespace fs = std::filesystem;

/// Runs synth beside a Festival that hangs with a child of its own, sends it the signal once both run, and prints its
/// exit code. A shell has what runs in its background ignore what keys send, and what is ignored stays so.
constexpr std::string_view kScript = R"sh(
cd "$1"
mkdir tmp out bin
printf '#!/bin/sh\nsleep 300 & echo $! > "%s/grandchild"\necho $$ > "%s/child"\nsleep 300\n' "$1" "$1" > bin/festival
chmod +x bin/festival
export TMPDIR="$1/tmp" PATH="$1/bin:$PATH"
env --default-signal=INT,QUIT "$2" --text 'one two' --voice festival:kal_diphone --out out &
for i in $(seq 200); do test -s child && break; sleep 0.05; done
kill -"$3" $!
wait $!
echo "exit $?"
# Both have been killed by now; on a busy machine it may take them a while to be gone.
runs() { case "$(cat /proc/$1/stat 2>/dev/null)" in ''|*') Z'*) return 1 ;; esac; }
for p in $(cat child grandchild); do
  for i in $(seq 100); do runs $p || break; sleep 0.05; done
  ! runs $p || echo "process $p still runs"
done
find tmp out -mindepth 1
)sh";

class Interrupted : public ::testing::TestWithParam<std::pair<const char*, int>> {};

TEST_P(Interrupted, LeavesNothingBehind) {
  const ScratchFolder scratch;
  const fs::path script = scratch.write("run.sh", std::string(kScript));
  const fs::path folder = scratch.path() / "here";
  fs::create_directories(folder);
  const ProgramResult result =
      runProgram("/bin/sh", {script, folder, fs::path(MOUTHPIECE_BIN_DIR) / "synth", GetParam().first});
  EXPECT_EQ(result.out, "exit " + std::to_string(GetParam().second) + "\n") << result.err;
}

INSTANTIATE_TEST_SUITE_P(BySignal, Interrupted,
                         testing::Values(std::pair("INT", 130), std::pair("TERM", 143), std::pair("HUP", 129),
                                         std::pair("QUIT", 131)));

/// The system ends a program that writes beyond its limit, unless that asks to be told.
TEST(FileSizeLimit, IsAWriteErrorLikeAnother) {
  const ScratchFolder scratch;
  std::string text = "time_s,A.x,A.y,A.z,B.x,B.y,B.z,C.x,C.y,C.z";
  for (int f = 0; f < 2000; ++f) text += "\n" + std::to_string(0.01 * f) + ",1,2,3,4,5,6,7,8,9";
  const fs::path motion = scratch.write("motion.csv", text + "\n"), out = scratch.path() / "out";
  fs::create_directories(out);
  const fs::path script = scratch.write("run.sh", "ulimit -f 8\n\"$1\" convert \"$2\" \"$3\"\necho \"exit $?\"\n");
  const ProgramResult result =
      runProgram("/bin/sh", {script, fs::path(MOUTHPIECE_BIN_DIR) / "corpus", motion, out / "motion.c3d"});
  EXPECT_EQ(result.out, "exit 1\n") << result.err;
  EXPECT_EQ(result.err, "corpus: " + (out / "motion.c3d").string() + ": cannot be written: File too large\n");
  EXPECT_TRUE(fs::is_empty(out));
}

}  // namespace
}  // namespace mouthpiece::test
