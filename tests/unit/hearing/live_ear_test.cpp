#include "hearing/recognition/live_ear.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "hearing/alignment/phone_ear.h"
#include "voices/voice.h"

namespace mouthpiece {
namespace {

/// Of the time in which a voice says phones, the share in which they are heard.
double heardShare(LiveEar ear, const SpokenLine& line) {
  std::vector<std::int16_t> samples = samplesToHear(line.audio);
  samples.resize((samples.size() / LiveEar::kHop + 25) * LiveEar::kHop);  // a second more settles all
  std::vector<PhoneSegment> heard;
  for (std::size_t at = 0; at < samples.size(); at += LiveEar::kHop) {
    const std::vector<PhoneSegment> more = ear.hear(std::span(samples).subspan(at, LiveEar::kHop));
    heard.insert(heard.end(), more.begin(), more.end());
  }
  Seconds right = 0, said = 0;
  for (const LabelledPhone& phone : line.labels.phones) {
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

TEST(LiveEar, HearsASpeakerBetterWhoWasLearntFrom) {
  constexpr double kBetter = 0.10;
  const auto speaker = makeVoice("espeak:en-gb");
  std::vector<LabelledSound> learnt;
  for (const char* text :
       {"bring the blue boat back before many people come", "my mother may move the pump by the pond",
        "nine men never knew the tune", "five very brave foxes live above the valley", "put the paper cup upon the map",
        "the cat could not keep the key", "some boys hope for a warm summer", "we know that moon and man are one"}) {
    SpokenLine line = speaker->speak(text);
    learnt.push_back({line.audio, line.labels});
  }
  const SpokenLine line = speaker->speak("maybe nobody came to the pump by noon");
  EXPECT_GT(heardShare(LiveEar(english(), learnt), line), heardShare(LiveEar(english()), line) + kBetter);
}

}  // namespace
}  // namespace mouthpiece
