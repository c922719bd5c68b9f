#include "phonetics/labels/label_files.h"

#include <gtest/gtest.h>

#include "base/errors.h"
#include "phonetics/labels/textgrid.h"
#include "phonetics/language/language.h"

namespace mouthpiece {
namespace {

SpeechLabels spoken() {
  return parseTextGrid(
      "File type = \"ooTextFile\"\nObject class = "
      "\"TextGrid\"\n\n0\n1\n<exists>\n2\n\"IntervalTier\"\n\"words\"\n0\n1\n3\n"
      "0\n0.25\n\"\"\n0.25\n0.75\n\"bö\xF0\x9F\x98\x80\"\n0.75\n1\n\"\"\n"
      "\"IntervalTier\"\n\"phones\"\n0\n1\n4\n0\n0.25\n\"sil\"\n0.25\n0.4375\n\"B\"\n0.4375\n0.75\n\"ER1\"\n0."
      "75\n1\n\"\"\n",
      "by hand");
}

class LabelFormats : public testing::TestWithParam<LabelFormat> {};

TEST_P(LabelFormats, PhonesComeBackAndAreWrittenAlikeAgain) {
  const SpeechLabels labels = spoken();
  for (const bool utf16 : {false, true}) {
    const LabelFileOptions options{.sample_rate_hz = 16000, .name = "a b", .utf16 = utf16};
    const std::string text = formatLabels(labels, GetParam(), options);
    const bool is_grid = GetParam() == LabelFormat::kTextGrid || GetParam() == LabelFormat::kShortTextGrid;
    const SpeechLabels read = is_grid ? parseTextGrid(text, "written") : parseLabFile(text, "written");
    ASSERT_EQ(read.phones.size(), labels.phones.size());
    for (std::size_t i = 0; i < labels.phones.size(); ++i) {
      EXPECT_EQ(read.phones[i].phone, labels.phones[i].phone);
      EXPECT_NEAR(read.phones[i].span.end, labels.phones[i].span.end, 1e-6);
    }
    if (is_grid) {
      EXPECT_EQ(read.words.at(0).text, labels.words.at(0).text);
    }
    EXPECT_EQ(formatLabels(read, GetParam(), options), text);
  }
}
INSTANTIATE_TEST_SUITE_P(All, LabelFormats,
                         testing::Values(LabelFormat::kTextGrid, LabelFormat::kShortTextGrid, LabelFormat::kHtk,
                                         LabelFormat::kEsps, LabelFormat::kTimit, LabelFormat::kCtm,
                                         LabelFormat::kSeconds));

TEST(LabelFiles, AreWrittenToTheByte) {
  EXPECT_EQ(formatLabels(spoken(), LabelFormat::kHtk),
            "0 2500000 sil\n2500000 4375000 B\n4375000 7500000 ER\n7500000 10000000 sil\n");
  EXPECT_EQ(
      formatLabels(spoken(), LabelFormat::kCtm, {.name = "x"}),
      "x 1 0.000000 0.250000 sil\nx 1 0.250000 0.187500 B\nx 1 0.437500 0.312500 ER\nx 1 0.750000 0.250000 sil\n");
}

TEST(Ctm, IsReadWithPositionsCommentsAndConfidence) {
  const SpeechLabels labels = parseLabFile(
      ";; of Kaldi\nutt1 1 0.00 0.10 SIL\nutt1 1 0.10 0.20 B_B 0.99\nutt1 1 0.30 0.20 IH1_E 0.98\n", "a.ctm");
  ASSERT_EQ(labels.phones.size(), 4U);
  EXPECT_EQ(labels.phones[1].phone, Phone::kB);
  EXPECT_EQ(labels.phones[2].phone, Phone::kIH);
  EXPECT_NEAR(labels.phones[2].span.start, 0.3, 1e-9);
  EXPECT_THROW(parseLabFile("a 1 0 0.1 AA\nb 1 0.1 0.1 AA\n", "two.ctm"), InputError);
}

TEST(LabelFiles, AreNoTextThatAnyoneSays) {
  EXPECT_TRUE(isLabFile("0.0 0.23 sil\n\n0.23 0.31 n\n"));
  EXPECT_TRUE(isLabFile("separator ;\n#\n0.23 121 pau\n0.31 121 n\n"));
  EXPECT_FALSE(isLabFile("1 2 buckle my shoe\n3 4 shut the door\n"));
  EXPECT_FALSE(isLabFile("2 2 Baker Street\n"));
  EXPECT_FALSE(isLabFile("#\nthe time is now\nand then\n"));
  EXPECT_FALSE(isLabFile(""));
}

TEST(PhoneSets, AreToldApartByTheWholeFile) {
  EXPECT_EQ(likeliestPhoneSet(std::vector<std::string>{"D", "AH0", "T", "sil"}), PhoneSet::kArpabet);
  EXPECT_EQ(likeliestPhoneSet(std::vector<std::string>{"D", "@", "tS", "{"}), PhoneSet::kXSampa);
  EXPECT_EQ(likeliestPhoneSet(std::vector<std::string>{"ð", "ə", "tʃ", "æ", "n"}), PhoneSet::kIpa);
  EXPECT_EQ(likeliestPhoneSet(std::vector<std::string>{"h#", "dcl", "d", "q", "ix", "axr"}), PhoneSet::kArpabet);
}

TEST(PhoneSets, SaySheSellsInAnyOfThem) {
  const std::vector<Phone> expected = {Phone::kSH, Phone::kIY, Phone::kS,  Phone::kEH, Phone::kL,  Phone::kZ,
                                       Phone::kDH, Phone::kAH, Phone::kCH, Phone::kEY, Phone::kNG, Phone::kER};
  const auto read = [](std::initializer_list<const char*> names, PhoneSet set) {
    std::vector<Phone> phones;
    for (const char* name : names) phones.push_back(phoneFromName(name, set).value());
    return phones;
  };
  EXPECT_EQ(read({"SH", "IY1", "S", "EH1", "L", "Z", "DH", "AH0", "CH", "EY1", "NG", "ER0"}, PhoneSet::kArpabet),
            expected);
  EXPECT_EQ(read({"sh", "iy", "s", "eh", "el", "z", "dh", "ax", "ch", "ey", "eng", "axr"}, PhoneSet::kArpabet),
            expected);
  EXPECT_EQ(read({"S", "i:", "s", "e", "l", "z", "D", "@", "tS", "eI", "N", "3:"}, PhoneSet::kXSampa), expected);
  EXPECT_EQ(read({"ʃ", "iː", "s", "ɛ", "ɫ", "z", "ð", "ə", "t͡ʃ", "ej", "ŋ", "ɚ"}, PhoneSet::kIpa), expected);
}

TEST(LabelFiles, JsonIsToldAsThat) {
  try {
    parseLabFile("\n{\"phones\": []}\n", "facts.json");
    FAIL() << "no error";
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(),
                 "facts.json:2: begins as JSON does; expected a TextGrid or lines of \"start end label\"");
  }
}

TEST(PhoneSets, AnUnknownPhoneIsNamed) {
  try {
    parseLabFile("0 0.1 ʃ\n0.1 0.2 iː\n0.2 0.3 ☃\n0.3 0.4 ə\n", "a.lab");
    FAIL() << "no error";
  } catch (const InputError& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("a.lab:3"), std::string::npos) << text;
    EXPECT_NE(text.find("IPA"), std::string::npos) << text;
  }
}

}  // namespace
}  // namespace mouthpiece
