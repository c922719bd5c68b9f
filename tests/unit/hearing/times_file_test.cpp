#include "hearing/times/times_file.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "base/errors.h"
#include "base/files.h"
#include "support/error_of.h"
#include "voices/voice.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

const fs::path kTimes = fs::path(MOUTHPIECE_SOURCE_DIR) / "tests/data/times";

TimesFile timesIn(const std::string& file) { return parseTimes(readFile(kTimes / file), file); }

std::string wordsOf(const TimesFile& times) {
  std::string text;
  for (const TimesFile::Word& word : times.words) text += (text.empty() ? "" : " ") + word.text;
  return text;
}

std::string phonesOf(const TimesFile& times) {
  std::string text;
  for (const PhoneSegment& phone : times.phones)
    text += (text.empty() ? "" : " ") + std::string(phoneName(phone.phone));
  return text;
}

struct Kind {
  std::string file, kind, words, phones;
  Seconds last_word_start;  ///< NaN without words
};

class TimesOfOthers : public testing::TestWithParam<Kind> {};

TEST_P(TimesOfOthers, AreReadAsTheirDocumentationSays) {
  const TimesFile times = timesIn(GetParam().file);
  EXPECT_EQ(times.kind, GetParam().kind);
  EXPECT_EQ(wordsOf(times), GetParam().words);
  EXPECT_EQ(phonesOf(times), GetParam().phones);
  if (!times.words.empty()) {
    EXPECT_NEAR(times.words.back().span.start, GetParam().last_word_start, 1e-6);
  }
  if (!times.phones.empty()) {
    EXPECT_NEAR(times.phones.back().span.end, 1.4, 0.002);
  }
}

constexpr const char* kSaid = "DH AH T AY M IH Z N AW";

INSTANTIATE_TEST_SUITE_P(
    Kinds, TimesOfOthers,
    testing::Values(Kind{"whisper.json", "Whisper JSON", "The time is now.", "", 0.9},
                    Kind{"whisper_lines.json", "Whisper JSON", "The time is now.", "", 0.1},
                    Kind{"whisperx.json", "Whisper JSON", "The 2 times are now.", "", 0.9},
                    Kind{"transformers.json", "Transformers JSON", "The time is now.", "", 0.9},
                    Kind{"whisper.tsv", "Whisper TSV", "The time is now.", "", 0.1},
                    Kind{"audacity.txt", "Audacity labels", "The time is now.", "", 0.9},
                    Kind{"whisper_cpp.json", "whisper.cpp JSON", "The time is now.", "", 0.1},
                    Kind{"vosk.json", "Vosk JSON", "the time is now", "", 0.9},
                    Kind{"vosk_stream.json", "Vosk JSON", "the time is now", "", 0.9},
                    Kind{"vosk_alternatives.json", "Vosk JSON", "the time is now", "", 0.9},
                    Kind{"azure_words.json", "Azure visemes", "the time is now", "", 0.9},
                    Kind{"azure_results.jsonl", "Azure JSON", "the time is now", "", 0.9},
                    Kind{"azure_batch.json", "Azure JSON", "the time is now", "", 0.9},
                    Kind{"azure_fast.json", "Azure JSON", "The time is now.", "", 0.9},
                    Kind{"elevenlabs_stream.jsonl", "ElevenLabs JSON", "The time is now.", "", 0.9},
                    Kind{"elevenlabs_socket.jsonl", "ElevenLabs JSON", "The time is now.", "", 0.9},
                    Kind{"elevenlabs_aligned.json", "ElevenLabs JSON", "The time is now.", "", 0.9},
                    Kind{"gentle.json", "Gentle JSON", "The time is now", kSaid, 0.9},
                    Kind{"deepgram.json", "Deepgram JSON", "The time is now.", "", 0.9},
                    Kind{"transcribe.json", "Amazon Transcribe JSON", "The time is now", "", 0.9},
                    Kind{"google.json", "Google JSON", "the time is now", "", 0.9},
                    Kind{"google_v2.json", "Google JSON", "the time is now", "", 0.9},
                    Kind{"assemblyai.json", "AssemblyAI JSON", "The time is now.", "", 0.9},
                    Kind{"watson.json", "Watson JSON", "the time is now", "", 0.9},
                    Kind{"speechmatics.json", "Speechmatics JSON", "The time is now", "", 0.9},
                    Kind{"rev.json", "Rev JSON", "The time is now", "", 0.9},
                    Kind{"azure_result.json", "Azure JSON", "the time is now", "", 0.9},
                    Kind{"azure_events.json", "Azure visemes", "The time is now", "DH AE T AY P IY S T AW", 0.9},
                    Kind{"polly.jsonl", "Polly speech marks", "The time is now", "TH AH T AA P IY S T AA", 0.9},
                    Kind{"polly_list.json", "Polly speech marks", "The time is now", "TH AH T AA P IY S T AA", 0.9},
                    Kind{"elevenlabs.json", "ElevenLabs JSON", "The time is now.", "", 0.9},
                    Kind{"piper.json", "Piper JSON", "", kSaid, 0},
                    Kind{"rhubarb.tsv", "Rhubarb TSV", "", "S S AA M EH S AO", 0},
                    Kind{"rhubarb.xml", "Rhubarb XML", "", "S S AA M EH S AO", 0},
                    Kind{"rhubarb.json", "Rhubarb JSON", "", "S S AA M EH S AO", 0},
                    Kind{"mfa.TextGrid", "TextGrid", "the time is now", kSaid, 0.9},
                    Kind{"mfa.json", "MFA JSON", "the time is now", kSaid, 0.9},
                    Kind{"mfa.csv", "MFA CSV", "the time is now", kSaid, 0.9},
                    Kind{"whisper.csv", "Whisper CSV", "The time is now.", "", 0.1},
                    Kind{"lines.lrc", "LRC", "The time is now.", "", 0.7},
                    Kind{"words.ctm", "CTM", "the time is now", "", 0.9},
                    Kind{"lines.srt", "SRT", "The time is now.", "", 0.1},
                    Kind{"lines.vtt", "WebVTT", "The time is now.", "", 0.1}),
    [](const testing::TestParamInfo<Kind>& kind) {
      std::string name = kind.param.file;
      std::replace_if(
          name.begin(), name.end(), [](char c) { return std::isalnum(static_cast<unsigned char>(c)) == 0; }, '_');
      return name;
    });

