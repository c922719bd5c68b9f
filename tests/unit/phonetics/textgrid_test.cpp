#include "phonetics/labels/textgrid.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <functional>
#include <random>

#include "base/errors.h"
#include "base/files.h"
#include "base/text_encoding.h"
#include "phonetics/labels/labels_builder.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

std::string namesOf(const SpeechLabels& labels) {
  std::string names;
  for (const auto& phone : labels.phones) {
    if (!names.empty()) names += ' ';
    names += phoneName(phone.phone);
  }
  return names;
}

std::string gridErrorOf(const std::string& bytes) {
  try {
    parseTextGrid(bytes, "a.TextGrid");
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

/// Short text: one tier `phones`, an interval a line from line 12 on.
std::string shortGrid(const std::string& intervals, int count, const std::string& tier = "phones") {
  return "File type = \"ooTextFile\"\nObject class = \"TextGrid\"\n\n0\n2\n<exists>\n1\n\"IntervalTier\"\n\"" + tier +
         "\"\n0 2\n" + std::to_string(count) + "\n" + intervals;
}

constexpr const char* kTwoTiers =
    "File type = \"ooTextFile\"\nObject class = "
    "\"TextGrid\"\n\n0\n1.5\n<exists>\n2\n\"IntervalTier\"\n\"words\"\n0\n1.5\n3\n"
    "0\n0.5\n\"\"\n0.5\n1\n\"say "
    "\"\"A\"\"\"\n1\n1.5\n\"<eps>\"\n\"IntervalTier\"\n\"phones\"\n0\n1.5\n3\n0\n0.5\n\"\"\n"
    "0.5\n1\n\"EY2\"\n1\n1.5\n\"sp\"\n";

std::string asUtf16(std::string_view text, bool is_big_endian) {
  std::string out = is_big_endian ? "\xFE\xFF" : "\xFF\xFE";
  for (std::size_t i = 0; i < text.size();) {
    const char32_t c = decodeUtf8(text, i).value();
    const char high = static_cast<char>(c >> 8U);
    const char low = static_cast<char>(c & 0xFFU);
    out += is_big_endian ? high : low;
    out += is_big_endian ? low : high;
  }
  return out;
}

TEST(TextGrid, ReadsShortTextWithQuotesAndStress) {
  const SpeechLabels labels = parseTextGrid(kTwoTiers, "a.TextGrid");
  EXPECT_EQ(namesOf(labels), "sil EY sil");
  ASSERT_EQ(labels.words.size(), 1U);
  EXPECT_EQ(labels.words[0].text, "say \"A\"");
  ASSERT_EQ(labels.syllables.size(), 1U);
  EXPECT_EQ(labels.syllables[0].stress, 2);
  EXPECT_EQ(labels.duration(), 1.5);
}

TEST(TextGrid, ReadsEveryEncoding) {
  std::string text = kTwoTiers;
  text.replace(text.find("say"), 3, "caf\xC3\xA9");
  for (const std::string& bytes : {text, "\xEF\xBB\xBF" + text, asUtf16(text, true), asUtf16(text, false)}) {
    EXPECT_EQ(parseTextGrid(bytes, "a.TextGrid").words[0].text, "caf\xC3\xA9 \"A\"");
  }
  std::string latin = kTwoTiers;
  latin.replace(latin.find("say"), 3, "caf\xE9");
  EXPECT_EQ(parseTextGrid(latin, "a.TextGrid").words[0].text, "caf\xC3\xA9 \"A\"");
}

TEST(TextGrid, ReadsWindowsLineEndsAndComments) {
  std::string text = kTwoTiers;
  for (std::size_t i = 0; (i = text.find('\n', i)) != std::string::npos; i += 2) text.replace(i, 1, "\r\n");
  text.insert(text.find("\"IntervalTier\""), "! a comment with \"quotes\" and 12\r\n");
  EXPECT_EQ(namesOf(parseTextGrid(text, "a.TextGrid")), "sil EY sil");
}

TEST(TextGrid, FindsTheAlignersTiers) {
  for (const char* tier : {"phones", "Phones", "phonemes", "segments", "speaker 1 - phones"}) {
    EXPECT_EQ(namesOf(parseTextGrid(shortGrid("0.5 1 \"AH0\"\n", 1, tier), "a.TextGrid")), "sil AH sil") << tier;
  }
  EXPECT_EQ(gridErrorOf(shortGrid("0.5 1 \"AH0\"\n", 1, "orthography")),
            "a.TextGrid: has tiers [orthography]; expected one named phones");
}

TEST(TextGrid, ReadsIpaBesideArpabetWhicheverIsMore) {
  for (const std::string_view more : {"SH", "\u0268"}) {
    const SpeechLabels labels =
        parseTextGrid(shortGrid(fmt::format("0.5 1 \"SH\"\n1 1.5 \"\u0268\"\n1.5 2 \"{}\"", more), 3), "a.TextGrid");
    ASSERT_EQ(labels.phones.size(), 5U) << more;
    EXPECT_EQ(labels.phones[1].name(), "SH");
    EXPECT_EQ(labels.phones[2].phone, Phone::kIH);
  }
}

TEST(TextGrid, ForgivesRoundingOnly) {
  EXPECT_EQ(namesOf(parseTextGrid(shortGrid("0.5 1.00005 \"M\"\n1.0 1.5 \"AA\"\n1.50005 2 \"N\"", 3), "a.TextGrid")),
            "sil M AA N sil");
  EXPECT_EQ(gridErrorOf(shortGrid("0.5 1 \"M\"\n0.9 1.5 \"AA\"\n", 2)),
            "a.TextGrid:13: 'AA' begins at 0.9 s, inside the interval before it, which ends at 1 s; expected intervals "
            "that do "
            "not overlap");
}

TEST(TextGrid, NamesTheLineOfWhatIsWrong) {
  EXPECT_EQ(gridErrorOf(shortGrid("0.5 1.2 \"M\"\n1.25 1.2 \"AA\"\n", 2)),
            "a.TextGrid:13: 'AA' ends at 1.2 s, before it begins at 1.25 s; expected a later end");
  EXPECT_EQ(gridErrorOf(shortGrid("0.5 1.2 \"M\"\n1.2 1.3 \"QX\"\n", 2)),
            "a.TextGrid:13: found phone 'QX'; expected ARPAbet (AA AE AH ... ZH) or sil");
  EXPECT_EQ(gridErrorOf(shortGrid("0.5 nan \"M\"\n", 1)),
            "a.TextGrid:12: found times 0.5 to nan s; expected 0 to 86400 s");
  EXPECT_EQ(gridErrorOf(shortGrid("0.5 1e300 \"M\"\n", 1)),
            "a.TextGrid:12: found times 0.5 to 1e+300 s; expected 0 to 86400 s");
  EXPECT_EQ(gridErrorOf(shortGrid("0.5 0.5 \"M\"\n", 1)),
            "a.TextGrid:12: 'M' lasts 0.000000 s; expected at least 0.0002 s");
  EXPECT_EQ(gridErrorOf(shortGrid("0.5 1 \"M\"\n", 2)),
            "a.TextGrid:13: found the end of the file; expected an interval's start");
  EXPECT_EQ(gridErrorOf(shortGrid("0.5 1 \"M", 1)), "a.TextGrid:12: found a string without its closing quote");
  EXPECT_EQ(gridErrorOf(shortGrid("0.5 1 7", 1)), "a.TextGrid:12: found the number 7; expected an interval's text");
}

TEST(TextGrid, BelievesNoAbsurdCount) {
  for (const char* count : {"1e18", "-1", "2.5", "nan", "999999999"}) {
    std::string text = shortGrid("0.5 1 \"M\"\n", 1);
    text.replace(text.find("\n1\n0.5") + 1, 1, count);
    EXPECT_NE(gridErrorOf(text).find("expected a count that the file can hold"), std::string::npos)
        << gridErrorOf(text);
  }
}

TEST(TextGrid, RefusesOtherFiles) {
  EXPECT_EQ(gridErrorOf(""), "a.TextGrid:1: found the end of the file; expected \"ooTextFile\"");
  EXPECT_NE(gridErrorOf("File type = \"ooTextFile\"\nObject class = \"Pitch\"\n").find("is no TextGrid"),
            std::string::npos);
  EXPECT_NE(gridErrorOf("\"Praat chronological TextGrid text file\"\n0 1\n").find("chronological"), std::string::npos);
  EXPECT_NE(gridErrorOf(std::string("ooBinaryFile\010TextGrid")).find("is a binary TextGrid"), std::string::npos);
}

TEST(TextGrid, MovesTimesOfACutOutPartToZero) {
  const std::string moved =
      "\"ooTextFile\" \"TextGrid\" 10 11.5 <exists> 1 \"IntervalTier\" \"phones\" 10 11.5 1 10.5 11 \"AA\"";
  const SpeechLabels labels = parseTextGrid(moved, "a.TextGrid");
  EXPECT_EQ(namesOf(labels), "sil AA sil");
  EXPECT_NEAR(labels.phones[1].span.start, 0.5, 1e-12);
}

SpeechLabels randomLabels(std::mt19937& random) {
  std::vector<PhoneSegment> phones;
  std::vector<std::string> words;
  Seconds time = 0.1;
  const auto count = std::uniform_int_distribution<int>(1, 30)(random);
  for (int i = 0; i < count; ++i) {
    if (i % 4 == 0) words.push_back(std::string("word \"").append(std::to_string(i)).append("\""));
    auto phone = static_cast<Phone>(std::uniform_int_distribution<std::size_t>(0, kPhoneCount - 1)(random));
    const Seconds end = time + std::uniform_real_distribution<double>(0.001, 0.2)(random);
    phones.push_back({.phone = phone, .span = {time, end}, .word = words.size() - 1});
    time = end;
  }
  return buildSpeechLabels(std::move(phones), words, time + 0.1);
}

TEST(TextGrid, WritingReadingAndWritingAgainIsByteIdentical) {
  const unsigned seed = 20240711;
  SCOPED_TRACE(seed);
  std::mt19937 random(seed);
  for (int round = 0; round < 200; ++round) {
    const SpeechLabels labels = randomLabels(random);
    const std::string text = formatTextGrid(labels);
    const SpeechLabels read = parseTextGrid(text, "a.TextGrid");
    EXPECT_TRUE(formatTextGrid(read) == text) << "round " << round;
    EXPECT_EQ(read.syllables.size(), labels.syllables.size());
  }
}

TEST(TextGrid, ReadsEveryTakeOfTheRealCapture) {
  const fs::path takes = fs::path(MOUTHPIECE_SOURCE_DIR) / "../shared/capture/grid_s1/takes";
  if (!fs::exists(takes)) GTEST_SKIP() << "needs the capture in ../shared/capture/grid_s1, which is not here";
  std::size_t takes_read = 0, words = 0, phones = 0;
  for (const auto& entry : fs::directory_iterator(takes)) {
    if (entry.path().extension() != ".TextGrid") continue;
    const SpeechLabels labels = readTextGrid(entry.path());
    ++takes_read;
    words += labels.words.size();
    for (const auto& phone : labels.phones) phones += phone.phone != Phone::kSil ? 1 : 0;
    fs::path text = entry.path();
    std::string spoken;
    for (const auto& word : labels.words) {
      if (!spoken.empty()) spoken += ' ';
      spoken += word.text;
    }
    std::string expected = readFile(text.replace_extension(".txt"));
    while (!expected.empty() && (expected.back() == '\n' || expected.back() == '\r')) expected.pop_back();
    EXPECT_EQ(spoken, expected);
    EXPECT_EQ(formatTextGrid(parseTextGrid(formatTextGrid(labels), "again")), formatTextGrid(labels));
  }
  EXPECT_EQ(takes_read, 296U);
  EXPECT_EQ(words, 1776U);  // its README
  EXPECT_EQ(phones, 4961U);
}

}  // namespace
}  // namespace mouthpiece
