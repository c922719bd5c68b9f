#include "phonetics/labels/label_files.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "base/errors.h"
#include "base/files.h"
#include "phonetics/labels/textgrid.h"

namespace mouthpiece {
namespace {

std::string shown(const SpeechLabels& labels) {
  std::string out;
  for (const auto& phone : labels.phones) {
    out += std::string(phoneName(phone.phone)) + "@" + std::to_string(static_cast<int>(phone.span.start * 1000 + 0.5)) +
           " ";
  }
  return out + std::to_string(static_cast<int>(labels.duration() * 1000 + 0.5));
}

std::string labErrorOf(std::string_view bytes) {
  try {
    parseLabFile(bytes, "a.lab");
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

constexpr const char* kExpected = "sil@0 B@100 AH@200 sil@350 500";

TEST(LabFile, TellsFourKindsApartByContent) {
  EXPECT_EQ(
      shown(parseLabFile("signal x\nnfields 1\n#\n0.1 121 pau\n 0.2 121 b\n0.35 121 ax ; 3\n0.5 121 pau\n", "esps")),
      kExpected);
  EXPECT_EQ(
      shown(parseLabFile("0 1000000 sil -12.5\n1000000 2000000 b\n2000000 3500000 ah\n3500000 5000000 sil\n", "htk")),
      kExpected);
  EXPECT_EQ(shown(parseLabFile("0 1600 h#\n1600 2400 bcl\n2400 3200 b\n3200 5600 ax-h\n5600 8000 h#\n", "timit")),
            kExpected);
  EXPECT_EQ(shown(parseLabFile("0.0\t0.1\t\r\n0.1\t0.2\tB\r\n\r\n0.2\t0.35\tAH1\r\n0.35\t0.5\tsil\r\n", "plain")),
            kExpected);
}

TEST(LabFile, CountsTimitInItsOwnRate) {
  EXPECT_EQ(shown(parseLabFile("0 800 h#\n800 1600 b\n1600 2800 ax\n2800 4000 h#\n", "timit",
                               {.timit_sample_rate_hz = 8000})),
            kExpected);
}

TEST(LabFile, JoinsTimitsClosuresAndGlottalStops) {
  EXPECT_EQ(
      shown(parseLabFile(
          "0 1600 h#\n1600 3200 dcl\n3200 4800 jh\n4800 6400 ih\n6400 8000 q\n8000 9600 tcl\n9600 11200 h#\n", "t")),
      "sil@0 JH@100 IH@300 T@500 sil@600 700");
}

TEST(LabFile, NamesTheLineOfWhatIsWrong) {
  EXPECT_EQ(labErrorOf(""), "a.lab: holds no labels; expected lines of \"start end label\"");
  EXPECT_EQ(labErrorOf("\n\n0.1 x sil\n"), "a.lab:3: found 'x'; expected a time");
  EXPECT_EQ(labErrorOf("0.1\n"), "a.lab:1: found 1 fields; expected \"start end label\"");
  EXPECT_EQ(labErrorOf("0.0 0.3 sil\n0.2 0.4 M\n"),
            "a.lab:2: 'M' begins at 0.2 s, inside the interval before it, which ends at 0.3 s; "
            "expected intervals that do not overlap");
  EXPECT_EQ(labErrorOf("#\n0.3 1 pau\n0.2 1 m\n"),
            "a.lab:3: 'm' ends at 0.2 s, before it begins at 0.3 s; expected a later end");
  EXPECT_EQ(labErrorOf("0.0 0.3 blah\n"), "a.lab:1: found phone 'blah'; expected ARPAbet (AA AE AH ... ZH) or sil");
  EXPECT_EQ(labErrorOf("0.0 0.3 spn\n"),
            "a.lab:1: found phone 'spn' (the aligner's mark for a word that its dictionary lacks); "
            "expected ARPAbet (AA AE AH ... ZH) or sil");
  EXPECT_EQ(labErrorOf("0.0 1e99 M\n"), "a.lab:1: found times 0 to 1e+99 s; expected 0 to 86400 s");
  EXPECT_EQ(labErrorOf("#!MLF!#\n"), "a.lab:1: is a master label file; expected one file a take");
}

TEST(ReadLabels, TellsTextGridsFromLabelFiles) {
  const auto folder = std::filesystem::path(::testing::TempDir()) / "mouthpiece_labels_test";
  const SpeechLabels labels = parseLabFile("0.0 0.1 sil\n0.1 0.2 B\n0.2 0.35 AH\n0.35 0.5 sil\n", "a.lab");
  writeTextGrid(folder / "named.lab", labels);
  writeFileAtomically(folder / "named.TextGrid",
                      std::string_view("0.0 0.1 sil\n0.1 0.2 B\n0.2 0.35 AH\n0.35 0.5 sil\n"));
  EXPECT_EQ(shown(readLabels(folder / "named.lab")), kExpected);
  EXPECT_EQ(shown(readLabels(folder / "named.TextGrid")), kExpected);
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace mouthpiece