/// Variants of the kinds that are met in the wild; the words, each with its start in hundredths of a second.
struct Variant {
  const char *name, *bytes, *words;
};
class VariantsOfTimes : public testing::TestWithParam<Variant> {};

TEST_P(VariantsOfTimes, AreReadAsTheyAreMeant) {
  std::string words;
  for (const TimesFile::Word& word : parseTimes(GetParam().bytes, "x").words)
    words += (words.empty() ? "" : ", ") + word.text + " " + std::to_string(std::lround(100 * word.span.start));
  EXPECT_EQ(words, GetParam().words);
}

INSTANTIATE_TEST_SUITE_P(
    Kinds, VariantsOfTimes,
    testing::Values(
        Variant{"PiecesOfWhisperCpp",
                R"({"result": {"language": "en"}, "transcription": [
                   {"offsets": {"from": 0, "to": 0}, "text": ""}, {"offsets": {"from": 100, "to": 200}, "text": " Pe"},
                   {"offsets": {"from": 200, "to": 400}, "text": "ter"}, {"offsets": {"from": 400, "to": 600}, "text": " is"},
                   {"offsets": {"from": 600, "to": 800}, "text": " here"}, {"offsets": {"from": 800, "to": 810}, "text": "."}]})",
                "Peter 10, is 40, here. 60"},
        Variant{"MarksOfNoWord", "a 1 0.1 0.2 <unk>\na 1 0.3 0.2 the\na 1 0.5 0.2 %HESITATION\na 1 0.7 0.2 time\n",
                "the 30, time 70"},
        Variant{"LyricsWithSeveralTimes",
                "[ti:A song]\n[offset:0]\n[00:01.00][00:03.50]again\n[00:02.00]once\n[00:04.00]\n",
                "again 100, once 200, again 350"},
        Variant{"ScoresThatPythonDoesNotKnow",
                R"({"segments": [{"end": 1, "words": [{"word": "NaN \"", "start": 0.1, "end": 0.3, "score": NaN},
                   {"word": "2", "start": NaN, "end": NaN, "score": -Infinity}, {"word": "b", "start": 0.5, "end": 1}]}]})",
                "NaN \" 10, 2 30, b 50"},
        Variant{"WordsThatAreNull", R"({"segments": [{"text": "the time", "start": 0.1, "end": 1, "words": null}]})",
                "the time 10"},
        Variant{"WordsOfTheWholeThatAreNone",
                R"({"words": [], "segments": [{"text": "the time", "start": 0.1, "end": 1}]})", "the time 10"},
        Variant{"WordsInSomeSegmentsAlone",
                R"({"segments": [{"text": "hm", "start": 0, "end": 0.2}, {"text": "x", "start": 0.2, "end": 1,
                   "words": [{"word": "time", "start": 0.3, "end": 0.9}]}, {"text": "so", "start": 1, "end": 1.2,
                   "words": []}]})",
                "hm 0, time 30, so 100"},
        Variant{"LinesOfTransformers",
                R"({"text": "", "chunks": [{"text": " the time", "timestamp": [0.1, 1.0]},
                   {"text": " is now", "timestamp": [1.2, null]}]})",
                "the time 10, is now 120"},
        Variant{"BlanksAndNoisesAmongWords",
                R"({"words": [{"text": "the", "start": 0.1, "end": 0.2, "type": "word"}, {"text": " ", "start": 0.2,
                   "end": 0.3, "type": "spacing"}, {"text": "laughs", "start": 0.3, "end": 0.5, "type": "audio_event"},
                   {"text": "time", "start": 0.5, "end": 0.9, "type": "word"}]})",
                "the 10, time 50"},
        Variant{"VoskListOfResults",
                R"([{"text": ""}, {"result": [{"conf": 1, "start": 0.1, "end": 0.3, "word": "the"}], "text": "the"},
                   {"result": [{"conf": 1, "start": 0.5, "end": 0.9, "word": "time"}], "text": "time"}])",
                "the 10, time 50"},
        Variant{"AzuresListOfResults",
                R"([{"NBest": [{"Words": [{"Word": "the", "Offset": 1000000, "Duration": 2000000}]}]},
                   {"NBest": [{"Words": [{"Word": "time", "Offset": 5000000, "Duration": 2000000}]}]}])",
                "the 10, time 50"},
        Variant{
            "PollysSpanishVisemes",
            "{\"time\":100,\"type\":\"word\",\"value\":\"bebé\"}\n{\"time\":100,\"type\":\"viseme\",\"value\":\"B\"}\n"
            "{\"time\":200,\"type\":\"viseme\",\"value\":\"J\"}\n{\"time\":300,\"type\":\"viseme\",\"value\":\"new\"}\n"
            "{\"time\":400,\"type\":\"viseme\",\"value\":\"sil\"}\n",
            "bebé 10"},
        Variant{"SentencesOfAStreamWithoutABlankBetween",
                R"({"alignment": {"chars": ["a", "."], "charStartTimesMs": [100, 150], "charDurationsMs": [50, 50]}}
                   {"alignment": {"chars": ["b"], "charStartTimesMs": [0], "charDurationsMs": [100]}})",
                "a. 10, b 20"},
        Variant{"SubtitlesThatOverlap",
                "1\n00:00:00,100 --> 00:00:00,900\nthe time\n\n2\n00:00:00,800 --> 00:00:01,500\nis now\n",
                "the time 10, is now 80"},
        Variant{"GooglesSecondsAndNanos",
                R"({"results": [{"alternatives": [{"words": [{"word": "the", "startTime": {}, "endTime": {"nanos":
                   300000000}}, {"word": "time", "startTime": {"seconds": "1", "nanos": 250000000}, "endTime":
                   {"seconds": "2"}}]}]}]})",
                "the 0, time 125"},
        Variant{"GooglesNamesInPython",
                R"({"results": [{"alternatives": [{"words": [{"word": "the", "start_time": "0.1s", "end_time":
                   "0.300s"}]}]}]})",
                "the 10"},
        Variant{"DeepgramsChannelOnWhichNobodySpeaks",
                R"({"results": {"channels": [{"alternatives": [{"words": []}]}, {"alternatives": [{"words":
                   [{"word": "the", "start": 0.1, "end": 0.3}]}]}]}})",
                "the 10"},
        Variant{"WatsonWithoutConfidences",
                R"({"results": [{"final": true, "alternatives": [{"timestamps": [["the", 0.1, 0.3]]}]},
                   {"final": true, "alternatives": [{"timestamps": [["time", 1, 1.5]]}]}]})",
                "the 10, time 100"},
        Variant{"SpeechmaticsEntities",
                R"({"results": [{"type": "speaker_change"}, {"type": "entity", "start_time": 0.1, "end_time": 0.9,
                   "alternatives": [{"content": "17th of January"}], "spoken_form": []}]})",
                "17th of January 10"},
        Variant{"AlignersTiersOfASpeaker",
                R"({"tiers": {"bob - words": {"entries": [[0.1, 0.3, "the"]]}, "bob - phones": {"entries":
                   [[0.1, 0.2, "ð"], [0.2, 0.3, "ə"]]}}})",
                "the 10"},
        Variant{"AlignersMarksAreNoPhones",
                R"({"tiers": {"words": {"entries": [[0.1, 0.3, "the"], [0.5, 0.7, "<unk>"], [0.8, 0.9, "[bracketed]"]]},
                   "phones": {"entries": [[0.1, 0.3, "AH"], [0.5, 0.7, "spn"]]}}})",
                "the 10"},
        Variant{"AlignersWordsAlone", R"({"tiers": {"words": {"entries": [[0.1, 0.3, "the"], [0.5, 0.7, "time"]]}}})",
                "the 10, time 50"},
        Variant{"ATextGridOfWordsAlone",
                "File type = \"ooTextFile\"\nObject class = \"TextGrid\"\n0\n1\n<exists>\n1\n\"IntervalTier\"\n"
                "\"words\"\n0\n1\n3\n0\n0.1\n\"\"\n0.1\n0.5\n\"the\"\n0.5\n1\n\"time\"\n",
                "the 10, time 50"},
        Variant{"AlignersCsvWithoutSpeakers", "Begin,End,Label,Type\r\n0.1,0.3,the,words\r\n0.5,0.7,time,words\r\n",
                "the 10, time 50"},
        Variant{"SubtitlesWithoutEmptyLines",
                "1\n00:00:00,100 --> 00:00:00,550\nwe are\n2\n00:00:00,550 --> 00:00:01,000\nnow\n",
                "we are 10, now 55"},
        Variant{"ASubtitleThatIsANumber",
                "1\n00:00:00,100 --> 00:00:00,550\n7\n\n2\n00:00:00,550 --> 00:00:01,000\nnow\n", "7 10, now 55"},
        Variant{"CaptionsThatRoll",
                "WEBVTT\nKind: captions\n\n00:00:00.100 --> 00:00:00.600 align:start position:0%\n \n"
                "the<00:00:00.250><c> time</c>\n\n00:00:00.600 --> 00:00:00.610 align:start\nthe time\n \n\n"
                "00:00:00.610 --> 00:00:01.000\nthe time\nis<00:00:00.700><c> now</c>\n",
                "the time 10, is now 61"},
        Variant{"ANoteWithAnArrow", "WEBVTT\n\nNOTE a --> b\n\n00:00.100 --> 00:00.600\nNOTE\n", "NOTE 10"},
        Variant{"ASubtitleThatIsSaidTwice", "WEBVTT\n\n00:00.100 --> 00:00.600\nno\n\n00:00.600 --> 00:01.000\nno\n",
                "no 10, no 60"},
        Variant{"AudacitysFrequencies", "0.1\t0.25\tthe\n\\\t100.0\t200.0\n0.25\t0.55\ttime\n", "the 10, time 25"},
        Variant{"AudacitysEmptyLabels", "0.0\t0.1\t\r\n0.1\t1.0\tthe time\r\n", "the time 10"}),
    [](const testing::TestParamInfo<Variant>& variant) { return std::string(variant.param.name); });

