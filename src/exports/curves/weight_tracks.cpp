#include "exports/curves/weight_tracks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "base/errors.h"

namespace mouthpiece {
namespace {

enum Oculus : std::uint8_t { kSilent, kPP, kFF, kTH, kDD, kKK, kCH, kSS, kNN, kRR, kAa, kE, kIh, kOh, kOu };
constexpr std::array<std::string_view, 15> kOculusNames{"sil", "PP", "FF", "TH", "DD", "kk", "CH", "SS",
                                                        "nn",  "RR", "aa", "E",  "ih", "oh", "ou"};

/// What other vocabularies show for a phone: the one that it starts in, the one it ends in.
struct PhoneMouths {
  Phone phone;
  Oculus first, last;
  char drawn_first, drawn_last;  ///< Rhubarb's
};

// Meta's viseme reference and Rhubarb's README, phone by phone; HH has the mouth of what follows.
constexpr std::array<PhoneMouths, kPhoneCount> kMouths{
    {{Phone::kSil, kSilent, kSilent, 'X', 'X'}, {Phone::kAA, kAa, kAa, 'D', 'D'},
     {Phone::kAE, kAa, kAa, 'C', 'C'},          {Phone::kAH, kAa, kAa, 'C', 'C'},
     {Phone::kAO, kOh, kOh, 'E', 'E'},          {Phone::kAW, kAa, kOu, 'D', 'F'},
     {Phone::kAY, kAa, kIh, 'D', 'B'},          {Phone::kEH, kE, kE, 'C', 'C'},
     {Phone::kER, kRR, kRR, 'E', 'E'},          {Phone::kEY, kE, kIh, 'C', 'B'},
     {Phone::kIH, kIh, kIh, 'B', 'B'},          {Phone::kIY, kIh, kIh, 'B', 'B'},
     {Phone::kOW, kOh, kOu, 'E', 'F'},          {Phone::kOY, kOh, kIh, 'E', 'B'},
     {Phone::kUH, kOu, kOu, 'E', 'E'},          {Phone::kUW, kOu, kOu, 'F', 'F'},
     {Phone::kB, kPP, kPP, 'A', 'A'},           {Phone::kCH, kCH, kCH, 'B', 'B'},
     {Phone::kD, kDD, kDD, 'B', 'B'},           {Phone::kDH, kTH, kTH, 'B', 'B'},
     {Phone::kF, kFF, kFF, 'G', 'G'},           {Phone::kG, kKK, kKK, 'B', 'B'},
     {Phone::kHH, kSilent, kSilent, 'X', 'X'},  {Phone::kJH, kCH, kCH, 'B', 'B'},
     {Phone::kK, kKK, kKK, 'B', 'B'},           {Phone::kL, kNN, kNN, 'H', 'H'},
     {Phone::kM, kPP, kPP, 'A', 'A'},           {Phone::kN, kNN, kNN, 'B', 'B'},
     {Phone::kNG, kKK, kKK, 'B', 'B'},          {Phone::kP, kPP, kPP, 'A', 'A'},
     {Phone::kR, kRR, kRR, 'E', 'E'},           {Phone::kS, kSS, kSS, 'B', 'B'},
     {Phone::kSH, kCH, kCH, 'B', 'B'},          {Phone::kT, kDD, kDD, 'B', 'B'},
     {Phone::kTH, kTH, kTH, 'B', 'B'},          {Phone::kV, kFF, kFF, 'G', 'G'},
     {Phone::kW, kOu, kOu, 'F', 'F'},           {Phone::kY, kIh, kIh, 'B', 'B'},
     {Phone::kZ, kSS, kSS, 'B', 'B'},           {Phone::kZH, kCH, kCH, 'B', 'B'}}};

const PhoneMouths& mouthsOf(Phone phone) {
  const PhoneMouths& row = kMouths[static_cast<std::size_t>(phone)];
  MOUTHPIECE_EXPECT(row.phone == phone);
  return row;
}

/// A stretch with one mouth.
struct Shown {
  TimeSpan span;
  const PhoneMouths* mouths = nullptr;
  bool is_last = false;  ///< the mouth that a diphthong ends in
};

/// Phones as stretches: HH goes to what follows, a diphthong is two.
std::vector<Shown> shownIn(const SpeechLabels& labels) {
  std::vector<Shown> shown;
  Seconds begin = -1;
  for (const LabelledPhone& phone : labels.phones) {
    const PhoneMouths& mouths = mouthsOf(phone.phone);
    if (begin < 0) begin = phone.span.start;
    if (phone.phone == Phone::kHH) continue;
    const Seconds end = phone.span.end;
    constexpr double kFirstShare = 0.6;  // of a diphthong
    const bool is_diphthong = mouths.first != mouths.last;
    const Seconds turn = is_diphthong ? begin + kFirstShare * (end - begin) : end;
    shown.push_back({{begin, turn}, &mouths, false});
    if (is_diphthong) shown.push_back({{turn, end}, &mouths, true});
    begin = -1;
  }
  return shown;
}

/// From 0 to 1 with level ends.
double smoothly(double share) {
  share = std::clamp(share, 0.0, 1.0);
  return share * share * (3 - 2 * share);
}

}  // namespace

WeightTracks oculusVisemes(const SpeechLabels& labels, Eigen::Index frames, double frame_rate_hz) {
  constexpr Seconds kFade = 0.05;  // to each side of a boundary, at most half of the phone there
  WeightTracks tracks{frame_rate_hz, {kOculusNames.begin(), kOculusNames.end()}, {}};
  tracks.weights.setZero(frames, signedIndex(kOculusNames.size()));
  const std::vector<Shown> shown = shownIn(labels);
  if (shown.empty()) {
    tracks.weights.col(kSilent).setOnes();
    return tracks;
  }
  /// How much of the way from stretch i to the next has been gone.
  const auto passed = [&](std::size_t i, Seconds time) {
    const Seconds before = std::min(kFade, shown[i].span.duration() / 2),
                  after = std::min(kFade, shown[i + 1].span.duration() / 2);
    return smoothly((time - (shown[i].span.end - before)) / std::max(before + after, 1e-6));
  };
  std::size_t at = 0;
  for (Eigen::Index frame = 0; frame < frames; ++frame) {
    const Seconds time = asReal(frame) / frame_rate_hz;
    while (at + 1 < shown.size() && time >= shown[at].span.end) ++at;
    for (std::size_t i = at > 0 ? at - 1 : 0; i < std::min(at + 2, shown.size()); ++i) {
      const double in = i > 0 ? passed(i - 1, time) : 1.0, out = i + 1 < shown.size() ? passed(i, time) : 0.0;
      const Oculus viseme = shown[i].is_last ? shown[i].mouths->last : shown[i].mouths->first;
      tracks.weights(frame, viseme) += asFloat(std::max(0.0, in - out));
    }
  }
  for (Eigen::Index frame = 0; frame < frames; ++frame) tracks.weights.row(frame) /= tracks.weights.row(frame).sum();
  return tracks;
}

WeightTracks vrmMouth(const WeightTracks& visemes) {
  struct Share {
    Oculus viseme;
    int expression;
    float weight;
  };
  enum : std::uint8_t { kVrmAa, kVrmIh, kVrmOu, kVrmEe, kVrmOh };
  // Vowels as they are; consonants as far open and round as they are said; PP and FF stay shut.
  constexpr Share kShares[] = {{kAa, kVrmAa, 1.0F}, {kIh, kVrmIh, 1.0F},  {kOu, kVrmOu, 1.0F},  {kE, kVrmEe, 1.0F},
                               {kOh, kVrmOh, 1.0F}, {kRR, kVrmOu, 0.5F},  {kCH, kVrmOu, 0.4F},  {kSS, kVrmIh, 0.35F},
                               {kDD, kVrmIh, 0.3F}, {kTH, kVrmEe, 0.25F}, {kNN, kVrmIh, 0.25F}, {kKK, kVrmAa, 0.25F}};
  WeightTracks mouth{visemes.frame_rate_hz, {"aa", "ih", "ou", "ee", "oh"}, {}};
  mouth.weights.setZero(visemes.weights.rows(), 5);
  for (const Share& share : kShares)
    mouth.weights.col(share.expression) += share.weight * visemes.weights.col(share.viseme);
  return mouth;
}

std::vector<MouthCue> mouthCues(const SpeechLabels& labels) {
  constexpr Seconds kPause = 0.12;  // a shorter one keeps the mouth of what was before it
  std::vector<MouthCue> cues;
  const auto hundredths = [](Seconds time) { return std::round(time * 100) / 100; };
  for (const Shown& shown : shownIn(labels)) {
    char shape = shown.is_last ? shown.mouths->drawn_last : shown.mouths->drawn_first;
    if (shape == 'X' && shown.span.duration() < kPause && !cues.empty()) shape = cues.back().shape;
    const TimeSpan span{hundredths(shown.span.start), hundredths(shown.span.end)};
    if (!(span.end > span.start)) continue;
    if (!cues.empty() && cues.back().shape == shape) {
      cues.back().span.end = span.end;
    } else {
      cues.push_back({span, shape});
    }
  }
  return cues;
}

}  // namespace mouthpiece
