// Laws of what labels tell the prediction: windows, segments, means.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "base/index.h"
#include "support/random_corpus.h"
#include "support/tiny_corpus.h"
#include "support/tiny_model.h"
#include "units/costs/viseme_distance.h"
#include "units/prediction/context_network.h"
#include "units/prediction/phone_shapes.h"
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
  const Eigen::MatrixXd mean = contextMean(line, database, predictedShapes(*corpus.trajectory_model, line));
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
