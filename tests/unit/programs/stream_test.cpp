// synth --stream: what comes in on standard input goes out as frames.
#include <arpa/inet.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <thread>

#include "phonetics/labels/textgrid.h"
#include "programs/synth/stream_ends.h"
#include "support/error_of.h"
#include "support/run_program.h"

namespace mouthpiece::test {
namespace {

namespace fs = std::filesystem;
const fs::path kStreamShare = MOUTHPIECE_BUILD_SHARE_DIR;

std::vector<std::string> sentencesOf(const std::string& text) {
  const ScratchFolder scratch;
  const std::atomic<bool> is_stopped = false;
  SentenceReader reader(scratch.write("text.txt", text).string(), is_stopped);
  std::vector<std::string> sentences;
  while (const auto sentence = reader.next()) sentences.push_back(*sentence);
  return sentences;
}

TEST(SentenceReader, CutsAtSentencesAndLongOnesAtPauses) {
  EXPECT_EQ(sentencesOf("Dr. Who paid 3.50 today. Did he? Yes!\nAnd then\n\n ... \nthe rest"),
            (std::vector<std::string>{"Dr. Who paid 3.50 today.", " Did he?", " Yes!", "And then\n", "the rest"}));
  std::string clauses;
  for (int i = 0; i < 100; ++i) clauses += "one more clause, ";
  for (const std::string& part : sentencesOf(clauses)) EXPECT_LE(part.size(), 81U);
  const std::string opening = "When the old man had bought all the shells, and put them on the table,";
  EXPECT_EQ(sentencesOf(opening + " he went home, and sat down to read until it was dark outside.").front(), opening);
  EXPECT_EQ(sentencesOf("Well, " + std::string(200, 'a') + ", so.").front(), "Well, " + std::string(200, 'a') + ",");
  std::string words;
  for (int i = 0; i < 500; ++i) words += "word ";
  std::string joined;
  for (const std::string& part : sentencesOf(words)) {
    EXPECT_LE(part.size(), 401U);
    joined += part;
  }
  EXPECT_EQ(joined, words);
  std::string unbroken;
  for (int i = 0; i < 5000; ++i) unbroken += "日";
  joined.clear();
  for (const std::string& part : sentencesOf(unbroken)) {
    EXPECT_EQ(part.size() % 3, 0U) << "characters stay whole";
    joined += part;
  }
  EXPECT_EQ(joined, unbroken);
}

TEST(SentenceReader, CountsCharactersInAnyScript) {
  const std::string clause = "Когда он купил все ракушки и положил их на стол,", whole = clause + " он ушёл домой.";
  EXPECT_GT(whole.size(), 80U);
  EXPECT_EQ(sentencesOf(whole + " Потом"), (std::vector<std::string>{whole, " Потом"}));
  EXPECT_EQ(sentencesOf(clause + " он ушёл домой и читал до самого вечера.").front(), clause);
  EXPECT_EQ(sentencesOf("今日は晴れです。散歩に行きますか？はい"),
            (std::vector<std::string>{"今日は晴れです。", "散歩に行きますか？", "はい"}));
  EXPECT_TRUE(sentencesOf("").empty());
  EXPECT_TRUE(sentencesOf(" \n . \n").empty());
}

class Streaming : public testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(kStreamShare / "sample.corpus"))
      GTEST_SKIP() << "no sample corpus in " << kStreamShare << ": run `make data`";
  }
  /// synth --stream with `input` on standard input.
  ProgramResult run(const std::string& arguments, const std::string& input) const {
    const fs::path file = scratch_.write("input", input);
    const std::string synth = (fs::path(MOUTHPIECE_BIN_DIR) / "synth").string();
    return runProgram("/bin/sh", {"-c", synth + " --stream " + arguments + " < " + file.string()}, scratch_.path());
  }
  /// Two seconds that are loud and quiet by turns, 16 bits.
  static std::string someSound() {
    std::string bytes;
    for (int i = 0; i < 32000; ++i) {
      const double loud = 0.5 + 0.5 * std::sin(i / 900.0);
      const auto value = static_cast<std::int16_t>(6000 * loud * std::sin(i * 0.09) * std::sin(i * 0.31));
      bytes.push_back(static_cast<char>(value & 0xFF));
      bytes.push_back(static_cast<char>(value >> 8));
    }
    return bytes;
  }
  static std::string stamped(const std::string& bytes, const std::vector<std::size_t>& chunks) {
    std::string sent;
    for (const std::size_t chunk : chunks) {
      const auto put = [&](std::uint64_t value, int count) {
        for (int i = 0; i < count; ++i) sent.push_back(static_cast<char>(value >> (8 * i) & 0xFF));
      };
      put(chunk * 1600, 8);
      put(1600, 4);
      sent += bytes.substr(chunk * 3200, 3200);
    }
    return sent;
  }
  ScratchFolder scratch_;
};

