#include "phonetics/language/phone.h"

#include <gtest/gtest.h>

#include <functional>
#include <iterator>
#include <set>
#include <sstream>
#include <string>

namespace mouthpiece {
namespace {

using PhoneNames = std::set<std::string>;

/// The names of the phones for which `holds`.
PhoneNames phonesWhere(const std::function<bool(const PhoneRow&)>& holds) {
  PhoneNames names;
  for (std::size_t i = 0; i < kPhoneCount; ++i) {
    const PhoneRow& row = rowOf(static_cast<Phone>(i));
    if (holds(row)) names.emplace(row.name);
  }
  return names;
}

PhoneNames named(const std::string& names) {
  std::istringstream words(names);
  return {std::istream_iterator<std::string>(words), {}};
}

TEST(Phone, EveryNameReadsBack) {
  for (std::size_t i = 0; i < kPhoneCount; ++i) {
    const auto phone = static_cast<Phone>(i);
    EXPECT_EQ(phoneFromName(phoneName(phone)), phone) << phoneName(phone);
  }
}

TEST(Phone, SchwaHasOneNormalForm) {
  for (const char* name : {"AX", "ax", "AH", "ah", "AH0", "ah1", "ax0", "ax-h"}) {
    EXPECT_EQ(phoneFromName(name), Phone::kAH) << name;
  }
}

TEST(Phone, AcceptsStressOnVowelsOnly) {
  EXPECT_EQ(phoneFromName("EY2"), Phone::kEY);
  EXPECT_EQ(phoneFromName("er1"), Phone::kER);
  EXPECT_FALSE(phoneFromName("B1"));
  EXPECT_FALSE(phoneFromName("EY3"));
  EXPECT_FALSE(phoneFromName("sil1"));
}

TEST(Phone, RefusesWhatIsNoPhone) {
  for (const char* name : {"", "QQ", "A", "spn", "AHH", "0", "\xC3\xA9", "a very long name that is none"}) {
    EXPECT_FALSE(phoneFromName(name)) << name;
  }
}

TEST(PhoneRow, MannersAreThoseOfPhonetics) {
  const auto with = [](Articulation manner) {
    return phonesWhere([=](const PhoneRow& row) { return row.manner == manner; });
  };
  EXPECT_EQ(with(Articulation::kVowel), named("AA AE AH AO AW AY EH ER EY IH IY OW OY UH UW"));
  EXPECT_EQ(with(Articulation::kPlosive), named("B D G K P T"));
  EXPECT_EQ(with(Articulation::kAffricate), named("CH JH"));
  EXPECT_EQ(with(Articulation::kFricative), named("DH F S SH TH V Z ZH"));
  EXPECT_EQ(with(Articulation::kNasal), named("M N NG"));
  EXPECT_EQ(with(Articulation::kLateral), named("L"));
  EXPECT_EQ(with(Articulation::kApproximant), named("R W Y"));
  EXPECT_EQ(with(Articulation::kAspirate), named("HH"));
  EXPECT_EQ(with(Articulation::kSilence), named("sil"));
}

TEST(PhoneRow, TraitsAreThoseOfTheModelsThatUseThem) {
  EXPECT_EQ(phonesWhere([](const PhoneRow& row) { return row.lip_heavy; }), named("UW OW OY W SH ZH CH JH"));  // JALI
  EXPECT_EQ(phonesWhere([](const PhoneRow& row) { return row.turbulent; }),
            named("S Z F V SH ZH CH JH P B D T G K"));  // VOCAL 4.2
  EXPECT_EQ(phonesWhere([](const PhoneRow& row) { return row.fleeting; }), named("Y W R L HH"));
  EXPECT_EQ(phonesWhere([](const PhoneRow& row) { return isDiphthong(row.phone); }), named("AW AY EY OW OY"));
  EXPECT_EQ(phonesWhere([](const PhoneRow& row) { return row.lips_parting == 0; }), named("sil P B M"));
}

TEST(PhoneRow, VoicelessPhonesHaveAVoicedTwin) {
  for (const auto& [voiceless, voiced] :
       {std::pair(Phone::kP, Phone::kB), std::pair(Phone::kT, Phone::kD), std::pair(Phone::kK, Phone::kG),
        std::pair(Phone::kF, Phone::kV), std::pair(Phone::kTH, Phone::kDH), std::pair(Phone::kS, Phone::kZ),
        std::pair(Phone::kSH, Phone::kZH), std::pair(Phone::kCH, Phone::kJH)}) {
    const PhoneRow &one = rowOf(voiceless), &other = rowOf(voiced);
    EXPECT_FALSE(one.voiced) << one.name;
    EXPECT_TRUE(other.voiced) << other.name;
    EXPECT_TRUE(one.manner == other.manner && one.first == other.first && one.turbulent == other.turbulent) << one.name;
    EXPECT_TRUE(one.tongue.tip_up == other.tongue.tip_up && one.tongue.back_up == other.tongue.back_up) << one.name;
  }
}

TEST(PhoneRow, RowsAgreeWithThemselves) {
  for (std::size_t i = 0; i < kPhoneCount; ++i) {
    const PhoneRow& row = rowOf(static_cast<Phone>(i));
    SCOPED_TRACE(row.name);
    EXPECT_EQ((row.first == Viseme::kSil), (row.phone == Phone::kSil));
    EXPECT_TRUE(row.first == row.last || row.manner == Articulation::kVowel) << "only vowels glide";
    EXPECT_EQ(lipClosure(row.phone) == LipClosure::kLipToLip && row.phone != Phone::kSil,
              row.lips_parting == 0 && row.phone != Phone::kSil);
    for (const float share : {row.tongue.tip_up, row.tongue.tip_forward, row.tongue.back_up, row.lips_parting}) {
      EXPECT_GE(share, 0);
      EXPECT_LE(share, 1);
    }
    if (row.manner == Articulation::kVowel) {
      EXPECT_TRUE(row.voiced && rowOf(row.first).open >= 0.3 && !rowOf(row.first).sibilant);
    }
  }
}

TEST(VisemeRow, EachIsSomePhonesAndOnItsScales) {
  std::set<Viseme> used;
  for (std::size_t i = 0; i < kPhoneCount; ++i) {
    used.insert(firstViseme(static_cast<Phone>(i)));
    used.insert(lastViseme(static_cast<Phone>(i)));
  }
  EXPECT_EQ(used.size(), kVisemeCount);
  std::set<std::string_view> names;
  for (std::size_t i = 0; i < kVisemeCount; ++i) {
    const VisemeRow& row = rowOf(static_cast<Viseme>(i));
    names.insert(row.name);
    EXPECT_TRUE(row.open >= 0 && row.open <= 1 && row.round >= -1 && row.round <= 1) << row.name;
    EXPECT_TRUE(row.closure != LipClosure::kLipToLip || row.open == 0) << row.name;
    EXPECT_TRUE(row.viseme == Viseme::kSil || (row.kin[0] != row.viseme && row.kin[1] != row.viseme)) << row.name;
  }
  EXPECT_EQ(names.size(), kVisemeCount);
}

TEST(Phone, VisemesFollowTheTable) {
  struct Row {
    const char* phone;
    const char* first;
    const char* last;
  };
  for (const Row& row : {Row{"AY", "Ah", "Ee"},
                         {"AW", "Ah", "Oo"},
                         {"EY", "Eh", "Ee"},
                         {"OW", "Oh", "Oo"},
                         {"OY", "Oh", "Ee"},
                         {"AA", "Ah", "Ah"},
                         {"UH", "Uh", "Uh"},
                         {"M", "MBP", "MBP"},
                         {"CH", "ShChJ", "ShChJ"},
                         {"NG", "GK", "GK"},
                         {"HH", "H", "H"},
                         {"DH", "Th", "Th"},
                         {"sil", "sil", "sil"}}) {
    const Phone phone = phoneFromName(row.phone).value();
    EXPECT_EQ(visemeName(firstViseme(phone)), row.first) << row.phone;
    EXPECT_EQ(visemeName(lastViseme(phone)), row.last) << row.phone;
  }
  for (const char* name : {"P", "B", "M"}) EXPECT_TRUE(isBilabial(phoneFromName(name).value()));
  for (const char* name : {"F", "V"}) EXPECT_TRUE(isLabiodental(phoneFromName(name).value()));
  EXPECT_FALSE(isBilabial(Phone::kF) || isLabiodental(Phone::kM));
}

}  // namespace
}  // namespace mouthpiece