/// A subtitle, what of it is said ("" for nothing), and what is not.
struct Cue {
  const char *written, *said, *not_said;
};
class SubtitlesOfSounds : public testing::TestWithParam<Cue> {};

TEST_P(SubtitlesOfSounds, SayWhatIsSpoken) {
  const std::string cue = GetParam().written;
  const std::string said = GetParam().said, end = "00:00:01,000 --> 00:00:02,000\nend\n";
  const auto textOf = [](const TimesFile& times) {
    std::string text;
    for (const std::string& each : times.not_said) text += (text.empty() ? "" : "|") + each;
    return wordsOf(times) + " / " + text;
  };
  const std::string expected = (said.empty() ? "" : said + " ") + "end / " + GetParam().not_said;
  EXPECT_EQ(textOf(parseTimes("1\n00:00:00,100 --> 00:00:00,900\n" + cue + "\n\n2\n" + end, "x")), expected);
  EXPECT_EQ(textOf(parseTimes("WEBVTT\n\n00:00:00.100 --> 00:00:00.900\n" + cue + "\n\n" + end, "x")), expected);
}

INSTANTIATE_TEST_SUITE_P(
    Cues, SubtitlesOfSounds,
    testing::Values(Cue{"(laughs)", "", "(laughs)"}, Cue{"[music]", "", "[music]"}, Cue{"♪ la la ♪", "", "♪ la la ♪"},
                    Cue{"♪ la la", "", "♪ la la"}, Cue{"# la la #", "", "# la la #"}, Cue{"# la\nla", "", "# la la"},
                    Cue{"#1 in Ohio", "#1 in Ohio", ""}, Cue{"♪ la ♪ so it was ♪ la", "so it was", "♪ la ♪|♪ la"},
                    Cue{"♫ la\nla ♫", "", "♫ la la ♫"}, Cue{"Yes (laughs) no", "Yes  no", "(laughs)"},
                    Cue{"(a door\nslams) Who is it?", "Who is it?", "(a door slams)"},
                    Cue{"JOHN: Hello", "Hello", "JOHN:"}, Cue{"- JOHN: Hello\n- MARY: Hi", "Hello Hi", "JOHN:|MARY:"},
                    Cue{"MR. SMITH 2 (on the phone): Go", "Go", "MR. SMITH 2 (on the phone):"},
                    Cue{"JOHN:\nHello", "Hello", "JOHN:"}, Cue{"- Hello\n-Hi", "Hello Hi", ""},
                    Cue{">> Hello", "Hello", ""}, Cue{"&gt;&gt; JOHN: R&amp;B", "R&B", "JOHN:"},
                    Cue{"<i>Hello</i> {\\an8}there", "Hello there", ""}, Cue{"{\\an8}<b>(sighs)</b>", "", "(sighs)"},
                    Cue{"note: we leave", "note: we leave", ""}, Cue{"Note: we leave", "Note: we leave", ""},
                    Cue{"WE LEAVE AT 10:30", "WE LEAVE AT 10:30", ""},
                    Cue{"THIS IS ALL I HAVE: GO", "THIS IS ALL I HAVE: GO", ""},
                    Cue{"STOP! NOW: GO", "STOP! NOW: GO", ""}, Cue{"word(s) (of", "word(s) (of", ""},
                    Cue{":) [no end", ":) [no end", ""}));

