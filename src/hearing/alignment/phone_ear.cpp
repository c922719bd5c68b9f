#include "hearing/alignment/phone_ear.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <optional>
#include <string>

#include "base/index.h"
#include "hearing/alignment/noise_adaptation.h"
#include "hearing/alignment/phone_decoder.h"
#include "hearing/alignment/phone_discriminant.h"
#include "hearing/alignment/phone_loop.h"
#include "hearing/alignment/samples_to_hear.h"
#include "hearing/alignment/speaker_adaptation.h"

namespace mouthpiece {
namespace {

/// The model's own mean of cepstra (cmninit of its feat.params), how many frames it counts for, and the
/// time that it takes to forget one, in frames.
constexpr std::array<float, 13> kUsualCepstra{41.00F, -5.29F, -0.12F, 5.09F,  2.48F,  -4.07F, -1.37F,
                                              -1.78F, -5.08F, -2.05F, -6.45F, -1.42F, 1.17F};
constexpr float kForgets = 300, kUsualWeighs = 60;

}  // namespace

struct PhoneEar::State {
  explicit State(const Language& language)
      : decoder({}, language), loop(loopOf(decoder.scorer().sharedModel(), language)) {}
  PhoneDecoder decoder;
  PhoneLoop loop;
  SpeakerSounds speaker = {};                             ///< who is not learnt yet
  std::optional<TiedModel> sketch = std::nullopt;         ///< as he says the phones, by a few of his sounds
  std::optional<SenoneScorer> of_speaker = std::nullopt;  ///< as he says the phones
  PhoneDiscriminant discriminant{};                       ///< of his phones
  bool is_speaker = false;                                ///< whether the sound that posteriors() heard last is his
  std::optional<SenoneScorer> in_noise = std::nullopt;    ///< of the sound that posteriors() heard last
  VoiceTransform of_recording = {};                       ///< of who is not known
  bool is_by_voice = false;  ///< whether the sound that posteriors() heard last is heard by it
  bool is_noisy = false;     ///< that sound
  /// As learn(), but for what parts his phones.
  void learnFrom(std::span<const LabelledSound> sounds);
  [[nodiscard]] std::vector<SpeakerFrames> framesOf(std::span<const LabelledSound> sounds);
  /// Whether the speaker says these features.
  [[nodiscard]] bool isHis(const Eigen::MatrixXf& features);
  /// The scorer that knows a sound best.
  SenoneScorer& fittest(std::span<const std::int16_t> samples, std::span<const std::int16_t> around,
                        const Eigen::MatrixXf& features);
  // Of a sound that goes on:
  std::vector<std::vector<std::int16_t>> said = {};  ///< by the speaker, with his level and microphone
  /// The mean that such a sound begins with.
  [[nodiscard]] Eigen::ArrayXf firstMean();
  PhoneLoop::Passage passage{kRemembered};
  Eigen::ArrayXf mean;                      ///< of the cepstra of speech
  float weighs = 0;                         ///< frames that it stands for
  std::deque<Eigen::ArrayXf> cepstra = {};  ///< the last ones, three on either side of the frames that are remembered
  /// Of the last seconds of speech, the oldest frames gone: features whose cepstra have their mean yet, and posteriors.
  HeardFrames said_on = {};
  Eigen::Index learnt_until = 0;  ///< frames of the sound before this one are among them, or no speech
  Eigen::Index heard_again = 0;   ///< frames that there were when the last ones were
  VoiceTransform voice_on = {};
  /// Features of the last `count` frames of the sound that goes on, the mean taken off or not.
  [[nodiscard]] Eigen::MatrixXf featuresOn(Eigen::Index count, bool with_mean) const;
  void learnVoice(Eigen::Index count);
};

PhoneEar::PhoneEar(const Language& language) : state_(std::make_unique<State>(language)) {}
PhoneEar::~PhoneEar() = default;
bool PhoneEar::knowsSpeaker() const { return state_->is_speaker; }
VoiceTransform PhoneEar::voice() const { return state_->is_by_voice ? state_->of_recording : VoiceTransform{}; }

SpeakerSounds soundsAmong(std::vector<LabelledSound> all) {
  return [all = std::move(all)](std::size_t most) {
    std::vector<LabelledSound> some;
    for (std::size_t i = 0; i < all.size(); i += all.size() / most + 1) some.push_back(all[i]);
    return some;
  };
}

std::vector<std::int16_t> samplesToHear(const AudioClip& audio) {
  if (audio.sample_rate_hz != kDecoderSampleRateHz) return samplesToHear(resampleAudio(audio, kDecoderSampleRateHz));
  std::vector<std::int16_t> samples(audio.samples.size());
  std::transform(audio.samples.begin(), audio.samples.end(), samples.begin(), [](float sample) {
    return static_cast<std::int16_t>(std::lrint(std::clamp(32767.0F * sample, -32767.0F, 32767.0F)));
  });
  return samples;
}

namespace {

/// From a little before the first phone to a little after the last one.
TimeSpan saidIn(const SpeechLabels& labels) {
  constexpr Seconds kMargin = 0.2;
  TimeSpan said{0, labels.duration()};
  if (labels.phones.size() < 3) return said;
  if (labels.phones.front().phone == Phone::kSil) said.start = std::max(0.0, labels.phones.front().span.end - kMargin);
  if (labels.phones.back().phone == Phone::kSil)
    said.end = std::min(said.end, labels.phones.back().span.start + kMargin);
  return said;
}

/// Whose codebook is heard in each frame of a labelled sound that is heard from `start` on.
std::vector<std::size_t> codebooksOf(const SpeechLabels& labels, Seconds start, std::size_t frames,
                                     const TiedModel& model) {
  constexpr Seconds kStep = 0.010, kMiddle = 0.013;  // of a frame's window
  std::vector<std::size_t> codebooks(frames, SpeakerFrames::kNoCodebook);
  std::size_t phone = 0;
  for (std::size_t t = 0; t < frames; ++t) {
    const Seconds time = start + asReal(t) * kStep + kMiddle;
    while (phone < labels.phones.size() && labels.phones[phone].span.end <= time) ++phone;
    if (phone == labels.phones.size()) break;
    const std::string_view name =
        labels.phones[phone].phone == Phone::kSil ? "SIL" : phoneName(labels.phones[phone].phone);
    const auto found = std::find_if(model.codebooks.begin(), model.codebooks.end(),
                                    [&](const TiedModel::Codebook& codebook) { return codebook.phone == name; });
    if (found != model.codebooks.end()) codebooks[t] = unsignedIndex(found - model.codebooks.begin());
  }
  return codebooks;
}

}  // namespace

namespace {

/// A speaker's model fits his own frames so many nats better for each strangeness that they have; other voices' less
/// (docs/theory/hearing/phone_ear.md).
constexpr double kSameVoice = 0.3;
/// What fits the model of a few of his sounds so much better than the general one may be his, in nats: half of what the
/// least of his own do (docs/theory/hearing/phone_ear.md#the-speaker-and-noise).
constexpr std::size_t kSketchedFrom = 12;
constexpr double kMayBeHis = 0.15;
/// Of fewer frames nobody can tell whose they are.
constexpr Eigen::Index kKnownBy = 100;

}  // namespace

bool PhoneEar::State::isHis(const Eigen::MatrixXf& features) {
  if (!sketch && !of_speaker) return false;
  const double by_others = fitOf(decoder.scorer().model(), features);
  if (sketch) {
    if (fitOf(*sketch, features) - by_others <= kMayBeHis) return false;
    learnFrom(speaker(kMostSounds));  // which throws where a take is damaged, this time and the next
    sketch.reset();
    speaker = {};
  }
  return of_speaker &&
         fitOf(of_speaker->model(), features) - by_others > kSameVoice * discriminant.strangenessOf(features);
}

SenoneScorer& PhoneEar::State::fittest(std::span<const std::int16_t> samples, std::span<const std::int16_t> around,
                                       const Eigen::MatrixXf& features) {
  is_speaker = isHis((sketch || of_speaker) && features.cols() < kKnownBy ? decoder.featuresOf(around) : features);
  SenoneScorer& scorer = is_speaker ? *of_speaker : decoder.scorer();
  in_noise.reset();
  is_noisy = noisinessOf(around) > 0;
  if (!is_noisy) return scorer;
  const Eigen::MatrixXd columns = decoder.cepstraOf(samples);
  if (!isSteady(columns)) return scorer;
  return in_noise.emplace(
      std::make_shared<TiedModel>(adaptedToNoise(scorer.model(), columns, phonesIn(scorer.model()))));
}

Eigen::ArrayXf PhoneEar::State::firstMean() {
  if (said.empty()) return Eigen::Map<const Eigen::ArrayXf>(kUsualCepstra.data(), std::ssize(kUsualCepstra));
  Eigen::ArrayXd sum = Eigen::ArrayXd::Zero(std::ssize(kUsualCepstra));
  double frames = 0;
  for (const std::vector<std::int16_t>& samples : said) {
    const Eigen::MatrixXd columns = decoder.cepstraOf(samples);
    sum += columns.topRows(sum.size()).rowwise().sum().array();
    frames += asReal(columns.cols());
  }
  return (sum / frames).cast<float>();
}

/// Of those that are not empty, which firstMean() takes, too.
std::vector<SpeakerFrames> PhoneEar::State::framesOf(std::span<const LabelledSound> sounds) {
  constexpr std::size_t kMeanOf = 10;
  std::vector<SpeakerFrames> heard;
  const TiedModel& model = decoder.scorer().model();
  for (const LabelledSound& sound : sounds) {
    if (sound.audio.samples.empty()) continue;
    // As sounds are heard: with little of the silence around what is said.
    const TimeSpan span = saidIn(sound.labels);
    const std::vector<std::int16_t> samples = samplesToHear(sound.audio);
    const auto first =
        std::min(samples.size(), static_cast<std::size_t>(std::max(0.0, span.start) * kDecoderSampleRateHz));
    const auto end =
        std::clamp(static_cast<std::size_t>(std::max(0.0, span.end) * kDecoderSampleRateHz), first, samples.size());
    SpeakerFrames frames;
    frames.features = decoder.featuresOf(std::span(samples).subspan(first, end - first));
    if (frames.features.cols() == 0) continue;
    frames.codebook =
        codebooksOf(sound.labels, asReal(first) / kDecoderSampleRateHz, unsignedIndex(frames.features.cols()), model);
    if (heard.size() < kMeanOf)
      said.emplace_back(samples.begin() + signedIndex(first), samples.begin() + signedIndex(end));
    heard.push_back(std::move(frames));
  }
  return heard;
}

void PhoneEar::State::learnFrom(std::span<const LabelledSound> sounds) {
  said.clear();
  const std::vector<SpeakerFrames> heard = framesOf(sounds);
  if (heard.empty()) return;
  const TiedModel& model = decoder.scorer().model();
  of_speaker.emplace(std::make_shared<TiedModel>(adaptedToSpeaker(model, heard)));
  discriminant = PhoneDiscriminant(heard, model.codebooks.size());
}

void PhoneEar::learn(std::span<const LabelledSound> sounds) {
  state_->learnFrom(sounds);
  state_->discriminant.learnRatios();
}

void PhoneEar::learn(SpeakerSounds speaker) {
  State& state = *state_;
  const std::vector<SpeakerFrames> heard = state.framesOf(speaker(kSketchedFrom));
  if (heard.empty()) return;
  state.sketch = adaptedToSpeaker(state.decoder.scorer().model(), heard);
  state.speaker = std::move(speaker);
}

void PhoneEar::adaptTo(std::span<const std::span<const std::int16_t>> stretches) {
  constexpr Eigen::Index kMostFrames = 6000;
  constexpr int kRounds = 2;
  State& state = *state_;
  state.of_recording = {};
  std::vector<HeardFrames> heard;
  Eigen::Index frames = 0;
  for (const std::span<const std::int16_t> samples : stretches) {
    HeardFrames own{state.decoder.featuresOf(samples), {}};
    if (own.features.cols() == 0 || state.isHis(own.features) || noisinessOf(samples) > 0) continue;
    frames += own.features.cols();
    heard.push_back(std::move(own));
    if (frames >= kMostFrames) break;
  }
  SenoneScorer& scorer = state.decoder.scorer();
  for (int round = 0; round < kRounds; ++round) {
    for (HeardFrames& own : heard) own.posteriors = state.loop.posteriors(scorer, state.of_recording(own.features));
    state.of_recording = fitVoice(scorer.model(), heard);
  }
}

Eigen::MatrixXf PhoneEar::posteriors(std::span<const std::int16_t> samples, std::span<const std::int16_t> around) {
  const Eigen::MatrixXf features = state_->decoder.featuresOf(samples);
  if (features.cols() == 0) return Eigen::MatrixXf::Zero(kPhoneCount, 0);
  SenoneScorer& scorer = state_->fittest(samples, around.empty() ? samples : around, features);
  // Another may speak here than where the voice was learnt: then the sound is no likelier by it.
  state_->is_by_voice = !state_->is_speaker && !state_->is_noisy && !state_->of_recording.isNone() &&
                        fitOf(scorer.model(), state_->of_recording(features)) + state_->of_recording.logStretch() >
                            fitOf(scorer.model(), features);
  if (!state_->is_speaker) return state_->loop.posteriors(scorer, voice()(features));
  state_->discriminant.learnRatios();
  return state_->loop.posteriors(scorer, features, state_->discriminant.logRatios(features));
}

namespace {

constexpr std::size_t kDifferenceReach = 3;  ///< frames on either side that a frame's differences are made of
/// What goes on is heard again after so many frames more, or, for who is not known, after as many as tell of his voice,
/// at most so many.
constexpr Eigen::Index kHeardAgain = 16, kVoiceFrames = 500;

/// The last `count` columns of both side by side, at most.
Eigen::MatrixXf lastOf(const Eigen::MatrixXf& before, const Eigen::MatrixXf& more, Eigen::Index count) {
  Eigen::MatrixXf joined(more.rows(), before.cols() + more.cols());
  if (before.cols() > 0) joined.leftCols(before.cols()) = before;
  joined.rightCols(more.cols()) = more;
  return joined.rightCols(std::min(count, joined.cols()));
}

}  // namespace

/// Cepstra, their first and their second differences, as the model's features are ("1s_c_d_dd").
Eigen::MatrixXf PhoneEar::State::featuresOn(Eigen::Index count, bool with_mean) const {
  const Eigen::Index size = mean.size();
  Eigen::MatrixXf features(3 * size, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const auto middle = cepstra.end() - signedIndex(kDifferenceReach) - (count - i);
    features.col(i) << middle[0].matrix(), (middle[2] - middle[-2]).matrix(),
        ((middle[3] - middle[-1]) - (middle[1] - middle[-3])).matrix();
  }
  if (!with_mean) features.topRows(size).colwise() -= mean.matrix();
  return features;
}

std::size_t PhoneEar::hearOn(std::span<const std::int16_t> samples, bool begins, bool is_speech) {
  State& state = *state_;
  if (begins) {
    state.passage = PhoneLoop::Passage(signedIndex(kRemembered));
    state.cepstra.clear();
    state.said_on = {};
    state.learnt_until = state.heard_again = 0;
    state.voice_on = {};
    state.weighs = kUsualWeighs;
    state.mean = state.firstMean();
  }
  for (const std::vector<float>& row : state.decoder.cepstraOn(samples, begins)) {
    const Eigen::Map<const Eigen::ArrayXf> cepstrum(row.data(), signedIndex(row.size()));
    if (is_speech) {
      state.weighs = std::min(kForgets, state.weighs + 1);
      state.mean += (cepstrum - state.mean) / state.weighs;
    }
    if (state.cepstra.empty())
      state.cepstra.assign(kDifferenceReach, cepstrum);  // before the sound begins it is as there
    state.cepstra.emplace_back(cepstrum);
    if (state.cepstra.size() > kRemembered + 2 * kDifferenceReach) state.cepstra.pop_front();
    SenoneScorer& scorer = state.of_speaker ? *state.of_speaker : state.decoder.scorer();
    if (state.cepstra.size() > 2 * kDifferenceReach)
      state.loop.hearOn(scorer, state.voice_on(state.featuresOn(1, false)), state.passage);
  }
  return unsignedIndex(state.passage.frames);
}

/// Adds what was said before the last `count` frames to what the voice is fitted to, and fits it to these, too.
void PhoneEar::State::learnVoice(Eigen::Index count) {
  const Eigen::Index more = std::clamp(passage.frames - learnt_until, count, signedIndex(kRemembered));
  const Eigen::MatrixXf features = featuresOn(more, true), heard = loop.posteriorsOfLast(more, passage);
  std::vector<Eigen::Index> spoken;
  for (Eigen::Index i = 0; i < more - count; ++i) {
    if (heard(static_cast<Eigen::Index>(Phone::kSil), i) < 0.5F) spoken.push_back(i);
  }
  said_on.features = lastOf(said_on.features, features(Eigen::all, spoken), kVoiceFrames);
  said_on.posteriors = lastOf(said_on.posteriors, heard(Eigen::all, spoken), kVoiceFrames);
  learnt_until = passage.frames - count;
  std::vector<HeardFrames> all{{features.rightCols(count), heard.rightCols(count)}};
  if (said_on.features.cols() > 0) all.push_back(said_on);
  for (HeardFrames& own : all) own.features.topRows(mean.size()).colwise() -= mean.matrix();
  voice_on = fitVoice(decoder.scorer().model(), all);
}

bool PhoneEar::hearAgain(std::size_t count, bool is_clean) {
  State& state = *state_;
  const Eigen::Index since = state.passage.frames - state.heard_again;
  if (!state.of_speaker && !is_clean) state.voice_on = {};
  const Eigen::Index due = state.of_speaker ? kHeardAgain : std::max(kHeardAgain, state.said_on.features.cols());
  if (since < due || (!state.of_speaker && !is_clean)) return false;
  state.heard_again = state.passage.frames;
  Eigen::Index again = signedIndex(count);
  if (!state.of_speaker) {
    state.learnVoice(again);
    state.passage.frames -= again;
    state.loop.hearOn(state.decoder.scorer(), state.voice_on(state.featuresOn(again, false)), state.passage);
    return true;
  }
  again = std::min(again, since + PhoneDiscriminant::kFarthest);
  const Eigen::MatrixXf around =
      state.featuresOn(std::min(again + PhoneDiscriminant::kFarthest, state.passage.frames), false);
  state.passage.frames -= again;
  state.loop.hearOn(*state.of_speaker, around.rightCols(again), state.passage,
                    state.discriminant.logRatios(around).rightCols(again));
  return true;
}

Eigen::MatrixXf PhoneEar::posteriorsOfLast(std::size_t count) const {
  return state_->loop.posteriorsOfLast(signedIndex(count), state_->passage);
}

namespace {

constexpr Eigen::Index kShortestFrames = 3;

}  // namespace

std::vector<HeardPhone> likeliestPhones(const Eigen::MatrixXf& posteriors, const Eigen::MatrixXf& likeness,
                                        double change) {
  const Eigen::Index frames = posteriors.cols(), phones = posteriors.rows();
  std::vector<HeardPhone> heard;
  if (frames < kShortestFrames) return heard;
  const Eigen::MatrixXf gain = likeness * posteriors;
  // best(p, t): of rows whose phone p began at least kShortestFrames before frame t's end.
  Eigen::MatrixXf best = Eigen::MatrixXf::Constant(phones, frames, -1e9F);
  std::vector<std::vector<bool>> begins(unsignedIndex(frames), std::vector<bool>(unsignedIndex(phones)));
  std::vector<Eigen::Index> champion(unsignedIndex(frames), 0);
  std::vector<float> champion_value(unsignedIndex(frames), 0);
  for (Eigen::Index t = 0; t < frames; ++t) {
    for (Eigen::Index phone = 0; phone < phones; ++phone) {
      const Eigen::Index start = t - kShortestFrames + 1;
      float stay = t > 0 ? best(phone, t - 1) + gain(phone, t) : -1e9F, begin = -1e9F;
      if (start == 0) begin = gain.row(phone).head(kShortestFrames).sum();
      if (start > 0)
        begin = champion_value[unsignedIndex(start - 1)] - asFloat(change) +
                gain.row(phone).segment(start, kShortestFrames).sum();
      begins[unsignedIndex(t)][unsignedIndex(phone)] = begin > stay;
      best(phone, t) = std::max(begin, stay);
    }
    champion_value[unsignedIndex(t)] = best.col(t).maxCoeff(&champion[unsignedIndex(t)]);
  }
  Eigen::Index t = frames - 1, end = frames;
  Eigen::Index phone = champion[unsignedIndex(t)];
  while (true) {
    while (!begins[unsignedIndex(t)][unsignedIndex(phone)]) --t;
    const Eigen::Index first = t - kShortestFrames + 1;
    heard.push_back({static_cast<Phone>(phone), unsignedIndex(first), unsignedIndex(end),
                     posteriors.row(phone).segment(first, end - first).mean()});
    if (first == 0) break;
    end = first;
    t = first - 1;
    phone = champion[unsignedIndex(t)];
  }
  std::reverse(heard.begin(), heard.end());
  return heard;
}

Eigen::MatrixXf lipLikeness() {
  constexpr float kAlikeOnLips = 0.3F;
  const auto count = signedIndex(kPhoneCount);
  Eigen::MatrixXf likeness = Eigen::MatrixXf::Identity(count, count);
  for (Eigen::Index a = 1; a < count; ++a) {
    for (Eigen::Index b = 1; b < count; ++b) {
      const auto one = static_cast<Phone>(a), other = static_cast<Phone>(b);
      if (a != b && firstViseme(one) == firstViseme(other) && lastViseme(one) == lastViseme(other))
        likeness(a, b) = kAlikeOnLips;
    }
  }
  return likeness;
}

}  // namespace mouthpiece
