#include "units/prediction/context_network.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "base/index.h"

namespace mouthpiece {
namespace {

constexpr std::array<Seconds, kContextWindows> kMiddles{-0.24, -0.18, -0.13, -0.09, -0.055, -0.025, 0,
                                                        0.025, 0.055, 0.09,  0.13,  0.18,   0.24};

/// Where a vowel is made; 0 to 1.
struct VowelPlace {
  Phone phone;
  float height, back;
  float last_height, last_back;  ///< the end of a diphthong; the same for others
};
constexpr std::array<VowelPlace, 15> kVowelPlaces{{
    {Phone::kAA, 0, 0.8F, 0, 0.8F},
    {Phone::kAE, 0.15F, 0.1F, 0.15F, 0.1F},
    {Phone::kAH, 0.4F, 0.5F, 0.4F, 0.5F},
    {Phone::kAO, 0.3F, 1, 0.3F, 1},
    {Phone::kAW, 0, 0.5F, 0.85F, 0.9F},
    {Phone::kAY, 0, 0.5F, 0.9F, 0.1F},
    {Phone::kEH, 0.45F, 0.1F, 0.45F, 0.1F},
    {Phone::kER, 0.5F, 0.5F, 0.5F, 0.5F},
    {Phone::kEY, 0.55F, 0.1F, 0.9F, 0.1F},
    {Phone::kIH, 0.85F, 0.15F, 0.85F, 0.15F},
    {Phone::kIY, 1, 0, 1, 0},
    {Phone::kOW, 0.55F, 0.9F, 0.85F, 0.95F},
    {Phone::kOY, 0.35F, 1, 0.9F, 0.1F},
    {Phone::kUH, 0.8F, 0.85F, 0.8F, 0.85F},
    {Phone::kUW, 1, 0.9F, 1, 0.9F},
}};

enum Feature : Eigen::Index {
  kSpeech,
  kVowel,
  kHeight,
  kBack,
  kRound,
  kSpread,
  kOpen,
  kLipToLip,
  kLipToTeeth,
  kDental,
  kAlveolar,
  kPostalveolar,
  kVelar,
  kPlosiveOrAffricate,
  kFricativeOrAspirate,
  kNasal,
  kApproximant,
  kVoiced,
  kLipHeavy,
  kTurbulent,
  kRest,
  kBefore,
  kAfter,
  kPause,
  kLength,
  kVowelLength,
  kStressed,
  kSecondary,
  kRate,
  kWordStart,
  kWordEnd,
  kPhraseStart,
  kPhraseEnd,
  kLength2,
  kFirstSound
};
constexpr std::size_t kSounds = kPhoneCount;  ///< a feature each, and another for the second half of a diphthong

constexpr std::array<std::string_view, kFirstSound> kNames{
    "speech",     "vowel",        "height",      "back",         "round",        "spread",        "open",
    "lip to lip", "lip to teeth", "dental",      "alveolar",     "postalveolar", "velar",         "stop",
    "fricative",  "nasal",        "approximant", "voiced",       "lip heavy",    "turbulent",     "rest",
    "before",     "after",        "pause",       "length",       "vowel length", "stressed",      "secondary stress",
    "rate",       "word start",   "word end",    "phrase start", "phrase end",   "length squared"};

using Features = std::vector<std::pair<Eigen::Index, float>>;

void addPlaceAndManner(const PhoneRow& phone, bool second_half, Features& features) {
  const VisemeRow& viseme = rowOf(second_half ? phone.last : phone.first);
  const auto add = [&](Eigen::Index feature, double value) {
    if (value != 0) features.emplace_back(feature, asFloat(value));
  };
  add(kRound, std::max(0.0, viseme.round));
  add(kSpread, std::max(0.0, -viseme.round));
  add(kOpen, viseme.open);
  add(kLipToLip, viseme.closure == LipClosure::kLipToLip ? 1 : 0);
  add(kLipToTeeth, viseme.closure == LipClosure::kLipToTeeth ? 1 : 0);
  add(kLipHeavy, phone.lip_heavy ? 1 : 0);
  add(kVoiced, phone.voiced ? 1 : 0);
  add(kTurbulent, phone.turbulent ? 1 : 0);
  if (phone.manner == Articulation::kVowel) {
    const auto* place = std::find_if(kVowelPlaces.begin(), kVowelPlaces.end(),
                                     [&](const VowelPlace& p) { return p.phone == phone.phone; });
    add(kVowel, 1);
    if (place == kVowelPlaces.end()) return;
    add(kHeight, second_half ? place->last_height : place->height);
    add(kBack, second_half ? place->last_back : place->back);
    return;
  }
  const bool between_teeth = phone.tongue.tip_forward > 0.5F, hushing = viseme.viseme == Viseme::kShChJ;
  add(kDental, between_teeth ? 1 : 0);
  add(kPostalveolar, hushing ? 1 : 0);
  add(kAlveolar, phone.tongue.tip_up > 0.5F && !between_teeth && !hushing ? 1 : 0);
  add(kVelar, phone.tongue.back_up > 0.5F ? 1 : 0);
  switch (phone.manner) {
    case Articulation::kPlosive:
    case Articulation::kAffricate:
      add(kPlosiveOrAffricate, 1);
      break;
    case Articulation::kFricative:
    case Articulation::kAspirate:
      add(kFricativeOrAspirate, 1);
      break;
    case Articulation::kNasal:
      add(kNasal, 1);
      break;
    default:
      add(kApproximant, 1);
  }
}

/// Phones a second in the half second to each side, in natural logarithms beside a usual rate.
double rateAround(const SpeechLabels& labels, std::size_t phone) {
  constexpr Seconds kReach = 0.5, kLeast = 0.05;
  constexpr double kUsual = 12;
  const Seconds middle = labels.phones[phone].span.middle();
  double phones = 0;
  Seconds spoken = 0;
  const auto first = std::partition_point(labels.phones.begin(), labels.phones.end(), [&](const LabelledPhone& other) {
    return other.span.end <= middle - kReach;
  });
  for (auto other = first; other != labels.phones.end() && other->span.start < middle + kReach; ++other) {
    const TimeSpan& span = other->span;
    const Seconds within = std::min(span.end, middle + kReach) - std::max(span.start, middle - kReach);
    if (within <= 0 || other->phone == Phone::kSil) continue;
    phones += within / std::max(span.duration(), 1e-6);
    spoken += within;
  }
  return std::log(std::max(1.0, phones) / std::max(spoken, kLeast) / kUsual);
}

void addPosition(const SpeechLabels& labels, std::size_t phone, Features& features) {
  const LabelledPhone& own = labels.phones[phone];
  if (own.syllable) {
    const int stress = labels.syllables[*own.syllable].stress;
    if (stress == 1) features.emplace_back(kStressed, 1.0F);
    if (stress == 2) features.emplace_back(kSecondary, 1.0F);
  }
  if (own.word) {
    const PhoneRange& word = labels.words[*own.word].phones;
    if (word.first.value == phone) features.emplace_back(kWordStart, 1.0F);
    if (word.last.value == phone) features.emplace_back(kWordEnd, 1.0F);
  }
  // How near the phrase's ends are: 1 there, gone within a second.
  constexpr Seconds kFades = 0.4;
  std::size_t first = phone, last = phone;
  while (first > 0 && labels.phones[first - 1].phone != Phone::kSil) --first;
  while (last + 1 < labels.phones.size() && labels.phones[last + 1].phone != Phone::kSil) ++last;
  features.emplace_back(kPhraseStart, asFloat(std::exp(-(own.span.start - labels.phones[first].span.start) / kFades)));
  features.emplace_back(kPhraseEnd, asFloat(std::exp(-(labels.phones[last].span.end - own.span.end) / kFades)));
  features.emplace_back(kRate, asFloat(rateAround(labels, phone)));
}

ContextSegment speechSegment(const SpeechSegment& segment, const SpeechLabels& labels) {
  constexpr Seconds kUsualLength = 0.080, kShortest = 0.010;
  ContextSegment made{segment.span, {}};
  const PhoneRow& row = rowOf(segment.phone);
  made.features.emplace_back(kSpeech, 1.0F);
  addPlaceAndManner(row, segment.is_second_half, made.features);
  const double length = std::log(std::max(kShortest, segment.span.duration()) / kUsualLength);
  made.features.emplace_back(kLength, asFloat(length));
  made.features.emplace_back(kLength2, asFloat(0.5 * length * length));
  if (row.manner == Articulation::kVowel) made.features.emplace_back(kVowelLength, asFloat(length));
  addPosition(labels, segment.label, made.features);
  const auto sound = static_cast<std::size_t>(segment.phone) + (segment.is_second_half ? kSounds : 0U);
  made.features.emplace_back(kFirstSound + signedIndex(sound), 1.0F);
  return made;
}

ContextSegment silentSegment(const SpeechSegment& segment) {
  constexpr std::string_view kSilence = "silence ";
  ContextSegment made{segment.span, {}};
  Eigen::Index kind = kPause;
  if (segment.features.empty()) kind = kRest;
  if (!segment.features.empty() && segment.features.front().name.starts_with(kSilence))
    kind = segment.breath ? kBefore : kAfter;
  made.features.emplace_back(kind, 1.0F);
  const bool in_pause =
      kind != kPause && segment.features.size() > 1 && segment.features[1].name.starts_with("silence pause ");
  if (in_pause) made.features.emplace_back(kPause, 1.0F);
  return made;
}

/// The integral of a raised cosine of width 2 that is 1 at 0, from -1 to u.
double raisedCosineUpTo(double u) {
  if (u <= -1) return 0;
  if (u >= 1) return 1;
  return 0.5 * (1 + u + std::sin(std::numbers::pi * u) / std::numbers::pi);
}

/// sums += share * row. However many numbers are added at once, each is rounded as it is alone.
inline void addShare(float share, const float* row, Eigen::Index count, float* __restrict sums) {
  for (Eigen::Index i = 0; i < count; ++i) sums[i] += share * row[i];
}
#if defined(__x86_64__)
__attribute__((target("avx2"))) void addShareAvx2(float share, const float* row, Eigen::Index count,
                                                  float* __restrict sums) {
  for (Eigen::Index i = 0; i < count; ++i) sums[i] += share * row[i];
}
#endif

auto shareAdder() {
#if defined(__x86_64__)
  static const bool has_avx2 = __builtin_cpu_supports("avx2") != 0;
  if (has_avx2) return addShareAvx2;
#endif
  return addShare;
}

}  // namespace

std::span<const std::string_view> contextFeatureNames() {
  static const std::vector<std::string_view> kAll = [] {
    std::vector<std::string_view> names(kNames.begin(), kNames.end());
    for (std::size_t half = 0; half < 2; ++half) {
      for (std::size_t phone = 0; phone < kSounds; ++phone) names.push_back(phoneName(static_cast<Phone>(phone)));
    }
    return names;
  }();
  return kAll;
}

Eigen::VectorXf articulationOf(Phone phone, bool second_half) {
  Features features;
  addPlaceAndManner(rowOf(phone), second_half, features);
  Eigen::VectorXf values = Eigen::VectorXf::Zero(kRest);
  for (const auto& [feature, value] : features) values(feature) = value;
  return values;
}

std::vector<ContextSegment> contextSegments(const SpeechLabels& labels, const SilenceTiming& timing) {
  std::vector<ContextSegment> segments;
  for (const SpeechSegment& segment : speechSegments(labels, timing))
    segments.push_back(segment.in_speech ? speechSegment(segment, labels) : silentSegment(segment));
  if (!segments.empty()) {  // what lies beyond the line is as its ends
    constexpr Seconds kBeyond = 10;
    segments.front().span.start -= kBeyond;
    segments.back().span.end += kBeyond;
  }
  return segments;
}

void windowShares(const TimeSpan& segment, Seconds time, std::vector<std::pair<Eigen::Index, float>>& shares) {
  shares.clear();
  constexpr float kNothing = 1e-4F;
  for (std::size_t window = 0; window < kMiddles.size(); ++window) {
    const Seconds before = window > 0 ? kMiddles[window] - kMiddles[window - 1] : kMiddles[1] - kMiddles[0];
    const Seconds after = window + 1 < kMiddles.size() ? kMiddles[window + 1] - kMiddles[window] : before;
    const Seconds reach = 0.5 * (before + after), middle = time + kMiddles[window];
    if (segment.end <= middle - reach || segment.start >= middle + reach) continue;
    const float share =
        asFloat(raisedCosineUpTo((segment.end - middle) / reach) - raisedCosineUpTo((segment.start - middle) / reach));
    if (share > kNothing) shares.emplace_back(signedIndex(window), share);
  }
}

ContextView contextView(const std::vector<ContextSegment>& segments, std::span<const Seconds> times) {
  ContextView view{std::ssize(times), {}};
  std::vector<std::pair<Eigen::Index, float>> shares;
  for (std::size_t time = 0; time < times.size(); ++time) {
    const auto near = std::partition_point(segments.begin(), segments.end(), [&](const ContextSegment& segment) {
      return segment.span.end < times[time] - kContextReach;
    });
    for (auto i = unsignedIndex(near - segments.begin()); i < segments.size(); ++i) {
      if (segments[i].span.start > times[time] + kContextReach) break;
      windowShares(segments[i].span, times[time], shares);
      for (const auto& [window, share] : shares)
        view.shares.push_back({signedIndex(time), signedIndex(i), window, share});
    }
  }
  return view;
}

ContextNetwork::Matrix ContextNetwork::given(const std::vector<ContextSegment>& segments) const {
  const auto add = shareAdder();
  Matrix given = Matrix::Zero(std::ssize(segments), input.cols());
  for (std::size_t i = 0; i < segments.size(); ++i) {
    for (const auto& [feature, value] : segments[i].features)
      add(value, &input(feature, 0), input.cols(), &given(signedIndex(i), 0));
  }
  return given;
}

Eigen::MatrixXd ContextNetwork::at(const ContextView& view, const Matrix& given) const {
  const Eigen::Index hidden = hiddenCount();
  Matrix sums = bias.replicate(view.time_count, 1);
  const auto add = shareAdder();
  for (const auto& [time, segment, window, share] : view.shares)
    add(share, &given(segment, window * hidden), hidden, &sums(time, 0));
  return (sums.array().tanh().matrix() * output).cast<double>();
}

}  // namespace mouthpiece