/// Where every word has its times a bracket may go over several.
TEST(TimesFile, WhisperTellsSoundsAmongItsWords) {
  const auto timesOf = [](const char* words) {
    return parseTimes(std::string(R"({"segments": [{"start": 0, "end": 9, "words": [)") + words + "]}]}", "x");
  };
  const TimesFile times = timesOf(R"json({"word": " [BLANK_AUDIO]", "start": 0, "end": 1},
      {"word": " so", "start": 1, "end": 2}, {"word": " (upbeat", "start": 2, "end": 3},
      {"word": " rock", "start": 3, "end": 4}, {"word": " music)", "start": 4, "end": 5},
      {"word": " (he", "start": 5, "end": 6})json");
  EXPECT_EQ(wordsOf(times), "so (he");
  EXPECT_EQ(times.not_said, (std::vector<std::string>{"[BLANK_AUDIO]", "(upbeat rock music)"}));
  const TimesFile line = parseTimes(R"json({"segments": [{"text": " (coughing) so", "start": 0, "end": 1},
      {"text": " [BLANK_AUDIO]", "start": 1, "end": 2}]})json",
                                    "x");
  EXPECT_EQ(wordsOf(line), "so");
  EXPECT_EQ(line.not_said, (std::vector<std::string>{"(coughing)", "[BLANK_AUDIO]"}));
}

