// The command lines of the three programs, tried on the programs themselves: help, wrong usage (2), bad input (1, one
// line that names the file).
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <sstream>
#include <tuple>

#include "support/run_program.h"

namespace mouthpiece::test {
namespace {

namespace fs = std::filesystem;
using Arguments = std::vector<std::string>;

struct Call {
  std::string program;
  Arguments arguments;
};

std::string shown(const Call& call) {
  std::string text = call.program;
  for (const std::string& argument : call.arguments) text += " '" + argument + "'";
  return text;
}

/// The subcommands that `program --help` lists.
Arguments subcommandsOf(const std::string& program) {
  std::istringstream help(runProgram(program, {"--help"}).out);
  Arguments names;
  bool is_list = false;
  for (std::string line; std::getline(help, line);) {
    if (is_list && line.starts_with("  ") && line[2] != ' ') names.push_back(line.substr(2, line.find(' ', 2) - 2));
    if (line.starts_with("Subcommands")) is_list = true;
    if (is_list && line.empty()) break;
  }
  return names;
}

std::vector<Call> allCommands() {
  std::vector<Call> calls{{"synth", {}}};
  for (const char* program : {"synth", "corpus", "retarget"}) {
    for (const std::string& name : subcommandsOf(program)) calls.push_back({program, {name}});
  }
  return calls;
}

ProgramResult runWith(const Call& call, const Arguments& more) {
  Arguments arguments = call.arguments;
  arguments.insert(arguments.end(), more.begin(), more.end());
  return runProgram(call.program, arguments);
}

void expectWrongUsage(const Call& call) {
  const ProgramResult result = runProgram(call.program, call.arguments);
  EXPECT_EQ(result.exit_code, 2) << shown(call) << "\n" << result.err;
  EXPECT_TRUE(result.out.empty()) << shown(call) << " printed " << result.out;
  EXPECT_TRUE(result.err.starts_with(call.program + ": ")) << shown(call) << "\n" << result.err;
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << shown(call) << "\n" << result.err;
}

void expectBadInput(const Call& call, const std::string& place) {
  const ProgramResult result = runProgram(call.program, call.arguments);
  EXPECT_EQ(result.exit_code, 1) << shown(call) << "\n" << result.err;
  EXPECT_TRUE(result.out.empty()) << shown(call) << " printed " << result.out;
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << shown(call) << "\n" << result.err;
  EXPECT_TRUE(result.err.starts_with(call.program + ": ")) << result.err;
  EXPECT_NE(result.err.find(place), std::string::npos) << shown(call) << "\n" << result.err;
  EXPECT_EQ(result.err.find("internal error"), std::string::npos) << result.err;
}

TEST(Usage, TheSubcommandsAreListed) {
  const auto has = [](const Arguments& names, const char* name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  EXPECT_TRUE(has(subcommandsOf("synth"), "batch"));
  for (const char* name : {"sample", "build", "info", "check", "report", "clean", "convert", "align", "tag", "evaluate",
                           "prompts", "tune"}) {
    EXPECT_TRUE(has(subcommandsOf("corpus"), name)) << name;
  }
  for (const char* name : {"fit", "pick", "anchors", "apply", "check", "sample", "shapes"})
    EXPECT_TRUE(has(subcommandsOf("retarget"), name)) << name;
}

TEST(Usage, EveryCommandHelps) {
  for (const Call& call : allCommands()) {
    const ProgramResult result = runWith(call, {"--help"});
    EXPECT_EQ(result.exit_code, 0) << shown(call);
    EXPECT_TRUE(result.err.empty()) << shown(call) << result.err;
    EXPECT_NE(result.out.find("--quiet"), std::string::npos) << shown(call);
    const std::size_t example = result.out.find("Example");
    ASSERT_NE(example, std::string::npos) << shown(call);
    EXPECT_NE(result.out.find(call.program, example), std::string::npos) << shown(call) << ": whose example is it?";
  }
}

TEST(Usage, EveryCommandRefusesWhatItDoesNotKnow) {
  for (const Call& call : allCommands()) {
    for (const char* wrong : {"--no-such-option", "--quiet=maybe"}) {
      Call tried = call;
      tried.arguments.push_back(wrong);
      expectWrongUsage(tried);
    }
  }
}

TEST(Usage, EveryCommandSaysWhatItLacks) {
  for (const Call& call : allCommands()) {
    // `prompts` has a grammar of its own, `serve` needs nothing, and `stream` standard input alone.
    if (call.arguments != Arguments{"prompts"} && call.arguments != Arguments{"serve"} &&
        call.arguments != Arguments{"stream"})
      expectWrongUsage(call);
  }
  for (const char* program : {"corpus", "retarget"}) {
    expectWrongUsage({program, {}});
    expectWrongUsage({program, {"no-such-command"}});
  }
}

TEST(Usage, OptionsThatExcludeOrNeedEachOther) {
  const std::vector<Call> calls{
      {"synth", {"--text", "a", "--text-file", "b"}},
      {"synth", {"--text", "a", "--audio", "b.wav", "--transcript", "a"}},
      {"synth", {"--text-file", "a", "--audio", "b.wav", "--transcript", "a"}},
      {"synth", {"--song", "a.json", "--text", "b"}},
      {"synth", {"--song", "a.json", "--audio", "b.wav", "--transcript", "a"}},
      {"synth", {"--song", "a.json", "--audio", "b.wav", "--lyrics-text", "a"}},
      {"synth", {"--song", "a.json", "--song-offset", "1"}},
      {"synth", {"--audio", "b.wav", "--song-offset", "1"}},
      {"synth", {"--hint", "a"}},
      {"synth", {"--stream", "--labels", "phones", "--text-file", "a"}},
      {"synth", {"--stream", "--labels", "phones", "--stamped"}},
      {"synth", {"--stream", "--sound", "a.wav"}},
      {"synth", {"--times", "a.json"}},
      {"synth", {"--audio", "a.wav", "--times", "b.json", "--phones", "c.lab"}},
      {"synth", {"--audio", "a.wav", "--hear", "letters"}},
      {"synth", {"--audio", "a.wav", "--phones", "b.lab", "--transcript", "c"}},
      {"synth", {"--audio", "a.wav", "--lyrics", "b.txt", "--transcript", "c"}},
      {"synth", {"--text", "a", "--phones", "b.lab"}},
      {"synth", {"--transcript", "a"}},
      {"synth", {"--lyrics", "a.txt"}},
      {"synth", {"--text", "a", "--out", "b", "-o", "c.csv"}},
      {"corpus", {"align", "a.wav", "--out", "a.TextGrid"}},
      {"corpus", {"align", "a.wav", "--transcript", "a", "--transcript-file", "b", "--out", "a.TextGrid"}},
      {"corpus", {"align", "a.wav", "--transcript", "a"}},
      {"corpus", {"build", "takes"}},
      {"corpus", {"convert", "a.c3d"}},
      {"corpus", {"convert", "a.csv", "b.c3d", "--anchors", "c.json"}},
      {"corpus", {"evaluate", "a.corpus"}},
      {"corpus", {"evaluate", "a.corpus", "--takes", "b", "--hold-out", "0.1"}},
      {"corpus", {"evaluate", "a.corpus", "--folds", "3", "--learning-curve", "10"}},
      {"corpus", {"evaluate", "a.corpus", "--takes", "b", "--truth", "c"}},
      {"corpus", {"prompts", "--grammar", "a", "--text", "b"}},
      {"corpus", {"report", "a.corpus"}},
      {"corpus", {"tag", "a.wav", "--phones", "a.lab", "--lyrics", "a.txt", "--out", "b.json"}},
      {"retarget", {"fit", "--mesh", "a.obj", "--anchors", "b.json", "--corpus", "c.corpus"}},
      {"retarget", {"apply", "--face", "a.face", "--motion", "b.c3d"}},
      {"retarget", {"sample", "--out", "a"}},
  };
  for (const Call& call : calls) expectWrongUsage(call);
}

TEST(Usage, ValuesThatNoOptionTakes) {
  const Arguments fit{"fit", "--mesh", "a.obj", "--anchors", "b.json", "--corpus", "c.corpus", "--out", "d.face"};
  const auto fitWith = [&](const std::string& option, const std::string& value) {
    Arguments arguments = fit;
    arguments.insert(arguments.end(), {option, value});
    return Call{"retarget", arguments};
  };
  const std::vector<Call> calls{
      {"synth", {"--text", "a", "--fps", "many"}},
      {"synth", {"--text", "a", "--select", "best"}},
      {"synth", {"--text", "a", "--units", "all"}},
      {"synth", {"--text", "a", "--blend", "square"}},
      {"synth", {"--text", "a", "--backoff", "maybe"}},
      {"synth", {"--text", "a", "--style", "rap"}},
      {"synth", {"--text", "a", "--overlap-ms", "x"}},
      {"synth", {"--text", "a", "--rate", "9"}},
      {"corpus", {"prompts", "--count", "0"}},
      {"corpus", {"prompts", "--count", "ten"}},
      {"corpus", {"build", "takes", "--out", "a.corpus", "--jobs", "0"}},
      {"corpus", {"evaluate", "a.corpus", "--folds", "1"}},
      {"corpus", {"convert", "a.json", "b.csv", "--fps", "0"}},
      {"corpus", {"convert", "a.json", "b.csv", "--eye-corners-mm", "-5"}},
      fitWith("--kernel", "gaussian"),
      fitWith("--shape", "-1"),
      fitWith("--smooth", "1e9"),
      fitWith("--max-angle", "181"),
      {"synth", {"--text", "a", "--seed", "-1"}},
      {"synth", {"--text", "a", "--text", "b"}},
      {"synth", {"--text", "a", "--mood"}},
      {"synth", {"--text", "a", "--seed", std::string(120'000, 'x')}},
      {"synth", {"--text", "a", "--rate", std::string(120'000, 'x')}},
      {"synth", {"--text", "a", "--rate", " not in range  to "}},
      {"synth", {"--text", "a", "--method", std::string(120'000, 'x')}},
      fitWith("--kernel", std::string(120'000, 'x')),
  };
  for (const Call& call : calls) {
    expectWrongUsage(call);
    const std::string told = runProgram(call.program, call.arguments).err;
    EXPECT_NE(told.find(": found "), std::string::npos) << told;
    EXPECT_NE(told.find("; expected "), std::string::npos) << told;
  }
}

/// `--transcript "$WORDS"` of a script whose variable is not set once recognised the recording in silence.
TEST(Usage, AnEmptyValueIsNotAnOptionLeftOut) {
  const std::vector<std::pair<std::string, std::vector<std::string>>> commands{
      {"--transcript", {"synth", "--audio", "a.wav", "--transcript", ""}},
      {"--hint", {"synth", "--audio", "a.wav", "--hint", ""}},
      {"--face", {"synth", "--text", "a", "--face", ""}},
      {"--out", {"synth", "--text", "a", "--out", ""}},
      {"-o", {"synth", "--text", "a", "-o", "a.wav", "-o", ""}},
      {"--cast", {"synth", "batch", "lines.csv", "--cast", ""}},
      {"--corpus", {"retarget", "fit", "--mesh", "a.obj", "--out", "a.face", "--corpus", ""}}};
  for (const auto& [option, words] : commands)
    expectBadInput({words[0], {words.begin() + 1, words.end()}},
                   option + ": is empty; expected a value, or to be left out");
}

TEST(Usage, AFolderIsForOut) {
  expectBadInput({"synth", {"--text", "a", "-o", "talks/"}}, "--out");
  expectBadInput({"synth", {"--text", "a", "-o", "."}}, "names a folder");
}

/// Files that are none of ours, by a name that promises something.
class BadInput : public testing::Test {
 protected:
  [[nodiscard]] std::string garbage(const std::string& name) const {
    return folder_.write(name, "no such thing\n\x01\x02\xff").string();
  }
  [[nodiscard]] std::string missing(const std::string& name) const {
    return (folder_.path() / "nowhere" / name).string();
  }
  [[nodiscard]] std::string out(const std::string& name) const { return (folder_.path() / "out" / name).string(); }
  void TearDown() override { EXPECT_FALSE(fs::exists(folder_.path() / "out")) << "something was written"; }

  ScratchFolder folder_;
};

TEST_F(BadInput, OfCorpus) {
  for (const bool is_missing : {false, true}) {
    const auto file = [&](const std::string& name) { return is_missing ? missing(name) : garbage(name); };
    expectBadInput({"corpus", {"info", file("a.corpus")}}, "a.corpus");
    expectBadInput({"corpus", {"info", file("a.corpus"), "--json"}}, "a.corpus");
    expectBadInput({"corpus", {"info", file("a.c3d")}}, "a.c3d");
    expectBadInput({"corpus", {"report", file("a.corpus"), "--out", out("a.html")}}, "a.corpus");
    expectBadInput({"corpus", {"evaluate", file("a.corpus"), "--hold-out", "0.5"}}, "a.corpus");
    expectBadInput({"corpus", {"tune", file("a.corpus"), "--out", out("b.corpus")}}, "a.corpus");
    expectBadInput({"corpus", {"convert", file("a.c3d"), out("b.csv")}}, "a.c3d");
    expectBadInput({"corpus", {"convert", file("a.trc"), out("b.csv")}}, "a.trc");
    expectBadInput({"corpus", {"convert", file("a.TextGrid"), out("b.lab")}}, "a.TextGrid");
    expectBadInput({"corpus", {"clean", file("a.csv"), out("b.csv")}}, "a.csv");
    expectBadInput({"corpus", {"align", file("a.wav"), "--transcript", "the time", "--out", out("a.TextGrid")}},
                   "a.wav");
    expectBadInput({"corpus", {"tag", file("a.flac"), "--out", out("a.json")}}, "a.flac");
  }
  expectBadInput({"corpus", {"prompts", "--text", missing("a\n.txt")}}, "a\\x0A.txt");
  expectBadInput({"corpus", {"build", missing("takes"), "--out", out("a.corpus")}}, "takes");
  expectBadInput({"corpus", {"build", garbage("file"), "--out", out("a.corpus")}}, "file");
}

TEST_F(BadInput, OfRetarget) {
  for (const bool is_missing : {false, true}) {
    const auto file = [&](const std::string& name) { return is_missing ? missing(name) : garbage(name); };
    expectBadInput({"retarget", {"check", file("a.face")}}, "a.face");
    expectBadInput({"retarget", {"check", file("a.face"), "--json"}}, "a.face");
    expectBadInput({"retarget", {"apply", "--face", file("a.face"), "--motion", "b.c3d", "--out", out("c.glb")}},
                   "a.face");
    for (const char* mesh : {"a.obj", "a.ply", "a.off", "a.glb"})
      expectBadInput({"retarget", {"pick", file(mesh), "--out", out("a.html")}}, mesh);
    expectBadInput(
        {"retarget",
         {"fit", "--mesh", "m.obj", "--anchors", "a.json", "--corpus", file("c.corpus"), "--out", out("a.face")}},
        "c.corpus");
    expectBadInput({"retarget", {"sample", "--corpus", file("c.corpus"), "--canonical", "f.obj", "--out", out("")}},
                   "c.corpus");
  }
  // Without --corpus it is the sample corpus.
  expectBadInput({"retarget", {"fit", "--mesh", missing("m.obj"), "--out", out("a.face")}}, "m.obj: no such file");
  expectBadInput({"retarget", {"fit", missing("m.obj"), "--out", out("a.face")}}, "m.obj: no such file");
  for (const char* name : {"talk.avi", "talk.json"})
    expectBadInput({"retarget", {"apply", "--face", garbage("a.face"), "--motion", "b.c3d", "--out", out(name)}}, name);
  expectBadInput(
      {"retarget", {"apply", "--face", garbage("a.face"), "--motion", "b.c3d", "--arkit", "--out", out("a.pc2")}},
      "a.pc2");
}

/// Told whole: what was found and what is expected; what was saved before stays.
TEST_F(BadInput, OfOtherCommandsKeepsWhatWasSaved) {
  const std::string motion = folder_.write("a.csv", "time_s,A.x,A.y,A.z\n0,1,2,3\n0.04,1,2,3\n").string(),
                    mesh = folder_.write("h.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").string(),
                    anchors = folder_.write("h.anchors.json", R"({"about": "no head", "markers": {}})").string();
  fs::create_directory(folder_.path() / "empty");
  const std::string empty = (folder_.path() / "empty").string();
  // A corpus' file by its first bytes, since nothing else makes way for one.
  const std::string corpus = std::string("SQLite format 3\0", 16) + std::string(52, '\0') + "\x4d\x70\x63\x65 earlier";
  const auto expectKept = [&](const std::string& program, Arguments arguments, const std::string& saved,
                              const std::string& said) {
    const std::string earlier = saved.ends_with(".corpus") ? corpus : "earlier";
    const fs::path kept = folder_.write("kept/" + saved, earlier);
    std::replace(arguments.begin(), arguments.end(), std::string("SAVED"), kept.string());
    expectBadInput({program, arguments}, said);
    EXPECT_EQ(readAll(kept), earlier) << said;
    EXPECT_EQ(std::distance(fs::directory_iterator(kept.parent_path()), fs::directory_iterator()), 1) << said;
    fs::remove_all(kept.parent_path());
  };
  expectKept("corpus", {"convert", motion, "SAVED", "--map", "A=B", "--map", "A=C"}, "b.c3d",
             ": --map: found 'A=C'; expected OLD=NEW, each OLD once");
  expectKept("corpus", {"convert", motion, "SAVED", "--map", "=C"}, "b.c3d",
             ": --map: found '=C'; expected OLD=NEW, each OLD once");
  expectKept("corpus", {"convert", motion, "SAVED"}, "b.bvh",
             "b.bvh: found the ending \".bvh\"; expected .c3d, .csv or .trc");
  expectKept("corpus", {"build", empty, "--out", "SAVED"}, "b.corpus",
             "empty: holds no take; expected files like NAME.c3d (.trc, .csv), NAME.wav (.flac), NAME.txt and "
             "NAME.TextGrid (.lab, .phn, .ctm)");
  expectKept(
      "corpus", {"align", motion, "--transcript", "hi", "--out", "SAVED"}, "a.TextGrid",
      "a.csv: starts with 'time_s,A.x,A'; expected a WAV, AIFF, AU, FLAC, Ogg (Vorbis, Opus), MP3, M4A or AAC file");
  expectKept("retarget", {"cut", mesh, "--anchors", anchors, "--out", "SAVED"}, "c.obj",
             "h.anchors.json:markers: is without CANTHUS_OUT_R; `retarget pick` asks for it");
  expectKept("retarget", {"cut", mesh, "--anchors", anchors, "--out", "SAVED"}, "c.ply",
             "c.ply: expected an .obj to write, or, of a GLB, a .glb");
  expectKept("retarget", {"fit", mesh, "--anchors", anchors, "--out", "x.face", "--mouth-parts", "SAVED"}, "whole.ply",
             "whole.ply: expected an .obj to write, or, of a GLB, a .glb");
  expectKept("retarget", {"own", "--corpus", motion, "--out", "SAVED"}, "me.stl", "me.stl: expected an .obj to write");
  expectKept("retarget", {"apply", "--face", "x.face", "--motion", motion, "--arkit", "--out", "SAVED"}, "a.obj",
             "a.obj: expected .glb or .csv with --arkit");
  expectKept("synth", {"batch", "a.csv", "--out", "SAVED", "--shard", "3/2"}, "lines",
             ": --shard: found '3/2'; expected I/N with 1 <= I <= N, as 2/5");
  expectKept("synth", {"--text", "hello", "--fps", "500", "-o", "SAVED"}, "talk.glb",
             ": found 500 frames a second; expected 23.976 to 240");
  expectKept("synth", {"--text", "hello", "--overlap-ms", "5000", "-o", "SAVED"}, "talk.glb",
             ": found an overlap of 5000 ms; expected 0 to 1000");
  expectBadInput({"synth", {"merge", empty}},
                 "empty: holds no manifest of a shard; expected what `synth batch --shard I/N` writes");
  EXPECT_TRUE(fs::is_empty(empty));
  expectBadInput({"corpus", {"prompts", "--grammar", motion}},
                 "a.csv:1: found 'time_s,A.x,A.y,A.z'; expected \"name = words\" with a name of its own");
}

TEST_F(BadInput, OfBatchLists) {
  const auto expectListError = [&](const std::string& list, const std::string& place) {
    const fs::path path = folder_.write("lines.csv", list);
    expectBadInput({"synth", {"batch", path.string(), "--out", out("lines")}}, place);
  };
  expectListError("", "lines.csv");
  expectListError("id,text\n", "no lines");
  expectListError("id,text\nb\n", "lines.csv:2:");
  for (const std::string& id : Arguments{"", "..", ".hidden", "a/b", "a b", "\xC3\xA4", std::string(101, 'x')})
    expectListError("id,text\n" + id + ",hello\n", "lines.csv:2:");
  for (const char* shard : {"0/2", "3/2", "1", "1/0", "a/b", "1/2/3", "-1/2", ""}) {
    const fs::path path = folder_.write("lines.csv", "a,one\n");
    const ProgramResult result = runProgram("synth", {"batch", path.string(), "--out", out("lines"), "--shard", shard});
    EXPECT_TRUE(result.exit_code == 1 || result.exit_code == 2) << shard;
    EXPECT_FALSE(result.err.empty()) << shard;
  }
}

TEST_F(BadInput, OfBatchCasts) {
  const std::string list = folder_.write("lines.csv", "id,text,speaker\na,one,Bob\n").string();
  const auto expectCastError = [&](const std::string& cast, const std::string& said) {
    const std::string file = folder_.write("cast.csv", cast).string();
    expectBadInput({"synth", {"batch", list, "--cast", file, "--out", out("lines")}}, "cast.csv:" + said);
  };
  expectCastError("speaker\n", " names nobody");
  expectCastError("speaker,hat\nBob,red\n", "1: found a column 'hat'");
  expectCastError("speaker,voice,rate\nAnn,flite:slt,1\nBob,flite:rms,quick\n", "3: found the rate 'quick'");
  expectCastError("speaker,voice\nBob\n", "2: found 1 cell; expected 2");
  expectCastError("speaker,voice\n,flite:rms\n", "2: names no speaker");
  expectCastError("speaker,voice\nBob,flite:rms\nBob,flite:slt\n", "3: names the speaker 'Bob' a second time");
  expectCastError("speaker,voice\n\"Bob,flite:rms\n", "2: found a quote that never closes");
}

/// What has no end, too: it is refused by its length, not read whole.
TEST_F(BadInput, OfSynthThatIsTooLong) {
  const std::string long_text = folder_.write("long.txt", std::string((1 << 20) + 1, 'a')).string();
  for (const std::string& file : {long_text, std::string("/dev/zero")}) {
    for (const char* option : {"--text-file", "--transcript-file"}) {
      Arguments arguments{option, file, "--out", out("line")};
      if (option == std::string("--transcript-file")) arguments.insert(arguments.end(), {"--audio", "a.wav"});
      const auto start = std::chrono::steady_clock::now();
      expectBadInput({"synth", arguments}, fs::path(file).filename().string());
      EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(5)) << "on a busy machine";
    }
  }
}

TEST_F(BadInput, OfASongThatIsTooLong) {
  constexpr std::uint32_t kBytes = 2 * 8000 * 901;
  std::string wav("RIFF\0\0\0\0WAVEfmt \x10\0\0\0\1\0\1\0\x40\x1F\0\0\x80\x3E\0\0\2\0\x10\0data\0\0\0\0", 44);
  for (const auto& [at, size] : {std::pair(4U, kBytes + 36), std::pair(40U, kBytes)}) {
    for (unsigned i = 0; i < 4; ++i) wav[at + i] = static_cast<char>(size >> (8 * i));
  }
  const std::string file = folder_.write("long.wav", wav + std::string(kBytes, '\0')).string();
  expectBadInput({"corpus", {"tag", file, "--out", out("a.json")}},
                 "long.wav: claims 901 s of sound; expected at most 900 s");
}

/// A file is told as what it is wherever text was expected, not by the first byte that is no text.
TEST_F(BadInput, OfAnotherKind) {
  const std::string sound = folder_.write("a.wav", std::string("RIFF\x24\0\0\0WAVEfmt ", 16)).string();
  const std::string corpus = folder_.write("a.corpus", std::string("SQLite format 3\0\x10", 17)).string();
  for (const auto& [file, kind] : {std::pair(sound, "a.wav: is a sound (WAV); expected "),
                                   std::pair(corpus, "a.corpus: is a corpus or another database; expected ")}) {
    for (Arguments arguments : {Arguments{"--song", file},
                                {"--audio", sound, "--times", file},
                                {"--audio", sound, "--lyrics", file},
                                {"--audio", sound, "--transcript-file", file},
                                {"--text-file", file},
                                {"--text", "now", "--lexicon", file},
                                {"--text", "now", "--edits", file},
                                {"batch", file}}) {
      arguments.insert(arguments.end(), {"--out", out("line")});
      expectBadInput({"synth", arguments}, kind);
    }
  }
  expectBadInput({"synth", {"--audio", corpus, "--out", out("line")}}, "a.corpus: is a corpus or another database");
  // One that is too long for what it is given as, too.
  fs::resize_file(corpus, 17 << 20);
  const std::string mesh = folder_.write("m.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").string();
  expectBadInput({"retarget", {"fit", "--mesh", mesh, "--anchors", corpus, "--out", out("a.face")}},
                 "bytes long, a corpus or another database; expected at most 16777216");
}

/// Text that is nothing to say is not spoken.
TEST_F(BadInput, OfTextThatIsNotPlain) {
  for (const auto& [text, kind] :
       {std::pair("\n{\"words\": []}\n", "is JSON; expected plain text (--song takes a written song)"),
        std::pair("<?xml version=\"1.0\"?>\n<score-partwise/>", "is XML; expected plain text (--song takes MusicXML)"),
        std::pair("File type = \"ooTextFile\"\n", "is a TextGrid; expected plain text (--phones takes labels)"),
        std::pair("0 2300000 sil\n2300000 3100000 n\n", "is labels; expected plain text (--phones takes labels)"),
        std::pair("#\n0.23 121 pau\n0.31 121 n\n", "is labels; expected plain text (--phones takes labels)")}) {
    const std::string file = folder_.write("line.txt", text).string();
    expectBadInput({"synth", {"--text-file", file, "--out", out("line")}}, std::string("line.txt: ") + kind);
  }
  const std::string aside = folder_.write("line.txt", "[aside] {well}").string();
  const ProgramResult said =
      runProgram("synth", {"--text-file", aside, "-o", (folder_.path() / "said.TextGrid").string()});
  EXPECT_EQ(said.exit_code, 0) << said.err;
}

TEST_F(BadInput, OfSongs) {
  const auto sing = [&](const std::string& song, Arguments more = {}) {
    more.insert(more.begin(), {"--song", song, "--corpus", "clock", "--out", out("song")});
    return Call{"synth", more};
  };
  const std::string twinkle = MOUTHPIECE_SOURCE_DIR "/sample_data/songs/twinkle.json";
  expectBadInput(sing(folder_.write("words.txt", "twinkle twinkle\n").string()),
                 "words.txt: is no song by its name; expected one that ends in .json .musicxml");
  expectBadInput(sing(twinkle, {"--voice", "flite:slt"}), "found 'flite:slt'; expected one that sings");
  expectBadInput(sing(twinkle, {"--language", "German"}), "language: found German for a written song");
  expectBadInput({"synth", {"--text", "a", "--strength", "stark", "--out", out("line")}},
                 "--strength: found 'stark'; expected 0 to 2, or a file of time_s,value");
  expectBadInput({"synth", {"--text", "a", "--ma", "stark", "--out", out("line")}}, "expected 0 to 1, auto, or a file");
}

TEST_F(BadInput, OfSynth) {
  const auto speak = [&](Arguments arguments) {
    arguments.insert(arguments.end(), {"--out", out("line")});
    return Call{"synth", arguments};
  };
  expectBadInput(speak({"--text-file", missing("line.txt")}), "line.txt");
  expectBadInput(speak({"--audio", "a.wav", "--lyrics", missing("song.txt")}), "song.txt");
  expectBadInput(speak({"--audio", "a.wav", "--transcript-file", folder_.write("none.txt", "").string()}), "none.txt");
  for (const auto& [name, bytes, kind] :
       {std::tuple("clicks.json", R"({"markers": {"NOSE_TIP": 3}})", "JSON, as a head's anchors are"),
        std::tuple("a.wav", "RIFF1234WAVEfmt ", "a sound (WAV)"), std::tuple("none.face", "", "empty"),
        std::tuple("a.csv", "time_s,NOSE_TIP.x\n", "no face")}) {
    expectBadInput(speak({"--text", "now", "--face", folder_.write(name, bytes).string()}),
                   fmt::format("{}: is {}; expected what `retarget fit` makes of a head and its anchors", name, kind));
  }
  expectBadInput(speak({"--text", "now", "--face", folder_.write("head.OBJ", "v 0 0 0\n").string()}),
                 "is a head, no face yet; expected what `retarget fit` makes of it");
  expectBadInput({"synth", {"--text", "the time is now", "-o", out("talk.avi")}}, "talk.avi");
  expectBadInput({"synth", {"--text", "the time is now", "-o", out("noending")}}, "noending");
}

}  // namespace
}  // namespace mouthpiece::test
