// The front door as a program uses it, with the sample corpus and the default face.
#include "mouthpiece/speaker.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "support/error_of.h"
#include "support/run_program.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;
const fs::path kShare = MOUTHPIECE_BUILD_SHARE_DIR;

class Front : public testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(kShare / "default.face")) GTEST_SKIP() << "no sample corpus in " << kShare << ": run `make data`";
  }
  static SpeakerOptions sample(bool with_face = false) {
    SpeakerOptions options;
    options.corpus = kShare / "sample.corpus";
    options.face = kShare / "default.face";
    options.with_face = with_face;
    return options;
  }
  /// All that a performance is made of, as bytes.
  std::string bytesOf(const Performance& line, const std::string& name) {
    std::string bytes;
    for (const char* ending : {".c3d", ".wav", ".TextGrid", ".curves.json", ".arkit.csv", ".glb"}) {
      if (formatOf("x" + std::string(ending)).needs_face && !line.hasFace()) continue;
      const fs::path file = scratch_.path() / (name + ending);
      save(line, file);
      bytes += test::readAll(file);
    }
    return bytes;
  }
  test::ScratchFolder scratch_;
};

TEST_F(Front, ALineHasSoundLabelsAndMotionOnOneClock) {
  Speaker speaker(sample());
  const Performance line = speaker.perform("the time is now");
  EXPECT_EQ(line.text(), "the time is now");
  EXPECT_FALSE(line.hasFace());
  EXPECT_EQ(line.labels().words.size(), 4U);
  EXPECT_EQ(line.labels().phones.front().phone, "sil");
  for (std::size_t i = 1; i < line.labels().phones.size(); ++i)
    EXPECT_DOUBLE_EQ(line.labels().phones[i].span.start, line.labels().phones[i - 1].span.end);
  EXPECT_EQ(line.motion().frameCount(), line.frameCount());
  EXPECT_NEAR(line.duration() * line.frameRateHz(), static_cast<double>(line.frameCount()), 1e-6);
  EXPECT_NEAR(line.sound().duration(), line.duration(), 0.05);
  EXPECT_EQ(line.units().front().first, 0U);
  EXPECT_EQ(line.units().back().last, line.labels().phones.size() - 1);
  EXPECT_TRUE(std::all_of(line.motion().positions_mm.begin(), line.motion().positions_mm.end(),
                          [](double x) { return std::isfinite(x); }));
}

TEST_F(Front, FramesAreThoseOfTheMotion) {
  Speaker speaker(sample(true));
  FrameStream stream = speaker.stream("now");
  const Performance line = stream.performance();
  std::size_t count = 0;
  for (const Frame& frame : stream) {
    EXPECT_EQ(frame.index, count);
    EXPECT_NEAR(frame.time, static_cast<double>(count) / line.frameRateHz(), 1e-12);
    EXPECT_TRUE(std::ranges::equal(frame.markers_mm, line.motion().frame(count)));
    EXPECT_TRUE(std::ranges::all_of(frame.arkit, [](float w) { return w >= 0 && w <= 1; }));
    if (count % 20 == 0) {
      EXPECT_TRUE(std::ranges::equal(frame.vertices, line.vertices(count)));
    }
    ++count;
  }
  EXPECT_EQ(count, line.frameCount());
  EXPECT_EQ(stream.next(), nullptr) << "and it stays at its end";
}

TEST_F(Front, ArkitOpensTheJawInVowelsAndNotInSilence) {
  Speaker speaker(sample());
  const Performance line = speaker.perform("the time is now");
  std::size_t jaw = 0;
  while (arkitName(jaw) != "JawOpen") ++jaw;
  float widest = 0;
  for (std::size_t frame = 0; frame < line.frameCount(); ++frame)
    widest = std::max(widest, line.arkitWeights(frame)[jaw]);
  EXPECT_GT(widest, 0.1F);
  EXPECT_LT(line.arkitWeights(line.frameCount() - 1)[jaw], 0.1F * widest) << "at rest";
}

