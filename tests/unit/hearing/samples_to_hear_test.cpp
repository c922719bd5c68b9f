// What is heard of a long sound is the same wherever it is kept.
#include "hearing/alignment/samples_to_hear.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "base/files.h"
#include "hearing/alignment/phone_ear.h"
#include "hearing/recognition/recogniser.h"
#include "hearing/times/times_file.h"
#include "voices/voice.h"

namespace mouthpiece {
namespace {

AudioClip longTone(int rate_hz) {
  AudioClip clip{rate_hz, std::vector<float>(static_cast<std::size_t>(301 * rate_hz))};
  for (std::size_t i = 0; i < clip.samples.size(); ++i)
    clip.samples[i] =
        static_cast<float>(std::sin(0.001 * static_cast<double>(i % 100'003) * static_cast<double>(i % 13)));
  return clip;
}

TEST(SamplesToHear, AreTheSameOfALongSound) {
  for (const int rate_hz : {16'000, 22'050}) {
    const AudioClip clip = longTone(rate_hz);
    const SamplesToHear kept(clip);
    EXPECT_TRUE(std::ranges::equal(kept.all(), samplesToHear(clip))) << rate_hz;
    kept.letGo();
    EXPECT_TRUE(std::ranges::equal(kept.all(), samplesToHear(clip))) << rate_hz;
  }
}

TEST(SamplesToHear, StayInMemoryWhereNoFileCanBeMade) {
  const AudioClip clip = longTone(16'000);
  ::setenv("TMPDIR", "/proc", 1);
  const SamplesToHear kept(clip);
  ::unsetenv("TMPDIR");
  EXPECT_TRUE(std::ranges::equal(kept.all(), samplesToHear(clip)));
}

/// The words of a long sound are aligned in what is kept of it.
TEST(TimedRecogniser, FindsThePhonesOfALongSoundAsOfAShortOne) {
  const SpokenLine line = makeVoice("flite:slt")->speak("the time is now");
  const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / "mouthpiece_of_long.ctm";
  std::string ctm;
  for (const LabelledWord& word : line.labels.words) {
    const TimeSpan span = line.labels.spanOf(word.phones);
    ctm += "a 1 " + std::to_string(span.start) + " " + std::to_string(span.duration()) + " " + word.text + "\n";
  }
  writeFileAtomically(file, ctm);
  AudioClip sound = resampleAudio(line.audio, SamplesToHear::kRateHz);
  sound.samples.resize(sound.samples.size() + SamplesToHear::kRateHz, 0.0F);
  const SpeechLabels of_short = makeTimedRecogniser(file)->hear(sound, "short").labels;
  sound.samples.resize(static_cast<std::size_t>(301 * SamplesToHear::kRateHz), 0.0F);
  const SpeechLabels of_long = makeTimedRecogniser(file)->hear(sound, "long").labels;
  ASSERT_EQ(of_short.phones.size(), of_long.phones.size());
  for (std::size_t i = 0; i + 1 < of_short.phones.size(); ++i) {
    EXPECT_EQ(of_short.phones[i].phone, of_long.phones[i].phone) << i;
    EXPECT_EQ(of_short.phones[i].span.end, of_long.phones[i].span.end) << i;
  }
}

}  // namespace
}  // namespace mouthpiece
