// One random line as each program writes it down, by its documentation (docs/formats/times.md): all say the same.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <functional>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <vector>

#include "base/errors.h"
#include "hearing/times/times_file.h"

namespace mouthpiece {
namespace {

using nlohmann::json;

constexpr double kMillisecond = 1e-3;

/// A word and its times, ms.
struct Said {
  std::string word;
  int start, end;
  double confidence;
};
using Line = std::vector<Said>;
using Random = std::mt19937;

std::size_t upTo(Random& random, std::size_t most) { return random() % (most + 1); }

/// Words do not overlap; some follow each other at once. None is a single phone's name.
Line randomLine(Random& random) {
  constexpr std::array<const char*, 8> kWords{"birch", "canoe", "slid",   "d\xC3\xA9j\xC3\xA0",
                                              "don't", "seven", "planks", "\xD0\xB4\xD0\xB0\xD0\xB2\xD0\xBD\xD0\xBE"};
  Line line;
  int at = static_cast<int>(upTo(random, upTo(random, 1) == 0 ? 400 : 7'000'000));  // up to two hours
  for (std::size_t i = 0; i < 3 + upTo(random, 6); ++i) {
    const int length = 20 + static_cast<int>(upTo(random, 700));
    line.push_back(
        {kWords[upTo(random, kWords.size() - 1)], at, at + length, 0.01 * static_cast<double>(upTo(random, 100))});
    at += length + (upTo(random, 1) == 0 ? 0 : static_cast<int>(upTo(random, 300)));
  }
  return line;
}

double seconds(int milliseconds) { return kMillisecond * milliseconds; }

/// Words in a list, the keys as a program calls them; what a reader has no use for is strewn in.
json wordsAs(const Line& line, std::string_view word_key, std::string_view confidence_key, Random& random) {
  json words = json::array();
  for (const Said& said : line) {
    json word{{std::string(word_key), (upTo(random, 1) == 0 ? " " : "") + said.word},
              {"start", seconds(said.start)},
              {"end", seconds(said.end)},
              {std::string(confidence_key), said.confidence}};
    if (upTo(random, 2) == 0) word["speaker"] = "SPEAKER_00";
    words.push_back(std::move(word));
  }
  return words;
}

std::string whisper(const Line& line, Random& random) {
  json segments = json::array();
  for (std::size_t first = 0; first < line.size();) {
    const std::size_t count = 1 + upTo(random, line.size() - first - 1);
    const Line part(line.begin() + static_cast<std::ptrdiff_t>(first),
                    line.begin() + static_cast<std::ptrdiff_t>(first + count));
    segments.push_back({{"id", segments.size()},
                        {"start", seconds(part.front().start)},
                        {"end", seconds(part.back().end)},
                        {"text", "its own"},
                        {"words", wordsAs(part, "word", "probability", random)}});
    first += count;
  }
  return json{{"text", "all of it"}, {"segments", segments}, {"language", "en"}}.dump(upTo(random, 1) == 0 ? -1 : 2);
}
std::string whisperWords(const Line& line, Random& random) {
  return json{{"task", "transcribe"}, {"words", wordsAs(line, "word", "confidence", random)}}.dump();
}
std::string whisperLines(const Line& line, Random&) {
  json segments = json::array();
  for (const Said& said : line)
    segments.push_back({{"text", said.word + " "}, {"start", seconds(said.start)}, {"end", seconds(said.end)}});
  return json{{"segments", segments}}.dump();
}
std::string whisperCpp(const Line& line, Random&) {
  json rows = json::array();
  for (const Said& said : line)
    rows.push_back({{"timestamps", {{"from", "not"}, {"to", "read"}}},
                    {"offsets", {{"from", said.start}, {"to", said.end}}},
                    {"text", " " + said.word}});
  return json{{"result", {{"language", "en"}}}, {"transcription", rows}}.dump(1);
}
std::string vosk(const Line& line, Random& random) {
  return json{{"result", wordsAs(line, "word", "conf", random)}, {"text", "all of it"}}.dump(2);
}
std::string voskRows(const Line& line, Random& random) {
  std::string rows;
  for (std::size_t first = 0; first < line.size(); ++first)
    rows += json{{"result", wordsAs({line[first]}, "word", "conf", random)}, {"text", line[first].word}}.dump() + "\n" +
            (upTo(random, 2) == 0 ? "{\"text\":\"\"}\n" : "");
  return rows;
}
std::string gentle(const Line& line, Random& random) {
  json words = json::array();
  for (const Said& said : line) {
    if (upTo(random, 2) == 0) words.push_back({{"case", "not-found-in-audio"}, {"word", "lost"}});
    words.push_back({{"case", "success"},
                     {"word", said.word},
                     {"alignedWord", "its own"},
                     {"start", seconds(said.start)},
                     {"end", seconds(said.end)}});
  }
  return json{{"transcript", "all of it"}, {"words", words}}.dump();
}
std::string azure(const Line& line, Random&) {
  json words = json::array();
  for (const Said& said : line)
    words.push_back({{"Word", said.word},
                     {"Offset", 10'000LL * said.start},
                     {"Duration", 10'000LL * (said.end - said.start)},
                     {"Confidence", said.confidence}});
  return json{{"RecognitionStatus", "Success"}, {"NBest", {{{"Words", words}}, {{"Words", "worse"}}}}}.dump();
}
/// Of a word's letters the first begins and the last ends with it.
std::string elevenLabs(const Line& line, Random& random) {
  json characters = json::array(), starts = json::array(), ends = json::array();
  const auto add = [&](const std::string& character, double start, double end) {
    characters.push_back(character);
    starts.push_back(start);
    ends.push_back(end);
  };
  for (const Said& said : line) {
    if (!characters.empty()) add(upTo(random, 1) == 0 ? " " : "\n", seconds(said.start), seconds(said.start));
    std::vector<std::string> letters;
    for (const char c : said.word) {
      if ((static_cast<unsigned char>(c) & 0xC0U) != 0x80U) letters.emplace_back();
      letters.back() += c;
    }
    const double step = (seconds(said.end) - seconds(said.start)) / static_cast<double>(letters.size());
    for (std::size_t i = 0; i < letters.size(); ++i)
      add(letters[i], seconds(said.start) + step * static_cast<double>(i),
          i + 1 == letters.size() ? seconds(said.end) : seconds(said.start) + step * static_cast<double>(i + 1));
  }
  return json{
      {"audio_base64", "UklGRg=="},
      {"alignment",
       {{"characters", characters}, {"character_start_times_seconds", starts}, {"character_end_times_seconds", ends}}}}
      .dump();
}
std::string ctm(const Line& line, Random& random) {
  std::string rows = ";; a comment\n";
  for (const Said& said : line) {
    rows += fmt::format("line 1 {:.3f} {:.3f} {} {:.2f}\n", seconds(said.start), seconds(said.end - said.start),
                        said.word, said.confidence);
    if (upTo(random, 2) == 0) rows += fmt::format("line 1 {:.3f} 0.000 <eps> 1.0\n", seconds(said.end));
  }
  return rows;
}
std::string clock(int milliseconds, char point) {
  return fmt::format("{:02}:{:02}:{:02}{}{:03}", milliseconds / 3'600'000, milliseconds / 60'000 % 60,
                     milliseconds / 1000 % 60, point, milliseconds % 1000);
}
std::string srt(const Line& line, Random& random) {
  std::string text;
  for (std::size_t i = 0; i < line.size(); ++i)
    text += fmt::format("{}\r\n{} --> {}\r\n{}\r\n\r\n", i + 1, clock(line[i].start, ','), clock(line[i].end, ','),
                        upTo(random, 1) == 0 ? "<i>" + line[i].word + "</i>" : "- " + line[i].word);
  return text;
}
std::string vtt(const Line& line, Random& random) {
  std::string text = "WEBVTT - a title\n\nNOTE said by nobody\n00:00:00.000 --> 00:00:09.000\n\n";
  for (const Said& said : line) {
    if (upTo(random, 1) == 0) text += "cue\n";
    text +=
        fmt::format("{} --> {} align:start\n<v Bob>{}\n\n", clock(said.start, '.'), clock(said.end, '.'), said.word);
  }
  return text;
}

struct Writer {
  const char* name;
  std::string kind;
  std::function<std::string(const Line&, Random&)> write;
  bool tells_confidence = false, gives_lines = false;
};

const std::vector<Writer>& writers() {
  static const std::vector<Writer> all{{"Whisper", "Whisper JSON", whisper, true},
                                       {"WhisperWords", "Whisper JSON", whisperWords, true},
                                       {"WhisperLines", "Whisper JSON", whisperLines, false, true},
                                       {"WhisperCpp", "whisper.cpp JSON", whisperCpp},
                                       {"Vosk", "Vosk JSON", vosk, true},
                                       {"VoskRows", "Vosk JSON", voskRows, true},
                                       {"Gentle", "Gentle JSON", gentle},
                                       {"Azure", "Azure JSON", azure, true},
                                       {"ElevenLabs", "ElevenLabs JSON", elevenLabs},
                                       {"Ctm", "CTM", ctm, true},
                                       {"Srt", "SRT", srt, false, true},
                                       {"Vtt", "WebVTT", vtt, false, true}};
  return all;
}

class EveryProgram : public testing::TestWithParam<std::size_t> {
 protected:
  const Writer& writer_ = writers()[GetParam()];
};

TEST_P(EveryProgram, TellsTheSameLine) {
  for (unsigned seed = 1; seed <= 40; ++seed) {
    Random random(seed);
    const Line line = randomLine(random);
    const std::string bytes = writer_.write(line, random);
    const TimesFile times = parseTimes(bytes, "line");
    EXPECT_EQ(times.kind, writer_.kind) << bytes;
    EXPECT_EQ(times.words_are_lines, writer_.gives_lines);
    EXPECT_TRUE(times.phones.empty());
    ASSERT_EQ(times.words.size(), line.size()) << bytes;
    for (std::size_t i = 0; i < line.size(); ++i) {
      EXPECT_EQ(times.words[i].text, line[i].word);
      EXPECT_NEAR(times.words[i].span.start, seconds(line[i].start), 1e-9);
      EXPECT_NEAR(times.words[i].span.end, seconds(line[i].end), 1e-9);
      EXPECT_NEAR(times.words[i].confidence, writer_.tells_confidence ? line[i].confidence : 1, 1e-9);
    }
  }
}

/// Two words that change places are refused, and so is one that ends before it begins.
TEST_P(EveryProgram, RefusesTimesOutOfOrder) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    Random random(seed);
    Line line = randomLine(random);
    std::swap(line.front(), line.back());
    EXPECT_THROW(parseTimes(writer_.write(line, random), "line"), InputError);
    line = randomLine(random);
    std::swap(line[1].start, line[1].end);
    EXPECT_THROW(parseTimes(writer_.write(line, random), "line"), InputError);
  }
}

/// Any cut is refused, or read as the words before it.
TEST_P(EveryProgram, CutAnywhereGivesNothingElse) {
  for (unsigned seed = 1; seed <= 40; ++seed) {
    Random random(seed);
    const Line line = randomLine(random);
    const std::string bytes = writer_.write(line, random);
    try {
      const TimesFile times = parseTimes(bytes.substr(0, upTo(random, bytes.size() - 1)), "line");
      ASSERT_LE(times.words.size(), line.size());
      for (std::size_t i = 0; i < times.words.size(); ++i)
        EXPECT_NEAR(times.words[i].span.start, seconds(line[i].start), 1e-9) << bytes;
    } catch (const InputError&) {
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Writers, EveryProgram, testing::Range(std::size_t{0}, writers().size()),
                         [](const auto& writer) { return writers()[writer.param].name; });

}  // namespace
}  // namespace mouthpiece