TEST_F(Front, TwoSpeakersInTwoThreadsGiveTheSameBytesAsOneAfterTheOther) {
  const SharedCorpus corpus(kShare / "sample.corpus");
  const SharedFace face(kShare / "default.face");
  const std::vector<std::string> texts{"the time is now", "seven lazy foxes jumped over my garden wall"};
  const auto speak = [&](std::size_t i, const std::string& name) {
    Speaker speaker(corpus, face, sample(true));
    return bytesOf(speaker.perform(texts[i]), name);
  };
  std::vector<std::string> alone{speak(0, "a"), speak(1, "b")}, together(2);
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < 2; ++i) threads.emplace_back([&, i] { together[i] = speak(i, "t" + std::to_string(i)); });
  for (std::thread& thread : threads) thread.join();
  EXPECT_TRUE(alone == together) << "bytes differ between threads";
  EXPECT_FALSE(alone[0] == alone[1]);
}

TEST_F(Front, APerformanceMayBeReadByManyThreads) {
  Speaker speaker(sample(true));
  const Performance line = speaker.perform("now");
  std::vector<std::vector<float>> seen(3);
  std::vector<std::thread> threads;
  for (auto& own : seen)
    threads.emplace_back([&own, line] {
      own = line.vertices(line.frameCount() / 2);
      const auto weights = line.arkitWeights(1);
      own.insert(own.end(), weights.begin(), weights.end());
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(seen[0], seen[1]);
  EXPECT_EQ(seen[0], seen[2]);
}

TEST_F(Front, IsAsTheProgramIs) {
  Speaker speaker(sample());
  const Performance line = speaker.perform("the time is now");
  const fs::path ours = scratch_.path() / "ours.c3d", theirs = scratch_.path() / "theirs.c3d";
  save(line, ours);
  std::vector<std::string> arguments{"--text", "the time is now", "-o", theirs.string(), "--quiet"};
  ASSERT_EQ(test::runProgram("synth", arguments).exit_code, 0);
  EXPECT_TRUE(test::readAll(ours) == test::readAll(theirs)) << "the library's defaults are not the program's";
  fs::remove(theirs);
  arguments.insert(arguments.end(), {"--corpus", "sample"});
  ASSERT_EQ(test::runProgram("synth", arguments).exit_code, 0);
  EXPECT_TRUE(test::readAll(ours) == test::readAll(theirs)) << "the sample corpus has a name, too";
}

/// Words are recognised in US English alone; a recording in another language is heard by its phones.
TEST_F(Front, ARecordingInAnotherLanguageIsHeardByPhones) {
  SpeakerOptions options = sample();
  options.language = "de";
  Speaker german(options);
  const fs::path wav = scratch_.path() / "german.wav";
  save(german.perform("Guten Morgen, wir haben Hunger."), wav);
  const Performance heard = german.perform(Line::heard(wav, ""));
  EXPECT_TRUE(heard.labels().words.empty());
  EXPECT_GT(heard.labels().phones.size(), 8U);
  options.hear = SpeakerOptions::Hear::kWords;
  EXPECT_NE(errorOf([&] { Speaker(options).perform(Line::heard(wav, "")); }).find("no words of German"),
            std::string::npos);
}

/// Words that another program has heard are German ones, and a TextGrid of words alone is labels without their phones.
TEST_F(Front, ToldWordsOfAnotherLanguageHaveItsPhones) {
  SpeakerOptions options = sample();
  options.language = "de";
  Speaker german(options);
  const fs::path wav = scratch_.path() / "german.wav", words = scratch_.path() / "words.TextGrid";
  const Performance said = german.perform("Ich möchte heute schöne Bücher kaufen");
  save(said, wav);
  std::string tier;
  for (const WordLabel& word : said.labels().words)
    tier += fmt::format("{} {} \"{}\"\n", word.span.start, word.span.end, word.text);
  std::ofstream(words) << fmt::format(
      "File type = \"ooTextFile\"\nObject class = \"TextGrid\"\n0 {0} <exists> 1\n\"IntervalTier\" \"words\" 0 {0} "
      "{1}\n{2}",
      said.duration(), said.labels().words.size(), tier);
  const auto phonesOf = [&](const Performance& line) {  // as the language writes them
    save(line, scratch_.path() / "line.TextGrid");
    std::istringstream rows(test::readAll(scratch_.path() / "line.TextGrid"));
    std::string phones, row;
    bool is_tier = false;
    while (std::getline(rows, row)) {
      if (row.find("name = ") != std::string::npos) is_tier = row.find("\"phones\"") != std::string::npos;
      if (is_tier && row.find("text = ") != std::string::npos) phones += row.substr(row.find('"'));
    }
    return phones;
  };
  const Performance timed = german.perform(Line::timed(wav, words)),
                    labelled = german.perform(Line::labelled(wav, words));
  EXPECT_NE(phonesOf(said).find("øː"), std::string::npos);
  EXPECT_EQ(phonesOf(timed), phonesOf(said));
  EXPECT_EQ(phonesOf(labelled), phonesOf(said));
  EXPECT_TRUE(std::ranges::any_of(labelled.warnings(), [](const std::string& warning) {
    return warning.find("has words without phones: these are found in the sound") != std::string::npos;
  }));
}

/// The corpus knows where these words begin and which syllables are stressed.
TEST_F(Front, PhonesWithoutWordsMoveTheMouthAsWithThem) {
  Speaker speaker(sample());
  for (const char* text : {"the time is now", "good morning"}) {
    const Performance said = speaker.perform(text);
    const fs::path wav = scratch_.path() / "said.wav", words = scratch_.path() / "said.TextGrid";
    save(said, wav);
    save(said, words);
    std::string rows;
    for (const PhoneLabel& phone : said.labels().phones)
      rows += fmt::format("{} {} {}\n", phone.span.start, phone.span.end, phone.phone);
    const fs::path phones = scratch_.path() / "said.txt";
    std::ofstream(phones) << rows;
    const Performance with = speaker.perform(Line::labelled(wav, words));
    const Performance without = speaker.perform(Line::labelled(wav, phones));
    EXPECT_EQ(with.motion().positions_mm, without.motion().positions_mm) << text;
    EXPECT_TRUE(without.labels().words.empty());
    EXPECT_TRUE(without.guesses().empty());
  }
}

TEST_F(Front, TheReportComesLastAndTellsOfTheOthers) {
  Speaker speaker(sample(true));
  const Performance line = speaker.perform("now");
  const std::vector<fs::path> files = usualFiles(scratch_.path() / "out");
  save(line, files);
  for (const fs::path& file : files) EXPECT_TRUE(fs::exists(file)) << file;
  const auto report = nlohmann::json::parse(test::readAll(scratch_.path() / "out" / "report.json"));
  EXPECT_GT(report.at("timing_ms").at("deform").get<double>(), 0);
  EXPECT_GT(report.at("timing_ms").at("write").get<double>(), 0);
  EXPECT_GT(line.realTimeFactor(), 0);
}

TEST_F(Front, WhatCannotBeIsRefusedInOneLine) {
  const auto refusal = [](const auto& work) -> std::string {
    try {
      work();
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  const auto with = [&](const auto& change) {
    return refusal([&] {
      SpeakerOptions options = sample();
      change(options);
      Speaker speaker(options);
      speaker.perform("now");
    });
  };
  EXPECT_NE(with([](SpeakerOptions& o) { o.manner.frame_rate_hz = std::nan(""); }).find("23.976 to 240"),
            std::string::npos);
  EXPECT_NE(with([](SpeakerOptions& o) { o.manner.overlap_ms = -1; }).find("0 to 1000"), std::string::npos);
  EXPECT_NE(with([](SpeakerOptions& o) { o.rate = 1; }).find("corpus"), std::string::npos);
  EXPECT_NE(with([](SpeakerOptions& o) { o.voice = "nobody"; }).find("nobody"), std::string::npos);
  EXPECT_NE(with([](SpeakerOptions& o) { o.corpus = "/nowhere/x.corpus"; }).find("/nowhere/x.corpus"),
            std::string::npos);
  EXPECT_NE(with([](SpeakerOptions& o) { o.manner.ma.constant = 2; }).find("Ma"), std::string::npos);
  Speaker speaker(sample());
  const Performance line = speaker.perform("now");
  EXPECT_NE(refusal([&] { static_cast<void>(line.vertices(0)); }).find("no face"), std::string::npos);
  EXPECT_NE(refusal([&] { static_cast<void>(line.arkitWeights(line.frameCount())); }).find("frame"), std::string::npos);
  EXPECT_NE(refusal([&] { save(line, scratch_.path() / "a.glb"); }).find("no face"), std::string::npos);
  EXPECT_FALSE(fs::exists(scratch_.path() / "a.glb"));
  EXPECT_FALSE(refusal([&] { speaker.perform(" ... "); }).empty());
  EXPECT_EQ(refusal([&] { speaker.perform("now"); }), "") << "a refused line leaves the speaker usable";
}

}  // namespace
}  // namespace mouthpiece