TEST(TimesFile, WordsWithoutTimesLieBetweenTheirNeighbours) {
  const TimesFile times = timesIn("whisperx.json");
  EXPECT_NEAR(times.words[1].span.start, 0.25, 1e-9);
  EXPECT_NEAR(times.words[1].span.end, 0.45, 1e-9);
  const auto whisper = [](const std::string& words) {
    return parseTimes(R"({"segments": [{"start": 0.5, "end": 2, "words": [)" + words + "]}]}", "x.json");
  };
  const TimesFile ends = whisper(R"({"word": "1", "start": null, "end": null}, {"word": "a", "start": 1, "end": 1.4},
                                    {"word": "2"}, {"word": "3"})");
  ASSERT_EQ(ends.words.size(), 4U);
  EXPECT_LT(ends.words[0].span.start, 1);
  EXPECT_NEAR(ends.words[2].span.start, 1.4, 1e-9);
  EXPECT_NEAR(ends.words[3].span.start, 1.7, 1e-9);
  EXPECT_NEAR(ends.words[3].span.end, 2, 1e-9);
  const TimesFile digits = whisper(R"({"word": "1"}, {"word": "2"})");
  ASSERT_EQ(digits.words.size(), 2U);
  EXPECT_NEAR(digits.words[1].span.start, 1.25, 1e-9);
}

