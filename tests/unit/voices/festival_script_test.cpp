#include "voices/festival_script.h"

#include "support/voice_testing.h"

namespace mouthpiece {
namespace {

TEST(FestivalScript, DoesNotDependOnTheText) {
  const auto script = makeFestivalJob("kal_diphone", "hello", nullptr).script;
  for (const char* text : {"\") (system \"touch /tmp/x\") (\"", "(quit)", "a ; b", "{labels} {text}"}) {
    const FestivalJob job = makeFestivalJob("kal_diphone", text, nullptr);
    EXPECT_EQ(job.script, script);
    EXPECT_EQ(job.text, std::string(text) + "\n");
  }
  EXPECT_NE(script.find("(tts_file \"text.txt\" 'text)"), std::string::npos);
  EXPECT_NE(script.find("(fopen \"labels.txt\" \"wb\")"), std::string::npos);
}

TEST(FestivalScript, TakesPronunciationsFromTheLexicon) {
  const Lexicon lexicon = Lexicon::parse("again AH G EH N\nfour F AO\nZ Z EH D\nM EH M\nx-ray EH K S\n", "l");
  const FestivalJob job = makeFestivalJob("kal_diphone", "Again Z, four Z again. a.M. x-ray", &lexicon);
  EXPECT_EQ(job.text, "Again mpletterz, four mpletterz again. a.M. x-ray\n");
  EXPECT_NE(job.script.find("(lex.add.entry '(\"again\" nil (((ax) 0)((g eh n) 1))))\n"), std::string::npos)
      << job.script;
  EXPECT_NE(job.script.find("(lex.add.entry '(\"mpletterz\" nil (((z eh d) 1))))\n"), std::string::npos);
  EXPECT_EQ(job.script.find("x-ray"), std::string::npos);
  EXPECT_EQ(job.script.find("mpletterm"), std::string::npos);
}

TEST(FestivalScript, LetsNoLexiconWordIntoTheSchemeProgram) {
  const Lexicon lexicon = Lexicon::parse("a\"b)(c AH\n(system AH\n\\ AH\nit's IH T S\n", "l");
  const FestivalJob job = makeFestivalJob("kal_diphone", "a\"b)(c (system it's", &lexicon);
  EXPECT_EQ(job.script.find("system"), std::string::npos);
  EXPECT_NE(job.script.find("(\"it's\" nil (((ih t s) 1)))"), std::string::npos);
}

TEST(FestivalLabels, ReadsUtterancesWordsAndPhones) {
  const auto utterances = parseFestivalLabels(
      "utterance\nword _1 John\nword _2 's\nword _3 mplettera\nphone pau 0.1 0 0 0\nphone jh 0.2 _9 1 _1\nphone aa 0.3 "
      "_9 1 _1\n"
      "phone z 0.4 _9 1 _1\nphone ey 0.5 _10 0 _3\nphone pau 0.6 0 0 0\nutterance\nphone pau 0.1 0 0 0\nend\n");
  ASSERT_EQ(utterances.size(), 2U);
  EXPECT_EQ(utterances[0].words, (std::vector<std::string>{"John's", "'s", "A"}));
  ASSERT_EQ(utterances[0].phones.size(), 6U);
  EXPECT_EQ(utterances[0].phones[3].word, 0U);
  EXPECT_EQ(utterances[0].phones[3].stress, 1);
  EXPECT_NE(utterances[0].phones[3].syllable, utterances[0].phones[4].syllable);
  EXPECT_EQ(utterances[0].phones[4].span, (TimeSpan{0.4, 0.5}));
  EXPECT_EQ(utterances[1].phones[0].span, (TimeSpan{0, 0.1}));
}

TEST(FestivalLabels, RefusesWhatIsNotWhole) {
  EXPECT_EQ(errorOf([] { parseFestivalLabels("utterance\n"); }),
            "festival:labels line 1: ended in the middle; expected its labels");
  for (const char* labels :
       {"", "phone aa 1 0 0 0\nend\n", "utterance\nphone qq 1 0 0 0\nend\n", "utterance\nphone aa x 0 0 0\nend\n",
        "utterance\nphone aa 1 0 0 0\nphone aa 0.5 0 0 0\nend\n", "utterance\nphone aa nan 0 0 0\nend\n",
        "utterance\nphone aa 1e30 0 0 0\nend\n", "utterance\nword _1 a b\nend\n", "\n"}) {
    EXPECT_NE(errorOf([&] { parseFestivalLabels(labels); }).find("expected its labels"), std::string::npos) << labels;
  }
}

}  // namespace
}  // namespace mouthpiece
