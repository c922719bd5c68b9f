#include "hearing/network/word_network.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "audio/audio_clip.h"
#include "base/child_process.h"
#include "hearing/alignment/forced_alignment.h"
#include "hearing/network/network_doubt.h"
#include "hearing/recognition/recogniser.h"
#include "support/error_of.h"
#include "support/gust.h"
#include "support/hiss.h"
#include "voices/voice.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

const fs::path kNetwork = fs::path(MOUTHPIECE_BUILD_SHARE_DIR) / "word_network";

#if defined(__x86_64__) || defined(__aarch64__)
#define NEEDS_NETWORK() ASSERT_TRUE(WordNetwork(kNetwork).isThere()) << "`make build` brings " << kNetwork
#else
#define NEEDS_NETWORK() GTEST_SKIP() << "ONNX Runtime is not packed for this processor"
#endif

std::vector<std::int16_t> saidBy(const char* voice, const char* text) {
  std::vector<std::int16_t> samples;
  for (const float sample : resampleAudio(makeVoice(voice)->speak(text).audio, 16000).samples)
    samples.push_back(static_cast<std::int16_t>(std::lround(32767 * std::clamp(sample, -1.0F, 1.0F))));
  return samples;
}

std::string textOf(const std::vector<NetworkWord>& words) {
  std::string text;
  for (const NetworkWord& word : words) {
    for (const char c : word.text) {
      if (c != '.' && c != ',' && c != '?') text += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
    text += ' ';
  }
  return text.substr(0, text.empty() ? 0 : text.size() - 1);
}

TEST(WordNetwork, HearsTheWordsOfEachSoundAndHowSureTheyAre) {
  NEEDS_NETWORK();
  const auto first = saidBy("flite:rms", "there is nothing good on television"),
             second = saidBy("flite:kal16", "sorry I did not catch your name");
  const std::vector<std::int16_t> nothing, click(800, 1000);
  const std::vector<std::span<const std::int16_t>> sounds{first, nothing, click, second};
  const auto heard = WordNetwork(kNetwork).hear(sounds);
  ASSERT_EQ(heard.size(), 4U);
  EXPECT_TRUE(heard[1].empty());
  EXPECT_TRUE(heard[2].empty());
  EXPECT_EQ(textOf(heard[0]), "there is nothing good on television");
  EXPECT_EQ(textOf(heard[3]), "sorry i did not catch your name");
  for (const NetworkWord& word : heard[0]) {
    EXPECT_LE(word.log_probability, 0) << word.text;
    EXPECT_GT(word.log_probability, -3) << word.text;
  }
}

/// PocketSphinx hears none of it.
TEST(WordNetwork, IsHeardByTheRecogniserInNoise) {
  NEEDS_NETWORK();
  const AudioClip sound = test::inHiss(saidBy("flite:kal16", "he usually walks the dog before breakfast"), 20);
  const std::string right = "he usually walks the dog before breakfast";
  const auto textBy = [&](const fs::path& network) {
    return textOf(
        {{makeRecogniser({.as = HearAs::kAuto, .hint = {}, .word_network = std::make_shared<WordNetwork>(network)})
              ->hear(sound, "line")
              .text}});
  };
  EXPECT_EQ(textBy(kNetwork), right);
  EXPECT_NE(textBy({}), right);
}

/// Any sound is some row of a corpus' words; in noise those fit as well as what is said.
TEST(WordNetwork, IsBelievedBeforeACorpusWhoseLinesWereNotSaid) {
  NEEDS_NETWORK();
  std::vector<std::string> known;
  std::ifstream file(MOUTHPIECE_SOURCE_DIR "/sample_data/prompts/rich.txt");
  for (std::string line; std::getline(file, line);) known.push_back(line);
  for (int hour = 1; hour <= 12; ++hour)
    known.push_back("almost half past " + std::to_string(hour) + " in the morning");
  const auto recogniser = makeRecogniser(
      {.as = HearAs::kAuto, .hint = {}, .known = known, .word_network = std::make_shared<WordNetwork>(kNetwork)});
  for (const double snr_db : {15.0, 20.0}) {
    const AudioClip sound = test::inHiss(
        saidBy("flite:rms", "please call me back on Tuesday at half past three, I have some good news for you"),
        snr_db);
    const std::string text = textOf({{recogniser->hear(sound, "line").text}});
    EXPECT_NE(text.find("call me back"), std::string::npos) << snr_db << " dB: " << text;
  }
}

/// A name that it cannot write: "R. Conqueror" and "Gross and Calas" are heard without the hint.
TEST(WordNetwork, WritesTheWordsOfAHintForOnesOfWhichItIsNotSure) {
  NEEDS_NETWORK();
  const auto network = std::make_shared<WordNetwork>(kNetwork);
  const auto heard = [&](const std::string& hint, const char* text) {
    AudioClip sound{16000, {}};
    for (const std::int16_t sample : saidBy("flite:awb", text))
      sound.samples.push_back(static_cast<float>(sample) / 32768);
    return makeRecogniser({.as = HearAs::kAuto, .hint = hint, .word_network = network})->hear(sound, "line").text;
  };
  const char* name = "We saw Mister Okonkwo at the station.";
  EXPECT_EQ(heard("", name).find("okonkwo"), std::string::npos);
  EXPECT_NE(heard("Kowalczyk, Okonkwo", name).find("okonkwo at the station"), std::string::npos);
  const char* other = "Could you open the window before lunch?";
  EXPECT_EQ(heard("Kowalczyk, Okonkwo", other), heard("", other));
}

TEST(WordNetwork, TellsHowLikelyTheWordsOfATextAre) {
  NEEDS_NETWORK();
  const auto sound = saidBy("flite:rms", "there is nothing good on television"),
             number = saidBy("flite:kal16", "we have seven blue chairs");
  const std::vector<std::int16_t> nothing;
  const std::vector<std::vector<std::string>> texts{{"there", "is", "nothing", "good", "on", "television"},
                                                    {"there", "is", "nothing", "wood", "on", "television"},
                                                    {"there", "is", "nothing", "good"},
                                                    {"we", "have", "seven", "blue", "chairs"},
                                                    {"now"}};
  const std::vector<std::span<const std::int16_t>> sounds{sound, sound, sound, number, nothing};
  const auto scores = WordNetwork(kNetwork).score(sounds, texts);
  ASSERT_EQ(scores.size(), 5U);
  for (const std::size_t right : {0U, 3U}) {
    ASSERT_EQ(scores[right]->words.size(), texts[right].size() + 1);
    for (const WordScore& score : scores[right]->words) EXPECT_GT(score.behind, -2);
    EXPECT_EQ(scores[right]->heard.size(), texts[right].size()) << "heard without the text";
  }
  EXPECT_LT(scores[1]->words[3].behind, scores[0]->words[3].behind - 2) << "another word";
  EXPECT_LT(scores[1]->log_probability, scores[0]->log_probability - 2);
  EXPECT_EQ(scores[1]->heard_log_probability, scores[0]->heard_log_probability);
  EXPECT_GT(scores[0]->heard_tokens, texts[0].size());
  EXPECT_LT(scores[2]->words[4].behind, scores[0]->words[6].behind - 2) << "the text ends before the sound";
  EXPECT_FALSE(scores[4]);
}

/// Lines and a voice from which no weight was learnt.
TEST(WordNetwork, IsAskedWhereATextIsInDoubt) {
  NEEDS_NETWORK();
  ForcedAligner aligner;
  WordNetwork none{fs::path()}, network(kNetwork);
  const auto doubts = [&](const AudioClip& sound, const char* text, WordNetwork& by) {
    ForcedAlignment alignment = aligner.align(sound, Pronouncer().wordsOf(text), "line");
    EXPECT_EQ(judgeByNetwork(by, Pronouncer(), SamplesToHear(sound), alignment), "");
    return doubtsAbout(alignment);
  };
  const AudioClip quiet = test::inHiss(saidBy("flite:kal16", "he usually walks the dog before breakfast"), 60);
  const char* changed = "he usually walks the cat before breakfast";
  EXPECT_EQ(doubts(quiet, changed, none), "");
  EXPECT_NE(doubts(quiet, changed, network).find("cat"), std::string::npos);
  const char* said = "please leave the keys on the kitchen table";
  const AudioClip noisy = test::inHiss(saidBy("flite:kal16", said), 5);
  EXPECT_NE(doubts(noisy, said, none), "");
  EXPECT_EQ(doubts(noisy, said, network), "");
  // What the text lacks is heard, though what it has is likely.
  const char* planks = "the birch canoe slid on the smooth planks";
  const AudioClip hissing = test::inHiss(saidBy("flite:kal16", planks), 10);
  EXPECT_EQ(doubts(hissing, planks, network), "");
  EXPECT_EQ(doubts(hissing, planks + 10, none), "");
  EXPECT_NE(doubts(hissing, planks + 10, network).find("canoe"), std::string::npos);
  // Where it hears next to nothing it is unsure of what it hears, which speaks for no text.
  const char* longer = "the quick brown fox jumps over seven lazy elephants in amsterdam";
  for (const double snr_db : {10, 5, 0, -3}) {
    for (const char* voice : {"flite:kal16", "flite:rms"}) {
      const AudioClip sound = test::inHiss(saidBy(voice, said), snr_db);
      EXPECT_EQ(doubts(sound, said, network), "") << voice << " at " << snr_db << " dB";
      EXPECT_NE(doubts(sound, longer, network), "") << voice << " at " << snr_db << " dB";
    }
  }
}

class BrokenNetwork : public testing::Test {
 protected:
  /// A program whose first answer is `line`, whatever it is asked.
  static std::string answering(const std::string& line) {
    return "import { writeSync } from 'node:fs'; writeSync(3, '" + line + "\\n'); process.stdin.resume();";
  }
  /// A folder with a program of these lines.
  [[nodiscard]] fs::path networkOf(const char* script) const {
    std::ofstream(folder_.path() / "hear_words.mjs") << script;
    return folder_.path();
  }

 private:
  PrivateFolder folder_;
};

TEST_F(BrokenNetwork, SaysWhatIsWrong) {
  const std::vector<std::int16_t> samples(1600);
  const std::vector<std::span<const std::int16_t>> sounds{samples};
  const auto errorBy = [&](const char* script) {
    return errorOf([&] { WordNetwork(networkOf(script)).hear(sounds); });
  };
  EXPECT_EQ(errorBy("console.error('no\\nmemory'); process.exit(3);"), "hear_words.mjs: failed: no\\x0Amemory\\x0A");
  EXPECT_EQ(errorBy("process.exit(0);"), "hear_words.mjs: failed: ");
  for (const char* answer : {"[1", "[{}]", "[{\"text\":3,\"log_probability\":-1}]", "[]\\n[]"})
    EXPECT_TRUE(errorBy(answering(answer).c_str()).starts_with("hear_words.mjs")) << answer;
}

TEST_F(BrokenNetwork, LeavesTheDoubtAsItWas) {
  const AudioClip sound = test::inHiss(saidBy("flite:kal16", "the birch canoe slid on the smooth planks"), 60);
  ForcedAlignment alignment =
      ForcedAligner().align(sound, Pronouncer().wordsOf("measure every garage before you buy"), "line");
  const std::vector<double> before = alignment.line_confidence;
  WordNetwork network(networkOf("process.exit(3);"));
  EXPECT_TRUE(judgeByNetwork(network, Pronouncer(), SamplesToHear(sound), alignment)
                  .starts_with("the network that hears words was not heard (hear_words.mjs: failed"));
  EXPECT_EQ(alignment.line_confidence, before);
}

/// Its start takes three times what the alignment does.
TEST_F(BrokenNetwork, IsNotAskedWhereTheAlignmentIsSure) {
  const char* said = "the birch canoe slid on the smooth planks";
  const AudioClip sound = test::inHiss(saidBy("flite:kal16", said), 60);
  WordNetwork network(networkOf("process.exit(3);"));
  const auto faultWith = [&](const char* text) {
    ForcedAlignment alignment = ForcedAligner().align(sound, Pronouncer().wordsOf(text), "line");
    return judgeByNetwork(network, Pronouncer(), SamplesToHear(sound), alignment);
  };
  EXPECT_EQ(faultWith(said), "");
  EXPECT_NE(faultWith("the birch canoe slid in the smooth planks"), "") << "one word is another";
}

TEST_F(BrokenNetwork, LeavesTheWordsToPocketSphinx) {
  const auto samples = saidBy("flite:kal16", "the birch canoe slid on the smooth planks");
  const AudioClip sound = test::inHiss(samples, 60);
  const auto hear = [&](const fs::path& network) {
    return makeRecogniser({.as = HearAs::kAuto, .hint = {}, .word_network = std::make_shared<WordNetwork>(network)})
        ->hear(sound, "line");
  };
  const HeardSpeech heard = hear(networkOf("process.exit(3);"));
  EXPECT_EQ(heard.text, hear({}).text);
  ASSERT_FALSE(heard.warnings.empty());
  EXPECT_TRUE(heard.warnings[0].starts_with("the network that hears words was not heard (hear_words.mjs: failed"))
      << heard.warnings[0];
}

/// Words that nobody said and of which the network is not sure are not taken, but PocketSphinx' are.
TEST_F(BrokenNetwork, HeardSomethingElse) {
  const AudioClip sound = test::inHiss(saidBy("flite:kal16", "the birch canoe slid on the smooth planks"), 60);
  const auto hear = [&](const fs::path& network) {
    return makeRecogniser({.as = HearAs::kAuto, .hint = {}, .word_network = std::make_shared<WordNetwork>(network)})
        ->hear(sound, "line")
        .text;
  };
  const char* says_goodbye = R"(import { readSync, writeSync } from 'node:fs';
    const read = (count) => { const bytes = Buffer.alloc(count); let at = 0;
      while (at < count) at += readSync(0, bytes, at, count - at) || process.exit(0); return bytes; };
    for (;;) { read(2 * read(8).readUInt32LE(0)); writeSync(3, '[{"text":"goodbye","log_probability":-5}]\n'); })";
  EXPECT_EQ(hear(networkOf(says_goodbye)), hear({}));
}

