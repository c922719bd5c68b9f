#include "phonetics/language/phone.h"

#include <gtest/gtest.h>

#include <set>

namespace mouthpiece {
namespace {

TEST(Phone, EveryNameReadsBack) {
  for (std::size_t i = 0; i < kPhoneCount; ++i) {
    const auto phone = static_cast<Phone>(i);
    if (phone == Phone::kAX) continue;  // a name that is read, never written: AH is its normal form
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

TEST(Phone, VowelsAreTheFifteenAndTheSchwa) {
  std::set<std::string_view> vowels;
  for (std::size_t i = 0; i < kPhoneCount; ++i) {
    if (isVowel(static_cast<Phone>(i))) vowels.insert(phoneName(static_cast<Phone>(i)));
  }
  EXPECT_EQ(vowels, (std::set<std::string_view>{"AA", "AE", "AH", "AO", "AW", "AX", "AY", "EH", "ER", "EY", "IH", "IY",
                                                "OW", "OY", "UH", "UW"}));
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
