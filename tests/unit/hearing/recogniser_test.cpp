#include "hearing/recognition/recogniser.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <random>
#include <set>
#include <sstream>
#include <string>

#include "hearing/recognition/sound_search.h"
#include "support/error_of.h"
#include "voices/voice.h"

namespace mouthpiece {
namespace {

AudioClip spoken(const std::string& text) { return resampleAudio(makeVoice("flite:slt")->speak(text).audio, 16000); }

AudioClip joined(const std::vector<AudioClip>& clips) {
  AudioClip all{16000, {}};
  for (const AudioClip& clip : clips) all.samples.insert(all.samples.end(), clip.samples.begin(), clip.samples.end());
  return all;
}

AudioClip quiet(Seconds duration) {
  return {16000, std::vector<float>(static_cast<std::size_t>(16000 * duration), 0.0F)};
}

AudioClip noise(Seconds duration, float level) {
  AudioClip clip = quiet(duration);
  std::mt19937 random(7);
  std::normal_distribution<float> normal(0.0F, level);
  for (float& sample : clip.samples) sample = std::clamp(normal(random), -1.0F, 1.0F);
  return clip;
}

std::vector<std::int16_t> heardOf(const AudioClip& clip) {
  std::vector<std::int16_t> samples;
  for (const float sample : clip.samples)
    samples.push_back(static_cast<std::int16_t>(std::lround(32767 * std::clamp(sample, -1.0F, 1.0F))));
  return samples;
}

double meanSquare(const AudioClip& clip) {
  double sum = 0;
  for (const float sample : clip.samples) sum += double{sample} * double{sample};
  return sum / static_cast<double>(clip.samples.size());
}

/// Noise that falls by 6 dB an octave, as wind does.
AudioClip wind(Seconds duration) {
  AudioClip clip = noise(duration, 0.02F);
  float last = 0;
  for (float& sample : clip.samples) sample = last = 0.995F * last + sample;
  return clip;
}

AudioClip tones(Seconds duration, const std::vector<double>& hz, Seconds each) {
  AudioClip clip = quiet(duration);
  for (std::size_t i = 0; i < clip.samples.size(); ++i) {
    const double time = static_cast<double>(i) / 16000, of_note = std::fmod(time, each);
    const double root = 1 + static_cast<double>(static_cast<int>(time / each) % 4) / 4;
    for (const double f : hz)
      clip.samples[i] += static_cast<float>(0.05 * std::exp(-0.3 * of_note) * std::sin(2 * M_PI * root * f * time));
  }
  return clip;
}

Seconds speechIn(const AudioClip& sound) {
  Seconds found = 0;
  for (const SoundStretch& stretch : findSpeech(heardOf(sound)))
    found += stretch.kind == SoundKind::kSpeech ? stretch.span.duration() : 0;
  return found;
}

/// Whatever steady noise is under it, speech rises and falls in some band.
TEST(SpeechFinder, SpeechInSteadyNoiseIsSpeech) {
  const AudioClip line =
      joined({spoken("the birch canoe slid on the smooth planks"), spoken("rice is often served in round bowls")});
  const Seconds duration = line.duration();
  for (const AudioClip& under :
       {noise(duration, 0.1F), wind(duration), tones(duration, {50, 150, 250, 350, 450}, 100)}) {
    for (const double snr_db : {20.0, 10.0, 5.0}) {
      AudioClip sound = line;
      const double scale = std::sqrt(meanSquare(line) / meanSquare(under) * std::pow(10, -snr_db / 10));
      for (std::size_t i = 0; i < sound.samples.size(); ++i)
        sound.samples[i] = 0.7F * (sound.samples[i] + static_cast<float>(scale) * under.samples[i]);
      EXPECT_GT(speechIn(sound), 0.8 * speechIn(line)) << snr_db << " dB";
    }
  }
}

/// The spectrum of a low voice is as pure as a chord's, and in hiss its levels change as little.
TEST(SpeechFinder, AVoiceInHissIsNoMusic) {
  const AudioClip line =
      resampleAudio(makeVoice("flite:slt")->speak("The weather has been beautiful all week.").audio, 16000);
  AudioClip sound = joined({quiet(0.5), line, quiet(0.5)});
  const AudioClip hiss = noise(sound.duration(), static_cast<float>(0.1 * std::sqrt(meanSquare(sound))));
  for (std::size_t i = 0; i < sound.samples.size(); ++i) sound.samples[i] += hiss.samples[i];
  EXPECT_GT(speechIn(sound), 0.5 * speechIn(line));
}

TEST(SpeechFinder, NoiseAndTonesAreNoSpeech) {
  const auto kindsOf = [](const AudioClip& sound) {
    std::set<SoundKind> kinds;
    for (const SoundStretch& stretch : findSpeech(heardOf(sound))) kinds.insert(stretch.kind);
    return kinds;
  };
  EXPECT_EQ(kindsOf(noise(4, 0.1F)), std::set{SoundKind::kNoise});
  EXPECT_FALSE(kindsOf(wind(4)).contains(SoundKind::kSpeech));
  EXPECT_EQ(kindsOf(tones(4, {220, 277, 330, 440, 554, 880}, 100)), std::set{SoundKind::kMusic});
}

TEST(Recogniser, HearsWordsThatAreHinted) {
  const auto recogniser = makeRecogniser({.as = HearAs::kAuto, .hint = "the birch canoe slid on the smooth planks"});
  const HeardSpeech heard = recogniser->hear(spoken("the birch canoe slid on the smooth planks"), "line");
  EXPECT_EQ(heard.text, "the birch canoe slid on the smooth planks");
  EXPECT_EQ(heard.confidence.size(), heard.labels.phones.size());
  expectConsistent(heard.labels);
}

TEST(Recogniser, TellsThatAHintIsOfNoUse) {
  const AudioClip sound = spoken("the birch canoe slid on the smooth planks");
  const auto warned = [&](const RecogniserOptions& options) {
    const std::vector<std::string> warnings = makeRecogniser(options)->hear(sound, "line").warnings;
    EXPECT_TRUE(std::ranges::none_of(warnings, [](const std::string& warning) {
      return warning.find("or a hint would help") != std::string::npos;
    }));
    return std::ranges::count_if(
        warnings, [](const std::string& warning) { return warning.starts_with("the hint tells nothing: "); });
  };
  EXPECT_EQ(warned({.as = HearAs::kPhones, .hint = "birch canoe"}), 1);
  EXPECT_EQ(warned({.as = HearAs::kPhones, .hint = ""}), 0);
  EXPECT_EQ(warned({.as = HearAs::kAuto, .hint = "canoe", .language = &languageOf("de")}), 1);
}

/// A short book's only path is kept to its end, however little a noisy stretch fits it on the way.
TEST(Recogniser, FindsHintedLinesInNoise) {
  const auto voice = makeVoice("flite:slt");
  WordSearch search(english());
  for (const char* line : {"the children were playing in the garden", "we heard a strange noise in the basement",
                           "turn left at the second traffic light", "my computer keeps crashing for no reason"}) {
    AudioClip sound = resampleAudio(voice->speak(line).audio, 16000);
    const AudioClip hiss = noise(sound.duration(), static_cast<float>(0.1 * std::sqrt(meanSquare(sound))));
    for (std::size_t i = 0; i < sound.samples.size(); ++i) sound.samples[i] += hiss.samples[i];
    const std::vector<std::int16_t> samples = heardOf(sound);
    const TimeSpan said = findSpeech(samples).front().span;
    const auto first = static_cast<std::size_t>(16000 * said.start), end = static_cast<std::size_t>(16000 * said.end);
    PhraseBook book;
    std::istringstream words(line);
    book.lines.emplace_back(std::istream_iterator<std::string>(words), std::istream_iterator<std::string>());
    search.setBook("line", book);
    EXPECT_FALSE(
        search.hearBook("line", std::span(samples).subspan(first, std::min(end, samples.size()) - first)).empty())
        << line;
  }
}

TEST(Recogniser, HearsPhonesWithoutWords) {
  const auto recogniser = makeRecogniser({.as = HearAs::kPhones, .hint = {}});
  const HeardSpeech heard = recogniser->hear(spoken("papa may buy my maps"), "line");
  EXPECT_TRUE(heard.text.empty());
  EXPECT_TRUE(heard.labels.words.empty());
  const auto closed = std::count_if(heard.labels.phones.begin(), heard.labels.phones.end(),
                                    [](const LabelledPhone& phone) { return isBilabial(phone.phone); });
  EXPECT_GE(closed, 4);  // of seven
  expectConsistent(heard.labels);
}

/// Silence, steady noise and tones are no speech: one line that says so.
TEST(Recogniser, RefusesSoundsWithoutSpeech) {
  const auto recogniser = makeRecogniser({.as = HearAs::kPhones, .hint = {}});
  EXPECT_EQ(errorOf([&] { recogniser->hear(quiet(2), "a.wav"); }), "a.wav: holds silence only; expected speech");
  EXPECT_EQ(errorOf([&] { recogniser->hear(noise(3, 0.1F), "a.wav"); }),
            "a.wav: holds no speech that can be heard; expected speech");
}

TEST(Recogniser, NamesNoiseBesideSpeech) {
  const auto recogniser = makeRecogniser({.as = HearAs::kPhones, .hint = {}});
  const AudioClip sound =
      joined({spoken("the time is now"), quiet(1), noise(3, 0.05F), quiet(1), spoken("the time is now")});
  const HeardSpeech heard = recogniser->hear(sound, "a.wav");
  std::size_t noises = 0;
  for (const SoundStretch& stretch : heard.stretches) noises += stretch.kind == SoundKind::kNoise ? 1 : 0;
  EXPECT_EQ(noises, 1U);
  EXPECT_TRUE(std::any_of(heard.warnings.begin(), heard.warnings.end(),
                          [](const std::string& warning) { return warning.starts_with("noise without speech"); }));
}

/// The lips would be shut as long as it hisses around a line.
TEST(Recogniser, HoldsNoClosingInNoise) {
  AudioClip sound = joined({quiet(1), spoken("he broke his leg playing football"), quiet(1.5)});
  const AudioClip hiss = noise(sound.duration(), static_cast<float>(0.4 * std::sqrt(meanSquare(sound))));
  for (std::size_t i = 0; i < sound.samples.size(); ++i) sound.samples[i] += hiss.samples[i];
  const HeardSpeech heard = makeRecogniser({.as = HearAs::kPhones, .hint = {}})->hear(sound, "line");
  expectConsistent(heard.labels);
  for (const LabelledPhone& phone : heard.labels.phones) {
    if (isStop(phone.phone)) {
      EXPECT_LE(phone.span.duration(), 0.35) << phone.span.start;
    }
  }
}

/// Pauses part a recording: its stretches are heard each for itself, wherever they stand. Where they begin within a
/// frame of 10 ms differs, and with it a phone or two.
TEST(Recogniser, HearsAStretchAlikeAnywhere) {
  const auto recogniser = makeRecogniser({.as = HearAs::kPhones, .hint = {}});
  const AudioClip line = spoken("we always met at the moon");
  const HeardSpeech once = recogniser->hear(joined({quiet(0.6), line, quiet(0.6)}), "a");
  const HeardSpeech twice = recogniser->hear(joined({quiet(0.6), line, quiet(1.2), line, quiet(0.6)}), "a");
  const auto said = [](const HeardSpeech& heard) {
    return std::count_if(heard.labels.phones.begin(), heard.labels.phones.end(),
                         [](const LabelledPhone& phone) { return phone.phone != Phone::kSil; });
  };
  EXPECT_NEAR(static_cast<double>(2 * said(once)), static_cast<double>(said(twice)), 2);
  EXPECT_EQ(twice.stretches.size(), 2 * once.stretches.size());
}

/// Of a voice that nothing was fitted to, whose phones fit better than its words do.
TEST(Recogniser, TakesWordsOfUnknownSpeakers) {
  const auto recogniser = makeRecogniser({.as = HearAs::kAuto, .hint = {}});
  const auto voice = makeVoice("flite:kal16");
  for (const char* text : {"we need to change the sheets on the bed", "the teacher gave us too much homework",
                           "my grandmother makes the best apple pie"}) {
    const AudioClip line = resampleAudio(voice->speak(text).audio, 16000);
    EXPECT_EQ(recogniser->hear(joined({quiet(0.25), line, quiet(0.25)}), "line").text, text);
  }
}

/// Any sound is some row of the words of a corpus' lines; none of its lines is said here.
TEST(Recogniser, LeavesACorpusWordsInAnyOrder) {
  const std::vector<std::string> known{"why did the new pup serve the king", "the warm tub caught his feet",
                                       "please pile the wood", "he would like the hat", "two men cut the cup"};
  for (const char* hint : {"", "Mouthpiece, viseme"}) {
    const auto recogniser = makeRecogniser({.as = HearAs::kAuto, .hint = hint, .known = known});
    const auto heard = [&](const char* text) {
      const AudioClip line = resampleAudio(makeVoice("flite:rms")->speak(text).audio, 16000);
      return recogniser->hear(joined({quiet(0.25), line, quiet(0.25)}), "line").text;
    };
    EXPECT_EQ(heard("i would like two cups of warm coffee please"), "i would like two cups of warm coffee please")
        << "hint: " << hint;
    EXPECT_EQ(heard("the warm tub caught his feet"), "the warm tub caught his feet") << "hint: " << hint;
  }
}

/// Of a corpus of many lines most pairs of some row of its words follow each other somewhere.
TEST(Recogniser, HearsAStrangersWordsWithACorpusOfManyLines) {
  std::vector<std::string> known;
  std::ifstream prompts(std::string(MOUTHPIECE_SOURCE_DIR) + "/sample_data/prompts/rich.txt");
  for (std::string line; std::getline(prompts, line);) {
    if (!line.empty() && line.front() != '#') known.push_back(line);
  }
  const auto recogniser = makeRecogniser({.as = HearAs::kAuto, .hint = {}, .known = known});
  const auto heard = [&](const char* voice, const char* text) {
    const AudioClip line = resampleAudio(makeVoice(voice)->speak(text).audio, 16000);
    return recogniser->hear(joined({quiet(0.5), line, quiet(0.5)}), "line").text;
  };
  EXPECT_EQ(heard("flite:slt", "I'll be there in about ten minutes."), "i'll be there in about ten minutes");
  EXPECT_EQ(heard("festival:kal_diphone", "She called yesterday to say thank you."),
            "she called yesterday to say thank you");
}

/// Words that are heard for others leave closings out that the sound tells.
TEST(Recogniser, KeepsClosingsThatItsWordsLack) {
  const auto recogniser = makeRecogniser({.as = HearAs::kAuto, .hint = {}});
  constexpr Seconds kQuiet = 0.25, kNear = 0.04;
  struct Line {
    const char *voice, *text;
    int may_lack;
  };
  constexpr Line kLines[] = {{"flite:kal16", "bring bob a big bowl of plum jam", 1},
                             {"flite:slt", "put the map by the pump", 0},
                             {"flite:rms", "pack my box with maps", 0},
                             {"flite:awb", "bees make most of the honey", 0}};
  for (const auto& [voice, text, may_lack] : kLines) {
    const SpokenLine spoken = makeVoice(voice)->speak(text);
    const HeardSpeech heard =
        recogniser->hear(joined({quiet(kQuiet), resampleAudio(spoken.audio, 16000), quiet(kQuiet)}), "line");
    const std::vector<LabelledPhone>& phones = heard.labels.phones;
    ASSERT_EQ(phones.size(), heard.confidence.size());
    for (std::size_t i = 0; i + 1 < phones.size(); ++i) {
      EXPECT_GT(phones[i].span.duration(), 0) << text;
      EXPECT_NEAR(phones[i].span.end, phones[i + 1].span.start, 1e-9) << text;
    }
    int lost = 0;
    for (const LabelledPhone& lips : spoken.labels.phones) {
      lost += isBilabial(lips.phone) && std::none_of(phones.begin(), phones.end(), [&](const LabelledPhone& phone) {
                return isBilabial(phone.phone) && phone.span.start < lips.span.end + kQuiet + kNear &&
                       phone.span.end > lips.span.start + kQuiet - kNear;
              });
    }
    EXPECT_LE(lost, may_lack) << text << ", heard as " << heard.text;
  }
}

bool isDoubted(const HeardSpeech& heard) {
  return std::any_of(heard.warnings.begin(), heard.warnings.end(),
                     [](const std::string& warning) { return warning.starts_with("what was heard is doubtful"); });
}

/// Of voices and lines that the doubt was not fitted to.
TEST(Recogniser, DoubtsWhatItHearsWronglyAlone) {
  for (const HearAs as : {HearAs::kAuto, HearAs::kPhones}) {
    const auto recogniser = makeRecogniser({.as = as, .hint = {}});
    const AudioClip line = resampleAudio(makeVoice("flite:rms")->speak("we always met at the moon").audio, 16000);
    EXPECT_FALSE(isDoubted(recogniser->hear(line, "clear")));
    AudioClip in_noise = joined({quiet(0.5), line, quiet(0.5)});
    const AudioClip hiss = noise(line.duration() + 1.5, 0.008F);
    for (std::size_t i = 0; i < in_noise.samples.size(); ++i) in_noise.samples[i] += hiss.samples[i];
    EXPECT_TRUE(isDoubted(recogniser->hear(in_noise, "noisy")));
  }
}

/// The one that is understood does not make up for the other.
TEST(Recogniser, TellsWhichStretchOfARecordingIsDoubtful) {
  const auto recogniser = makeRecogniser({.as = HearAs::kPhones, .hint = {}});
  const AudioClip line = resampleAudio(makeVoice("flite:rms")->speak("we always met at the moon").audio, 16000);
  AudioClip noisy = joined({quiet(0.25), line, quiet(0.25)});
  const AudioClip hiss = noise(noisy.duration(), 0.008F);
  for (std::size_t i = 0; i < noisy.samples.size(); ++i) noisy.samples[i] += hiss.samples[i];
  const HeardSpeech heard = recogniser->hear(joined({line, quiet(1), line, quiet(1), line, quiet(1), noisy}), "line");
  ASSERT_EQ(heard.warnings.size(), 1U);
  const double begins = 3 * (line.duration() + 1);
  EXPECT_TRUE(heard.warnings[0].starts_with(fmt::format("what was heard is doubtful from {:.0f}.", begins)) ||
              heard.warnings[0].starts_with(fmt::format("what was heard is doubtful from {:.0f}.", begins - 1)))
      << heard.warnings[0];
}

/// Voices and lines from which the doubt was not learnt.
TEST(Recogniser, BelievesWhatItHearsRightlyInSomeNoise) {
  const auto recogniser = makeRecogniser({.as = HearAs::kAuto, .hint = {}});
  const AudioClip line = resampleAudio(makeVoice("flite:kal16")->speak("Let me know when you get home.").audio, 16000);
  AudioClip sound = joined({quiet(0.5), line, quiet(0.5)});
  const AudioClip hiss = noise(sound.duration(), static_cast<float>(0.1 * std::sqrt(meanSquare(sound))));
  for (std::size_t i = 0; i < sound.samples.size(); ++i) sound.samples[i] += hiss.samples[i];
  const HeardSpeech heard = recogniser->hear(sound, "line");
  EXPECT_EQ(heard.text, "let me know when you get home");
  EXPECT_FALSE(isDoubted(heard));
}

/// Words that fit well by themselves, while other phones are heard; phones that fit less well, but as the words do.
TEST(Recogniser, DoubtsWordsThatLieFarFromThePhones) {
  const auto recogniser = makeRecogniser({.as = HearAs::kAuto, .hint = {}});
  const auto hearLine = [&](const char* voice, const char* text) {
    const AudioClip line = resampleAudio(makeVoice(voice)->speak(text).audio, 16000);
    return recogniser->hear(joined({quiet(0.25), line, quiet(0.25)}), "line");
  };
  EXPECT_TRUE(isDoubted(hearLine("espeak:en-gb", "their apartment is on the third floor")));
  EXPECT_FALSE(isDoubted(hearLine("flite:kal16", "there is something wrong with my phone battery")));
}

/// Clear lines by voices that the doubt was not fitted to: a word of them is heard as another, or all are heard.
TEST(Recogniser, NamesTheWordsThatAreLikelyWrong) {
  const auto recogniser = makeRecogniser({.as = HearAs::kAuto, .hint = {}});
  const auto warningsOf = [&](const char* voice, const char* text) {
    const AudioClip line = resampleAudio(makeVoice(voice)->speak(text).audio, 16000);
    std::string all;
    for (const std::string& warning : recogniser->hear(joined({quiet(0.25), line, quiet(0.25)}), "line").warnings)
      all += warning + "\n";
    return all;
  };
  const auto names = [&](const char* voice, const char* text, const std::string& word) {
    const std::string all = warningsOf(voice, text);
    return all.starts_with("words that may be wrong: ") && all.find(" " + word + " (") != std::string::npos;
  };
  EXPECT_TRUE(names("flite:kal16", "the baby has two new teeth", "mutate"));
  EXPECT_EQ(warningsOf("flite:kal16", "we always have fish on friday"), "");
  EXPECT_EQ(warningsOf("flite:kal16", "the minister refused to answer any questions"), "");
}

}  // namespace
}  // namespace mouthpiece
