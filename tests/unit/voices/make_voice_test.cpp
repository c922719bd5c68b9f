#include "support/voice_testing.h"

namespace mouthpiece {
namespace {

TEST(MakeVoice, ListsTheKnownOnesForAnUnknownName) {
  for (const char* name :
       {"", "festival", "festival:", "festival:nobody", "flite:nobody", "espeak", "festival:kal_diphone) (quit"}) {
    const std::string error = errorOf([&] { makeVoice(name); });
    EXPECT_NE(error.find("expected one of festival:cmu_us_slt_arctic_hts, festival:kal_diphone, flite:slt"),
              std::string::npos)
        << error;
  }
}

TEST(MakeVoice, KnowsEveryVoiceItLists) {
  for (const std::string& name : knownVoices()) {
    if (name == "corpus") continue;  // below
    EXPECT_NE(makeVoice(name), nullptr) << name;
  }
}

TEST(MakeVoice, ACorpusVoiceNeedsACorpus) {
  EXPECT_NE(errorOf([] { makeVoice("corpus"); }).find("found no corpus"), std::string::npos);
}

TEST(MakeVoice, FallsBackOnFliteWithAWordWhereFestivalIsAbsent) {
  const std::string old_path = std::getenv("PATH");
  ::setenv("PATH", "/nonexistent", 1);
  EXPECT_FALSE(festivalAvailable());
  const SpokenLine line = makeVoice("festival:cmu_us_slt_arctic_hts")->speak("the time is now");
  ::setenv("PATH", old_path.c_str(), 1);
  EXPECT_EQ(line.voice, "flite:slt");
  EXPECT_EQ(line.notice,
            "Festival is not installed (sudo apt-get install festival festvox-us-slt-hts): speaking with flite:slt");
  EXPECT_EQ(wordsOf(line.labels), "the time is now");
}

TEST(MakeVoice, ALexiconIsReadOrSaidToBeNot) {
  const Lexicon lexicon = Lexicon::parse("time T UW M\n", "l");
  const auto says_oo = [](const SpokenLine& line) {
    return std::any_of(line.labels.phones.begin(), line.labels.phones.end(),
                       [](const LabelledPhone& phone) { return phone.phone == Phone::kUW; });
  };
  for (const std::string& name : knownVoices()) {
    if (name == "corpus") continue;                   // chosen by what Festival says
    if (languageOfVoice(name).tag != "en") continue;  // the words are English
    const SpokenLine line = makeVoice(name, {.lexicon = &lexicon})->speak("the time is it");
    const bool is_told = line.notice.find("the voice " + name + " reads no lexicon") != std::string::npos;
    EXPECT_NE(says_oo(line), is_told) << name << ": " << line.notice;
    EXPECT_EQ(makeVoice(name)->speak("it is").notice.find("lexicon"), std::string::npos) << name;
  }
}

}  // namespace
}  // namespace mouthpiece
