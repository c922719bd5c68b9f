#include <link.h>

#include <cmath>
#include <tuple>

#include "phonetics/text/speakable_text.h"
#include "support/voice_testing.h"
#include "voices/engines.h"

namespace mouthpiece {
namespace {

std::string phonesOf(std::string_view symbol) {
  std::string names;
  std::vector<std::string> unknown;
  for (const SpelledPhone& phone : phonesOfEspeakSymbol(symbol, english(), unknown))
    names += std::string(phoneName(phone.phone)) + " ";
  for (const std::string& sign : unknown) names += "?" + sign + " ";
  return names;
}

TEST(EspeakPhones, SplitsSymbolsThatStandForSeveral) {
  EXPECT_EQ(phonesOf("ɔːɹ"), "AO R ");
  EXPECT_EQ(phonesOf("əl"), "AH L ");
  EXPECT_EQ(phonesOf("n̩"), "AH N ");
  EXPECT_EQ(phonesOf("aɪɚ"), "AY ER ");
  EXPECT_EQ(phonesOf("tʃ"), "CH ");
  EXPECT_EQ(phonesOf("ᵻ"), "IH ");
  EXPECT_EQ(phonesOf("ʛ"), "G ") << "English has none: by articulation";
  EXPECT_EQ(phonesOf("☃"), "?☃ ");
}

TEST(EspeakPhones, ReadsTheStressesOfATranscription) {
  EXPECT_EQ(stressesOfEspeakText("ðə tˈaɪm ɪz nˈaʊ"), (std::vector<int>{0, 1, 0, 1}));
  EXPECT_EQ(stressesOfEspeakText("fˈɔːɹɾi_tˌuː bˈʌʔn̩"), (std::vector<int>{1, 0, 2, 1, 0}));
  EXPECT_TRUE(stressesOfEspeakText("").empty());
}

/// A tone with a hole of `closure` before 0.5 s.
AudioClip toneWithClosure(Seconds closure) {
  AudioClip audio{16000, std::vector<float>(16000)};
  for (std::size_t i = 0; i < audio.samples.size(); ++i) {
    const double time = static_cast<double>(i) / 16000;
    if (time < 0.5 - closure || time >= 0.5) audio.samples[i] = static_cast<float>(0.5 * std::sin(1000 * time));
  }
  return audio;
}

TEST(EspeakPhones, AStopHoldsTheSilenceBeforeItsBurst) {
  const std::vector<EspeakEvent> events = {{0.1, "æ", 0}, {0.5, "p", 0}, {0.6, "əl", 0}, {0.9, "", 0}};
  std::vector<std::string> unknown;
  const std::vector<PhoneSegment> phones = phonesFromEspeak(events, {1, 0}, toneWithClosure(0.06), english(), unknown);
  ASSERT_EQ(phones.size(), 5U);
  EXPECT_NEAR(phones[1].span.start, 0.44, 2e-3);  // the tone itself is quiet near its zeros
  EXPECT_EQ(phones[0].span.end, phones[1].span.start);
  EXPECT_NEAR(phones[2].span.end, 0.78, 1e-9);
  EXPECT_EQ(phones[0].stress, 1);
  EXPECT_EQ(phones[2].stress, 0);
  EXPECT_EQ(phones[4].phone, Phone::kSil);
}

TEST(EspeakPhones, AfterAPauseAStopClosesSixtyMillisecondsBefore) {
  const std::vector<EspeakEvent> events = {{0.1, "b", 0}, {0.2, "iː", 0}, {0.3, "", 0}, {0.5, "p", 1}, {0.6, "iː", 1}};
  std::vector<std::string> unknown;
  const std::vector<PhoneSegment> phones = phonesFromEspeak(events, {1, 1}, toneWithClosure(0), english(), unknown);
  EXPECT_NEAR(phones[0].span.start, 0.04, 1e-9);
  EXPECT_NEAR(phones[3].span.start, 0.44, 1e-9);
  EXPECT_NEAR(phones[2].span.end, 0.44, 1e-9);
}

TEST(EspeakPhones, AnLAnnouncedAtItsEndTakesAThird) {
  const std::vector<EspeakEvent> events = {{0.1, "ɔː", 0}, {0.39, "l", 0}, {0.4, "", 0}};
  std::vector<std::string> unknown;
  const std::vector<PhoneSegment> phones = phonesFromEspeak(events, {}, toneWithClosure(0), english(), unknown);
  EXPECT_NEAR(phones[1].span.start, 0.3, 1e-9);
  EXPECT_FALSE(phones[0].stress.has_value());
}

TEST(EspeakVoice, SpeaksWithLabelsOnTheSoundsClock) {
  const auto voice = makeVoice("espeak:en-us");
  const SpokenLine line = voice->speak("the time is now");
  expectGoodLine(line);
  EXPECT_EQ(line.voice, "espeak:en-us");
  EXPECT_EQ(namesOf(line.labels), "sil DH AH T AY M IH Z N AW sil");
  EXPECT_EQ(wordsOf(line.labels), "the time is now");
  ASSERT_EQ(line.labels.syllables.size(), 4U);
  EXPECT_EQ(line.labels.syllables[0].stress, 0);
  EXPECT_EQ(line.labels.syllables[1].stress, 1);
  EXPECT_EQ(namesOf(voice->speak("the time is now").labels), namesOf(line.labels));
}

TEST(EspeakVoice, SaysALineAlikeWhateverWasSaidBefore) {
  const auto say = [] { return makeVoice("espeak:en-gb")->speak("there is something wrong with my phone"); };
  const SpokenLine first = say();
  makeVoice("espeak:de")->speak("Guten Morgen liebe Leute");
  const SpokenLine again = say();
  EXPECT_EQ(again.audio.samples.size(), first.audio.samples.size());
  EXPECT_EQ(again.audio.samples, first.audio.samples);
}

/// How many shared libraries this program has loaded so far.
unsigned long long librariesLoaded() {
  unsigned long long count = 0;
  const auto visit = [](dl_phdr_info* info, std::size_t, void* found) {
    *static_cast<unsigned long long*>(found) = info->dlpi_adds;
    return 1;
  };
  dl_iterate_phdr(visit, &count);
  return count;
}

TEST(EspeakVoice, LoadsItsLibraryOnceForALine) {
  const auto voice = makeVoice("espeak:en-us");
  voice->speak("one");
  const auto before = librariesLoaded();
  const SpokenLine next = voice->speak("two");
  const auto of_a_sentence = librariesLoaded() - before;
  EXPECT_GT(of_a_sentence, 0U) << "each sentence has a library of its own";
  const SpokenLine alone = makeVoice("espeak:en-us")->speak("two");
  EXPECT_EQ(librariesLoaded() - before, 2 * of_a_sentence);
  EXPECT_EQ(alone.audio.samples, next.audio.samples);
}

/// The voice that was looked for is not the one that speaks next, or two were looked for.
TEST(EspeakVoice, SaysALineAlikeWhateverVoiceWasMadeBefore) {
  const SpokenLine first = makeVoice("espeak:en-gb")->speak("there is something wrong with my phone");
  const auto british = makeVoice("espeak:en-gb");
  const auto german = makeVoice("espeak:de");
  EXPECT_EQ(british->speak("there is something wrong with my phone").audio.samples, first.audio.samples);
  german->speak("Guten Morgen");
  makeVoice("espeak:de");
  EXPECT_EQ(british->speak("there is something wrong with my phone").audio.samples, first.audio.samples);
}

TEST(EspeakVoice, JoinsSentencesAndReadsNumbers) {
  const SpokenLine line = makeVoice("espeak:en-us")->speak("It is 42. Is it half past ten?");
  EXPECT_NO_THROW(expectConsistent(line.labels));
  EXPECT_EQ(wordsOf(line.labels), "It is forty two Is it half past ten");
}

TEST(EspeakVoice, SurvivesOddAndLongTexts) {
  const auto voice = makeVoice("espeak:en-us");
  std::string longest;
  while (longest.size() < 3000) longest += "(ten) \"past\" five\\ [[x]] <break time=\"9s\"/> ";
  for (const std::string& text : {std::string("a"), std::string("1"), std::string("''s"), std::string("$5"),
                                  std::string("10:30 A.M."), longest, std::string(1000, 'a'), std::string(300, '7')}) {
    EXPECT_NO_THROW(expectConsistent(voice->speak(text).labels)) << text.substr(0, 20);
  }
  EXPECT_THROW(voice->speak(""), InputError);
  EXPECT_THROW(voice->speak("\u041F"), InputError);
}

TEST(EspeakPhones, AnUnknownSymbolIsSaidWithANeutralMouthAndNamed) {
  std::vector<std::string> unknown;
  const auto phones =
      phonesFromEspeak({{0.1, "m", 0}, {0.2, "☃", 0}, {0.4, "", 0}}, {}, toneWithClosure(0), languageOf("de"), unknown);
  ASSERT_EQ(phones.size(), 3U);
  EXPECT_EQ(phones[1].phone, Phone::kAH);
  EXPECT_EQ(phones[1].ipa, "☃");
  EXPECT_EQ(unknown, std::vector<std::string>{"☃"});
}

/// eSpeak NG halts before a stop; that is its closure, no pause that parts a word.
TEST(EspeakVoice, NoSilencePartsAWord) {
  const SpokenLine line = makeVoice("espeak:it")->speak("Compriamo la frutta fresca e un bicchiere.");
  for (const LabelledWord& word : line.labels.words) {
    for (std::size_t i = word.phones.first.value; i <= word.phones.last.value; ++i)
      EXPECT_NE(line.labels.phones[i].phone, Phone::kSil) << word.text;
  }
}

/// They once went without a word: "1,50 €" was said as a number.
TEST(EspeakVoice, SignsAreReadInTheLanguage) {
  const auto voice = makeVoice("espeak:de");
  EXPECT_EQ(namesOf(voice->speak("Fünf € & fünf %").labels),
            namesOf(voice->speak("Fünf Euro und fünf Prozent").labels));
}

/// Its dictionaries say phrases as one, and announce them as one word.
TEST(EspeakVoice, EveryWrittenWordIsInTheLabels) {
  for (const auto& [tag, text] :
       {std::pair("en-us", "I am here with a man at the end of the road, and it was on the table for a while."),
        std::pair("en-gb", "You should have been there, as of the first of the month."),
        std::pair("de", "Es ist bei dem Haus, von der ich es weiß, und in der Nacht."),
        std::pair("fr", "Est-ce que vous avez vu le chat? Il n'y en a pas, il y a un homme de la ville."),
        std::pair("es", "A la vez hay un gato, por lo que no estoy en el trabajo."),
        std::pair("it", "Nella casa dell'uomo c'è un cane, per lo più di tanto in tanto."),
        std::pair("nl", "Het is in het huis van de man, en 's avonds bij het water."),
        std::pair("pl", "Z tobą nie idę do kina, bo w nocy nie ma autobusu.")}) {
    const SpokenLine line = makeVoice("espeak:" + std::string(tag))->speak(text);
    EXPECT_NO_THROW(expectConsistent(line.labels));
    EXPECT_EQ(plainWordsOf(wordsOf(line.labels)), plainWordsOf(line.text)) << tag;
  }
  // A phrase's phones are shared by the lengths that its words have alone.
  const SpokenLine line = makeVoice("espeak:en-us")->speak("I am sure of the rest");
  ASSERT_EQ(wordsOf(line.labels), "I am sure of the rest");
  EXPECT_EQ(line.labels.words[0].phones.last.value - line.labels.words[0].phones.first.value, 0U);
  EXPECT_EQ(line.labels.words[1].phones.last.value - line.labels.words[1].phones.first.value, 1U);
}

class EspeakLanguages : public testing::TestWithParam<const char*> {};

/// Every sound is one of IPA, every word stands in the labels, and what the aligner expects is what the voice says.
TEST_P(EspeakLanguages, SayAndExpectTheSame) {
  const auto& [tag, text, words] = std::tuple<const char*, const char*, std::size_t>(
      std::string_view(GetParam()) == "de"   ? std::tuple("de", "Über fünf Brücken müsst ihr gehen, 25 Mal.", 8UL)
      : std::string_view(GetParam()) == "fr" ? std::tuple("fr", "Les amis ont un bon vin.", 6UL)
      : std::string_view(GetParam()) == "pl" ? std::tuple("pl", "Pięć małych bułek.", 3UL)
                                             : std::tuple("ar", "مَرْحَبًا بالعالم", 2UL));
  const Language& language = languageOf(tag);
  const SpokenLine line = makeVoice(voiceFor(language))->speak(text);
  EXPECT_EQ(line.labels.words.size(), words);
  std::vector<std::string> spoken, expected, unknown;
  for (const LabelledPhone& phone : line.labels.phones) {
    if (phone.phone == Phone::kSil) continue;
    EXPECT_FALSE(phone.ipa.empty());
    phonesOfIpa(phone.ipa, unknown);
    spoken.push_back(phone.ipa);
  }
  EXPECT_TRUE(unknown.empty());
  for (const std::string& sentence : splitSentences(speakableText(text, language), 400)) {
    for (const SaidWord& word : language.say(sentence, language))
      expected.insert(expected.end(), word.said.ipa.begin(), word.said.ipa.end());
  }
  EXPECT_EQ(spoken, expected);
}
INSTANTIATE_TEST_SUITE_P(Some, EspeakLanguages, testing::Values("de", "fr", "pl", "ar"));

}  // namespace
}  // namespace mouthpiece
