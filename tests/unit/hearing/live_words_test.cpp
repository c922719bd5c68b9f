#include "hearing/live/live_words.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <thread>

#include "base/child_process.h"
#include "base/index.h"
#include "hearing/alignment/phone_ear.h"
#include "hearing/live/live_ear.h"
#include "support/gust.h"
#include "support/heard_share.h"
#include "voices/voice.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;
using test::heardShare;

constexpr Seconds kAhead = 1;
/// What is heard then comes by the clock of the sound, however busy the machine is.
constexpr std::chrono::minutes kAsLongAsItTakes{1};

struct HeardOn {
  std::vector<PhoneSegment> phones;
  std::size_t missed = 0;
};

/// What an ear hears, with words of the network in `folder`, if any, each waited for as LiveWords waits by `latest`.
HeardOn heardOn(const AudioClip& audio, const fs::path& folder = {},
                std::chrono::milliseconds latest = std::chrono::seconds(1)) {
  std::optional<LiveWords> words;
  if (!folder.empty()) words.emplace(std::make_shared<WordNetwork>(folder), nullptr, english(), latest);
  LiveEar ear(english(), {}, kAhead, std::move(words));
  std::vector<std::int16_t> samples = samplesToHear(audio);
  samples.resize((samples.size() / LiveEar::kHop + 40) * LiveEar::kHop);
  HeardOn heard;
  for (std::size_t at = 0; at < samples.size(); at += LiveEar::kHop) {
    for (const PhoneSegment& phone : ear.hear(std::span(samples).subspan(at, LiveEar::kHop)))
      heard.phones.push_back(phone);
  }
  heard.missed = ear.missedWords();
  return heard;
}

bool isTheSame(const HeardOn& a, const HeardOn& b) {
  return std::equal(a.phones.begin(), a.phones.end(), b.phones.begin(), b.phones.end(),
                    [](const PhoneSegment& x, const PhoneSegment& y) {
                      return x.phone == y.phone && x.span.start == y.span.start && x.span.end == y.span.end;
                    });
}

const SpokenLine& line() {
  static const SpokenLine said = makeVoice("flite:slt")->speak("there is nothing good on television");
  return said;
}

const HeardOn& phonesAlone() {
  static const HeardOn heard = heardOn(line().audio);
  return heard;
}

TEST(LiveWords, TellWhatIsSaidBetterThanPhonesDo) {
  constexpr double kBetter = 0.05;
  const fs::path network = fs::path(MOUTHPIECE_BUILD_SHARE_DIR) / "word_network";
#if defined(__x86_64__)
  ASSERT_TRUE(WordNetwork(network).isThere()) << "`make build` brings " << network;
#else
  if (!WordNetwork(network).isThere()) GTEST_SKIP() << "ONNX Runtime is not packed for this processor";
#endif
  const HeardOn by_words = heardOn(line().audio, network, kAsLongAsItTakes);
  EXPECT_GT(heardShare(by_words.phones, line().labels), heardShare(phonesAlone().phones, line().labels) + kBetter);
  EXPECT_EQ(by_words.missed, 0U);
}

class BrokenLiveWords : public testing::Test {
 protected:
  [[nodiscard]] fs::path networkOf(const char* script) const {
    std::ofstream(folder_.path() / "hear_words.mjs") << script;
    return folder_.path();
  }

 private:
  PrivateFolder folder_;
};

TEST_F(BrokenLiveWords, ThatDieAreCountedAndLeavePhones) {
  const HeardOn heard = heardOn(line().audio, networkOf("process.exit(3);"));
  EXPECT_TRUE(isTheSame(heard, phonesAlone()));
  EXPECT_EQ(heard.missed, 3U);
}

/// A network whose first hearing takes 1.6 s, and sound that comes at once, so that all of it is waited for.
TEST_F(BrokenLiveWords, AreWaitedForAsLongAsIsAsked) {
  const fs::path slow = networkOf(
      "import { readSync, writeSync } from 'node:fs';"
      "const read = (count) => { const bytes = Buffer.alloc(count); let at = 0;"
      "  while (at < count) at += readSync(0, bytes, at, count - at) || process.exit(0); return bytes; };"
      "for (let i = 0;; ++i) { const count = read(8).readUInt32LE(0); read(2 * count);"
      "  if (i === 1) Atomics.wait(new Int32Array(new SharedArrayBuffer(4)), 0, 0, 1600);"
      "  writeSync(3, '[]\\n'); }");
  EXPECT_GE(heardOn(line().audio, slow).missed, 1U);
  EXPECT_EQ(heardOn(line().audio, slow, kAsLongAsItTakes).missed, 0U);
}

