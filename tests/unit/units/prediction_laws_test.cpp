// Laws of what labels and sound tell the prediction: numbers of sounds, windows, segments, departures of a sound.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <string>
#include <vector>

#include "base/index.h"
#include "support/random_corpus.h"
#include "support/tiny_corpus.h"
#include "support/tiny_model.h"
#include "units/costs/viseme_distance.h"
#include "units/prediction/context_network.h"
#include "units/prediction/phone_shapes.h"
#include "units/prediction/sound_model.h"
#include "units/prediction/speech_segments.h"
#include "units/selection/selection.h"
#include "units/selection/unit_database.h"

namespace mouthpiece {
namespace {

using samples::Chance;
using samples::tinyCorpus;
using samples::tinyLabels;

std::vector<Phone> spokenPhones() {
  std::vector<Phone> phones;
  for (std::size_t p = 0; p < kPhoneCount; ++p) {
    if (static_cast<Phone>(p) != Phone::kSil) phones.push_back(static_cast<Phone>(p));
  }
  return phones;
}

std::size_t featureNamed(std::string_view name) {
  const auto names = contextFeatureNames();
  return static_cast<std::size_t>(std::find(names.begin(), names.end(), name) - names.begin());
}
float articulation(Phone phone, std::string_view name, bool second_half = false) {
  return articulationOf(phone, second_half)(signedIndex(featureNamed(name)));
}
bool isOneOf(Phone phone, std::initializer_list<Phone> phones) {
  return std::find(phones.begin(), phones.end(), phone) != phones.end();
}

/// What every book on English says of its consonants.
TEST(Articulation, PlacesAndMannersAreThoseOfPhonetics) {
  using enum Phone;
  for (const Phone phone : spokenPhones()) {
    SCOPED_TRACE(phoneName(phone));
    const auto has = [&](std::string_view name) { return articulation(phone, name) > 0; };
    EXPECT_EQ(has("lip to lip"), isOneOf(phone, {kP, kB, kM}));
    EXPECT_EQ(has("lip to teeth"), isOneOf(phone, {kF, kV}));
    EXPECT_EQ(has("dental"), isOneOf(phone, {kTH, kDH}));
    EXPECT_EQ(has("postalveolar"), isOneOf(phone, {kSH, kZH, kCH, kJH}));
    EXPECT_EQ(has("nasal"), isOneOf(phone, {kM, kN, kNG}));
    EXPECT_EQ(has("stop"), isOneOf(phone, {kP, kB, kT, kD, kK, kG, kCH, kJH}));
    EXPECT_EQ(has("fricative"), isOneOf(phone, {kF, kV, kTH, kDH, kS, kZ, kSH, kZH, kHH}));
    EXPECT_EQ(has("approximant"), isOneOf(phone, {kL, kR, kW, kY}));
    EXPECT_EQ(has("vowel"), isVowel(phone));
    if (isOneOf(phone, {kP, kB, kM})) {
      EXPECT_FALSE(has("open")) << "lips that are shut";
    }
    EXPECT_FALSE(has("round") && has("spread"));
    EXPECT_EQ(has("voiced"), !isOneOf(phone, {kP, kT, kK, kF, kTH, kS, kSH, kCH, kHH}));
    if (isOneOf(phone, {kT, kD, kN, kL})) {
      EXPECT_TRUE(has("alveolar"));
    }
    if (isOneOf(phone, {kK, kG, kNG})) {
      EXPECT_TRUE(has("velar"));
    }
    if (isOneOf(phone, {kP, kB, kM, kF, kV, kTH, kDH, kSH, kZH, kCH, kJH}) || isVowel(phone)) {
      EXPECT_FALSE(has("alveolar"));
    }
    if (!isOneOf(phone, {kK, kG, kNG, kW, kY, kR})) {
      EXPECT_FALSE(has("velar"));
    }
    EXPECT_EQ(articulationOf(phone, false).minCoeff() >= 0, true);
    EXPECT_LE(articulationOf(phone, false).maxCoeff(), 1);
  }
}

/// What is seen of the lips: open for AA, round for UW, spread for IY, each more than for its neighbours.
TEST(Articulation, LipsAreThoseOfTheirSounds) {
  using enum Phone;
  EXPECT_GT(articulation(kAA, "open"), articulation(kEH, "open"));
  EXPECT_GT(articulation(kEH, "open"), articulation(kIY, "open"));
  EXPECT_EQ(articulation(kM, "open"), 0);
  for (const Phone round : {kUW, kOW, kW, kSH}) {
    EXPECT_GT(articulation(round, "round"), 0.2F) << phoneName(round);
    EXPECT_EQ(articulation(round, "spread"), 0) << phoneName(round);
  }
  EXPECT_GT(articulation(kIY, "spread"), 0.2F);
  EXPECT_EQ(articulation(kIY, "round"), 0);
  EXPECT_GT(articulation(kAW, "round", true), articulation(kAW, "round")) << "it ends round";
}

/// The trapezium: high before low, front before back; a diphthong goes somewhere and another vowel stays.
TEST(Articulation, VowelsLieInTheirTrapezium) {
  using enum Phone;
  const auto rises = [](std::string_view what, std::initializer_list<Phone> phones) {
    float before = -1;
    for (const Phone phone : phones) {
      EXPECT_GT(articulation(phone, what), before) << what << " of " << phoneName(phone);
      before = articulation(phone, what);
    }
  };
  rises("height", {kAE, kEH, kEY, kIH, kIY});
  rises("height", {kAA, kAO, kOY, kOW, kUH, kUW});
  rises("height", {kAA, kAH, kER, kIH});
  rises("back", {kIY, kAE, kIH, kAH, kAA, kUW, kAO});
  for (const Phone phone : spokenPhones()) {
    if (!isVowel(phone)) continue;
    for (const char* what : {"height", "back"}) {
      const float begins = articulation(phone, what), ends = articulation(phone, what, true);
      EXPECT_GE(begins, 0) << phoneName(phone);
      EXPECT_LE(ends, 1) << phoneName(phone);
      if (!isDiphthong(phone)) {
        EXPECT_EQ(begins, ends) << phoneName(phone) << " " << what;
      }
    }
    if (isDiphthong(phone)) {
      EXPECT_GT(articulation(phone, "height", true), articulation(phone, "height") + 0.25F) << phoneName(phone);
      EXPECT_GT(articulation(phone, "height", true), articulation(kUH, "height")) << phoneName(phone);
      EXPECT_LT(articulation(phone, "height", true), articulation(kIY, "height")) << phoneName(phone);
      const bool ends_back = phone == kAW || phone == kOW;
      EXPECT_EQ(articulation(phone, "back", true) > 0.5F, ends_back) << phoneName(phone);
    }
  }
}

std::map<std::string, double> featureValuesOf(const ContextSegment& segment) {
  std::map<std::string, double> numbers;
  for (const auto& [feature, value] : segment.features)
    numbers[std::string(contextFeatureNames()[unsignedIndex(feature)])] += double{value};
  return numbers;
}

/// Where a phone stands in word, phrase and time, by looking at all labels for each.
TEST(ContextSegments, TellTheirPlaceInWordPhraseAndTime) {
  Chance chance(samples::firstSeed());
  for (int round = 0; round < 30; ++round) {
    SCOPED_TRACE(round);
    const SpeechLabels labels = tinyLabels(samples::randomWords(chance), 1 + chance.below(1000));
    const std::vector<SpeechSegment> segments = speechSegments(labels);
    const std::vector<ContextSegment> seen = contextSegments(labels);
    ASSERT_EQ(segments.size(), seen.size());
    for (std::size_t i = 0; i < segments.size(); ++i) {
      const auto numbers = featureValuesOf(seen[i]);
      EXPECT_EQ(numbers.contains("speech"), segments[i].in_speech);
      if (!segments[i].in_speech) continue;
      const std::size_t own = segments[i].label;
      const LabelledPhone& phone = labels.phones[own];
      const auto is = [&](const char* name) { return numbers.contains(name) && numbers.at(name) == 1; };
      const bool begins = own == 0 || labels.phones[own - 1].word != phone.word;
      const bool ends = own + 1 == labels.phones.size() || labels.phones[own + 1].word != phone.word;
      EXPECT_EQ(is("word start"), phone.word && begins);
      EXPECT_EQ(is("word end"), phone.word && ends);
      Seconds from = phone.span.start, to = phone.span.end;
      for (std::size_t k = own; k < labels.phones.size() && labels.phones[k].phone != Phone::kSil; --k)
        from = labels.phones[k].span.start;
      for (std::size_t k = own; k < labels.phones.size() && labels.phones[k].phone != Phone::kSil; ++k)
        to = labels.phones[k].span.end;
      EXPECT_NEAR(numbers.at("phrase start"), std::exp(-(phone.span.start - from) / 0.4), 1e-6);
      EXPECT_NEAR(numbers.at("phrase end"), std::exp(-(to - phone.span.end) / 0.4), 1e-6);
      const double length = std::log(segments[i].span.duration() / 0.08);
      EXPECT_NEAR(numbers.at("length"), length, 1e-5);
      EXPECT_NEAR(numbers.at("length squared"), 0.5 * length * length, 1e-5);
      EXPECT_EQ(numbers.contains("vowel length"), isVowel(segments[i].phone));
      if (phone.syllable) {
        EXPECT_EQ(is("stressed"), labels.syllables[*phone.syllable].stress == 1);
        EXPECT_EQ(is("secondary stress"), labels.syllables[*phone.syllable].stress == 2);
      }
      EXPECT_TRUE(numbers.contains(std::string(phoneName(segments[i].phone))));
    }
  }
}

TEST(ContextSegments, TellStressesAndSilencesApart) {
  SpeechLabels labels = tinyLabels("M-AE-N | T-AE-N N-AE-T", 0);
  for (LabelledPhone& phone : labels.phones) {  // half a second for the pause, a second at the ends
    const Seconds later = phone.span.start > 0.55 ? 1.3 : phone.span.start > 0.15 ? 0.8 : 0.0;
    const Seconds end_later = phone.span.end > 0.75 ? 1.3 : 0.8;
    phone.span = {phone.span.start + later, phone.span.end + end_later};
  }
  labels.phones.back().span.end += 1;
  ASSERT_GE(labels.syllables.size(), 3U);
  for (int stress = 0; stress < 3; ++stress) labels.syllables[unsignedIndex(stress)].stress = stress;
  std::vector<std::string> silences;
  for (const ContextSegment& segment : contextSegments(labels)) {
    const auto numbers = featureValuesOf(segment);
    const auto is = [&](const char* name) { return numbers.contains(name); };
    if (is("speech")) continue;
    for (const auto& [name, value] : numbers) EXPECT_EQ(value, 1) << name;
    silences.push_back(std::string(is("rest")     ? "rest"
                                   : is("before") ? "before"
                                   : is("after")  ? "after"
                                                  : "none") +
                       (is("pause") ? " in pause" : ""));
  }
  std::vector<std::string> without_rest = silences;
  std::erase_if(without_rest, [&](const std::string& silence) { return silence == "rest"; });
  EXPECT_EQ(without_rest, (std::vector<std::string>{"before", "after in pause", "before in pause", "after"}));
  EXPECT_EQ(silences.front(), "rest");
  EXPECT_EQ(silences.back(), "rest");
  std::map<int, std::size_t> counted;
  for (std::size_t i = 0; i < labels.phones.size(); ++i) {
    if (!labels.phones[i].syllable) continue;
    for (const ContextSegment& segment : contextSegments(labels)) {
      if (!segment.span.contains(labels.phones[i].span.middle())) continue;
      const auto numbers = featureValuesOf(segment);
      const int stress = labels.syllables[*labels.phones[i].syllable].stress;
      EXPECT_EQ(numbers.contains("stressed"), stress == 1);
      EXPECT_EQ(numbers.contains("secondary stress"), stress == 2);
      for (const char* one : {"stressed", "secondary stress"}) {
        if (numbers.contains(one)) {
          EXPECT_EQ(numbers.at(one), 1) << one;
        }
      }
      ++counted[stress];
    }
  }
  EXPECT_EQ(counted.size(), 3U);
}

/// Where all phones are as long, their rate is that, whatever pauses there are; twice as fast is a logarithm more.
TEST(ContextSegments, TheRateIsPhonesASecondOfSpeech) {
  const auto ratesAt = [](double stretch) {
    SpeechLabels labels = tinyLabels("M-AE-N T-AE-M | N-AE-T M-AE-N", 0);
    for (LabelledPhone& phone : labels.phones) phone.span = {stretch * phone.span.start, stretch * phone.span.end};
    std::vector<double> rates;
    for (const ContextSegment& segment : contextSegments(labels)) {
      const auto numbers = featureValuesOf(segment);
      if (numbers.contains("rate")) rates.push_back(numbers.at("rate"));
    }
    return rates;
  };
  for (const double stretch : {0.5, 1.0, 1.7}) {
    ASSERT_EQ(ratesAt(stretch).size(), 12U);
    for (const double rate : ratesAt(stretch)) EXPECT_NEAR(rate, std::log(10 / stretch / 12), 1e-5) << stretch;
  }
}

/// What is said before a moment is seen as what is said as long after it, by the windows' mirror images.
TEST(ContextWindows, SeeBeforeAsTheySeeAfter) {
  Chance chance(samples::firstSeed());
  for (int round = 0; round < 200; ++round) {
    const Seconds start = chance.between(-0.4, 0.4), end = start + chance.between(0.01, 0.4);
    std::vector<std::pair<Eigen::Index, float>> before, after;
    windowShares({start, end}, 0, before);
    windowShares({-end, -start}, 0, after);
    ASSERT_EQ(before.size(), after.size()) << start << " " << end;
    for (std::size_t i = 0; i < before.size(); ++i) {
      const auto& [window, share] = after[after.size() - 1 - i];
      EXPECT_EQ(before[i].first, kContextWindows - 1 - window);
      EXPECT_NEAR(before[i].second, share, 1e-5);
    }
    if (start > kContextReach || end < -kContextReach) {
      EXPECT_TRUE(before.empty()) << "nothing further away is seen";
    }
  }
}

/// A movement that leads by so much is the same movement, earlier.
TEST(SegmentWeights, ALeadIsAShiftInTime) {
  Chance chance(samples::firstSeed());
  for (int round = 0; round < 20; ++round) {
    const auto segments = speechSegments(tinyLabels(samples::randomWords(chance), 1 + chance.below(1000)));
    const Seconds constant = chance.between(0.005, 0.03), lead = chance.between(-0.05, 0.05);
    std::vector<Seconds> times, later;
    for (int i = 0; i < 40; ++i) {
      times.push_back(chance.between(-0.1, 1));
      later.push_back(times.back() + lead);
    }
    EXPECT_LT((segmentWeights(segments, constant, lead, times) - segmentWeights(segments, constant, 0, later))
                  .cwiseAbs()
                  .maxCoeff(),
              1e-12);
  }
}

/// Several networks say their mean, mixed with the rest by their share.
TEST(LinePrediction, SeveralNetworksAreTheirMean) {
  const Corpus corpus = tinyCorpus();
  TrajectoryModel model = *samples::tinyModel(corpus);
  const Eigen::Index components = model.componentCount(), hidden = 4;
  const auto network = [&] {
    return ContextNetwork{ContextNetwork::Matrix::Random(std::ssize(contextFeatureNames()), kContextWindows * hidden),
                          Eigen::RowVectorXf::Random(hidden), ContextNetwork::Matrix::Random(hidden, components)};
  };
  const ContextNetwork first = network(), second = network();
  const SpeechLabels labels = tinyLabels("M-AE-N T-AY-M", 4);
  const std::vector<Seconds> times{0.1, 0.25, 0.33, 0.47, 0.6};
  const auto predicted = [&](std::vector<ContextNetwork> networks, double share) {
    TrajectoryModel with = model;
    with.networks = std::move(networks);
    with.network_share = Eigen::RowVectorXd::Constant(components, share);
    return LinePrediction(with, labels).at(times);
  };
  const Eigen::MatrixXd mean = 0.5 * (predicted({first}, 0.6) + predicted({second}, 0.6));
  EXPECT_LT((predicted({first, second}, 0.6) - mean).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_GT((predicted({first}, 0.6) - predicted({second}, 0.6)).cwiseAbs().maxCoeff(), 0.01);
  const Eigen::MatrixXd none = predicted({first}, 0), all = predicted({first}, 1);
  EXPECT_LT((predicted({first}, 0.25) - 0.75 * none - 0.25 * all).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(ContextWindows, WhatComesIsSeenByLaterWindowsThanWhatWas) {
  std::vector<std::pair<Eigen::Index, float>> shares;
  Eigen::Index before = 0;
  for (Seconds start = -0.3; start < 0.28; start += 0.01) {
    windowShares({start, start + 0.02}, 0, shares);
    ASSERT_FALSE(shares.empty()) << start;
    const auto strongest = std::max_element(shares.begin(), shares.end(),
                                            [](const auto& a, const auto& b) { return a.second < b.second; });
    EXPECT_GE(strongest->first, before) << start;
    before = strongest->first;
  }
  EXPECT_EQ(before, kContextWindows - 1);
}

/// What is said further away than half a second changes nothing of how fast it seems to be.
TEST(ContextSegments, TheRateIsThatOfTheSecondAround) {
  const SpeechLabels near = tinyLabels("M-AE-N-T-AE-M-N-AE-T-M-AE-N-T-AE-M", 3);
  SpeechLabels stretched = near;
  const Seconds from = 0.9;
  for (LabelledPhone& phone : stretched.phones) {
    for (Seconds* end : {&phone.span.start, &phone.span.end}) *end = *end > from ? from + 3 * (*end - from) : *end;
  }
  const auto rateOf = [](const SpeechLabels& labels, std::size_t phone) {
    for (const ContextSegment& segment : contextSegments(labels)) {
      if (segment.span.contains(labels.phones[phone].span.middle())) return featureValuesOf(segment).at("rate");
    }
    return 0.0;
  };
  std::size_t alike = 0, slower = 0;
  for (std::size_t i = 1; i + 1 < near.phones.size(); ++i) {
    if (near.phones[i].span.middle() + 0.5 < from - 0.15) {  // the next phones' ends too
      EXPECT_NEAR(rateOf(near, i), rateOf(stretched, i), 1e-6) << i;
      ++alike;
    } else if (near.phones[i].span.start > from) {
      EXPECT_LT(rateOf(stretched, i), rateOf(near, i)) << i;
      ++slower;
    }
  }
  EXPECT_GE(alike, 1U);
  EXPECT_GE(slower, 3U);
}

std::set<std::string> featuresOf(const SpeechSegment& segment) {
  std::set<std::string> names;
  for (const SegmentFeature& feature : segment.features) names.insert(feature.name);
  return names;
}

TEST(SpeechSegments, HHHasTheMouthOfWhatFollowsIt) {
  const auto ofHH = [](const char* words) {
    for (const SpeechSegment& segment : speechSegments(tinyLabels(words, 0))) {
      if (segment.phone == Phone::kHH) return featuresOf(segment);
    }
    return std::set<std::string>{};
  };
  EXPECT_TRUE(ofHH("HH-IY").contains("viseme Ee"));
  EXPECT_TRUE(ofHH("HH-UW-T").contains("viseme Oo"));
  EXPECT_TRUE(ofHH("AE-HH").contains("viseme Uh")) << "before silence none in particular";
  EXPECT_TRUE(ofHH("T-HH-AA").contains("viseme Ah"));
}

TEST(SpeechSegments, ErIsHalfRAndHalfUh) {
  for (const SpeechSegment& segment : speechSegments(tinyLabels("T-ER-M", 0))) {
    if (segment.phone != Phone::kER) continue;
    std::map<std::string, double> weights;
    for (const SegmentFeature& feature : segment.features) weights[feature.name] += feature.weight;
    EXPECT_EQ(weights["phone ER"], 1);
    for (const char* name : {"viseme R", "viseme Uh", "left R LNTD", "right Uh MBP"})
      EXPECT_EQ(weights[name], 0.5) << name;
    return;
  }
  ADD_FAILURE() << "there is no ER";
}

/// Where a tenth of a second is left for it the face rests.
TEST(SpeechSegments, SilencesHaveARestWhereThereIsTime) {
  const auto parts = [](Seconds first, Seconds last) {
    SpeechLabels labels = tinyLabels("M-AE", 0);
    for (LabelledPhone& phone : labels.phones)
      phone.span = {phone.span.start + first - 0.2, phone.span.end + first - 0.2};
    labels.phones.front().span.start = 0;
    labels.phones.back().span.end = labels.phones.back().span.start + last;
    std::pair<std::size_t, std::size_t> counted{0, 0};
    for (const SpeechSegment& segment : speechSegments(labels)) {
      if (segment.in_speech) continue;
      ++(segment.label == 0 ? counted.first : counted.second);
    }
    return counted;
  };
  EXPECT_EQ(parts(0.44, 0.34), (std::pair<std::size_t, std::size_t>{1, 1}));
  EXPECT_EQ(parts(0.46, 0.36), (std::pair<std::size_t, std::size_t>{2, 2}));
}

TEST(SpeechSegments, AfterSpeechTheLipsSettleForAQuarterOfASecond) {
  SpeechLabels labels = tinyLabels("M-AE", 0);
  labels.phones.back().span.end += 1;
  const std::vector<SpeechSegment> segments = speechSegments(labels);
  const SpeechSegment &settling = segments[segments.size() - 2], &rest = segments.back();
  EXPECT_TRUE(featuresOf(settling).contains("silence after"));
  EXPECT_NEAR(settling.span.duration(), 0.25, 1e-12);
  EXPECT_TRUE(rest.features.empty());
  EXPECT_EQ(rest.span.end, labels.duration());
  for (const SpeechSegment& segment : segments) EXPECT_FALSE(segment.is_second_half);
  std::size_t second_halves = 0;
  for (const SpeechSegment& segment : speechSegments(tinyLabels("AY-OW-M", 0))) {
    second_halves += segment.is_second_half ? 1U : 0U;
    if (segment.is_second_half) {
      EXPECT_NEAR(segment.span.duration(), 0.055, 1e-9) << "0.55 of a diphthong";
    }
  }
  EXPECT_EQ(second_halves, 2U);
}

/// Twice as loud is 6 dB more of level, and the same spectrum.
TEST(SoundMeasures, TellLevelAndSpectrumApart) {
  AudioClip clip{16000, std::vector<float>(16000)};
  for (std::size_t i = 0; i < clip.samples.size(); ++i) {
    const double t = asReal(i) / 16000;
    clip.samples[i] = static_cast<float>(0.1 * std::sin(1200 * t) + 0.05 * std::sin(9000 * t + 20 * std::sin(11 * t)));
  }
  const SoundMeasures quiet = soundMeasures(clip);
  for (float& sample : clip.samples) sample *= 2;
  const SoundMeasures loud = soundMeasures(clip);
  ASSERT_EQ(quiet.rows.cols(), kSoundMeasures);
  EXPECT_NEAR(asReal(quiet.rows.rows()), 100, 2) << "a row for 10 ms";
  const Eigen::MatrixXd more = loud.rows - quiet.rows;
  EXPECT_LT((more.col(0).array() - 20 * std::log10(2.0)).abs().maxCoeff(), 0.02);
  EXPECT_LT(more.rightCols(kSoundMeasures - 1).cwiseAbs().maxCoeff(), 0.02);
  EXPECT_GT(quiet.rows.rightCols(kSoundMeasures - 1).colwise().norm().minCoeff(), 0.01) << "each tells something";
  EXPECT_EQ(soundMeasures({}).rows.rows(), 0);
}

/// Half a second of silence, speech, half a second of silence.
SpeechLabels spoken(Seconds speech) {
  SpeechLabels labels;
  labels.phones = {{Phone::kSil, {0, 0.5}, {}, {}},
                   {Phone::kAE, {0.5, 0.5 + speech}, {}, {}},
                   {Phone::kSil, {0.5 + speech, 1 + speech}, {}, {}}};
  return labels;
}

class Deviations : public ::testing::Test {
 protected:
  static constexpr Eigen::Index kRows = 300;  ///< 3 s, two of them spoken
  const SpeechLabels labels_ = spoken(2);
  const Eigen::MatrixXd expected_ = Eigen::MatrixXd::Random(kPhoneCount, kSoundMeasures);

  [[nodiscard]] SoundMeasures asExpected() const {
    SoundMeasures measures;
    for (Eigen::Index row = 0; row < kRows; ++row) {
      const Phone phone = row >= 50 && row < 250 ? Phone::kAE : Phone::kSil;
      measures.rows.conservativeResize(kRows, kSoundMeasures);
      measures.rows.row(row) = expected_.row(static_cast<Eigen::Index>(phone));
    }
    return measures;
  }
  [[nodiscard]] SoundDeviations of(const SoundMeasures& measures) const { return {measures, labels_, expected_}; }
  static constexpr double kRounding = 1e-9;
};

/// The speaker, the microphone and the room are no departure.
TEST_F(Deviations, ASoundAsItsPhonesAreExpectedDepartsInNothing) {
  SoundMeasures measures = asExpected();
  EXPECT_LT(of(measures).rows().cwiseAbs().maxCoeff(), kRounding);
  const Eigen::RowVectorXd speaker = Eigen::RowVectorXd::Random(kSoundMeasures), room = 3 * speaker;
  for (Eigen::Index row = 0; row < kRows; ++row) measures.rows.row(row) += row >= 50 && row < 250 ? speaker : room;
  EXPECT_LT(of(measures).rows().cwiseAbs().maxCoeff(), kRounding);
  EXPECT_LT(of(measures).spreadInSpeech().maxCoeff(), kRounding);
}

/// A departure of one moment is spread by a Gaussian of 35 ms, and nothing of it is lost.
TEST_F(Deviations, AreSmoothedByAGaussian) {
  SoundMeasures measures = asExpected();
  measures.rows(100, 2) += 5;  // and back, so that the mean stays
  measures.rows(200, 2) -= 5;
  const Eigen::MatrixXd rows = of(measures).rows();
  EXPECT_NEAR(rows.col(2).segment(80, 41).sum(), 5, kRounding);
  for (Eigen::Index away = 0; away <= 10; ++away) {
    const double share = std::exp(-0.5 * std::pow(10.0 * static_cast<double>(away) / 35, 2));
    EXPECT_NEAR(rows(100 + away, 2), share * rows(100, 2), kRounding) << away;
    EXPECT_NEAR(rows(100 - away, 2), share * rows(100, 2), kRounding) << away;
    EXPECT_NEAR(rows(200 - away, 2), -share * rows(100, 2), kRounding) << away;
  }
  EXPECT_LT(rows.leftCols(2).cwiseAbs().maxCoeff(), kRounding) << "each measure by itself";
  // Twice the departure is twice as wide; what silence does is no matter of speech.
  const Eigen::RowVectorXd spread = of(measures).spreadInSpeech();
  measures.rows(100, 2) += 5;
  measures.rows(200, 2) -= 5;
  measures.rows(10, 2) += 1000;
  measures.rows(290, 2) -= 1000;
  EXPECT_NEAR(of(measures).spreadInSpeech()(2), 2 * spread(2), kRounding);
  const double squares = rows.col(2).squaredNorm();
  EXPECT_NEAR(spread(2), std::sqrt(squares / 200), kRounding) << "the root of the mean square over two seconds";
}

TEST_F(Deviations, FeaturesAreThoseAroundAMomentAndInSilenceMore) {
  SoundMeasures measures = asExpected();
  measures.rows += Eigen::MatrixXd::Random(kRows, kSoundMeasures);
  const SoundDeviations deviations = of(measures);
  const auto rowAt = [&](Seconds time) -> Eigen::RowVectorXd {
    const double place = time / SoundMeasures::kStep;
    if (place < -1e-9 || place > kRows - 1 + 1e-9) return Eigen::RowVectorXd::Zero(kSoundMeasures);
    const auto before = static_cast<Eigen::Index>(std::clamp(std::floor(place + 1e-9), 0.0, double{kRows - 2}));
    return deviations.rows().row(before) +
           (place - asReal(before)) * (deviations.rows().row(before + 1) - deviations.rows().row(before));
  };
  const Eigen::RowVectorXd scale = Eigen::RowVectorXd::Random(kSoundMeasures);
  const std::vector<Seconds> times{0.03, 0.205, 1.5, 1.2037, 2.8, 2.96, 5};
  const Eigen::MatrixXd features = deviations.featuresAt(times, scale);
  const auto block = [&](std::size_t i, Eigen::Index number) -> Eigen::RowVectorXd {
    return features.row(signedIndex(i)).segment(number * kSoundMeasures, kSoundMeasures);
  };
  for (std::size_t i = 0; i < times.size(); ++i) {
    SCOPED_TRACE(times[i]);
    for (Eigen::Index lag = -1; lag <= 1; ++lag) {
      EXPECT_LT((block(i, lag + 1) - rowAt(times[i] + 0.06 * asReal(lag)).cwiseProduct(scale)).norm(), kRounding);
    }
    const bool is_speech = times[i] > 0.6 && times[i] < 2.4;
    for (Eigen::Index lag = -2; lag <= 2; ++lag) {
      const Eigen::RowVectorXd heard = rowAt(times[i] + 0.06 * asReal(lag)).cwiseProduct(scale);
      const double expected = is_speech ? 0 : 1;
      EXPECT_LT((block(i, lag + 5) - expected * heard).norm(), kRounding + 1e-3 * heard.norm()) << lag;
    }
  }
}

/// His own sound is believed and taken as it is; a wider one is scaled down, and one much wider not believed.
TEST_F(Deviations, AStrangersSoundIsScaledDownAndThenNotBelieved) {
  SoundMeasures measures = asExpected();
  measures.rows += Eigen::MatrixXd::Random(kRows, kSoundMeasures);
  const Eigen::RowVectorXd wide = of(measures).spreadInSpeech();
  const std::vector<Seconds> times{0.3, 1.1, 1.9};
  const auto heard = [&](double widest) {
    static SoundModel model;
    model.expected = expected_;
    model.spread = Eigen::RowVectorXd::Constant(kSoundMeasures, 0.4);
    model.widest_spread = wide / widest;
    model.weights = Eigen::MatrixXd::Ones(kSoundFeatures, 2);
    return HeardLine(model, measures, labels_);
  };
  const Eigen::MatrixXd plain = of(measures).featuresAt(times, Eigen::RowVectorXd::Constant(kSoundMeasures, 1 / 0.4)) *
                                Eigen::MatrixXd::Ones(kSoundFeatures, 2);
  for (const auto& [widest, believed] :
       {std::pair(0.5, 1.0), {1.0, 1.0}, {std::sqrt(2.0), 0.5}, {std::sqrt(2.5), 0.25}, {2.0, 0.0}}) {
    SCOPED_TRACE(widest);
    const HeardLine line = heard(widest);
    EXPECT_NEAR(line.strangeness(), widest * widest, kRounding);
    EXPECT_NEAR(line.believed(), believed, kRounding);
    EXPECT_LT((line.at(times) - believed / std::max(1.0, widest * widest) * plain).norm(), 1e-6 * plain.norm());
  }
}

TEST(VisemeDistance, IsADistanceThatClosuresAndSilenceMakeLong) {
  const std::vector<Phone> phones = spokenPhones();
  for (const PhonePart part : {PhonePart::kBegin, PhonePart::kEnd}) {
    const auto classOf = [&](Phone p) { return part == PhonePart::kBegin ? firstViseme(p) : lastViseme(p); };
    for (const Phone a : phones) {
      EXPECT_EQ(visemeDistance(a, a, part), 0);
      EXPECT_TRUE(std::isinf(visemeDistance(a, Phone::kSil, part)));
      for (const Phone b : phones) {
        SCOPED_TRACE(std::string(phoneName(a)) + " " + std::string(phoneName(b)));
        const double distance = visemeDistance(a, b, part);
        EXPECT_EQ(distance, visemeDistance(b, a, part));
        if (a == b) continue;
        if (classOf(a) == classOf(b)) {
          EXPECT_EQ(distance, isVowel(a) == isVowel(b) ? 0.5 * kSameVisemeDistance : kSameVisemeDistance);
          continue;
        }
        EXPECT_GT(distance, kSameVisemeDistance);
        const bool is_lost = (isBilabial(a) || isBilabial(b) || isLabiodental(a) || isLabiodental(b));
        EXPECT_EQ(distance >= kLostContactDistance, is_lost);
        // Of two that look alike the one of the other kind is a quarter further.
        for (const Phone like : phones) {
          if (classOf(like) != classOf(a) || isVowel(like) == isVowel(a)) continue;
          const double further = visemeDistance(like, b, part) - distance;
          EXPECT_NEAR(further, isVowel(a) == isVowel(b) ? 0.25 : -0.25, 1e-12) << phoneName(like);
        }
      }
    }
    EXPECT_LT(visemeDistance(Phone::kIY, Phone::kIH, part), visemeDistance(Phone::kIY, Phone::kAA, part));
    EXPECT_LT(visemeDistance(Phone::kUW, Phone::kUH, part), visemeDistance(Phone::kUW, Phone::kIY, part));
  }
}

/// A line that the corpus has word for word is missed by what its take was: from both its pairs, or from one at the
/// ends, each phone's own departure comes back, held back by one place that says nothing.
TEST(ContextMean, OfATakesOwnLineIsItsDepartureHeldBack) {
  Corpus corpus = tinyCorpus({"M-AE-N T-OW"});
  corpus.trajectory_model = samples::tinyModel(corpus);
  const UnitDatabase database(corpus);
  const SpeechLabels& line = corpus.takes[0].labels;
  const Eigen::MatrixXd mean = contextMean(line, database);
  const Eigen::Index components = shapeComponents(*corpus.trajectory_model);
  ASSERT_EQ(mean.rows(), std::ssize(line.phones) * PhoneShapes::kPoints);
  ASSERT_EQ(mean.cols(), components);
  double largest = 0;
  for (std::size_t phone = 0; phone < line.phones.size(); ++phone) {
    const PhoneShape shape = database.shapeOf({TakeIndex(0), PhoneIndex(phone)});
    const bool is_end = phone == 0 || phone + 1 == line.phones.size();
    const double share = is_end ? 0.5 : 2.0 / 3;
    for (Eigen::Index point = 0; point < PhoneShapes::kPoints; ++point) {
      const Eigen::RowVectorXd missed =
          (shape.captured() - shape.predicted()).segment(point * components, components).cast<double>();
      largest = std::max(largest, missed.norm());
      EXPECT_LT((mean.row(signedIndex(phone) * PhoneShapes::kPoints + point) - share * missed).norm(), 0.01)
          << phone << " " << point;
    }
  }
  EXPECT_GT(largest, 0.5);
}

TEST(Coverage, IsAPairOrAStandInThatWasSeenForEveryPair) {
  Corpus corpus = tinyCorpus({"M-AE-N T-OW", "P-AE-N D-OW"});
  corpus.trajectory_model = samples::tinyModel(corpus);
  SelectionOptions without;
  without.backoff = Backoff::kNone;
  const SpeechLabels said = tinyLabels("M-AE-N D-OW", 4), new_pair = tinyLabels("P-OW", 4);
  {
    const UnitDatabase database(corpus);
    EXPECT_TRUE(isCovered(said, database, without));
    EXPECT_FALSE(isCovered(new_pair, database, without)) << "nobody said P OW";
    EXPECT_TRUE(isCovered(new_pair, database, {})) << "but something like it";
  }
  for (CorpusTake& take : corpus.takes) take.motion.positions_mm.setConstant(std::nan(""));
  const UnitDatabase unseen(corpus);
  EXPECT_FALSE(isCovered(said, unseen, without));
  EXPECT_FALSE(isCovered(said, unseen, {}));
}

}  // namespace
}  // namespace mouthpiece