TEST_F(Streaming, SoundBecomesALineOfJsonAFrame) {
  const ProgramResult result = run("--json", someSound());
  ASSERT_EQ(result.exit_code, 0) << result.err;
  std::istringstream lines(result.out);
  std::size_t frames = 0;
  for (std::string line; std::getline(lines, line); ++frames) {
    const nlohmann::json frame = nlohmann::json::parse(line);
    EXPECT_EQ(frame.at("frame"), frames);
    EXPECT_NEAR(frame.at("time_s").get<double>(), static_cast<double>(frames) / 60, 1e-3);
    for (const auto& [name, weight] : frame.at("arkit").items()) EXPECT_TRUE(weight > 0 && weight <= 1) << name;
  }
  EXPECT_EQ(frames, 120U);
  const nlohmann::json counts = nlohmann::json::parse(result.err);
  EXPECT_EQ(counts.at("frames"), 120);
  EXPECT_EQ(counts.at("late"), 0);
}

TEST_F(Streaming, RowsAreAsWideAsAsked) {
  const ProgramResult weights = run("--as rows --quiet --fps 30", someSound());
  EXPECT_EQ(weights.out.size(), 60U * 4 * 53) << weights.err;
  const ProgramResult markers = run("--as rows --rows markers --quiet --fps 30", someSound());
  EXPECT_EQ(markers.out.size(), 60U * 4 * (1 + 3 * 66)) << markers.err;
  float time = 0;
  std::memcpy(&time, markers.out.data() + 30 * 4 * (1 + 3 * 66), 4);
  EXPECT_EQ(time, 1.0F);
}

TEST_F(Streaming, StampsTellWhatIsLostAndDoubled) {
  std::vector<std::size_t> in_order;
  for (std::size_t i = 0; i < 20; ++i) in_order.push_back(i);
  const ProgramResult whole = run("--as rows --quiet", someSound());
  EXPECT_EQ(run("--stamped --as rows --quiet", stamped(someSound(), in_order)).out, whole.out);
  const ProgramResult torn = run("--stamped --as rows --json", stamped(someSound(), {0, 1, 2, 2, 3, 6, 7, 5, 8, 9}));
  ASSERT_EQ(torn.exit_code, 0) << torn.err;
  const nlohmann::json counts = nlohmann::json::parse(torn.err);
  EXPECT_EQ(counts.at("dropped"), 1);
  EXPECT_EQ(counts.at("doubled"), 1);
  EXPECT_EQ(counts.at("late"), 1);
  EXPECT_NEAR(counts.at("missing_s").get<double>(), 0.2, 1e-9);
  EXPECT_EQ(torn.out.size(), 60U * 4 * 53);
  const ProgramResult bad = run("--stamped --as rows", stamped(someSound(), {0, 1}) + std::string(12, '\xFF'));
  EXPECT_EQ(bad.exit_code, 1);
  EXPECT_NE(bad.err.find("stdin:byte 6424: is no stamp of a chunk"), std::string::npos) << bad.err;
  EXPECT_EQ(bad.out.size() % (4 * 53), 0U) << "what came before is shown";
  EXPECT_GT(bad.out.size(), 0U);
}

TEST_F(Streaming, OwnVoiceIsHeardOtherwiseAndOnlyWhereSoundIs) {
  const ProgramResult own = run("--own-voice --as rows --quiet", someSound());
  EXPECT_EQ(own.out.size(), 120U * 4 * 53) << own.err;
  EXPECT_TRUE(own.out != run("--as rows --quiet", someSound()).out) << "nothing was learnt from the takes";
  EXPECT_EQ(run("--own-voice --labels phones", "0 0.4 sil\n").exit_code, 2);
}

