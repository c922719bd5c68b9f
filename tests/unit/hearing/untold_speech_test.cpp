// Speech of a sound that its labels have no words for.
#include "hearing/alignment/untold_speech.h"

#include <gtest/gtest.h>

#include "hearing/alignment/forced_alignment.h"
#include "hearing/alignment/samples_to_hear.h"
#include "voices/voice.h"

namespace mouthpiece {
namespace {

constexpr const char* kFirst = "Could you pass me the salt, please?";
constexpr const char* kSecond = "She called yesterday to say thank you, and the train was late again this morning.";

SpokenLine spoken() { return makeVoice("flite:slt")->speak(std::string(kFirst) + " " + kSecond); }

TEST(UntoldSpeech, IsNoneWhereAllIsLabelled) {
  const SpokenLine line = spoken();
  EXPECT_EQ(untoldSpeech(SamplesToHear(line.audio).all(), line.labels), "");
}

TEST(UntoldSpeech, IsToldWithItsTimes) {
  SpokenLine line = spoken();
  Seconds end = 0;  // of the last phone that keeps its label
  for (LabelledPhone& phone : line.labels.phones) {
    if (phone.word && *phone.word >= 7) {
      phone.phone = Phone::kSil;
    } else if (phone.phone != Phone::kSil) {
      end = phone.span.end;
    }
  }
  const std::string told = untoldSpeech(SamplesToHear(line.audio).all(), line.labels);
  EXPECT_NE(told.find("have no words"), std::string::npos) << told;
  const double from = std::stod(told.substr(told.find("words, ") + 7)),
               to = std::stod(told.substr(told.find(" to ") + 4));
  EXPECT_NEAR(from, end, 0.8) << told;
  EXPECT_NEAR(to, line.audio.duration(), 0.8) << told;
}

TEST(UntoldSpeech, IsToldOfATextThatIsAPartOfWhatIsSaid) {
  const SpokenLine line = spoken();
  const Pronouncer pronouncer(nullptr, english());
  ForcedAligner aligner;
  for (const auto& [text, is_whole] : {std::pair(std::string(kFirst) + " " + kSecond, true), {kFirst, false}}) {
    const ForcedAlignment found = aligner.align(line.audio, pronouncer.wordsOf(text), "a.wav");
    EXPECT_EQ(untoldSpeech(SamplesToHear(line.audio).all(), found.labels).empty(), is_whole) << text;
  }
}

TEST(UntoldSpeech, IsNoneInSilence) {
  SpokenLine line = spoken();
  line.audio.samples.resize(line.audio.samples.size() + 10 * static_cast<std::size_t>(line.audio.sample_rate_hz));
  line.labels.phones.push_back({.phone = Phone::kSil, .span = {line.labels.duration(), line.audio.duration()}});
  EXPECT_EQ(untoldSpeech(SamplesToHear(line.audio).all(), line.labels), "");
}

}  // namespace
}  // namespace mouthpiece
