// Times of other programs there and back, and where a made-up sound is more than its background.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "hearing/recognition/hinted_words.h"
#include "hearing/recognition/known_lines.h"
#include "hearing/recognition/sound_search.h"
#include "hearing/times/times_file.h"
#include "support/error_of.h"

namespace mouthpiece {
namespace {

/// Words one after the other, now and then with a pause between them; times in whole milliseconds.
std::vector<TimesFile::Word> randomWords(std::mt19937& random) {
  const std::vector<std::string> known{"the", "time", "is", "now", "don't", "caf\xC3\xA9", "we", "x-ray", "seven", "a"};
  std::vector<TimesFile::Word> words(1 + random() % 12);
  int ms = static_cast<int>(random() % 3000);
  for (TimesFile::Word& word : words) {
    word.text = known[random() % known.size()];
    const int length = 20 + static_cast<int>(random() % 800);
    word.span = {ms / 1000.0, (ms + length) / 1000.0};
    word.confidence = static_cast<double>(random() % 101) / 100;
    ms += length + (random() % 3 == 0 ? static_cast<int>(random() % 900) : 0);
  }
  return words;
}

std::string clock(Seconds time, char point) {
  const int ms = static_cast<int>(std::lround(1000 * time));
  return fmt::format("{:02}:{:02}:{:02}{}{:03}", ms / 3'600'000, ms / 60'000 % 60, ms / 1000 % 60, point, ms % 1000);
}

/// What a program would have written.
std::string written(const std::string& kind, const std::vector<TimesFile::Word>& words) {
  using Json = nlohmann::json;
  std::string text, lines;
  Json list = Json::array();
  for (std::size_t i = 0; i < words.size(); ++i) {
    const auto& [word, span, confidence] = words[i];
    text += (i > 0 ? " " : "") + word;
    if (kind == "Whisper JSON")
      list.push_back({{"word", " " + word}, {"start", span.start}, {"end", span.end}, {"probability", confidence}});
    if (kind == "Vosk JSON")
      list.push_back({{"word", word}, {"start", span.start}, {"end", span.end}, {"conf", confidence}});
    if (kind == "CTM")
      lines += fmt::format("talk 1 {:.3f} {:.3f} {} {:.2f}\n", span.start, span.end - span.start, word, confidence);
    if (kind == "SRT")
      lines += fmt::format("{}\n{} --> {}\n{}\n\n", i + 1, clock(span.start, ','), clock(span.end, ','), word);
    if (kind == "WebVTT")
      lines += fmt::format("{} --> {} align:start\n{}\n\n", clock(span.start, '.'), clock(span.end, '.'), word);
  }
  if (kind == "WebVTT") return "WEBVTT\n\n" + lines;
  if (kind == "Vosk JSON") return Json{{"result", list}, {"text", text}}.dump();
  if (kind == "Whisper JSON") {
    const Json segment{{"id", 0},
                       {"start", words.front().span.start},
                       {"end", words.back().span.end},
                       {"text", " " + text},
                       {"words", list}};
    return Json{{"text", " " + text}, {"language", "en"}, {"segments", Json::array({segment})}}.dump();
  }
  return lines;
}

TEST(TimesOfWords, ComeBackAsTheyWereWritten) {
  for (unsigned seed = 1; seed <= 25; ++seed) {
    for (const std::string kind : {"Whisper JSON", "Vosk JSON", "CTM", "SRT", "WebVTT"}) {
      SCOPED_TRACE(fmt::format("{}, seed {}", kind, seed));
      std::mt19937 random(seed);
      const std::vector<TimesFile::Word> words = randomWords(random);
      const TimesFile times = parseTimes(written(kind, words), "made up");
      EXPECT_EQ(times.kind, kind);
      ASSERT_EQ(times.words.size(), words.size()) << written(kind, words);
      EXPECT_EQ(times.words_are_lines, kind == "SRT" || kind == "WebVTT");
      EXPECT_TRUE(times.phones.empty());
      for (std::size_t i = 0; i < words.size(); ++i) {
        EXPECT_EQ(times.words[i].text, words[i].text);
        EXPECT_NEAR(times.words[i].span.start, words[i].span.start, 6e-4) << i;
        EXPECT_NEAR(times.words[i].span.end, words[i].span.end, 6e-4) << i;
        if (!times.words_are_lines) {
          EXPECT_NEAR(times.words[i].confidence, words[i].confidence, 1e-9) << i;
        }
        if (i > 0) {
          EXPECT_GE(times.words[i].span.start, times.words[i - 1].span.end) << "no two at once";
        }
      }
    }
  }
}

constexpr int kRate = 16000;

/// Faint noise, with sounds in it.
class MadeUpSound {
 public:
  MadeUpSound(unsigned seed, Seconds duration) : random_(seed), samples_(static_cast<std::size_t>(duration * kRate)) {
    std::normal_distribution<double> faint(0, 8);
    for (double& sample : samples_) sample = faint(random_);
  }
  /// A buzz of syllables, four a second, each of another colour.
  void speak(Seconds from, Seconds to) {
    std::normal_distribution<double> any(0, 1);
    double low = 0, before = 0;
    eachSample(from, to, [&](Seconds t) {
      const double syllable = std::pow(std::max(0.0, std::sin(2 * std::numbers::pi * 4 * t)), 2);
      const double colour = 0.05 + 0.9 * std::abs(std::sin(5.3 * std::floor(4 * t)));
      const double noise = any(random_);
      low += colour * (noise - low);
      const double buzz = std::sin(2 * std::numbers::pi * 120 * t) > 0.9 ? 2 : 0;
      const double sample = 3000 * syllable * (low + buzz - 0.5 * before);
      before = low;
      return sample;
    });
  }
  void hiss(Seconds from, Seconds to, double level = 1500) {
    std::normal_distribution<double> any(0, level);
    eachSample(from, to, [&](Seconds) { return any(random_); });
  }
  /// Low, and far below a hiss of 400 over all bands.
  void murmur(Seconds from, Seconds to) {
    eachSample(from, to, [](Seconds t) { return 300 * std::sin(2 * std::numbers::pi * 300 * t); });
  }
  void chord(Seconds from, Seconds to) {
    eachSample(from, to, [](Seconds t) {
      double sum = 0;
      for (const double hertz : {220.0, 277.2, 329.6, 440.0}) sum += std::sin(2 * std::numbers::pi * hertz * t);
      return 1800 * sum;
    });
  }
  [[nodiscard]] std::vector<std::int16_t> samples(double gain = 1) const {
    std::vector<std::int16_t> whole;
    for (const double sample : samples_)
      whole.push_back(static_cast<std::int16_t>(std::clamp(std::lround(gain * sample), -32767L, 32767L)));
    return whole;
  }

 private:
  template <typename Make>
  void eachSample(Seconds from, Seconds to, const Make& make) {
    for (auto i = static_cast<std::size_t>(from * kRate); i < static_cast<std::size_t>(to * kRate); ++i)
      samples_[i] += make(static_cast<double>(i) / kRate);
  }
  std::mt19937 random_;
  std::vector<double> samples_;
};

TEST(FindSpeech, FindsWhatIsLouderThanItsBackgroundWhereverItIs) {
  for (unsigned seed = 1; seed <= 8; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> length(0.8, 3), pause(0.7, 2);
    MadeUpSound sound(seed, 16);
    std::vector<TimeSpan> spoken;
    for (Seconds from = pause(random); from + 3 < 15; from = spoken.back().end + pause(random)) {
      spoken.push_back({from, from + length(random)});
      sound.speak(spoken.back().start, spoken.back().end);
    }
    const std::vector<SoundStretch> found = findSpeech(sound.samples());
    ASSERT_EQ(found.size(), spoken.size());
    for (std::size_t i = 0; i < found.size(); ++i) {
      EXPECT_EQ(found[i].kind, SoundKind::kSpeech) << i;
      EXPECT_NEAR(found[i].span.start, spoken[i].start, 0.3) << i;
      EXPECT_NEAR(found[i].span.end, spoken[i].end, 0.3) << i;
      if (i > 0) {
        EXPECT_GE(found[i].span.start, found[i - 1].span.end) << "one after the other";
      }
    }
    // Half as loud it is the same sound.
    const std::vector<SoundStretch> quiet = findSpeech(sound.samples(0.5));
    ASSERT_EQ(quiet.size(), found.size());
    for (std::size_t i = 0; i < found.size(); ++i) {
      EXPECT_NEAR(quiet[i].span.start, found[i].span.start, 0.06) << i;
      EXPECT_NEAR(quiet[i].span.end, found[i].span.end, 0.06) << i;
    }
  }
}

TEST(FindSpeech, PausesOfAThirdOfASecondPartAndShorterOnesDoNot) {
  for (const auto& [gap, parts] : {std::pair(0.15, 1U), {0.6, 2U}}) {
    MadeUpSound sound(3, 6);
    // Both end and begin in full: 4 syllables a second begin at quarters.
    sound.hiss(1, 2);
    sound.hiss(2 + gap, 3 + gap);
    EXPECT_EQ(findSpeech(sound.samples()).size(), parts) << gap;
  }
}

TEST(FindSpeech, GoesOnWhereSpeechIsLessThanASteadyNoiseButNotInItsBand) {
  for (unsigned seed = 1; seed <= 8; ++seed) {
    SCOPED_TRACE(seed);
    MadeUpSound sound(seed, 8);
    sound.hiss(0, 8, 400);
    sound.speak(2, 4);
    const std::vector<SoundStretch> plain = findSpeech(sound.samples());
    ASSERT_EQ(plain.size(), 1U);
    EXPECT_GT(plain[0].span.start, 1.7) << "of noise no more than before";
    EXPECT_LT(plain[0].span.end, 4.3);
    sound.murmur(1.3, 2);
    sound.murmur(4, 4.7);
    const std::vector<SoundStretch> found = findSpeech(sound.samples());
    ASSERT_EQ(found.size(), 1U);
    EXPECT_NEAR(found[0].span.start, 1.3, 0.25);
    EXPECT_NEAR(found[0].span.end, 4.7, 0.25);
  }
}

/// The background is that of the half minute: a noise that sets in is none of the speech before it.
TEST(FindSpeech, GoesOnNoFurtherWhereTheNoiseIsAnotherOneLater) {
  MadeUpSound sound(9, 180);
  sound.hiss(0, 120, 300);
  sound.hiss(120, 180, 400);
  std::vector<TimeSpan> spoken;
  for (Seconds from = 4; from < 175; from += 8) spoken.push_back({from, from + 3});
  for (const TimeSpan& span : spoken) sound.speak(span.start, span.end);
  const std::vector<SoundStretch> found = findSpeech(sound.samples());
  for (const TimeSpan& span : spoken) {
    const auto of = std::find_if(found.begin(), found.end(),
                                 [&](const SoundStretch& stretch) { return stretch.span.contains(span.middle()); });
    ASSERT_NE(of, found.end()) << span.start;
    EXPECT_NEAR(of->span.start, span.start, 0.35);
    EXPECT_NEAR(of->span.end, span.end, 0.35);
  }
}

TEST(FindSpeech, TellsSteadyNoiseAndChordsFromSpeech) {
  MadeUpSound sound(4, 14);
  sound.hiss(1, 4);
  sound.chord(5.5, 8.5);
  sound.speak(10, 13);
  const std::vector<SoundStretch> found = findSpeech(sound.samples());
  ASSERT_EQ(found.size(), 3U);
  EXPECT_EQ(found[0].kind, SoundKind::kNoise);
  EXPECT_EQ(found[1].kind, SoundKind::kMusic);
  EXPECT_EQ(found[2].kind, SoundKind::kSpeech);
}

/// Speech without a pause is cut where it is quietest, and none of it is lost.
TEST(FindSpeech, LongSpeechIsCutAtItsQuietestPlace) {
  MadeUpSound sound(5, 50);
  // A quarter of a second between: no pause, but quieter than anywhere else, for there is a hum besides.
  for (const auto& [from, to] : {std::pair(1.0, 13.05), {13.3, 49.0}}) {
    sound.speak(from, to);
    sound.hiss(from, to, 200);
  }
  const std::vector<SoundStretch> found = findSpeech(sound.samples());
  ASSERT_GE(found.size(), 3U);
  for (std::size_t i = 0; i < found.size(); ++i) {
    EXPECT_LE(found[i].span.duration(), kLongestStretch + 0.4);
    if (i > 0) {
      EXPECT_NEAR(found[i].span.start, found[i - 1].span.end, 1e-9) << "nothing between is lost";
    }
  }
  EXPECT_NEAR(found[0].span.end, 13.18, 0.2);
  EXPECT_NEAR(found.front().span.start, 1, 0.3);
  EXPECT_NEAR(found.back().span.end, 49, 0.3);
}

TEST(FindSpeech, SilenceHoldsNothing) {
  EXPECT_TRUE(findSpeech({}).empty());
  EXPECT_TRUE(findSpeech(std::vector<std::int16_t>(kRate)).empty());
  EXPECT_TRUE(findSpeech(MadeUpSound(6, 3).samples(0.1)).empty()) << "less than a step of its samples";
}

TEST(KnownLines, AHintWithoutWordsIsRefusedAsAHint) {
  const auto error = [](const char* hint) { return errorOf([&] { KnownLines::ofHint(hint, Pronouncer()); }); };
  EXPECT_TRUE(error("   ").starts_with("hint: has nothing to say in it")) << error("   ");
  EXPECT_TRUE(error("now \xFF").starts_with("hint:byte 4: is broken UTF-8")) << error("now \xFF");
}

TEST(KnownLines, TellHowMuchOfWhatIsHeardIsInTheirOrder) {
  const KnownLines lines({"the time is now", "\x01", "a cold night"}, Pronouncer());
  EXPECT_EQ(lines.book().lines.size(), 2U) << "what cannot be said is left out";
  EXPECT_DOUBLE_EQ(lines.inOrder({"the", "time", "is", "now"}), 1);
  EXPECT_DOUBLE_EQ(lines.inOrder({"a", "cold", "time", "is"}), 0.75);
  EXPECT_DOUBLE_EQ(lines.inOrder({"now", "is", "the"}), 0);
  EXPECT_DOUBLE_EQ(lines.inOrder({}), 0);
}

TEST(HintedPlaces, AreWhereTheHintSoundsLikeOtherWords) {
  const auto labelsOf = [](const std::vector<std::pair<std::string, std::vector<Phone>>>& words) {
    SpeechLabels labels;
    for (const auto& [text, phones] : words) {
      const std::size_t first = labels.phones.size();
      for (const Phone phone : phones)
        labels.phones.push_back({.phone = phone, .span = {}, .word = labels.words.size(), .syllable = {}});
      labels.words.push_back({text, {PhoneIndex(first), PhoneIndex(labels.phones.size() - 1)}});
    }
    return labels;
  };
  const KnownLines hint = KnownLines::ofHint("planet, tub", Pronouncer());
  const std::pair<std::string, std::vector<Phone>> the{"the", {Phone::kDH, Phone::kAH}},
      plan{"plan", {Phone::kP, Phone::kL, Phone::kAE, Phone::kN}}, it{"it", {Phone::kIH, Phone::kT}},
      planet{"Planet", {Phone::kP, Phone::kL, Phone::kAE, Phone::kN, Phone::kAH, Phone::kT}};
  const std::vector<HintedPlace> places = hintedPlaces(hint, labelsOf({the, plan, it}));
  ASSERT_FALSE(places.empty());
  EXPECT_EQ(places[0].first, 1U);
  EXPECT_EQ(places[0].end, 3U);
  EXPECT_EQ(places[0].words, std::vector<std::string>{"planet"});
  EXPECT_NEAR(places[0].apart, 0.6 / 6, 1e-9) << "one vowel for another";
  EXPECT_TRUE(hintedPlaces(hint, labelsOf({the, planet})).empty()) << "it is heard";
  EXPECT_TRUE(hintedPlaces(hint, labelsOf({the, it})).empty());
  EXPECT_TRUE(hintedPlaces(hint, labelsOf({})).empty());
  EXPECT_TRUE(hintedPlaces(KnownLines::ofHint("", Pronouncer()), labelsOf({plan, it})).empty());
}

TEST(KnownLines, AreTheWordsAndPhrasesOfAHint) {
  const auto linesOf = [](std::string_view hint) { return KnownLines::ofHint(hint, Pronouncer()).book().lines; };
  EXPECT_EQ(linesOf("Mouthpiece, viseme;a cold\nnight"),
            (std::vector<std::vector<std::string>>{{"mouthpiece"}, {"viseme"}, {"a", "cold"}, {"night"}}));
  EXPECT_EQ(linesOf("1,000 nights").size(), 1U);
  EXPECT_TRUE(linesOf("").empty());
  EXPECT_THROW(linesOf("\x01"), InputError);
  EXPECT_THROW(linesOf(std::string((1 << 16) + 1, 'a')), InputError);
}

}  // namespace
}  // namespace mouthpiece