/// Every kind cut short anywhere is refused with its name, or read as less than the whole; nothing else is thrown.
TEST(TimesFile, CutShortIsRefusedWithTheFilesName) {
  for (const char* file : {"whisper.json", "vosk.json", "gentle.json", "azure_result.json", "azure_events.json",
                           "deepgram.json", "transcribe.json", "transformers.json", "google.json", "assemblyai.json",
                           "elevenlabs.json", "piper.json", "rhubarb.json", "rhubarb.xml", "mfa.TextGrid"}) {
    const std::string bytes = readFile(kTimes / file);
    for (const double share : {0.1, 0.5, 0.9}) {
      const std::string cut = bytes.substr(0, static_cast<std::size_t>(share * static_cast<double>(bytes.size())));
      EXPECT_NE(errorOf([&] { parseTimes(cut, file); }).find(file), std::string::npos) << file << " to " << share;
    }
  }
}

TEST(TimesFile, BadTimesAreNamedWithTheirPlace) {
  const auto whisper = [](const std::string& start, const std::string& end) {
    return R"({"segments": [{"words": [{"word": "a", "start": 0.5, "end": 0.6}, {"word": "b", "start": )" + start +
           R"(, "end": )" + end + "}]}]}";
  };
  const auto error = [&](const std::string& bytes) { return errorOf([&] { parseTimes(bytes, "x.json"); }); };
  EXPECT_EQ(error(whisper("0.6", "0.7")), "no error");
  EXPECT_EQ(error(whisper("0.3", "0.7")),
            "x.json:segments[0].words[1]: 'b' begins at 0.300 s, before the one before it ends, at 0.600 s; expected "
            "times in order");
  EXPECT_EQ(error(whisper("0.8", "0.7")),
            "x.json:segments[0].words[1]: 'b' ends at 0.700 s, before it begins at 0.800 s; expected a later end");
  EXPECT_EQ(error(whisper("-1", "0.7")), "x.json:segments[0].words[1]: found times -1 to 0.7 s; expected 0 to 86400 s");
  EXPECT_NE(error(whisper("NaN", "0.7")).find("x.json"), std::string::npos);
  EXPECT_NE(error(whisper("1e999", "0.7")).find("x.json"), std::string::npos);
  EXPECT_NE(error(whisper("\"soon\"", "0.7")).find("segments[0].words[1].start"), std::string::npos);
  EXPECT_NE(error(R"({"segments": [{"words": [{"word": "a", "end": 1}]}]})").find("is missing"), std::string::npos);
  EXPECT_EQ(error(R"({"words": [{"rest": 1}, {"word": "a", "notes": [{"pitch": "C3", "beats": 1}]}]})"),
            "x.json: is a written song; expected words with their times");
  EXPECT_EQ(error("0 2500000 sil\n2500000 5000000 dh\n"),
            "x.json:1: holds labels of phones; expected words with their times");
  EXPECT_NE(errorOf([] { parseTimes("", "x"); }).find("is empty"), std::string::npos);
  EXPECT_NE(errorOf([] { parseTimes("hello there\n", "x"); }).find("expected JSON of Whisper"), std::string::npos);
  EXPECT_NE(errorOf([] { parseTimes("{\"a\": 1}", "x"); }).find("has no words"), std::string::npos);
  EXPECT_EQ(error(R"([{"time": 1, "type": "viseme", "value": "Q"}, {"time": 2, "type": "viseme", "value": "p"}])"),
            "x.json:[0].value: found \"Q\"; expected one of Amazon Polly's visemes");
  EXPECT_NE(errorOf([] { parseTimes("0.00\tX\n0.10\tQ\n0.3\tX\n", "x"); }).find("mouth shape 'Q'"), std::string::npos);
  EXPECT_NE(errorOf([] { parseTimes("0.00\tX\n0.10\tA\n", "x"); }).find("expected X"), std::string::npos);
  EXPECT_NE(errorOf([] { parseTimes("1\n00:00:xx --> 00:00:02,000\na\n", "x"); }).find("expected a time"),
            std::string::npos);
}

}  // namespace
}  // namespace mouthpiece
