#include "hearing/live/live_ear.h"

#include <gtest/gtest.h>

#include <vector>

#include "base/index.h"
#include "hearing/alignment/phone_ear.h"
#include "hearing/recognition/recogniser.h"
#include "support/heard_share.h"
#include "voices/voice.h"

namespace mouthpiece {
namespace {

using test::heardShare;

constexpr double kLearntShare = 0.85, kStrangersShare = 0.65;

std::vector<PhoneSegment> heardBy(LiveEar ear, const AudioClip& audio) {
  constexpr std::size_t kMore = 50;  // hops: two seconds more settle all
  std::vector<std::int16_t> samples = samplesToHear(audio);
  samples.resize((samples.size() / LiveEar::kHop + kMore) * LiveEar::kHop);
  std::vector<PhoneSegment> heard;
  for (std::size_t at = 0; at < samples.size(); at += LiveEar::kHop) {
    const std::vector<PhoneSegment> more = ear.hear(std::span(samples).subspan(at, LiveEar::kHop));
    heard.insert(heard.end(), more.begin(), more.end());
  }
  return heard;
}

double shareHeardBy(LiveEar ear, const SpokenLine& line) {
  return heardShare(heardBy(std::move(ear), line.audio), line.labels);
}

std::vector<LabelledSound> linesOf(const char* voice) {
  const auto speaker = makeVoice(voice);
  std::vector<LabelledSound> lines;
  for (const char* text :
       {"bring the blue boat back before many people come", "my mother may move the pump by the pond",
        "nine men never knew the tune", "five very brave foxes live above the valley", "put the paper cup upon the map",
        "the cat could not keep the key", "some boys hope for a warm summer", "we know that moon and man are one"}) {
    SpokenLine line = speaker->speak(text);
    lines.push_back({line.audio, line.labels});
  }
  return lines;
}

TEST(LiveEar, HearsASpeakerBetterWhoWasLearntFrom) {
  constexpr double kBetter = 0.10;
  const std::vector<LabelledSound> learnt = linesOf("espeak:en-gb");
  const SpokenLine line = makeVoice("espeak:en-gb")->speak("maybe nobody came to the pump by noon");
  EXPECT_GT(shareHeardBy(LiveEar(english(), learnt), line), shareHeardBy(LiveEar(english()), line) + kBetter);
}

/// The mean over lines of the share of what a file's ear hears, without words, that the stream's ear hears as well.
double likeTheFile(const std::vector<LabelledSound>& speaker, const std::vector<LabelledSound>& lines,
                   Seconds look_ahead) {
  RecogniserOptions options;
  options.as = HearAs::kPhones;
  options.speaker = soundsAmong(speaker);
  const auto file = makeRecogniser(options);
  double share = 0;
  for (const LabelledSound& line : lines) {
    share +=
        heardShare(heardBy(LiveEar(english(), speaker, look_ahead), line.audio), file->hear(line.audio, "").labels) /
        asReal(lines.size());
  }
  return share;
}

TEST(LiveEar, HearsALearntSpeakerAsTheFileDoes) {
  const auto voice = makeVoice("festival:kal_diphone");
  const SpokenLine line = voice->speak("maybe nobody came to the pump by noon");
  EXPECT_GT(likeTheFile(linesOf("festival:kal_diphone"), {{line.audio, line.labels}}, 1.0), kLearntShare);
}

TEST(LiveEar, HearsAStrangersVoiceWhileItGoesOn) {
  EXPECT_GT(likeTheFile({}, linesOf("espeak:en-us"), 1.0), kStrangersShare);
}

}  // namespace
}  // namespace mouthpiece
