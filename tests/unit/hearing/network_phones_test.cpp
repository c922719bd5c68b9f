#include "hearing/network/network_phones.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "base/child_process.h"
#include "base/errors.h"
#include "base/index.h"
#include "hearing/alignment/forced_alignment.h"
#include "hearing/alignment/phone_ear.h"
#include "hearing/alignment/pronouncer.h"
#include "hearing/live/live_ear.h"
#include "hearing/network/word_network.h"
#include "hearing/recognition/phones_in_words.h"
#include "hearing/recognition/recogniser.h"
#include "hearing/recognition/said_stretches.h"
#include "hearing/recognition/stretch_hearing.h"
#include "phonetics/labels/labels_builder.h"
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
const HeardPhones kUnheard;

class NetworkPhones : public testing::Test {
 protected:
  static std::shared_ptr<WordNetwork> shipped() { return network_; }

  void SetUp() override {
#if !defined(__x86_64__)
    if (!shipped()->isThere()) GTEST_SKIP() << "ONNX Runtime is not packed for this processor";
#endif
    ASSERT_TRUE(shipped()->isThere()) << "`make build` brings it";
  }

 private:
  /// Started once for all of the suite.
  static inline const auto network_ =
      std::make_shared<WordNetwork>(fs::path(MOUTHPIECE_BUILD_SHARE_DIR) / "word_network");
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
  const Eigen::MatrixXf phones = phonesOfEncoded(shipped()->encode(samples), english());
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

TEST_F(NetworkPhones, AreTheSameAfterANoisySound) {
  constexpr double kSnrDb = 5;
  RecogniserOptions options{.as = HearAs::kPhones, .word_network = shipped()};
  const SpokenLine other = makeVoice("flite:kal16")->speak("we moved the blue map above the pump");
  const auto recogniser = makeRecogniser(options);
  recogniser->hear(test::inHiss(samplesToHear(line().audio), kSnrDb), "noisy");
  const SpeechLabels after = recogniser->hear(other.audio, "clean").labels,
                     alone = makeRecogniser(options)->hear(other.audio, "clean").labels;
  EXPECT_TRUE(std::ranges::equal(after.phones, alone.phones, [](const LabelledPhone& a, const LabelledPhone& b) {
    return a.phone == b.phone && a.span.start == b.span.start && a.span.end == b.span.end;
  }));
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

/// Of a sound: one column a frame of 10 ms, a phone in each.
HeardPhones surely(const std::vector<std::pair<Phone, Eigen::Index>>& row) {
  Eigen::Index frames = 0;
  for (const auto& [phone, count] : row) frames += count;
  HeardPhones heard = HeardPhones::Zero(signedIndex(kPhoneCount), frames);
  Eigen::Index first = 0;
  for (const auto& [phone, count] : row) {
    heard.row(static_cast<Eigen::Index>(phone)).segment(first, count).setOnes();
    first += count;
  }
  return heard;
}

TEST(HearUnlikelyWords, LeavesLikelyOnesAndThoseOfWhichNothingIsHeard) {
  const Eigen::MatrixXf likeness = lipLikeness();
  const StretchHearing hearing(
      surely({{Phone::kM, 10}, {Phone::kIY, 10}, {Phone::kP, 10}, {Phone::kAA, 10}, {Phone::kSil, 20}}), likeness);
  SpeechLabels labels = buildSpeechLabels({{.phone = Phone::kB, .span = {0.008, 0.108}, .word = 0},
                                           {.phone = Phone::kAE, .span = {0.108, 0.208}, .word = 0},
                                           {.phone = Phone::kT, .span = {0.208, 0.308}, .word = 1},
                                           {.phone = Phone::kUW, .span = {0.308, 0.408}, .word = 1},
                                           {.phone = Phone::kS, .span = {0.408, 0.608}, .word = 2}},
                                          std::vector<std::string>{"bat", "two", "s"}, 0.7);
  std::vector<double> fits(labels.phones.size(), 0.25);
  hearUnlikelyWords(hearing, {-0.1, 0.1, 3}, labels, fits);
  std::vector<Phone> phones;
  for (const LabelledPhone& phone : labels.phones) {
    if (phone.phone != Phone::kSil) phones.push_back(phone.phone);
  }
  EXPECT_EQ(phones, (std::vector{Phone::kB, Phone::kAE, Phone::kP, Phone::kAA, Phone::kS}));
  ASSERT_EQ(fits.size(), labels.phones.size());
  for (std::size_t i = 0; i < fits.size(); ++i) {
    const bool is_heard = labels.phones[i].word == 1U;
    EXPECT_EQ(fits[i], is_heard ? 1.0 : 0.25) << i;
  }
}

TEST(WithHeardSpeech, HasWhatTheNetworkHearsOutsideOfMusic) {
  // Speech is heard from 0.508 to 2.508 s and, after 0.3 s of silence, to 4.008; a click at 6 s.
  const HeardPhones heard = surely({{Phone::kSil, 50},
                                    {Phone::kAA, 200},
                                    {Phone::kSil, 30},
                                    {Phone::kIY, 120},
                                    {Phone::kSil, 200},
                                    {Phone::kT, 5},
                                    {Phone::kSil, 100}});
  EXPECT_NEAR(heardAsPhones(heard), 3.25, 1e-9);
  const std::vector<SoundStretch> found{{{1.0, 1.5}}, {{1.6, 2.0}}, {{3.0, 3.5}, SoundKind::kMusic}, {{6.5, 6.8}}};
  const std::vector<SoundStretch> all = withHeardSpeech(found, heard);
  ASSERT_EQ(all.size(), 4U);
  EXPECT_NEAR(all[0].span.start, 0.508, 1e-9);
  EXPECT_NEAR(all[0].span.end, 3.0, 1e-9);
  EXPECT_EQ(all[1].kind, SoundKind::kMusic);
  EXPECT_NEAR(all[2].span.start, 3.5, 1e-9);
  EXPECT_NEAR(all[2].span.end, 4.008, 1e-9);
  EXPECT_EQ(all[3].span.start, 6.5);
  EXPECT_EQ(withHeardSpeech(found, {}).size(), found.size());
}

TEST(WithHeardSpeech, HasNoStretchThatIsTooLongToHear) {
  const std::vector<SoundStretch> all = withHeardSpeech({{{1.0, 19.0}}}, surely({{Phone::kAA, 6500}}));
  ASSERT_FALSE(all.empty());
  EXPECT_NEAR(all.back().span.end, 65.008, 1e-9);
  for (const SoundStretch& stretch : all) EXPECT_LE(stretch.span.duration(), kLongestStretch + 1e-9);
  for (std::size_t i = 1; i < all.size(); ++i) EXPECT_NEAR(all[i].span.start, all[i - 1].span.end, 0.02);
}

/// A long sound is heard in parts, of which one begins in this line; others lie wholly within the sound.
TEST_F(NetworkPhones, AreThoseOfTheLineWhereverItIsSaid) {
  constexpr std::size_t kAt = 35 * 16000;
  const std::vector<std::int16_t> samples = samplesToHear(line().audio);
  std::vector<std::int16_t> sound(kAt);
  sound.insert(sound.end(), samples.begin(), samples.end());
  sound.resize(sound.size() + 20 * 16000);
  const HeardPhones alone = hearPhones(*shipped(), samples, english()), late = hearPhones(*shipped(), sound, english());
  EXPECT_EQ(late.cols(), signedIndex((sound.size() + 159) / 160));
  Eigen::Index same = 0;
  for (Eigen::Index frame = 0; frame < alone.cols(); ++frame) {
    Eigen::Index here = 0, there = 0;
    alone.col(frame).maxCoeff(&here);
    late.col(frame + signedIndex(kAt / 160)).maxCoeff(&there);
    same += here == there ? 1 : 0;
  }
  EXPECT_GT(asReal(same), 0.85 * asReal(alone.cols()));
}

/// The mean error of where the phones of a text begin that is said in noise.
TEST_F(NetworkPhones, FindWordsInNoise) {
  constexpr double kSnrDb = 3;
  const std::vector<std::int16_t> samples = samplesToHear(line().audio);
  const AudioClip noisy = test::inHiss(samples, kSnrDb);
  const Pronouncer pronouncer(nullptr, english());
  const std::vector<TranscriptWord> words = pronouncer.wordsOf(line().text);
  ForcedAligner aligner;
  const auto meanError = [&](const HeardPhones& heard) {
    const SpeechLabels found = aligner
                                   .align(SamplesToHear(noisy), noisy.duration(), words, "line", SpeechKind::kSpoken,
                                          BorderTimes::kFine, heard)
                                   .labels;
    double sum = 0;
    for (std::size_t word = 0; word < found.words.size(); ++word) {
      sum += std::abs(found.spanOf(found.words[word].phones).start -
                      line().labels.spanOf(line().labels.words[word].phones).start);
    }
    return sum / asReal(found.words.size());
  };
  std::string fault;
  const HeardPhones heard = phonesBesideText(*shipped(), samplesToHear(noisy), english(), fault);
  EXPECT_EQ(fault, "");
  EXPECT_LT(meanError(heard), 0.6 * meanError({}));
  EXPECT_EQ(phonesBesideText(*shipped(), samples, english(), fault).cols(), 0) << "the voice alone is clean";
}

/// Lips that shut sound alike in other languages than the network's own.
TEST_F(NetworkPhones, HearLipsShutInOtherLanguages) {
  const Language& french = languageOf("fr");
  const auto isShut = [](const LabelledPhone& phone) { return isBilabial(phone.phone); };
  const auto voice = makeVoice("espeak:fr");
  std::size_t shut = 0, by_ear = 0, by_both = 0;
  for (const char* text :
       {"Le petit bateau bleu part pour une île perdue.", "Ma mère peut mettre deux pommes sur la table.",
        "Un peu de pluie tombe sur la plume du peintre."}) {
    const SpokenLine said = voice->speak(text);
    const auto found = [&](std::shared_ptr<WordNetwork> network) {
      const SpeechLabels heard =
          makeRecogniser({.as = HearAs::kPhones, .hint = {}, .language = &french, .word_network = std::move(network)})
              ->hear(said.audio, "line")
              .labels;
      return std::count_if(said.labels.phones.begin(), said.labels.phones.end(), [&](const LabelledPhone& phone) {
        return isShut(phone) && std::any_of(heard.phones.begin(), heard.phones.end(), [&](const LabelledPhone& other) {
                 return isShut(other) && other.span.start < phone.span.end && other.span.end > phone.span.start;
               });
      });
    };
    shut += unsignedIndex(std::count_if(said.labels.phones.begin(), said.labels.phones.end(), isShut));
    by_ear += unsignedIndex(found(nullptr));
    by_both += unsignedIndex(found(shipped()));
  }
  EXPECT_GE(by_both, by_ear + 3);
  EXPECT_GE(asReal(by_both), 0.75 * asReal(shut));
}

/// What is said softly lies under the noise.
/// English hears the round vowels of others as its reduced ones.
TEST_F(NetworkPhones, HearRoundVowelsOfOtherLanguages) {
  constexpr auto isRound = [](Phone phone) {
    return phone == Phone::kUW || phone == Phone::kUH || phone == Phone::kOW || phone == Phone::kAO;
  };
  const Language& polish = languageOf("pl");
  const auto voice = makeVoice("espeak:pl");
  std::size_t frames = 0, as_polish = 0, as_english = 0;
  for (const char* text : {"Kto kupował owoce koło domu?", "Wujek długo budował mosty z tektury."}) {
    const SpokenLine said = voice->speak(text);
    const std::vector<std::int16_t> samples = samplesToHear(said.audio);
    const auto roundAt = [&](const HeardPhones& heard, Eigen::Index frame) {
      Eigen::Index phone = 0;
      heard.col(frame).maxCoeff(&phone);
      return isRound(static_cast<Phone>(phone)) ? 1U : 0U;
    };
    const HeardPhones polish_heard = hearPhones(*shipped(), samples, polish),
                      english_heard = hearPhones(*shipped(), samples, english());
    for (const LabelledPhone& phone : said.labels.phones) {
      if (!isRound(phone.phone)) continue;
      const auto frame = static_cast<Eigen::Index>((phone.span.start + phone.span.end) / 2 / kEarStep);
      ++frames;
      as_polish += roundAt(polish_heard, frame);
      as_english += roundAt(english_heard, frame);
    }
  }
  ASSERT_GE(frames, 15U);
  EXPECT_GE(as_polish, frames * 7 / 10) << "of " << frames;
  EXPECT_LE(as_english, as_polish - frames / 5);
}

/// An acoustic model of English tells little of them: by it most texts that lack their end are believed.
TEST_F(NetworkPhones, TellWrongTextsInOtherLanguages) {
  struct Doubted {
    std::size_t right = 0, another = 0, cut = 0;
  } by_both, by_ear;
  const std::vector<std::pair<std::string, std::vector<std::pair<std::string, std::string>>>> said{
      {"it",
       {{"I miei amici arrivano stasera", "con il treno da Milano"},
        {"Nessuno sapeva perché la porta", "era rimasta aperta"},
        {"Prendo un caffè e poi torniamo", "subito al lavoro"}}},
      {"pt",
       {{"Os meus amigos chegam hoje", "à noite de comboio"},
        {"Ninguém sabia porque a porta", "tinha ficado aberta"},
        {"Vou beber um café e depois", "voltamos ao trabalho"}}}};
  for (const auto& of_language : said) {
    const Language& language = languageOf(of_language.first);
    const auto& lines = of_language.second;
    const auto voice = makeVoice("espeak:" + of_language.first);
    const Pronouncer pronouncer(nullptr, language);
    ForcedAligner aligner({}, language);
    for (std::size_t i = 0; i < lines.size(); ++i) {
      const auto whole = [&](std::size_t line) { return lines[line].first + " " + lines[line].second; };
      const AudioClip noisy = test::inHiss(samplesToHear(voice->speak(whole(i)).audio), 20);
      std::string fault;
      const HeardPhones heard = phonesBesideText(*shipped(), samplesToHear(noisy), language, fault);
      EXPECT_EQ(fault, "");
      const auto isDoubted = [&](const std::string& words, const HeardPhones& by) {
        const ForcedAlignment found = aligner.align(SamplesToHear(noisy), noisy.duration(), pronouncer.wordsOf(words),
                                                    "line", SpeechKind::kSpoken, BorderTimes::kFine, by);
        return found.doubtfulWords().empty() ? 0U : 1U;
      };
      for (const auto& [by, doubted] : {std::pair(&heard, &by_both), std::pair(&kUnheard, &by_ear)}) {
        doubted->right += isDoubted(whole(i), *by);
        doubted->another += isDoubted(whole((i + 1) % lines.size()), *by);
        doubted->cut += isDoubted(lines[i].first, *by);
      }
    }
  }
  EXPECT_EQ(by_both.right, 0U);
  EXPECT_EQ(by_both.another, 6U);
  EXPECT_GE(by_both.cut, 5U) << "of six";
  EXPECT_LE(by_ear.cut, 4U) << "or this shows nothing";
}

TEST_F(NetworkPhones, AreHeardWhereLevelsTellNothing) {
  constexpr double kSnrDb = 5;
  const AudioClip noisy = test::inHiss(samplesToHear(line().audio), kSnrDb);
  const double by_ear = heardShare(heardOn(noisy, nullptr), line().labels);
  EXPECT_GT(heardShare(heardOn(noisy, shipped()), line().labels), by_ear + 0.2);
  const HeardSpeech heard =
      makeRecogniser({.as = HearAs::kPhones, .hint = {}, .word_network = shipped()})->hear(noisy, "line");
  EXPECT_LT(heard.stretches.front().span.start, 0.35);
  EXPECT_GT(heard.stretches.back().span.end, line().audio.duration() - 0.5);
}

/// Knocks are as loud and short as speech, and no levels tell them from it.
TEST_F(NetworkPhones, HearNobodyInKnocks) {
  AudioClip knocks{16000, std::vector<float>(48000)};
  std::mt19937 random(3);
  for (int k = 0; k < 20; ++k) {
    const std::size_t at = random() % 46000;
    const double hz = 300.0 * static_cast<double>(1 + random() % 8);
    for (std::size_t i = 0; i < 2000; ++i)
      knocks.samples[at + i] +=
          static_cast<float>(0.3 * std::exp(-asReal(i) / 300) * std::sin(2 * 3.14159265 * hz * asReal(i) / 16000));
  }
  for (const HearAs as : {HearAs::kPhones, HearAs::kAuto}) {
    const auto recogniser = makeRecogniser({.as = as, .hint = {}, .word_network = shipped()});
    EXPECT_EQ(errorOf([&] { recogniser->hear(knocks, "a.wav"); }),
              "a.wav: holds no speech that can be heard; expected speech");
  }
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

TEST_F(BrokenNetworkPhones, LeaveWordsInNoiseToTheAligner) {
  std::string fault;
  const AudioClip noisy = test::inHiss(samplesToHear(line().audio), 5);
  const std::vector<std::int16_t> samples = samplesToHear(noisy);
  EXPECT_EQ(phonesBesideText(*networkOf("process.exit(3);"), samples, english(), fault).cols(), 0);
  EXPECT_TRUE(fault.starts_with("the network that hears phones was not heard (")) << fault;
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
