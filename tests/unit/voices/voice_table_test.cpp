#include <random>
#include <set>

#include "phonetics/language/flite_functions.h"
#include "phonetics/language/flite_library.h"
#include "phonetics/language/language.h"
#include "support/made_up_language.h"
#include "support/voice_testing.h"
#include "voices/engines.h"
#include "voices/festival_script.h"
#include "voices/spoken_line_builder.h"

namespace mouthpiece {
namespace {

TEST(VoiceTable, EveryRowIsWholeAndItsOwn) {
  std::set<std::string_view> names;
  for (const VoiceRow& row : voices()) {
    EXPECT_TRUE(names.insert(row.name).second) << row.name;
    EXPECT_FALSE(row.what.empty()) << row.name;
    EXPECT_NO_THROW(languageOf(row.language)) << row.name;
    EXPECT_NE(row.make, nullptr);
  }
  EXPECT_EQ(names.size(), knownVoices().size());
  EXPECT_EQ(voices().front().name, "festival:cmu_us_slt_arctic_hts") << "the default";
}

TEST(VoiceTable, EveryLanguageIsSpokenButJapanese) {
  for (const Language* language : languages()) {
    if (language == &japanese()) {
      EXPECT_NE(errorOf([&] { voiceFor(*language); }).find("which no voice says"), std::string::npos);
      continue;
    }
    EXPECT_NO_THROW(languageOfVoice(voiceFor(*language))) << language->name;
    EXPECT_TRUE(std::any_of(voices().begin(), voices().end(), [&](const VoiceRow& row) {
      return &languageOf(row.language) == language;
    })) << language->name;
  }
}

TEST(VoiceTable, EveryLanguageOfEspeakIsAVoice) {
  EXPECT_EQ(languageOfVoice("espeak:sv").name, "Swedish");
  EXPECT_FALSE(languageOfVoice("espeak:sv").is_tuned);
  EXPECT_EQ(voiceFor(languageOf("fi")), "espeak:fi");
  EXPECT_EQ(voiceFor(languageOf("pt-BR")), "espeak:pt-br");
  EXPECT_NE(errorOf([] { makeVoice("espeak:xx"); }), "no error");
  EXPECT_NE(errorOf([] { makeVoice("espeak:ja"); }), "no error") << "its Japanese is no use";
}

TEST(VoiceTable, BritishEnglishHasAVoiceOfItsOwn) {
  for (const char* tag : {"en-GB", "en-gb", "en-GB-oxendict", "en_GB.UTF-8"})
    EXPECT_EQ(voiceOfRegion(tag), "espeak:en-gb") << tag;
  for (const char* tag : {"en", "en-US", "en-AU", "pt-BR", "es-419", "de", "en-gbx", ""})
    EXPECT_EQ(voiceOfRegion(tag), std::nullopt) << tag;
}

TEST(VoiceTable, TheErrorListsEveryRow) {
  const std::string error = errorOf([] { makeVoice("nobody"); });
  for (const VoiceRow& row : voices()) EXPECT_NE(error.find(row.name), std::string::npos) << row.name;
}

// No voice may speak a phone that we have no row for.

TEST(VoicePhones, EveryFlitePhoneHasARow) {
  const std::scoped_lock lock(fliteLock());
  for (const char* name : {"slt", "rms", "awb", "kal16"}) {
    const cst_voice* voice = fliteVoice(name);
    ASSERT_NE(voice, nullptr) << name;
    const LateFunction<decltype(::val_phoneset)> phonesetOf(kFlite, "val_phoneset");
    const cst_phoneset* phones = phonesetOf(feat_val(voice->features, "phoneset"));
    ASSERT_GT(phones->num_phones, 35) << name;
    for (int i = 0; i < phones->num_phones; ++i)
      EXPECT_TRUE(phoneFromName(phones->phonenames[i])) << name << " speaks " << phones->phonenames[i];
  }
  EXPECT_EQ(fliteVoice("nobody"), nullptr);
  EXPECT_EQ(fliteVoice("rms"), fliteVoice("rms"));
}

TEST(VoicePhones, EveryPhoneOfFestivalsRadioSetHasARow) {
  // festival/lib/radio_phones.scm.
  for (const char* name :
       {"aa", "ae", "ah", "ao", "aw", "ax", "axr", "ay", "b",  "ch", "d", "dh", "dx", "eh",  "el", "em",  "en",
        "er", "ey", "f",  "g",  "hh", "hv", "ih",  "iy", "jh", "k",  "l", "m",  "n",  "nx",  "ng", "ow",  "oy",
        "p",  "r",  "s",  "sh", "t",  "th", "uh",  "uw", "v",  "w",  "y", "z",  "zh", "pau", "h#", "brth"}) {
    const auto phone = phoneFromName(name);
    ASSERT_TRUE(phone) << name;
    EXPECT_TRUE(*phone == Phone::kSil || english().find(*phone) != nullptr) << name;
  }
}

TEST(VoicePhones, EspeakSaysEverySymbolOfALanguage) {
  const auto said = [](std::string_view symbol, const Language& language) {
    std::vector<std::string> unknown;
    std::vector<Phone> phones;
    for (const SpelledPhone& phone : phonesOfEspeakSymbol(symbol, language, unknown)) phones.push_back(phone.phone);
    return phones;
  };
  for (const Language* language : {&english(), &madeUpLanguage()}) {
    for (const LanguagePhone& phone : language->inventory) {
      const std::string usual(phone.ipa.substr(0, phone.ipa.find(' ')));
      EXPECT_EQ(said(usual, *language), std::vector{phone.phone}) << usual;
    }
    for (const VoiceSymbol& symbol : language->voice_symbols)
      EXPECT_FALSE(said(symbol.ipa, *language).empty()) << symbol.ipa;
  }
  EXPECT_EQ(said("ø", madeUpLanguage()), std::vector{Phone::kUW});
  EXPECT_EQ(said("ø", english()), std::vector{Phone::kOW}) << "English has none: by articulation";
  std::vector<std::string> unknown;
  EXPECT_TRUE(phonesOfEspeakSymbol("☃", english(), unknown).empty());
  EXPECT_EQ(unknown, std::vector<std::string>{"☃"});
}

TEST(VoicePhones, EspeaksVowelsHaveAStressEach) {
  std::mt19937 random(20261122);
  for (int round = 0; round < 500; ++round) {
    std::string transcription;
    std::vector<int> expected;
    int stress = 0;
    const int symbols = std::uniform_int_distribution<int>(1, 12)(random);
    for (int i = 0; i < symbols; ++i) {
      const int mark = std::uniform_int_distribution<int>(0, 4)(random);
      const auto& inventory = english().inventory;
      const auto& phone = inventory[std::uniform_int_distribution<std::size_t>(0, inventory.size() - 1)(random)];
      if (mark == 1 || mark == 2) {
        transcription += mark == 1 ? "ˈ" : "ˌ";
        stress = mark;
      }
      transcription += std::string(phone.ipa.substr(0, phone.ipa.find(' '))) + " ";  // blanks: no symbols of two
      if (isVowel(phone.phone)) expected.push_back(std::exchange(stress, 0));
    }
    EXPECT_EQ(stressesOfEspeakText(transcription), expected) << transcription;
  }
}

AudioClip noise(Seconds length, std::mt19937& random) {
  AudioClip audio{16000, {}};
  audio.samples.resize(static_cast<std::size_t>(length * audio.sample_rate_hz));
  for (float& sample : audio.samples) sample = std::uniform_real_distribution<float>(-0.5F, 0.5F)(random);
  return audio;
}

TEST(SpokenLineBuilder, SoundAndLabelsEndTogetherWhateverIsAdded) {
  for (unsigned round = 0; round < 100; ++round) {
    std::mt19937 random(20261122 + round);
    const auto length = [&](double low, double high) {
      return std::uniform_real_distribution<double>(low, high)(random);
    };
    SpokenLineBuilder builder;
    std::size_t words = 0, samples = 0;
    for (int utterance = 0; utterance < 4; ++utterance) {
      const AudioClip audio = noise(length(0.3, 1.5), random);
      std::vector<PhoneSegment> phones;
      Seconds time = 0;
      for (const Phone phone : {Phone::kSil, Phone::kM, Phone::kAA, Phone::kSil}) {
        const Seconds end = time + length(0.02, 0.4);
        phones.push_back({.phone = phone, .span = {time, end}, .word = 0});
        time = end;
      }
      if (utterance == 2) phones = {{.phone = Phone::kSil, .span = {0, 0.5}}};  // says nothing: left out
      if (utterance != 2) {
        ++words;
        samples += std::max(audio.samples.size(), static_cast<std::size_t>(std::ceil(time * 16000 - 1e-3)));
      }
      builder.add(audio, phones, {"ma"});
    }
    const SpokenLine line = builder.build("ma", "test");
    EXPECT_NO_THROW(expectConsistent(line.labels));
    EXPECT_EQ(line.labels.words.size(), words);
    EXPECT_NEAR(line.labels.duration(), line.audio.duration(), 1e-9);
    EXPECT_NEAR(static_cast<double>(line.audio.samples.size()), static_cast<double>(samples), 4.0);
  }
  EXPECT_NE(errorOf([] { SpokenLineBuilder().build("-", "test"); }).find("has nothing to say"), std::string::npos);
}

TEST(FestivalLabels, DamagedOnesAreRefusedOrStayInOrder) {
  const std::string good =
      "utterance\nword 1 time\nword 2 is\nphone pau 0.1 0 0 0\nphone t 0.2 5 1 1\nphone ay 0.35 5 1 1\n"
      "phone m 0.4 5 1 1\nphone ih 0.5 6 0 2\nphone z 0.6 6 0 2\nphone pau 0.7 0 0 0\nend\n";
  EXPECT_EQ(parseFestivalLabels(good).at(0).phones.size(), 7U);
  std::size_t refused = 0;
  for (unsigned round = 0; round < 2000; ++round) {
    std::mt19937 random(20261122 + round);
    std::string bytes = good;
    for (int edits = 0; edits < 2; ++edits) {
      const auto at = std::uniform_int_distribution<std::size_t>(0, bytes.size() - 1)(random);
      const int kind = std::uniform_int_distribution<int>(0, 2)(random);
      if (kind == 0) bytes[at] = static_cast<char>(std::uniform_int_distribution<int>(0, 255)(random));
      if (kind == 1) bytes.erase(at, 5);
      if (kind == 2) bytes.insert(at, bytes.substr(at / 2, 9));
    }
    try {
      for (const FestivalUtterance& utterance : parseFestivalLabels(bytes)) {
        Seconds end = 0;
        for (const PhoneSegment& phone : utterance.phones) {
          EXPECT_TRUE(phone.span.start >= end && phone.span.end > phone.span.start && phone.span.end < 1e5);
          EXPECT_TRUE(!phone.word || *phone.word < utterance.words.size());
          end = phone.span.end;
        }
      }
    } catch (const InputError&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 500U);
}

TEST(FestivalJob, NothingOfTheTextBecomesScheme) {
  const Lexicon lexicon = Lexicon::parse("red R EH1 D\nA EY1\nb(2) B IY1\n", "l");
  for (const char* text : {"red (quit) \"a\" A b", "'(voice) red; (exit)", "\\\" red A.", "a.m. A red-A"}) {
    const FestivalJob plain = makeFestivalJob("kal_diphone", text, nullptr);
    const FestivalJob said = makeFestivalJob("kal_diphone", text, &lexicon);
    EXPECT_EQ(plain.text, std::string(text) + "\n");
    EXPECT_EQ(plain.script, makeFestivalJob("kal_diphone", "another", nullptr).script);
    // With a lexicon the script gains entries of lower-case words and phones only.
    std::size_t entries = 0;
    std::istringstream lines(said.script);
    for (std::string line; std::getline(lines, line);) {
      if (!line.starts_with("(lex.add.entry")) continue;
      ++entries;
      EXPECT_EQ(line.find_first_not_of("(lex.add.entry '\"abcdefghijklmnopqrstuvwxyz)012"), std::string::npos) << line;
    }
    EXPECT_GT(entries, 0U) << text;
  }
}

}  // namespace
}  // namespace mouthpiece
