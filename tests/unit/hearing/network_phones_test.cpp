#include "hearing/recognition/network_phones.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <vector>

#include "base/child_process.h"
#include "base/errors.h"
#include "base/index.h"
#include "hearing/alignment/phone_ear.h"
#include "hearing/recognition/live_ear.h"
#include "hearing/recognition/recogniser.h"
#include "hearing/recognition/word_network.h"
#include "support/error_of.h"
#include "support/gust.h"
#include "support/heard_share.h"
#include "support/hiss.h"
#include "voices/voice.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;
using test::heardShare;

constexpr Seconds kAhead = 0.2;

std::shared_ptr<WordNetwork> shipped() {
  static const auto network = std::make_shared<WordNetwork>(fs::path(MOUTHPIECE_BUILD_SHARE_DIR) / "word_network");
  return network;
}

class NetworkPhones : public testing::Test {
 protected:
  void SetUp() override {
#if defined(__x86_64__)
    ASSERT_TRUE(shipped()->isThere()) << "`make build` brings it";
#else
    if (!shipped()->isThere()) GTEST_SKIP() << "ONNX Runtime is not packed for this processor";
#endif
  }
};

/// Nobody's voice that taught it.
const SpokenLine& line() {
  static const SpokenLine said = makeVoice("flite:rms")->speak("please bring my mother five big paper boxes");
  return said;
}

std::vector<PhoneSegment> heardOn(const AudioClip& audio, std::shared_ptr<WordNetwork> network) {
  std::optional<LivePhones> phones;
  if (network) phones.emplace(std::move(network));
  LiveEar ear(english(), {}, kAhead, std::nullopt, std::move(phones));
  std::vector<std::int16_t> samples = samplesToHear(audio);
  samples.resize((samples.size() / LiveEar::kHop + 40) * LiveEar::kHop);
  std::vector<PhoneSegment> heard;
  for (std::size_t at = 0; at < samples.size(); at += LiveEar::kHop) {
    for (const PhoneSegment& phone : ear.hear(std::span(samples).subspan(at, LiveEar::kHop))) heard.push_back(phone);
  }
  return heard;
}

TEST_F(NetworkPhones, AreHeardInAStrangersRecording) {
  constexpr double kRight = 0.7;
  const std::vector<std::int16_t> samples = samplesToHear(line().audio);
  const Eigen::MatrixXf phones = phonesOfEncoded(shipped()->encode(samples));
  EXPECT_EQ(phones.rows(), signedIndex(kPhoneCount));
  EXPECT_NEAR(asReal(phones.cols()) * WordNetwork::kEncodedStep, line().audio.duration(), 0.1);
  EXPECT_TRUE(phones.colwise().sum().isOnes(1e-4F));
  double right = 0, said = 0;
  for (const LabelledPhone& phone : line().labels.phones) {
    if (phone.phone == Phone::kSil) continue;
    const auto frame = static_cast<Eigen::Index>(phone.span.middle() / WordNetwork::kEncodedStep);
    Eigen::Index best = 0;
    phones.col(frame).maxCoeff(&best);
    right += best == static_cast<Eigen::Index>(phone.phone) ? 1 : 0;
    ++said;
  }
  EXPECT_GT(right / said, kRight);
}

/// The mean over lines in noise of how much of them is heard.
double heardInNoise(const std::function<std::vector<PhoneSegment>(const AudioClip&)>& hear) {
  constexpr double kSnrDb = 20;
  static const std::vector<SpokenLine> lines = [] {
    const auto voice = makeVoice("flite:kal16");
    return std::vector{voice->speak("please bring my mother five big paper boxes"),
                       voice->speak("nobody shall give you permission to copy the work"),
                       voice->speak("we moved the blue map above the pump")};
  }();
  double share = 0;
  for (const SpokenLine& said : lines)
    share += heardShare(hear(test::inHiss(samplesToHear(said.audio), kSnrDb)), said.labels) / asReal(lines.size());
  return share;
}

TEST_F(NetworkPhones, TellAStreamMoreThanItsEarDoes) {
  constexpr double kBetter = 0.05;
  EXPECT_GT(heardInNoise([](const AudioClip& audio) { return heardOn(audio, shipped()); }),
            heardInNoise([](const AudioClip& audio) { return heardOn(audio, nullptr); }) + kBetter);
}

TEST_F(NetworkPhones, TellAFileMoreThanItsEarDoes) {
  constexpr double kBetter = 0.05;
  RecogniserOptions options{.as = HearAs::kPhones};
  const auto hear = [&](const AudioClip& audio) {
    std::vector<PhoneSegment> heard;
    for (const LabelledPhone& phone : makeRecogniser(options)->hear(audio, "line").labels.phones)
      heard.push_back({.phone = phone.phone, .span = phone.span});
    return heard;
  };
  const double without = heardInNoise(hear);
  options.word_network = shipped();
  EXPECT_GT(heardInNoise(hear), without + kBetter);
}