TEST_F(BrokenLiveWords, AreTriedAgainAfterAMinute) {
  constexpr std::size_t kNearlyAMinute = 1400;
  LiveWords words(std::make_shared<WordNetwork>(networkOf("process.exit(3);")), nullptr, english());
  const std::vector<std::int16_t> hop(LiveWords::kHop);
  // A program's end takes its time to be noticed, in which nothing is asked.
  const auto hearUntilMissed = [&](std::size_t missed) {
    for (int i = 0; i < 2000 && words.missed() < missed; ++i) {
      words.hear(hop, true);
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return words.missed();
  };
  ASSERT_EQ(hearUntilMissed(3), 3U);
  std::this_thread::sleep_for(std::chrono::seconds(2));
  for (std::size_t i = 0; i < kNearlyAMinute; ++i) words.hear(hop, true);
  EXPECT_EQ(words.missed(), 3U);
  EXPECT_EQ(hearUntilMissed(4), 4U);
}

/// It starts, and answers nothing more.
TEST_F(BrokenLiveWords, ThatHangAreWaitedForOnce) {
  constexpr std::chrono::seconds kAtMost{20};
  const auto began = std::chrono::steady_clock::now();
  const HeardOn heard =
      heardOn(line().audio,
              networkOf("import { writeSync } from 'node:fs'; writeSync(3, '[]\\n'); setInterval(() => {}, 1000);"));
  EXPECT_LT(std::chrono::steady_clock::now() - began, kAtMost);  // the network itself is given a minute
  EXPECT_TRUE(isTheSame(heard, phonesAlone()));
  EXPECT_EQ(heard.missed, 1U);
}

/// Answers to all sounds with the same word.
constexpr const char* kHearsYou =
    "import { readSync, writeSync } from 'node:fs';"
    "const read = (count) => { const bytes = Buffer.alloc(count); let at = 0;"
    "  while (at < count) at += readSync(0, bytes, at, count - at) || process.exit(0); return bytes; };"
    "for (;;) { const count = read(8).readUInt32LE(0); read(2 * count);"
    "  writeSync(3, count > 0 ? '[{\"text\":\"you\",\"log_probability\":-0.2}]\\n' : '[]\\n'); }";

/// What a network makes of wind that rises for half a second moves no lips.
TEST_F(BrokenLiveWords, AreNotHeardInAGust) {
  const HeardOn heard = heardOn(test::gust(), networkOf(kHearsYou));
  EXPECT_TRUE(isTheSame(heard, heardOn(test::gust())));
  EXPECT_EQ(heard.missed, 0U);
}

TEST(LiveEar, HearsNobodyInAGust) {
  for (const PhoneSegment& phone : heardOn(test::gust()).phones)
    EXPECT_EQ(phone.phone, Phone::kSil) << phone.span.start;
}

/// Sound that waited comes at once: a second of it is gone before a hearing can be there.
TEST_F(BrokenLiveWords, AreNotTooLateWhileSoundCatchesUp) {
  constexpr std::size_t kSecondAndMore = 60;
  LiveWords words(
      std::make_shared<WordNetwork>(
          networkOf("import { readSync, writeSync } from 'node:fs';"
                    "const read = (count) => { const bytes = Buffer.alloc(count); let at = 0;"
                    "  while (at < count) at += readSync(0, bytes, at, count - at) || process.exit(0); return bytes; };"
                    "for (;;) { const count = read(8).readUInt32LE(0); read(2 * count);"
                    "  if (count > 0) Atomics.wait(new Int32Array(new SharedArrayBuffer(4)), 0, 0, 300);"
                    "  writeSync(3, '[]\\n'); }")),
      nullptr, english());
  const std::vector<std::int16_t> hop(LiveWords::kHop);
  const auto hear = [&] { return words.hear(hop, true, [] { return false; }).has_value(); };
  for (std::size_t i = 0; i < kSecondAndMore; ++i) EXPECT_FALSE(hear());
  std::this_thread::sleep_for(std::chrono::milliseconds(600));
  EXPECT_TRUE(hear());
  EXPECT_EQ(words.missed(), 0U);
}

}  // namespace
}  // namespace mouthpiece