TEST_F(Streaming, LabelsAndTextBecomeFrames) {
  const ProgramResult phones =
      run("--labels phones --as rows --quiet", "# a line\n0 0.4 sil\n0.4 0.5 M 0\n0.5 0.7 AA 0\n\n0.7 1.0 sil\n");
  EXPECT_EQ(phones.out.size(), 60U * 4 * 53) << phones.err;
  const ProgramResult words = run("--labels words --as rows --quiet", "0.5 1.0 hello\n1.0 1.5 world\n");
  EXPECT_EQ(words.out.size(), 90U * 4 * 53) << words.err;
  const ProgramResult bad = run("--labels phones", "0 0.4 sil\n0.4 x AA\n");
  EXPECT_EQ(bad.exit_code, 1);
  EXPECT_NE(bad.err.find("stdin:2: found '0.4 ...'; expected START END NAME in seconds"), std::string::npos) << bad.err;
  EXPECT_EQ(std::count(bad.err.begin(), bad.err.end(), '\n'), 1) << bad.err;

  const ProgramResult text =
      run("--text-file - --voice flite:slt --sound said.wav --as rows --quiet", "My name is Bob. Is yours?\n");
  ASSERT_EQ(text.exit_code, 0) << text.err;
  const std::string wav = readAll(scratch_.path() / "said.wav");
  std::uint32_t bytes = 0;
  std::memcpy(&bytes, wav.data() + 40, 4);
  EXPECT_EQ(bytes, wav.size() - 44);
  EXPECT_NEAR(static_cast<double>(text.out.size()) / (4 * 53 * 60), bytes / 32000.0, 0.1);
  EXPECT_EQ(run("--text-file - --voice flite:slt", " \n").exit_code, 1);
}

/// Root mean square of what rows of `width` floats differ by, up to the shorter one's end.
double rmsDifference(const std::string& a, const std::string& b) {
  const std::size_t count = std::min(a.size(), b.size()) / 4;
  double sum = 0;
  for (std::size_t i = 0; i < count; ++i) {
    std::array<float, 2> values{};
    std::memcpy(&values[0], a.data() + 4 * i, 4);
    std::memcpy(&values[1], b.data() + 4 * i, 4);
    sum += std::pow(static_cast<double>(values[0]) - static_cast<double>(values[1]), 2);
  }
  return std::sqrt(sum / static_cast<double>(count));
}

TEST_F(Streaming, SoundTakesNoFileAway) {
  const ScratchFolder scratch;
  const std::string kept = scratch.write("keep.wav", "my sound").string();
  const auto stream = [](const std::string& text, const std::string& sound) {
    return runProgram("synth", {"--stream", "--text-file", text, "--sound", sound, "--voice", "flite:slt"});
  };
  EXPECT_EQ(stream((scratch.path() / "none.txt").string(), kept).exit_code, 1);
  EXPECT_EQ(readAll(kept), "my sound");
  const std::string book = scratch.write("book.txt", "It is ten.").string();
  EXPECT_EQ(stream(book, book).exit_code, 1);
  EXPECT_EQ(readAll(book), "It is ten.");
}

class StreamingWords : public Streaming {
 protected:
  void SetUp() override {
    Streaming::SetUp();
    if (IsSkipped()) return;
    const std::string synth = (fs::path(MOUTHPIECE_BIN_DIR) / "synth").string();
    const ProgramResult said = runProgram(synth,
                                          {"--quiet", "--voice", "flite:slt", "--text", "My mother met Bob at my home.",
                                           "-o", "said.TextGrid", "-o", "said.wav"},
                                          scratch_.path());
    ASSERT_EQ(said.exit_code, 0) << said.err;
    const SpeechLabels labels = readTextGrid(scratch_.path() / "said.TextGrid");
    for (const LabelledPhone& phone : labels.phones) {
      const std::string span = fmt::format("{} {} ", phone.span.start, phone.span.end);
      phones_ += span + std::string(phoneName(phone.phone)) + (phone.word ? fmt::format(" {}\n", *phone.word) : "\n");
    }
    for (const LabelledWord& word : labels.words)
      words_ += fmt::format("{} {} {}\n", labels.phones[word.phones.first.value].span.start,
                            labels.phones[word.phones.last.value].span.end, word.text);
    const std::string wav = readAll(scratch_.path() / "said.wav");
    sound_ = wav.substr(44);
  }
  std::string sound_, words_, phones_;
};