TEST_F(NetworkPhones, HearNothingInAGust) {
  for (const PhoneSegment& phone : heardOn(test::gust(), shipped())) EXPECT_EQ(phone.phone, Phone::kSil);
}

TEST_F(NetworkPhones, AreNoneOfNothing) {
  const std::vector<std::int16_t> sound(1000);
  EXPECT_EQ(shipped()->encode(sound).cols(), 0);
}

TEST(NetworkPhonesAtFrames, AreBetweenThoseAroundThem) {
  Eigen::MatrixXf phones(1, 3);
  phones << 0, 1, 3;
  // The ear's frame 1 has its middle at 23 ms, 11 ms after that of the first column; frame 9 lies behind the last.
  const Eigen::MatrixXf at = atFramesOfEar(phones, 0, 1, 9);
  EXPECT_NEAR(at(0, 0), 11.0 / 24, 1e-5);
  EXPECT_FLOAT_EQ(at(0, 8), 3);
  EXPECT_NEAR(atFramesOfEar(phones, 0.010, 2, 1)(0, 0), 11.0 / 24, 1e-5);
}

class BrokenNetworkPhones : public testing::Test {
 protected:
  [[nodiscard]] std::shared_ptr<WordNetwork> networkOf(const std::string& script) const {
    std::ofstream(folder_.path() / "hear_words.mjs") << script;
    return std::make_shared<WordNetwork>(folder_.path());
  }
  /// Frames of nothing but zeros, one for each 384 samples; `then` is done before the answer of number `i`. It does not
  /// start where there is a file `failed`.
  static std::string answeringZeros(const std::string& then) {
    return "import { existsSync, readSync, writeFileSync, writeSync } from 'node:fs';"
           "const failed = process.argv[1] + '.failed'; if (existsSync(failed)) process.exit(3);"
           "const read = (count) => { const bytes = Buffer.alloc(count); let at = 0;"
           "  while (at < count) at += readSync(0, bytes, at, count - at) || process.exit(0); return bytes; };"
           "for (let i = 0;; ++i) { const count = read(8).readUInt32LE(0); read(2 * count);" +
           then + "  writeSync(3, '\"' + '0'.repeat(4 * 288 * Math.floor(count / 384)) + '\"\\n'); }";
  }

 private:
  PrivateFolder folder_;
};

bool areTheSame(const std::vector<PhoneSegment>& a, const std::vector<PhoneSegment>& b) {
  return std::ranges::equal(a, b, [](const PhoneSegment& x, const PhoneSegment& y) {
    return x.phone == y.phone && x.span.start == y.span.start && x.span.end == y.span.end;
  });
}

TEST_F(BrokenNetworkPhones, LeaveAllToTheEar) {
  const std::vector<PhoneSegment> by_ear = heardOn(line().audio, nullptr);
  EXPECT_TRUE(areTheSame(heardOn(line().audio, networkOf("process.exit(3);")), by_ear));
}

/// What the ear hears is not heard again while the network hears, so from when that fails it says nearly what it would
/// have said.
TEST_F(BrokenNetworkPhones, LeaveTheRestToTheEarWhenTheyFail) {
  constexpr Seconds kSettled = 1.5;  // three hearings fail, and what is open is settled
  constexpr double kLike = 0.15;
  SpeechLabels rest = line().labels;
  std::erase_if(rest.phones, [](const LabelledPhone& phone) { return phone.span.start < kSettled; });
  const auto network = networkOf(answeringZeros("if (i > 3) { writeFileSync(failed, ''); process.exit(3); }"));
  EXPECT_NEAR(heardShare(heardOn(line().audio, network), rest), heardShare(heardOn(line().audio, nullptr), rest),
              kLike);
}

/// One answer that takes its time is waited for a second, and then no more.
TEST_F(BrokenNetworkPhones, AreNotWaitedForTwice) {
  constexpr std::chrono::seconds kAtMost{15};
  const auto began = std::chrono::steady_clock::now();
  const auto heard = heardOn(
      line().audio,
      networkOf(answeringZeros("if (i > 2) Atomics.wait(new Int32Array(new SharedArrayBuffer(4)), 0, 0, 60000);")));
  EXPECT_LT(std::chrono::steady_clock::now() - began, kAtMost);
  EXPECT_FALSE(heard.empty());
}

TEST_F(BrokenNetworkPhones, SayWhatIsWrong) {
  const std::vector<std::int16_t> sound(16000);
  for (const char* answer : {"[]", "\"00\"", "3", "\"zz\""}) {
    const auto network = networkOf("import { writeSync } from 'node:fs'; writeSync(3, '" + std::string(answer) +
                                   "\\n'); process.stdin.resume();");
    EXPECT_TRUE(errorOf([&] { network->encode(sound); }).starts_with("hear_words.mjs")) << answer;
  }
}

}  // namespace
}  // namespace mouthpiece
