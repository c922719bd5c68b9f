#include "vocal/viseme_poses.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "base/errors.h"
#include "vocal/viseme_curves.h"

namespace mouthpiece {
namespace {

/// A layout of the generic poses' markers, their regions guessed from their names.
MarkerLayout fullLayout() { return defaultLayout(); }

SpeechLabels syllables(const std::vector<Phone>& phones, Seconds length) {
  SpeechLabels labels;
  labels.phones.push_back({Phone::kSil, {0, 0.4}, {}, {}});
  Seconds at = 0.4;
  for (const Phone phone : phones) {
    labels.phones.push_back({phone, {at, at + length}, {}, {}});
    at += length;
  }
  labels.phones.push_back({Phone::kSil, {at, at + 0.4}, {}, {}});
  return labels;
}

/// Performs the labels by `poses` without contacts: what a regression must find again.
MotionClip perform(const VisemePoses& poses, const SpeechLabels& labels, const MarkerPositions& neutral) {
  MotionClip clip{100, poses.marker_names, {}};
  std::vector<Seconds> times;
  for (Seconds time = 0; time < labels.duration(); time += 0.01) times.push_back(time);
  VisemePoses open = poses;
  open.bilabial_mm = open.labiodental_mm = 1e3;
  open.contact_mm = -1e3;
  clip.positions_mm =
      displacementsFromCurves(visemeCurves(labels, {}, {}), open, StyleSignal(1), StyleSignal(1), times);
  clip.positions_mm.rowwise() += Eigen::Map<const Eigen::RowVectorXd>(neutral.data(), neutral.size());
  return clip;
}

const std::vector<Phone> kSaid = {Phone::kM,  Phone::kAA, Phone::kS,  Phone::kIY, Phone::kF,  Phone::kUW, Phone::kT,
                                  Phone::kEH, Phone::kB,  Phone::kAO, Phone::kR,  Phone::kAH, Phone::kW,  Phone::kIY};

TEST(VisemePoses, RegressionFindsThePosesAgain) {
  const MarkerLayout layout = fullLayout();
  const VisemePoses& known = genericPoses();
  ASSERT_EQ(known.marker_names, layout.markerNames());
  const MarkerPositions neutral = MarkerPositions::Zero(static_cast<Eigen::Index>(layout.markers.size()), 3);
  std::vector<SpeechLabels> lines;
  std::vector<MotionClip> clips;
  for (const Seconds length : {0.06, 0.09, 0.13, 0.18, 0.23}) {
    std::vector<Phone> said = kSaid;
    std::rotate(said.begin(), said.begin() + static_cast<std::ptrdiff_t>(50 * length), said.end());
    lines.push_back(syllables(said, length));
    clips.push_back(perform(known, lines.back(), neutral));
  }
  std::vector<PoseTake> takes;
  for (std::size_t i = 0; i < lines.size(); ++i) takes.push_back({&lines[i], &clips[i]});
  const VisemePoses found = fitVisemePoses(takes, neutral, layout, &known);
  EXPECT_GT(found.explainedShare(), 0.95);
  // Jaw and lip parts trade with each other; what they do together is what was performed.
  const MotionClip again = perform(found, lines[2], neutral);
  const PositionMatrix centred = again.positions_mm.rowwise() - again.positions_mm.colwise().mean();
  const PositionMatrix wanted = clips[2].positions_mm.rowwise() - clips[2].positions_mm.colwise().mean();
  EXPECT_LT(std::sqrt((centred - wanted).array().square().mean()), 0.15) << "mm, of movements of several";
}

TEST(VisemePoses, WhatWasNotSeenComesFromTheGenericSet) {
  const MarkerLayout layout = fullLayout();
  const VisemePoses& known = genericPoses();
  const MarkerPositions neutral = MarkerPositions::Zero(static_cast<Eigen::Index>(layout.markers.size()), 3);
  const SpeechLabels labels = syllables({Phone::kM, Phone::kAA, Phone::kM, Phone::kIY, Phone::kM, Phone::kAA}, 0.3);
  const MotionClip clip = perform(known, labels, neutral);
  const VisemePoses found = fitVisemePoses({{&labels, &clip}}, neutral, layout, &known);
  const auto oo = static_cast<std::size_t>(Viseme::kOo);
  EXPECT_EQ(found.frames_seen[oo], 0);
  EXPECT_EQ(found.jaw_drop[oo], known.jaw_drop[oo]);
  EXPECT_EQ(found.lips.row(static_cast<Eigen::Index>(oo)), known.lips.row(static_cast<Eigen::Index>(oo)));
  EXPECT_GT(found.frames_seen[static_cast<std::size_t>(Viseme::kAh)], 8);
}

TEST(VisemePoses, JaAndLiScaleTheirParts) {
  const VisemePoses& poses = genericPoses();
  const CurveSet curves{{"Oh", {{0, 1, 0, 0}}}};
  const auto move = [&](double ja, double li) {
    return Eigen::RowVectorXd(displacementsFromCurves(curves, poses, StyleSignal(ja), StyleSignal(li), {0.0}).row(0));
  };
  const auto oh = static_cast<std::size_t>(Viseme::kOh);
  const Eigen::RowVectorXd jaw = poses.jaw_drop[oh] * poses.jaw_direction;
  EXPECT_LT((move(1, 0) - jaw).norm(), 1e-9);
  EXPECT_LT((move(2, 0) - 2 * jaw).norm(), 1e-9);
  EXPECT_LT((move(1, 1) - jaw - poses.lips.row(static_cast<Eigen::Index>(oh))).norm(), 1e-9);
}

TEST(VisemePoses, ContactsAreMade) {
  const VisemePoses& poses = genericPoses();
  const auto opening = [&](const CurveSet& curves) {
    const Eigen::RowVectorXd row = displacementsFromCurves(curves, poses, StyleSignal(1), StyleSignal(1), {0.0}).row(0);
    const auto y = [&](std::string_view name) {
      const auto found = std::find(poses.marker_names.begin(), poses.marker_names.end(), name);
      return row(3 * (found - poses.marker_names.begin()) + 1);
    };
    return y("LIP_UP_MID") - y("LIP_LO_MID");
  };
  const AnimationCurve ah{"Ah", {{0, 1, 0, 0}}}, mbp{"MBP", {{0, 1, 0, 0}}}, fv{"FV", {{0, 1, 0, 0}}};
  EXPECT_GT(opening({ah}), 4);
  EXPECT_LE(opening({ah, mbp}), poses.bilabial_mm + 0.01) << "whatever the vowel";
  EXPECT_LE(opening({ah, fv}), poses.labiodental_mm + 0.01);
  EXPECT_GE(opening({mbp}), poses.contact_mm - 0.01) << "but never through each other";
}

TEST(VisemePoses, JsonComesBack) {
  const VisemePoses& poses = genericPoses();
  const VisemePoses again = parsePoses(posesToJson(poses), "p.json");
  EXPECT_LT((again.lips - poses.lips).cwiseAbs().maxCoeff(), 1e-3);
  EXPECT_EQ(again.marker_names, poses.marker_names);
  EXPECT_NEAR(again.explainedShare(), poses.explainedShare(), 1e-3);
  for (const char* bad : {"", "{}", "[]", R"({"markers":["A"]})", R"({"markers":[1]})"})
    EXPECT_THROW(parsePoses(bad, "p.json"), InputError) << bad;
}

TEST(VisemePoses, RefusesALayoutWithoutLips) {
  MarkerLayout layout;
  layout.name = "brows";
  layout.markers.resize(3);
  EXPECT_THROW(fitVisemePoses({}, MarkerPositions::Zero(3, 3), layout, nullptr), InputError);
}

TEST(VisemePoses, AContactLastsNoLongerThanItsPhone) {
  // 8 mm apart without contacts, a P of 80 ms.
  const SpeechLabels labels = syllables({Phone::kAA, Phone::kP, Phone::kAA}, 0.08);
  const TimeSpan p = labels.phones[2].span;
  const VisemePoses& poses = genericPoses();
  const std::vector<Seconds> times = {p.start - 0.020, p.start, p.start + 0.74 * p.duration(), p.end, p.end + 0.010};
  PositionMatrix moved = 8 * poses.opening_direction.replicate(static_cast<Eigen::Index>(times.size()), 1) /
                         poses.mouth.verticalOpening(poses.opening_direction);
  moved = withContacts(visemeCurves(labels, {}, {}), poses, times, moved);
  const auto opening = [&](Eigen::Index row) { return poses.mouth.verticalOpening(moved.row(row)); };
  const double contact = std::max(poses.bilabial_mm, poses.contact_mm);
  EXPECT_NEAR(opening(0), 8, 0.01) << "20 ms before the phone";
  EXPECT_NEAR(opening(1), contact, 0.5);
  EXPECT_NEAR(opening(2), contact, 0.5) << "held to 75 %";
  EXPECT_GT(opening(3), 0.5 * (8 + contact)) << "the vowel begins with open lips";
  EXPECT_NEAR(opening(4), 8, 0.01);
}

}  // namespace
}  // namespace mouthpiece
