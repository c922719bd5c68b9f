#include "hearing/recognition/live_ear.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "base/index.h"
#include "hearing/alignment/phone_ear.h"
#include "hearing/recognition/recogniser.h"
#include "voices/voice.h"

namespace mouthpiece {
namespace {

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

/// Of the time in which `labels` have phones, the share in which they are heard.
double shareIn(const std::vector<PhoneSegment>& heard, const SpeechLabels& labels) {
  Seconds right = 0, said = 0;
  for (const LabelledPhone& phone : labels.phones) {
    if (phone.phone == Phone::kSil) continue;
    said += phone.span.duration();
    for (const PhoneSegment& segment : heard) {
      if (segment.phone != phone.phone) continue;
      right +=
          std::max(0.0, std::min(segment.span.end, phone.span.end) - std::max(segment.span.start, phone.span.start));
    }
  }
  return right / said;
}

double heardShare(LiveEar ear, const SpokenLine& line) {
  return shareIn(heardBy(std::move(ear), line.audio), line.labels);
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
  EXPECT_GT(heardShare(LiveEar(english(), learnt), line), heardShare(LiveEar(english()), line) + kBetter);
}

/// The mean over lines of the share of what a file's ear hears, without words, that the stream's ear hears as well.
double likeTheFile(const std::vector<LabelledSound>& speaker, const std::vector<LabelledSound>& lines,
                   Seconds look_ahead) {
  RecogniserOptions options;
  options.as = HearAs::kPhones;
  options.speaker = speaker;
  const auto file = makeRecogniser(options);
  double share = 0;
  for (const LabelledSound& line : lines) {
    share += shareIn(heardBy(LiveEar(english(), speaker, look_ahead), line.audio), file->hear(line.audio, "").labels) /
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
