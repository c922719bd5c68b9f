// What is said of a file of times that is none: file, place, what was found and what was expected.
#include <gtest/gtest.h>

#include <string>

#include "hearing/times/times_file.h"
#include "support/error_of.h"

namespace mouthpiece {
namespace {

struct Refusal {
  const char* name;
  std::string text, said;
};
class RefusedTimes : public ::testing::TestWithParam<Refusal> {};
TEST_P(RefusedTimes, AreToldWithTheirPlace) {
  const Refusal& times = GetParam();
  EXPECT_EQ(errorOf([&] { parseTimes(times.text, times.name); }), times.said);
}

std::string rhubarbXml(const std::string& cue) {
  return "<?xml version=\"1.0\"?><rhubarbResult><mouthCues>" + cue + "</mouthCues></rhubarbResult>";
}

INSTANTIATE_TEST_SUITE_P(
    All, RefusedTimes,
    ::testing::Values(
        Refusal{"a.srt", "1\n00:00:01,000 --> soon\nhello\n", "a.srt:2: found 'soon'; expected a time as 00:00:01,500"},
        Refusal{"a.srt", "1\n00:1x --> 00:02\nhello\n", "a.srt:2: found '00:1x'; expected a time as 00:00:01,500"},
        Refusal{"a.vtt", "WEBVTT\n\n1:2:3:4 --> 00:02\nhello\n",
                "a.vtt:3: found '1:2:3:4'; expected a time as 00:00:01,500"},
        Refusal{"a.tsv", "0.00\tX\n0.10\n", "a.tsv:2: found 1 fields; expected a time and a shape"},
        Refusal{"a.tsv", "0.00\tX\nsoon\tA\n", "a.tsv:2: found 'soon'; expected a time in seconds"},
        Refusal{"a.tsv", "0.00\tX\n0.10\tK\n", "a.tsv:2: found the mouth shape 'K'; expected A to H or X"},
        Refusal{"a.tsv", "0.00\tX\n0.10\tA\n",
                "a.tsv:2: ends with a shape that is not X; expected X, which tells when the last one ends"},
        Refusal{"a.xml", "<rhubarbResult/>", "a.xml: has no rhubarbResult with mouthCues; expected Rhubarb's XML"},
        Refusal{"a.xml", rhubarbXml("<mouthCue start=\"0\" end=\"late\">A</mouthCue>"),
                "a.xml:mouthCue 1: found 'late'; expected a time in seconds"},
        Refusal{"a.xml",
                rhubarbXml("<mouthCue start=\"0\" end=\"1\">A</mouthCue><mouthCue start=\"1\" end=\"2\">AA</mouthCue>"),
                "a.xml:mouthCue 2: found the mouth shape 'AA'; expected A to H or X"},
        Refusal{"a.ctm", "take 1 0.1 0.2 the\ntake 1 0.3 0.2\n",
                "a.ctm:2: found 4 fields; expected \"name channel start duration word\""},
        Refusal{"a.ctm", ";; made up\ntake 1 0.1 long time\n", "a.ctm:2: found 'long'; expected a time in seconds"},
        Refusal{"a.ctm", "one 1 0.1 0.2 the\ntwo 1 0.3 0.2 time\n",
                "a.ctm:2: found words of 'two' after those of 'one'; expected one recording a file"},
        Refusal{"a.ass", "[Script Info]\nScriptType: v4.00+\n",
                "a.ass:1: is a script of SubStation (ASS); expected SRT, as `ffmpeg -i FILE out.srt` writes it"},
        Refusal{"a.csv", "start,end,text\n100,200\n",
                "a.csv:2: has less than three fields; expected start, end and text"},
        Refusal{"a.json", R"({"text": ""})", "a.json: tells that nothing was heard; expected words with their times"},
        Refusal{"a.json", R"({"RecognitionStatus": "InitialSilenceTimeout", "Offset": 1, "Duration": 0})",
                "a.json: tells that nothing was heard; expected words with their times"},
        Refusal{"a.TextGrid",
                "File type = \"ooTextFile\"\nObject class = \"TextGrid\"\n\n0\n1\n<exists>\n1\n\"IntervalTier\"\n"
                "\"Mary\"\n0\n1\n1\n0\n1\n\"hello\"\n",
                "a.TextGrid: has tiers [Mary]; expected one named words, or phones"},
        Refusal{"a.json", "{}",
                "a.json: has no words, segments, chunks, result, results, transcription, alignment, NBest, visemes, "
                "phoneme_alignments, mouthCues, monologues or tiers; expected JSON of Whisper, Vosk, Gentle, Azure, "
                "Deepgram, Amazon Transcribe, Google, Watson, Speechmatics, Rev, AssemblyAI, ElevenLabs, Piper, "
                "Rhubarb or the Montreal Forced Aligner"},
        Refusal{"a.json",
                R"({"results": {"items": [{"type": "pronunciation", "start_time": "soon", "end_time": "1",)"
                R"( "alternatives": [{"content": "a"}]}]}})",
                "a.json:results.items[0].start_time: found \"soon\"; expected a time in seconds"},
        Refusal{"a.json", R"({"results": [{"alternatives": [{"transcript": "a"}]}]})",
                "a.json:results[0].alternatives[0]: has no words; expected them with their times "
                "(enableWordTimeOffsets)"},
        Refusal{"a.json", R"({"monologues": [{"elements": [{"type": "text", "value": "the", "ts": 0.1}]}]})",
                "a.json:monologues[0].elements[0].end_ts: is missing; expected a number"},
        Refusal{"a.json", R"({"results": [{"alternatives": [{"timestamps": [["the", 0.1]]}]}]})",
                "a.json:results[0].alternatives[0].timestamps[0]: found a list of 2; expected a list of 3 to 3"},
        Refusal{"a.json", R"({"tiers": {"marks": {"entries": []}}})",
                "a.json: is MFA JSON without words or phones; expected some"},
        Refusal{"a.json",
                R"({"tiers": {"a - words": {"entries": [[0, 1, "a"]]}, "b - words": {"entries": [[1, 2, "b"]]}}})",
                "a.json:tiers.b - words: is a second tier of words; expected one speaker"},
        Refusal{"a.json", R"({"tiers": {"words": {"entries": [[0, 1, "a"], [0.5, 2, "b"]]}}})",
                "a.json:tiers.words.entries[1]: 'b' begins at 0.5 s, inside the interval before it, which ends at 1 s; "
                "expected intervals that do not overlap"},
        Refusal{"a.csv", "Begin,End,Label,Type,Speaker\n0.1,0.2,the\n",
                "a.csv:2: found 3 fields; expected Begin,End,Label,Type,Speaker"},
        Refusal{"a.csv", "Begin,End,Label,Type,Speaker\n0.1,soon,the,words,a\n",
                "a.csv:2: found 'soon'; expected a time in seconds"},
        Refusal{"a.csv", "Begin,End,Label,Type,Speaker\n0.1,0.2,the,words,a\n0.2,0.3,the,words,b\n",
                "a.csv:3: found the speaker 'b' after 'a'; expected one"},
        Refusal{"a.csv", "Begin,End,Label,Type,Speaker\n0,1,a,marks,b\n",
                "a.csv: is MFA CSV without words or phones; expected some"}));

}  // namespace
}  // namespace mouthpiece