/// Tokens of bytes: the first is no character yet, the second makes it one, of which a half is new.
TEST_F(BrokenNetwork, TellsNoHalfOfACharacter) {
  const fs::path folder = networkOf("");
  const fs::path runtime = folder / "node_modules" / "onnxruntime-node";
  fs::create_directories(runtime);
  std::ofstream(folder / "word_pieces.txt") << "";
  std::ofstream(folder / "word_pieces.mjs")
      << R"(const texts = ['', '\ufffd', '\u{1F600}', '\u{1F600} go']; export class WordPieces { decode(ids) { return texts[ids.length]; } })";
  std::ofstream(runtime / "package.json") << R"({"type":"module","main":"index.js"})";
  std::ofstream(runtime / "index.js") << R"(export class Tensor {}
    let asked = 0; const tokens = [3, 4, 5, 2];
    const run = async () => ({ logits: { data: Float32Array.from({ length: 6 }, (_, i) => (i === tokens[asked] ? 9 : 0)) } });
    export const InferenceSession = { create: async (file) => ({
      run: async () => file.includes('encoder') ? {} : run().then((made) => (++asked, made)) }) };)";
  fs::copy_file(MOUTHPIECE_SOURCE_DIR "/src/hearing/network/hear_words.mjs", folder / "hear_words.mjs",
                fs::copy_options::overwrite_existing);
  const std::vector<std::int16_t> samples(16000);
  const std::vector<std::span<const std::int16_t>> sounds{samples};
  const auto words = WordNetwork(folder).hear(sounds).front();
  ASSERT_EQ(words.size(), 2U);
  EXPECT_EQ(words[1].text, "go");
}