TEST_F(StreamingWords, AreSaidAsTheirSoundTells) {
  const std::string told = "--times " + scratch_.write("words.txt", words_).string();
  const std::string options = " --as rows --rows markers --look-ahead 1000 --json";
  const ProgramResult heard = run(told + options, sound_);
  ASSERT_EQ(heard.exit_code, 0) << heard.err;
  EXPECT_NE(heard.err.find("\"words_without_sound\":0"), std::string::npos) << heard.err;
  const std::string unheard = run("--labels words" + options, words_).out;
  const std::string known = run("--labels phones" + options, phones_).out;
  const double off_mm = rmsDifference(heard.out, known);
  EXPECT_GT(off_mm, 0);
  EXPECT_LT(off_mm, 0.8 * rmsDifference(unheard, known));
  constexpr std::size_t kRow = 4 * 199;
  const auto frames = static_cast<std::size_t>(std::ceil(static_cast<double>(sound_.size()) / 2 / 16000 * 60 - 1e-6));
  EXPECT_EQ(heard.out.size(), frames * kRow) << "the frames last as long as the sound";
}

TEST_F(StreamingWords, ComeThroughAPipeWhenTheyAreSaid) {
  // Sound and words as they are said; each word 30 ms after its end.
  const fs::path words = scratch_.write("words.txt", words_), sound = scratch_.write("sound", sound_);
  const fs::path pace = scratch_.write("pace.sh", R"sh(words=$1; sound=$2; shift 2
mkfifo told
(begun=$(date +%s%N)
while read -r start end word; do
  sleep "$(echo "$end $begun $(date +%s%N)" | awk '{s = $1 + 0.03 - ($3 - $2) / 1e9; print (s > 0 ? s : 0)}')"
  echo "$start $end $word"
done < "$words" > told) &
(while :; do
  dd bs=640 count=5 iflag=fullblock status=none > piece
  test -s piece || break
  cat piece
  sleep 0.1
done) < "$sound" | "$@"
)sh");
  const std::string synth = (fs::path(MOUTHPIECE_BIN_DIR) / "synth").string();
  const ProgramResult result = runProgram("/bin/sh",
                                          {pace.string(), words.string(), sound.string(), synth, "--stream", "--times",
                                           "told", "--as", "rows", "--real-time", "--json", "--delay", "3000"},
                                          scratch_.path());
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.err.find("\"words_without_sound\":0"), std::string::npos) << result.err;
  EXPECT_NE(result.err.find("\"frames_at_rest\":0"), std::string::npos) << result.err;
  EXPECT_NE(result.err.find("\"late\":0"), std::string::npos) << result.err;
}

TEST_F(StreamingWords, ThatWaitLongerThanFramesCanAreSaidWithoutSound) {
  // No sound comes but silence of a second: the words behind it are said when the sound ends, or in time.
  const fs::path words = scratch_.write("words.txt", "0.2 0.5 hello\n5 5.5 world\n");
  const ProgramResult result = run("--times " + words.string() + " --as rows --json", std::string(32000, '\0'));
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.err.find("\"words_without_sound\":1"), std::string::npos) << result.err;
  EXPECT_NE(result.err.find("words that were said before all their sound had come: 1"), std::string::npos)
      << result.err;
  EXPECT_EQ(result.out.size(), 330U * 4 * 53);
}

TEST_F(StreamingWords, DoNotWaitForAPipeThatNobodyWritesTo) {
  const fs::path pipe = scratch_.path() / "nobody";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  const ProgramResult result = run("--times " + pipe.string() + " --as rows", std::string(32000, '\0'));
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_NE(result.err.find("nobody has written to it, and the sound is over; expected lines START END WORD"),
            std::string::npos)
      << result.err;
}

TEST_F(Streaming, LabelsThatComeAsTheyBeginAreInTime) {
  // 4 s of phones, each told when it begins.
  std::string labels = "0 0.3 SIL\n";
  Seconds at = 0.3;
  for (int i = 0; at < 4; ++i) {
    const Seconds end = at + 0.06 + 0.02 * (i % 5);
    labels += std::to_string(at) + " " + std::to_string(end) + (i % 2 == 0 ? " M\n" : " AA\n");
    at = end;
  }
  const fs::path file = scratch_.write("labels.txt", labels);
  const fs::path pace = scratch_.write("pace_labels.sh", R"sh(labels=$1; shift
begun=$(date +%s%N)
while read -r start rest; do
  sleep "$(echo "$start $begun $(date +%s%N)" | awk '{s = $1 - ($3 - $2) / 1e9; print (s > 0 ? s : 0)}')"
  echo "$start $rest"
done < "$labels" | "$@"
)sh");
  const auto framesAtRest = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments{pace.string(), file.string(), (fs::path(MOUTHPIECE_BIN_DIR) / "synth").string(),
                                       "--stream",    "--labels",    "phones",
                                       "--as",        "rows",        "--real-time",
                                       "--json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const ProgramResult result = runProgram("/bin/sh", arguments, scratch_.path());
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return nlohmann::json::parse(result.err).at("frames_at_rest").get<std::size_t>();
  };
  EXPECT_GT(framesAtRest({"--delay", "0"}), 10U) << "without a delay labels come too late";
  EXPECT_LE(framesAtRest({}), 3U);
}

