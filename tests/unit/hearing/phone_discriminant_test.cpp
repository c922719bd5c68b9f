#include "hearing/alignment/phone_discriminant.h"

#include <gtest/gtest.h>

#include <random>

#include "base/index.h"
#include "hearing/alignment/phone_ear.h"
#include "hearing/alignment/samples_to_hear.h"
#include "voices/voice.h"

namespace mouthpiece {
namespace {

constexpr std::size_t kSounds = 40, kPhonesASound = 24, kFramesAPhone = 9, kCodebooks = 5;

/// Phones 0 to 3 one after another as they come; what parts 2 and 3 is the product of two features alone.
std::vector<SpeakerFrames> soundsOf(unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<float> noise(0, 0.6F);
  std::uniform_int_distribution<std::size_t> any(0, 3);
  std::bernoulli_distribution coin(0.5);
  std::vector<SpeakerFrames> sounds(kSounds);
  for (SpeakerFrames& sound : sounds) {
    sound.features.resize(4, kPhonesASound * kFramesAPhone);
    std::size_t phone = 0;
    for (std::size_t i = 0; i < kPhonesASound; ++i) {
      phone = (phone + 1 + any(random) % 3) % 4;
      const float side = coin(random) ? 2.0F : -2.0F;
      for (std::size_t t = i * kFramesAPhone; t < (i + 1) * kFramesAPhone; ++t) {
        auto frame = sound.features.col(signedIndex(t));
        for (float& value : frame) value = noise(random);
        if (phone < 2) frame(0) += phone == 0 ? 3.0F : -3.0F;
        if (phone < 2) frame(phone == 0 ? 1 : 2) += 3;
        if (phone >= 2) frame(1) += side;
        if (phone >= 2) frame(2) += phone == 2 ? side : -side;
        sound.codebook.push_back(phone);
      }
    }
  }
  return sounds;
}

/// The share of a phone's frames where one of its own parts is the likeliest.
double foundShare(const PhoneDiscriminant& discriminant, const std::vector<SpeakerFrames>& sounds, std::size_t phone) {
  double right = 0, all = 0;
  for (const SpeakerFrames& sound : sounds) {
    const Eigen::MatrixXf ratios = discriminant.logRatios(sound.features);
    EXPECT_EQ(ratios.rows(), PhoneDiscriminant::kParts * signedIndex(kCodebooks));
    EXPECT_TRUE(ratios.allFinite());
    for (std::size_t t = 0; t < sound.codebook.size(); ++t) {
      if (sound.codebook[t] != phone) continue;
      Eigen::Index best = 0;
      ratios.col(signedIndex(t)).maxCoeff(&best);
      right += unsignedIndex(best) % kCodebooks == phone ? 1 : 0;
      all += 1;
    }
  }
  return right / all;
}

TEST(PhoneDiscriminant, TellsPhonesOfSoundsThatItHasNotHeard) {
  PhoneDiscriminant discriminant(soundsOf(1), kCodebooks);
  discriminant.learnRatios();
  const std::vector<SpeakerFrames> others = soundsOf(2);
  for (const std::size_t phone : {0U, 1U}) EXPECT_GT(foundShare(discriminant, others, phone), 0.9) << phone;
  // By products alone; one in four would be chance.
  for (const std::size_t phone : {2U, 3U}) EXPECT_GT(foundShare(discriminant, others, phone), 0.7) << phone;
}

/// What he was not heard to say is neither likelier nor less likely.
TEST(PhoneDiscriminant, SaysNothingOfPhonesNotHeard) {
  const std::vector<SpeakerFrames> sounds = soundsOf(1);
  PhoneDiscriminant discriminant(sounds, kCodebooks);
  discriminant.learnRatios();
  const Eigen::MatrixXf ratios = discriminant.logRatios(sounds.front().features);
  discriminant.learnRatios();  // a second time nothing is learnt
  EXPECT_EQ(discriminant.logRatios(sounds.front().features), ratios);
  for (Eigen::Index part = 0; part < PhoneDiscriminant::kParts; ++part)
    EXPECT_TRUE(ratios.row(part * signedIndex(kCodebooks) + 4).isZero());
}

TEST(PhoneDiscriminant, FindsOtherSoundsStrange) {
  const PhoneDiscriminant discriminant(soundsOf(1), kCodebooks);
  const Eigen::MatrixXf own = soundsOf(2).front().features;
  EXPECT_NEAR(discriminant.strangenessOf(own), 1, 0.2);
  EXPECT_GT(discriminant.strangenessOf(own.array() + 4), 2);
  EXPECT_EQ(PhoneDiscriminant().strangenessOf(own), 1);
}

TEST(PhoneDiscriminant, SaysNothingWhereTooLittleWasHeard) {
  std::vector<SpeakerFrames> few{soundsOf(1).front()};
  few.front().features.conservativeResize(Eigen::NoChange, 12);
  few.front().codebook.resize(12);
  const PhoneDiscriminant discriminant(few, kCodebooks);
  EXPECT_TRUE(discriminant.isEmpty());
  EXPECT_TRUE(discriminant.logRatios(few.front().features).isZero());
  EXPECT_TRUE(PhoneDiscriminant({}, kCodebooks).isEmpty());
  EXPECT_TRUE(PhoneDiscriminant().isEmpty());
}

/// The mean posterior of what a voice says, of phones of at least 40 ms.
double heardShare(PhoneEar& ear, const SpokenLine& line) {
  const Eigen::MatrixXf posteriors = ear.posteriors(samplesToHear(line.audio));
  double sum = 0, count = 0;
  for (const LabelledPhone& phone : line.labels.phones) {
    if (phone.phone == Phone::kSil) continue;
    const auto first = static_cast<Eigen::Index>(100 * phone.span.start) + 1;
    const auto end = std::min<Eigen::Index>(static_cast<Eigen::Index>(100 * phone.span.end) - 1, posteriors.cols());
    if (end - first < 2) continue;
    sum += double{posteriors.row(static_cast<Eigen::Index>(phone.phone)).segment(first, end - first).mean()};
    count += 1;
  }
  return sum / count;
}

constexpr double kBetter = 0.05;

/// Eight lines of a speaker.
std::vector<LabelledSound> linesOf(Voice& speaker) {
  std::vector<LabelledSound> lines;
  for (const char* text :
       {"bring the blue boat back before many people come", "my mother may move the pump by the pond",
        "nine men never knew the tune", "five very brave foxes live above the valley", "put the paper cup upon the map",
        "the cat could not keep the key", "some boys hope for a warm summer", "we know that moon and man are one"}) {
    SpokenLine line = speaker.speak(text);
    lines.push_back({std::move(line.audio), std::move(line.labels)});
  }
  return lines;
}

/// A speaker who was learnt from is heard better, and another no worse.
TEST(PhoneEar, HearsASpeakerBetterWhoWasLearntFrom) {
  const auto speaker = makeVoice("espeak:en-gb"), other = makeVoice("flite:slt");
  PhoneEar plain, knowing;
  knowing.learn(linesOf(*speaker));
  const std::string unheard = "maybe nobody came to the pump by noon";
  const SpokenLine line = speaker->speak(unheard), of_other = other->speak(unheard);
  EXPECT_GT(heardShare(knowing, line), heardShare(plain, line) + kBetter);
  EXPECT_EQ(heardShare(knowing, of_other), heardShare(plain, of_other));
}

/// A few sounds tell that another's are not his; all are asked for when one may be.
TEST(PhoneEar, LearnsASpeakerWhenHeIsHeard) {
  const auto speaker = makeVoice("espeak:en-gb"), other = makeVoice("flite:slt");
  const std::vector<LabelledSound> lines = linesOf(*speaker);
  std::vector<std::size_t> asked;
  PhoneEar at_once, later;
  at_once.learn(lines);
  later.learn([&, among = soundsAmong(lines)](std::size_t most) {
    asked.push_back(most);
    return among(most);
  });
  const std::string unheard = "maybe nobody came to the pump by noon";
  const auto heardBy = [&](PhoneEar& ear, Voice& voice) {
    return ear.posteriors(samplesToHear(voice.speak(unheard).audio));
  };
  EXPECT_EQ(heardBy(later, *other), heardBy(at_once, *other));
  ASSERT_EQ(asked.size(), 1U);
  EXPECT_LT(asked.front(), PhoneEar::kMostSounds);
  EXPECT_FALSE(later.knowsSpeaker());
  EXPECT_EQ(heardBy(later, *speaker), heardBy(at_once, *speaker));
  EXPECT_TRUE(later.knowsSpeaker());
  EXPECT_EQ(heardBy(later, *speaker), heardBy(at_once, *speaker));
  ASSERT_EQ(asked.size(), 2U);
  EXPECT_EQ(asked.back(), PhoneEar::kMostSounds);
}

std::span<const std::int16_t> partOf(const std::vector<std::int16_t>& samples, const TimeSpan& span) {
  const auto sampleAt = [](Seconds time) { return static_cast<std::size_t>(SamplesToHear::kRateHz * time); };
  return std::span(samples).subspan(sampleAt(span.start), sampleAt(span.duration()));
}

/// A word alone has no pause, as if all of it were said in noise; the line around it knows that it is not.
TEST(PhoneEar, HearsAWordByTheSilenceAroundIt) {
  const auto voice = makeVoice("flite:kal16");
  PhoneEar ear;
  double alone = 0, in_line = 0;
  for (const char* text : {"some boys hope for a warm summer", "five very brave foxes live above the valley"}) {
    const SpokenLine line = voice->speak(text);
    const std::vector<std::int16_t> samples = samplesToHear(line.audio);
    ASSERT_EQ(noisinessOf(samples), 0);
    for (const LabelledWord& word : line.labels.words) {
      const TimeSpan span = line.labels.spanOf(word.phones);
      const auto rightIn = [&](const Eigen::MatrixXf& heard) {
        double sum = 0;
        for (Eigen::Index t = 0; t < heard.cols(); ++t) {
          for (const LabelledPhone& phone : line.labels.phones) {
            if (phone.span.contains(span.start + kEarShift + (asReal(t) + 0.5) * kEarStep))
              sum += double{heard(static_cast<Eigen::Index>(phone.phone), t)};
          }
        }
        return sum;
      };
      alone += rightIn(ear.posteriors(partOf(samples, span)));
      in_line += rightIn(ear.posteriors(partOf(samples, span), samples));
    }
  }
  EXPECT_GT(in_line, 1.05 * alone);
}

/// Some tenths of a second do not tell who says them.
TEST(PhoneEar, KnowsItsSpeakerByWhatLiesAroundAWord) {
  const auto speaker = makeVoice("espeak:en-gb");
  PhoneEar ear;
  ear.learn(linesOf(*speaker));
  const SpokenLine line = speaker->speak("maybe nobody came to the pump by noon");
  const std::vector<std::int16_t> samples = samplesToHear(line.audio);
  for (const LabelledWord& word : line.labels.words) {
    ear.posteriors(partOf(samples, line.labels.spanOf(word.phones)), samples);
    EXPECT_TRUE(ear.knowsSpeaker()) << word.text;
  }
}

}  // namespace
}  // namespace mouthpiece