/// What a network makes of wind that rises for half a second is said by nobody.
TEST_F(BrokenNetwork, HearsNobodyInAGust) {
  const fs::path network = networkOf(answering("[{\"text\":\"you\",\"log_probability\":-0.2}]").c_str());
  const auto recogniser =
      makeRecogniser({.as = HearAs::kAuto, .hint = {}, .word_network = std::make_shared<WordNetwork>(network)});
  EXPECT_EQ(errorOf([&] { recogniser->hear(test::gust(), "wind.wav"); }),
            "wind.wav: holds no speech that can be heard; expected speech");
}

/// A program that answers with its number.
constexpr const char* kTellsItsNumber =
    "import { readSync, writeSync } from 'node:fs';"
    "const read = (count) => { const bytes = Buffer.alloc(count); let at = 0;"
    "  while (at < count) at += readSync(0, bytes, at, count - at) || process.exit(0); return bytes; };"
    "for (;;) { const count = read(8).readUInt32LE(0); read(2 * count); if (count > 16000) process.exit(3);"
    "  writeSync(3, JSON.stringify([{ text: String(process.pid), log_probability: -1 }]) + '\\n'); }";

/// The program goes on from recording to recording, and another one takes its place when it has failed.
TEST_F(BrokenNetwork, IsStartedOnceUntilItFails) {
  const std::vector<std::int16_t> second(16000), long_one(160000);
  const std::vector<std::span<const std::int16_t>> sounds{second}, too_much{long_one};
  WordNetwork network(networkOf(kTellsItsNumber));
  const std::string first = network.hear(sounds).at(0).at(0).text;
  EXPECT_EQ(network.hear(sounds).at(0).at(0).text, first);
  EXPECT_EQ(errorOf([&] { network.hear(too_much); }), "hear_words.mjs: failed: ");
  EXPECT_NE(network.hear(sounds).at(0).at(0).text, first);
}

TEST_F(BrokenNetwork, IsEndedWhereNobodyAsks) {
  const std::vector<std::int16_t> second(16000);
  const std::vector<std::span<const std::int16_t>> sounds{second};
  WordNetwork network(networkOf(kTellsItsNumber));
  network.endWaiting();
  const std::string first = network.hear(sounds).at(0).at(0).text;
  EXPECT_TRUE(fs::exists("/proc/" + first));
  network.endWaiting();
  EXPECT_FALSE(fs::exists("/proc/" + first));
  EXPECT_NE(network.hear(sounds).at(0).at(0).text, first);
}

TEST(WordNetwork, IsNotThereWithoutItsProgramOrNode) {
  EXPECT_FALSE(WordNetwork({}).isThere());
  EXPECT_FALSE(WordNetwork("/nowhere").isThere());
}

}  // namespace
}  // namespace mouthpiece
