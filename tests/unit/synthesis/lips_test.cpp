#include "synthesis/lips.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/tiny_corpus.h"
#include "synthesis/curve_model.h"
#include "synthesis/tongue.h"

namespace mouthpiece {
namespace {

constexpr Seconds kPhone = 0.3;
constexpr double kRateHz = 200;

/// sil, the phones, sil; each kPhone long.
SpeechLabels labelsOf(std::vector<Phone> phones) {
  phones.insert(phones.begin(), Phone::kSil);
  phones.push_back(Phone::kSil);
  SpeechLabels labels;
  for (std::size_t i = 0; i < phones.size(); ++i) {
    LabelledPhone& phone = labels.phones.emplace_back();
    phone.phone = phones[i];
    phone.span = {kPhone * static_cast<double>(i), kPhone * static_cast<double>(i + 1)};
  }
  return labels;
}

std::vector<Seconds> timesOf(const SpeechLabels& labels) {
  std::vector<Seconds> times;
  for (std::size_t i = 0; static_cast<double>(i) / kRateHz < labels.duration(); ++i)
    times.push_back(static_cast<double>(i) / kRateHz);
  return times;
}

std::size_t frameAt(double phone) { return static_cast<std::size_t>(std::lround(phone * kPhone * kRateHz)); }

TEST(Lips, AreSealedInBilabialsAndSilenceAlone) {
  for (const Phone bilabial : {Phone::kP, Phone::kB, Phone::kM}) {
    const SpeechLabels labels = labelsOf({Phone::kTH, bilabial, Phone::kR});
    const std::vector<LipPose> lips = lipsFromPhones(labels, timesOf(labels));
    for (const double sealed : {0.5, 2.05, 2.95}) {
      EXPECT_EQ(lips[frameAt(sealed)].seal, 1);
      EXPECT_EQ(lips[frameAt(sealed)].parting, 0);
    }
    for (const double open : {1.5, 3.5}) {
      EXPECT_EQ(lips[frameAt(open)].seal, 0);
      EXPECT_GT(lips[frameAt(open)].parting, 0);
    }
    EXPECT_EQ(lips[frameAt(1.5)].parting, 1) << "the tongue goes between";
  }
}

TEST(Lips, AreOpenFromTheFirstSoundToTheLastOne) {
  const SpeechLabels labels = labelsOf({Phone::kW, Phone::kSil, Phone::kW, Phone::kSil, Phone::kB, Phone::kUW});
  const std::vector<LipPose> lips = lipsFromPhones(labels, timesOf(labels));
  for (std::size_t i = frameAt(1); i <= frameAt(2); ++i) EXPECT_LT(lips[i].seal, 0.01F) << i;
  for (std::size_t i = frameAt(3); i <= frameAt(4); ++i) EXPECT_LT(lips[i].seal, 0.01F) << i;
  for (const double silence : {0.0, 0.5, 2.5, 7.5}) EXPECT_EQ(lips[frameAt(silence)].seal, 1) << silence;
  for (std::size_t i = frameAt(4.5); i <= frameAt(6); ++i) EXPECT_EQ(lips[i].seal, 1) << "before a B, " << i;
}

TEST(Lips, AreOpenInTheMiddleOfAShortWAfterAShortPause) {
  SpeechLabels labels = labelsOf({Phone::kT, Phone::kSil, Phone::kW, Phone::kEH});
  const Seconds lengths[] = {0.2, 0.065, 0.03, 0.065, 0.03, 0.2};
  Seconds at = 0;
  for (std::size_t i = 0; i < labels.phones.size(); ++i) {
    labels.phones[i].span = {at, at + lengths[i]};
    at += lengths[i];
  }
  const std::vector<LipPose> lips = lipsFromPhones(labels, timesOf(labels));
  const TimeSpan w = labels.phones[3].span;
  for (const LipPose& pose : {lips[static_cast<std::size_t>(std::lround(w.start * kRateHz))],
                              lips[static_cast<std::size_t>(std::lround(w.middle() * kRateHz))]}) {
    EXPECT_LT(pose.seal, 0.01F);
    EXPECT_GT(pose.rounding, 0.9F);
  }
}

TEST(Lips, TuckInLabiodentalsAlone) {
  const SpeechLabels labels = labelsOf({Phone::kAA, Phone::kF, Phone::kTH, Phone::kV});
  const std::vector<LipPose> lips = lipsFromPhones(labels, timesOf(labels));
  for (const double tucked : {2.2, 2.5, 2.8, 4.5}) EXPECT_EQ(lips[frameAt(tucked)].tuck, 1) << tucked;
  for (const double free : {0.5, 1.5, 3.5}) EXPECT_EQ(lips[frameAt(free)].tuck, 0) << free;
}

TEST(Lips, AreNotSealedInAShortVBeforeAB) {
  SpeechLabels labels = labelsOf({Phone::kAA, Phone::kV, Phone::kB});
  // The V lasts 60 ms.
  for (std::size_t i = 3; i < labels.phones.size(); ++i) {
    labels.phones[i].span.start -= 0.24;
    labels.phones[i].span.end -= 0.24;
  }
  labels.phones[2].span.end = labels.phones[3].span.start;
  const std::vector<LipPose> lips = lipsFromPhones(labels, timesOf(labels));
  const TimeSpan v = labels.phones[2].span, b = labels.phones[3].span;
  const auto at = [](Seconds time) { return static_cast<std::size_t>(std::lround(time * kRateHz)); };
  EXPECT_LT(lips[at(v.start + 0.01)].seal, 0.1F);
  EXPECT_GT(lips[at(v.start + 0.01)].tuck, 0.9F);
  EXPECT_EQ(lips[at(b.start + 0.01)].seal, 1);
  EXPECT_EQ(lips[at(b.start + 0.01)].tuck, 0);
}

/// A silence that is shorter than lips take to part seals nothing, and hides no closure that comes after it.
TEST(Lips, CloseWithoutASkipAfterAShortPause) {
  constexpr double kMostOfSeal = 1.5708 / 0.050 / kRateHz;  // a cosine ramp of 50 ms
  for (const Seconds pause : {0.01, 0.03, 0.05, 0.065}) {
    SpeechLabels labels = labelsOf({Phone::kAA, Phone::kSil, Phone::kM, Phone::kAA});
    labels.phones[2].span.end = labels.phones[2].span.start + pause;
    for (std::size_t i = 3; i < labels.phones.size(); ++i) {
      labels.phones[i].span.start += pause - kPhone;
      labels.phones[i].span.end += pause - kPhone;
    }
    const std::vector<LipPose> lips = lipsFromPhones(labels, timesOf(labels));
    for (std::size_t i = 1; i < lips.size(); ++i)
      EXPECT_LE(std::abs(lips[i].seal - lips[i - 1].seal), kMostOfSeal + 1e-6) << pause << " s, frame " << i;
  }
}

/// Silence has no lips to keep shut: the lower one is on its way before an F sounds, and goes back after it.
TEST(Lips, AreAtTheTeethWhenAnFAfterAPauseSounds) {
  constexpr double kMostAFrame = 0.3;  // of the way, in a sixtieth
  const SpeechLabels labels = labelsOf({Phone::kF, Phone::kAA, Phone::kV});
  std::vector<Seconds> times;
  for (int i = 0; i < 60 * labels.duration(); ++i) times.push_back(i / 60.0);
  const std::vector<LipPose> lips = lipsFromPhones(labels, times);
  const auto at = [](Seconds time) { return static_cast<std::size_t>(std::lround(60 * time)); };
  EXPECT_GT(lips[at(kPhone + 0.02)].tuck, 0.95F);
  EXPECT_GT(lips[at(4 * kPhone - 0.02)].tuck, 0.95F);
  EXPECT_LT(lips[at(kPhone + 0.05)].seal, 0.05F);
  EXPECT_EQ(lips[at(kPhone - 0.1)].tuck, 0);
  EXPECT_GT(lips[at(kPhone - 0.1)].seal, 0.95F);
  for (std::size_t i = 1; i < lips.size(); ++i) EXPECT_LT(std::abs(lips[i].tuck - lips[i - 1].tuck), kMostAFrame) << i;
}

/// The lower lip goes from the upper teeth to the upper lip in the time that there is, and back: it does not pop out.
TEST(Lips, GlideBetweenTheTeethAndEachOther) {
  const struct {
    Seconds between, most_a_frame;  // of the way, in a sixtieth
  } kNears[] = {{0, 0.6}, {0.06, 0.5}, {0.08, 0.4}, {0.1, 0.3}};
  constexpr int kFrame = 4;
  for (const auto& [between, most] : kNears) {
    for (const bool closes : {true, false}) {
      const Phone first = closes ? Phone::kV : Phone::kM, last = closes ? Phone::kM : Phone::kV;
      SpeechLabels labels;
      Seconds at = 0;
      const auto say = [&](Phone phone, Seconds length) {
        LabelledPhone& said = labels.phones.emplace_back();
        said.phone = phone;
        said.span = {at, at + length};
        at += length;
      };
      say(Phone::kAA, 0.3);
      say(first, 0.08);
      if (between > 0) say(Phone::kUW, between);
      say(last, 0.08);
      say(Phone::kAA, 0.3);
      std::vector<Seconds> times;
      for (int i = 0; i < at * 60 * kFrame; ++i) times.push_back(i / (60.0 * kFrame));
      const std::vector<LipPose> lips = lipsFromPhones(labels, times);
      float furthest_tuck = 0, furthest_seal = 0;
      for (std::size_t i = kFrame; i < lips.size(); ++i) {
        ASSERT_LT(std::abs(lips[i].tuck - lips[i - kFrame].tuck), most)
            << between << ", " << closes << ", " << times[i];
        furthest_tuck = std::max(furthest_tuck, lips[i].tuck);
        furthest_seal = std::max(furthest_seal, lips[i].seal);
        EXPECT_LE(lips[i].tuck + lips[i].seal, 1 + 1e-6F);
      }
      EXPECT_GT(furthest_tuck, 0.999F);
      EXPECT_GT(furthest_seal, 0.999F);
    }
  }
}

/// An actor's lips have gone far apart between closures that lie far apart: a seal that came within 50 ms let them
/// leap.
TEST(Lips, ComeTogetherAndPartInHalfOfTheTimeBetweenClosures) {
  const struct {
    Seconds parted, most_a_frame;  // of the way, in a sixtieth
  } kParted[] = {{0.06, 0.53}, {0.14, 0.53}, {0.2, 0.33}, {0.3, 0.27}};
  constexpr int kFrame = 4;
  for (const auto& [parted, most] : kParted) {
    SpeechLabels labels = labelsOf({Phone::kP, Phone::kL, Phone::kAA, Phone::kP});
    const Seconds lengths[] = {0.3, 0.1, parted / 3, 2 * parted / 3, 0.1, 0.3};
    Seconds at = 0;
    for (std::size_t i = 0; i < labels.phones.size(); ++i) {
      labels.phones[i].span = {at, at + lengths[i]};
      at += lengths[i];
    }
    std::vector<Seconds> times;
    for (int i = 0; i < at * 60 * kFrame; ++i) times.push_back(i / (60.0 * kFrame));
    const std::vector<LipPose> lips = lipsFromPhones(labels, times);
    const Seconds middle = labels.phones[1].span.end + parted / 2;
    for (std::size_t i = kFrame; i < lips.size(); ++i) {
      EXPECT_LT(std::abs(lips[i].seal - lips[i - kFrame].seal), most) << parted << ", " << times[i];
      if (std::abs(times[i] - middle) > parted / 2 - 0.02) {
        EXPECT_EQ(lips[i].seal, 1) << parted << ", " << times[i];
      }
    }
    if (parted >= 0.14) {
      EXPECT_LT(lips[unsignedIndex(std::lround(middle * 60 * kFrame))].seal, 0.01F) << "as open as the actor's";
    }
  }
}

TEST(Lips, RoundInWAndAtTheEndOfOw) {
  const SpeechLabels labels = labelsOf({Phone::kAA, Phone::kW, Phone::kIY, Phone::kAW, Phone::kTH});
  const std::vector<LipPose> lips = lipsFromPhones(labels, timesOf(labels));
  EXPECT_EQ(lips[frameAt(2.5)].rounding, 1);
  EXPECT_EQ(lips[frameAt(3.5)].rounding, 0);
  EXPECT_LT(lips[frameAt(4.1)].rounding, 0.2);
  EXPECT_GT(lips[frameAt(4.9)].rounding, 0.7);
}

/// Where a sound is told in IPA the lips do what it says, not what the phone nearest to it does.
TEST(Lips, OfASoundInIpaAreItsOwn) {
  SpeechLabels labels = labelsOf({Phone::kB, Phone::kIY, Phone::kB, Phone::kW, Phone::kAW});
  labels.phones[1].ipa = "β";
  labels.phones[2].ipa = "y";
  labels.phones[3].ipa = "b";
  labels.phones[4].ipa = "ɰ";
  labels.phones[5].ipa = "aʊ";
  const std::vector<LipPose> lips = lipsFromPhones(labels, timesOf(labels));
  EXPECT_EQ(lips[frameAt(1.5)].seal, 0);
  EXPECT_GT(lips[frameAt(1.5)].parting, 0.1F);
  EXPECT_LT(lips[frameAt(1.5)].parting, 0.2F);
  EXPECT_EQ(lips[frameAt(2.5)].rounding, 1);
  EXPECT_EQ(lips[frameAt(3.5)].seal, 1);
  EXPECT_EQ(lips[frameAt(4.5)].rounding, 0);
  EXPECT_LT(lips[frameAt(5.1)].rounding, 0.2);
  EXPECT_GT(lips[frameAt(5.9)].rounding, 0.7);
}

TEST(Lips, RoundHalfWayInAPhoneThatTakesNoTime) {
  SpeechLabels labels = labelsOf({Phone::kAW});
  labels.phones[1].span.end = labels.phones[1].span.start;
  const Seconds at = labels.phones[1].span.start;
  EXPECT_NEAR(lipsFromPhones(labels, std::vector{at})[0].rounding, 0.5, 1e-6);
}

TEST(Lips, AreLeftToRoundWhatTheCaptureHasNotShown) {
  Corpus corpus = samples::tinyCorpus();
  VisemePoses poses = learnPoses(corpus);
  poses.lips.setZero();
  const char* const corners[] = {"LIP_CORNER_R", "LIP_CORNER_L"};
  for (const std::size_t i : {0U, 1U}) corpus.layout.markers[2 + i].name = poses.marker_names[2 + i] = corners[i];
  corpus.neutral_pose_mm << 0, 5, 0, 0, -5, 0, -25, 0, 0, 25, 0, 0;
  const auto unseen = [&] {
    corpus.viseme_poses = posesToJson(poses);
    return unseenRounding(corpus);
  };
  EXPECT_DOUBLE_EQ(unseen().narrowing, kRounded.narrowing);
  EXPECT_DOUBLE_EQ(unseen().protrusion, kRounded.protrusion);
  // W is 5 of 50 mm narrower, UW 1.5 mm further forward.
  poses.lips(static_cast<Eigen::Index>(Viseme::kW), 6) = 2.5;
  poses.lips(static_cast<Eigen::Index>(Viseme::kW), 9) = -2.5;
  for (const Eigen::Index z : {2, 5}) poses.lips(static_cast<Eigen::Index>(Viseme::kOo), z) = 1.5;
  EXPECT_NEAR(unseen().narrowing, kRounded.narrowing - 0.1, 1e-6);
  EXPECT_NEAR(unseen().protrusion, kRounded.protrusion - 0.03, 1e-6);
  poses.lips(static_cast<Eigen::Index>(Viseme::kW), 6) = 10;
  EXPECT_EQ(unseen().narrowing, 0) << "more than lips need is no less";
  corpus.layout.markers[3].name = "BROW";
  poses.marker_names[3] = "BROW";
  EXPECT_EQ(unseen().protrusion, 0) << "a mouth without corners has no width";
}

TEST(Lips, PartAndRoundAsEachPhoneAsks) {
  const SpeechLabels labels = labelsOf({Phone::kTH, Phone::kAA, Phone::kSH, Phone::kIY, Phone::kR, Phone::kOW});
  const std::vector<LipPose> lips = lipsFromPhones(labels, timesOf(labels));
  EXPECT_EQ(lips[frameAt(1.5)].parting, 1);
  EXPECT_EQ(lips[frameAt(2.2)].parting, 0.4F) << "60 ms after a TH";
  EXPECT_NEAR(lips[frameAt(2.5)].rounding, 0, 1e-6);
  EXPECT_NEAR(lips[frameAt(3.5)].rounding, 0.6, 1e-6);
  EXPECT_NEAR(lips[frameAt(4.5)].rounding, 0, 1e-6);
  EXPECT_NEAR(lips[frameAt(5.5)].rounding, 0.3, 1e-6);
  EXPECT_NEAR(lips[frameAt(6.1)].rounding, 0.64, 1e-6) << "a tenth of the way from 0.6 to 1";
}

TEST(Lips, OfACorpusThatKeepsNoPosesAreLeftAsTheyAre) {
  const LipRounding unseen = unseenRounding(Corpus{});
  EXPECT_EQ(unseen.narrowing, 0);
  EXPECT_EQ(unseen.protrusion, 0);
}

TEST(Lips, ComeAndGoWithoutASkip) {
  const SpeechLabels labels = labelsOf({Phone::kTH, Phone::kM, Phone::kAA, Phone::kTH, Phone::kAA});
  const std::vector<LipPose> lips = lipsFromPhones(labels, timesOf(labels));
  // Cosine ramps of 50 ms rise by pi / 2 over that at most; the parting's comes while the seal goes.
  constexpr double kMostOfSeal = 1.5708 / 0.050 / kRateHz, kMostOfParting = 2 * kMostOfSeal;
  for (std::size_t i = 1; i < lips.size(); ++i) {
    EXPECT_LE(std::abs(lips[i].seal - lips[i - 1].seal), kMostOfSeal + 1e-6) << i;
    EXPECT_LE(std::abs(lips[i].parting - lips[i - 1].parting), kMostOfParting + 1e-6) << i;
  }
}

TEST(Tongue, GoesWhereThePhoneAsksItToAndBack) {
  const SpeechLabels labels = labelsOf({Phone::kTH, Phone::kAA, Phone::kT, Phone::kK, Phone::kAA});
  const std::vector<Seconds> times = timesOf(labels);
  const std::vector<TonguePose> poses = tongueFromPhones(labels, times);
  for (std::size_t phone = 0; phone < labels.phones.size(); ++phone) {
    const TongueTarget& target = rowOf(labels.phones[phone].phone).tongue;
    const TonguePose& pose = poses[frameAt(asReal(phone) + 0.5)];
    EXPECT_EQ(pose.tip_up, target.tip_up) << phone;
    EXPECT_EQ(pose.tip_forward, target.tip_forward) << phone;
    EXPECT_EQ(pose.back_up, target.back_up) << phone;
  }
  EXPECT_EQ(poses[frameAt(3.5)].tip_up, 1);
  EXPECT_EQ(poses[frameAt(1.5)].tip_forward, 1);
  EXPECT_EQ(poses[frameAt(4.5)].back_up, 1);
  SpeechLabels brief = labels;  // its T lasts 20 ms: whole in its middle
  brief.phones[3].span = {labels.phones[3].span.middle() - 0.01, labels.phones[3].span.middle() + 0.01};
  EXPECT_EQ(tongueFromPhones(brief, std::vector{brief.phones[3].span.middle()})[0].tip_up, 1);
  constexpr double kMost = 1.5708 / 0.100 / kRateHz;  // a cosine ramp of 100 ms
  for (std::size_t i = 1; i < poses.size(); ++i)
    EXPECT_LE(std::abs(poses[i].tip_up - poses[i - 1].tip_up), kMost + 1e-6);
}

}  // namespace
}  // namespace mouthpiece