TEST_F(Streaming, DatagramsReachWhoListens) {
  const int listening = socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  ASSERT_EQ(bind(listening, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  socklen_t size = sizeof address;
  ASSERT_EQ(getsockname(listening, reinterpret_cast<sockaddr*>(&address), &size), 0);
  const timeval patience{0, 200'000};
  setsockopt(listening, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  std::atomic<bool> is_over = false;
  std::vector<std::string> packets;
  std::thread reading([&] {
    std::string packet(2048, '\0');
    while (true) {
      const ssize_t count = recv(listening, packet.data(), packet.size(), 0);
      if (count > 0) packets.push_back(packet.substr(0, static_cast<std::size_t>(count)));
      if (count <= 0 && is_over) return;
    }
  });
  const ProgramResult result = run(
      "--as livelink --subject Bob --real-time --to 127.0.0.1:" + std::to_string(ntohs(address.sin_port)), someSound());
  is_over = true;
  reading.join();
  close(listening);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_TRUE(result.out.empty());
  ASSERT_GE(packets.size(), 118U) << "of 120";
  for (const std::string& packet : packets) {
    ASSERT_EQ(packet.size(), 4U + 37 + 4 + 3 + 17 + 4 * 61);
    EXPECT_EQ(packet.substr(45, 3), "Bob");
  }
  const auto numberOf = [](const std::string& packet) {
    std::uint32_t number = 0;
    for (const char byte : packet.substr(48, 4)) number = number << 8U | static_cast<unsigned char>(byte);
    return number;
  };
  for (std::size_t i = 1; i < packets.size(); ++i) ASSERT_GT(numberOf(packets[i]), numberOf(packets[i - 1]));
  EXPECT_GE(numberOf(packets.back()), 119U) << "frames at rest have numbers, too";
}

/// The second half of two seconds comes half a second late, counted from the first frame that is shown: on a busy
/// machine the program begins late.
TEST_F(Streaming, AStalledSenderIsCountedAndHeardAgain) {
  const std::string sound = someSound();
  const fs::path first = scratch_.write("first", sound.substr(0, 32000)),
                 second = scratch_.write("second", sound.substr(32000));
  const std::string synth = (fs::path(MOUTHPIECE_BIN_DIR) / "synth").string();
  const ProgramResult result = runProgram(
      "/bin/sh",
      {"-c", "(cat " + first.string() +
                 "; timeout 30 sh -c 'until test -s shown; do sleep 0.02; done'; sleep 1.5; cat " + second.string() +
                 ") | " + synth + " --stream --real-time --as rows --rows markers --json > shown"},
      scratch_.path());
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const nlohmann::json counts = nlohmann::json::parse(result.err);
  const std::size_t at_rest = counts.at("frames_at_rest"), frames = counts.at("frames");
  EXPECT_GT(at_rest, 10U);
  EXPECT_GE(frames, 120 + at_rest - 2) << "all of the sound is shown, and the frames at rest besides";
  EXPECT_EQ(fs::file_size(scratch_.path() / "shown"), frames * 4 * (1 + 3 * 66));
  EXPECT_EQ(counts.at("dropped"), 0);
}

/// What follows is said, and the notice tells where it stood.
TEST_F(Streaming, GoesOnWithoutWhatCannotBeSaid) {
  const std::string words = "0.2 0.6 now\n0.7 0.9 -\n1.0 1.3 then\n";
  for (const auto& [arguments, input, place] : std::vector<std::array<std::string, 3>>{
           {"--labels words --json", words, "stdin:2: "},
           {"--labels words --json", "0.2 0.6 now\n0.7 0.9 \xE4\xBD\xA0\n1.0 1.3 then\n", "stdin:2: "},
           {"--text-file - --voice flite:slt --json", "The first.\n\nThe \xE4\xBD\xA0 is Chinese.\nThe last line.\n",
            "stdin:3: "}}) {
    const ProgramResult result = run(arguments, input);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_NE(result.err.find(place), std::string::npos) << result.err;
    EXPECT_NE(result.err.find("\"left_out\":1"), std::string::npos) << result.err;
    EXPECT_GT(std::count(result.out.begin(), result.out.end(), '\n'), 70) << arguments;
  }
  const std::filesystem::path told = scratch_.write("words.txt", words);
  const ProgramResult beside = run("--json --times " + told.string(), someSound());
  EXPECT_EQ(beside.exit_code, 0) << beside.err;
  EXPECT_NE(beside.err.find("words.txt:2: "), std::string::npos) << beside.err;
  EXPECT_EQ(std::count(beside.out.begin(), beside.out.end(), '\n'), 120);
}

TEST_F(Streaming, TellsOfSamplesThatAreNone) {
  std::string bytes;
  for (int i = 0; i < 16000; ++i) {
    const auto bits = std::bit_cast<std::uint32_t>(i % 20 == 0 ? 7.0F : 0.0F);
    for (int k = 0; k < 4; ++k) bytes.push_back(static_cast<char>(bits >> (8 * k) & 0xFF));
  }
  const ProgramResult result = run("--pcm-format f32", bytes);
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_NE(result.err.find("warning: 800 of 16000 samples"), std::string::npos) << result.err;
  EXPECT_NE(result.err.find(", 800 unusable samples"), std::string::npos) << result.err;
}

TEST_F(Streaming, ItsHelpListsWhatItTakes) {
  const ProgramResult help = run("--help", "");
  EXPECT_NE(help.out.find("--look-ahead"), std::string::npos);
  for (const char* option : {"--strength", "--hold", "--ja ", "--mood", "--edits"})
    EXPECT_EQ(help.out.find(option), std::string::npos) << option;
}

TEST_F(Streaming, BadInputIsOneLine) {
  for (const auto& [arguments, input, message] : std::vector<std::array<std::string, 3>>{
           {"", "RIFF0000WAVEfmt ", "is a WAV file; expected raw samples"},
           {"", "fLaC00000000", "is a FLAC file; expected raw samples"},
           {"", "OggS00000000", "is an Ogg file; expected raw samples"},
           {"", "ID3400000000", "is an MP3 file; expected raw samples"},
           {"",
            std::string("\0\0\0\x20"
                        "ftypM4A ",
                        12),
            "is an M4A or MP4 file; expected raw samples"},
           {"", "", "stdin: is empty; expected raw samples"},
           {"", someSound() + "a", "stdin:byte 64001: ends within a sample"},
           {"--stamped", stamped(someSound(), {0, 1}).substr(0, 6000), "stdin:byte 6000: ends within a chunk"},
           {"--labels words", "0.2 0.6 \xE4\xBD\xA0\n", "stdin:1: "},
           {"--strength 2", someSound(), "found strength for a stream; expected none"},
           {"--as livelink --to nowhere", someSound(), "found 'nowhere'; expected HOST:PORT"},
           {"--as livelink --to 127.0.0.1:99999", someSound(), "expected HOST:PORT"},
           {"--method curves", someSound(), "by the method guided"},
           {"--text-file missing.txt", "", "missing.txt: cannot be read"},
           {"--times missing.txt", someSound(), "missing.txt: cannot be read"},
           {"--times input", "0.1 0.2\n", "input:1: found '0.1 ...'; expected START END WORD in seconds"},
           {"--times input", "# words\n0.2 0.1 not\n", "input:2: "},
           {"--delay 100", someSound(), "--delay: has nothing to delay; expected --real-time beside it"},
           {"--labels phones", "0 1 QQQ\n", "stdin:1: found the phone 'QQQ'"}}) {
    const ProgramResult result = run(arguments, input);
    EXPECT_EQ(result.exit_code, 1) << arguments;
    EXPECT_NE(result.err.find(message), std::string::npos) << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n') <= 2, true) << result.err;
  }
  EXPECT_EQ(run("--pcm-rate 8000", "").exit_code, 2);
  EXPECT_EQ(run("--look-ahead 1", "").exit_code, 2);
  EXPECT_EQ(run("--times -", "").exit_code, 2);
  EXPECT_EQ(run("--times input --labels words", "").exit_code, 2);
}

}  // namespace
}  // namespace mouthpiece::test
