#include "hearing/live/live_ear.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <deque>

#include "base/errors.h"
#include "base/index.h"
#include "hearing/alignment/phone_ear.h"
#include "hearing/network/network_phones.h"

namespace mouthpiece {
namespace {

constexpr std::size_t kLevelFrame = 160;  // 10 ms
/// A phone that ended so many frames ago is settled, or as many as the look-ahead has but for those that its last
/// phones take: later sound changes little (docs/theory/hearing/live_hearing.md).
constexpr std::size_t kSettles = 30, kMostSettles = 100, kLastPhones = 20;
/// What a word says counts so much against what is heard without it.
constexpr float kLiveWordWeight = 0.8F;
/// With a shorter look-ahead frames of a learnt speaker are shown before they are heard again: 56 ms until a frame is
/// heard, 120 for what follows it, 160 from one time to the next.
constexpr Seconds kHeardAgainWithin = 0.34;
/// A sound that lasts so many frames longer is settled in parts.
constexpr std::size_t kMostOpen = 70;
/// Frames of a phrase, and until it is heard.
constexpr std::size_t kPast = 400;
/// Frames of a pause; of a stop that follows one, at most; of sounds that noise is heard as, without others.
constexpr std::size_t kPause = 15, kLongestStop = 12, kLongestNoise = 30;

/// Stops, and what hisses without the teeth.
bool isLikeNoise(Phone phone) {
  const Articulation manner = rowOf(phone).manner;
  const bool hisses =
      manner == Articulation::kAspirate || (manner == Articulation::kFricative && !rowOf(firstViseme(phone)).sibilant);
  return isStop(phone) || hisses;
}

/// Levels of the last half minute, and whether the last frames are over their background. As in findSpeech(), but for
/// what is not there yet.
class LoudFrames {
 public:
  /// 10 ms more.
  void add(std::span<const std::int16_t> samples) {
    double energy = 0;
    for (const std::int16_t sample : samples) {
      const double value = sample - kDifference * before_;
      energy += value * value;
      before_ = sample;
    }
    const double db = std::clamp(10 * std::log10(energy / asReal(samples.size()) + 1e-9), kLeastDb, kMostDb);
    const auto bin = static_cast<std::uint16_t>(std::lround((db - kLeastDb) / kBinDb));
    ++counts_[bin];
    bins_.push_back(bin);
    if (bins_.size() > kWindow) {
      --counts_[bins_.front()];
      bins_.pop_front();
    }
    const double floor = quantile(0.05), top = quantile(0.95);
    const bool is_steady = top - floor < kRiseDb;
    // What stays the same for a second is no speech; before that nobody knows.
    if (is_steady)
      threshold_ = bins_.size() < kJudged ? kQuietDb : kMostDb;
    else
      threshold_ = floor + std::max(kRiseDb, kShareOfRise * (top - floor));
    quiet_ += isLoud() ? 0U : 1U;
    ++frames_;
  }

  /// Whether speech is around frame `frame`, one of the last 30 s, by all that is known by now.
  [[nodiscard]] bool isSpeech(std::size_t frame) const {
    const std::size_t begin = frames_ - bins_.size();
    const std::size_t first = std::max(begin, frame - std::min(frame, kHangover)),
                      end = std::min(frames_, frame + kOnset);
    for (std::size_t i = first; i < end; ++i) {
      if (dbOf(bins_[i - begin]) > threshold_) return true;
    }
    return false;
  }
  [[nodiscard]] bool isLoud() const { return !bins_.empty() && dbOf(bins_.back()) > threshold_; }
  /// As noisinessOf() tells; 0 where no background was heard alone.
  [[nodiscard]] double noisiness() const {
    if (quiet_ < kBackground) return 0;
    return std::clamp((kCleanDb - quantile(0.95) + quantile(0.05)) / (kCleanDb - kNoisyDb), 0.0, 1.0);
  }

 private:
  static constexpr double kDifference = 0.97, kLeastDb = -10, kMostDb = 110, kBinDb = 0.5, kQuietDb = 10;
  static constexpr double kRiseDb = 5, kShareOfRise = 0.30, kCleanDb = 38, kNoisyDb = 30;
  static constexpr std::size_t kWindow = 3000, kJudged = 100, kHangover = 25, kOnset = 15, kBackground = 20;

  static double dbOf(std::uint16_t bin) { return kLeastDb + kBinDb * asReal(bin); }
  [[nodiscard]] double quantile(double share) const {
    const double wanted = share * asReal(bins_.size());
    double sum = 0;
    for (std::size_t bin = 0; bin < counts_.size(); ++bin) {
      sum += counts_[bin];
      if (sum > wanted) return kLeastDb + kBinDb * asReal(bin);
    }
    return kMostDb;
  }

  double before_ = 0;
  std::array<std::uint32_t, 241> counts_{};
  std::deque<std::uint16_t> bins_;
  double threshold_ = kQuietDb;
  std::size_t frames_ = 0, quiet_ = 0;
};

}  // namespace

struct LiveEar::State {
  State(const Language& spoken, std::span<const LabelledSound> speaker, Seconds look_ahead,
        std::optional<LiveWords> of_words, std::optional<LivePhones> of_phones)
      : language(spoken),
        ear(spoken),
        words(std::move(of_words)),
        phones(std::move(of_phones)),
        settles(std::clamp(static_cast<std::size_t>(look_ahead / kEarStep), kSettles + kLastPhones,
                           kMostSettles + kLastPhones) -
                kLastPhones),
        hears_again(speaker.empty() || look_ahead >= kHeardAgainWithin) {
    if (!speaker.empty()) ear.learn(speaker);
  }

  void takePhones(const std::optional<LivePhones::Heard>& found);
  [[nodiscard]] Eigen::MatrixXf posteriorsOfOpen() const;
  void hearFrames(std::span<const std::int16_t> samples, const std::function<bool()>& waits);
  [[nodiscard]] PhoneSegment segmentOf(Phone phone, std::size_t first, std::size_t end) const;
  [[nodiscard]] bool isNoSpeech(const HeardPhrase& phrase) const;
  void putWords(Eigen::MatrixXf& posteriors) const;
  [[nodiscard]] std::vector<HeardPhone> withoutNoise(const std::vector<HeardPhone>& path) const;
  std::vector<PhoneSegment> settle();

  const Language& language;
  PhoneEar ear;
  std::optional<LiveWords> words;
  std::optional<LivePhones> phones;
  std::vector<PhoneSegment> word_phones;  ///< of the words that were found last
  std::size_t settles;                    ///< frames
  bool hears_again;
  Eigen::MatrixXf likeness = lipLikeness();
  LoudFrames loud;
  std::deque<Eigen::VectorXf> open;        ///< posteriors of the frames that are not settled, as they are without words
  std::deque<Eigen::VectorXf> by_network;  ///< of the same frames, where `phones` heard them
  std::deque<Eigen::VectorXf> past;        ///< where there are words, of those settled last
  std::size_t settled = 0;                 ///< frames that are
  bool has_begun = false;
  std::size_t silent = kPause;  ///< frames of silence that were settled last; before the sound begins there is a pause
  std::vector<PhoneSegment> guess;
};

LiveEar::LiveEar(const Language& language, std::span<const LabelledSound> speaker, Seconds look_ahead,
                 std::optional<LiveWords> words, std::optional<LivePhones> phones)
    : state_(std::make_unique<State>(language, speaker, look_ahead, std::move(words), std::move(phones))) {}
LiveEar::~LiveEar() = default;
LiveEar::LiveEar(LiveEar&&) noexcept = default;
LiveEar& LiveEar::operator=(LiveEar&&) noexcept = default;
const std::vector<PhoneSegment>& LiveEar::guess() const { return state_->guess; }
std::size_t LiveEar::missedWords() const { return state_->words ? state_->words->missed() : 0; }

void LiveEar::State::hearFrames(std::span<const std::int16_t> samples, const std::function<bool()>& waits) {
  for (std::size_t at = 0; at < samples.size(); at += kLevelFrame) loud.add(samples.subspan(at, kLevelFrame));
  const std::size_t frames = ear.hearOn(samples, !has_begun, loud.isLoud());
  has_begun = true;
  open.resize(frames - settled);
  by_network.resize(open.size());
  // Noise covers what is said softly.
  const double noisiness = loud.noisiness();
  if (phones) takePhones(phones->hear(samples, loud.isSpeech(frames) || noisiness > 0));
  const bool is_by_network =
      std::ranges::any_of(by_network, [](const Eigen::VectorXf& frame) { return frame.size() > 0; });
  const bool is_heard_again = !is_by_network && hears_again && frames > settles &&
                              ear.hearAgain(std::min(open.size(), settles), noisiness <= 0);
  const std::size_t again = std::min(open.size(), is_heard_again ? settles : kSettles);
  const Eigen::MatrixXf posteriors = ear.posteriorsOfLast(again);
  for (std::size_t i = 0; i < again; ++i) open[open.size() - again + i] = posteriors.col(signedIndex(i));
  // What seemed loud may be background by now.
  for (std::size_t i = 0; i < open.size(); ++i) {
    if (loud.isSpeech(settled + i)) continue;
    open[i].setZero();
    open[i](static_cast<Eigen::Index>(Phone::kSil)) = 1;
  }
  if (!words) return;
  if (auto found = words->hear(samples, loud.isSpeech(frames), waits))
    word_phones = isNoSpeech(*found) ? std::vector<PhoneSegment>() : std::move(found->phones);
}

void LiveEar::State::takePhones(const std::optional<LivePhones::Heard>& found) {
  for (Eigen::Index i = 0; found && i < found->posteriors.cols(); ++i) {
    const std::size_t frame = found->first + unsignedIndex(i);
    if (frame >= settled && frame < settled + by_network.size()) by_network[frame - settled] = found->posteriors.col(i);
  }
}

/// By both ears, and where levels tell of silence by the network alone, if it hears a phone there.
Eigen::MatrixXf LiveEar::State::posteriorsOfOpen() const {
  const double noisiness = loud.noisiness();
  Eigen::MatrixXf posteriors(open.front().size(), std::ssize(open));
  for (std::size_t i = 0; i < open.size(); ++i) {
    auto column = posteriors.col(signedIndex(i));
    column = open[i];
    const bool is_silent = column(static_cast<Eigen::Index>(Phone::kSil)) >= 1;
    if (by_network[i].size() == 0) continue;
    if (!is_silent)
      column = heardByBoth(open[i], by_network[i], noisiness, language);
    else if (isPhone(by_network[i]))
      column = by_network[i];
  }
  return posteriors;
}

/// As in a recording (docs/theory/hearing/recognition.md#noise-around-a-line): where nothing but silence is heard
/// without words, words that are less likely said than not are what the network makes of noise.
bool LiveEar::State::isNoSpeech(const HeardPhrase& phrase) const {
  if (phrase.word_odds >= 0) return false;
  const std::size_t begin = settled - past.size(), end = settled + open.size();
  const auto frameAt = [&](Seconds time) {
    return std::clamp(static_cast<std::size_t>(std::max(0.0, time / kEarStep)), begin, end);
  };
  const std::size_t first = frameAt(phrase.span.start), count = frameAt(phrase.span.end) - first;
  if (count == 0) return false;
  Eigen::MatrixXf posteriors(signedIndex(kPhoneCount), signedIndex(count));
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t at = first + i - begin;
    posteriors.col(signedIndex(i)) = at < past.size() ? past[at] : open[at - past.size()];
  }
  const std::vector<HeardPhone> row = likeliestPhones(posteriors, likeness, kFurtherPhone);
  return std::all_of(row.begin(), row.end(), [](const HeardPhone& phone) { return phone.phone == Phone::kSil; });
}

/// `posteriors`: of the open frames.
void LiveEar::State::putWords(Eigen::MatrixXf& posteriors) const {
  const auto openFrame = [&](Seconds time) {
    const Eigen::Index frame = std::lround((time - kEarShift) / kEarStep) - signedIndex(settled);
    return std::clamp<Eigen::Index>(frame, 0, posteriors.cols());
  };
  for (const PhoneSegment& phone : word_phones) {
    const Eigen::Index first = openFrame(phone.span.start), count = openFrame(phone.span.end) - first;
    posteriors.middleCols(first, count) *= 1 - kLiveWordWeight;
    posteriors.row(static_cast<Eigen::Index>(phone.phone)).segment(first, count).array() += kLiveWordWeight;
  }
}

PhoneSegment LiveEar::State::segmentOf(Phone phone, std::size_t first, std::size_t end) const {
  const std::size_t from = settled + first;
  return {
      .phone = phone,
      .span = {from == 0 ? 0.0 : asReal(from) * kEarStep + kEarShift, asReal(settled + end) * kEarStep + kEarShift}};
}

/// After a pause the closing before a stop's burst is silence but for its last part. What has none but sounds that
/// noise is heard as, up to the next silence or for longer than anybody goes on so, is noise.
std::vector<HeardPhone> LiveEar::State::withoutNoise(const std::vector<HeardPhone>& path) const {
  std::vector<HeardPhone> made;
  std::size_t silence = silent;
  for (std::size_t i = 0; i < path.size(); ++i) {
    HeardPhone phone = path[i];
    if (phone.phone == Phone::kSil) {
      silence += phone.end - phone.first;
      made.push_back(phone);
      continue;
    }
    if (silence >= kPause) {
      std::size_t end = i;
      while (end < path.size() && isLikeNoise(path[end].phone)) ++end;
      const bool is_noise = end > i && (end < path.size() ? path[end].phone == Phone::kSil
                                                          : path[end - 1].end - phone.first > kLongestNoise);
      if (is_noise) {
        made.push_back({Phone::kSil, phone.first, path[end - 1].end, phone.confidence});
        silence += path[end - 1].end - phone.first;
        i = end - 1;
        continue;
      }
      const std::size_t length = phone.end - phone.first;
      if (isStop(phone.phone) && length > kLongestStop) {
        made.push_back({Phone::kSil, phone.first, phone.end - kLongestStop, phone.confidence});
        phone.first = phone.end - kLongestStop;
      }
    }
    silence = 0;
    made.push_back(phone);
  }
  return made;
}

std::vector<PhoneSegment> LiveEar::State::settle() {
  std::vector<PhoneSegment> made;
  guess.clear();
  if (open.empty()) return made;
  Eigen::MatrixXf posteriors = posteriorsOfOpen();
  putWords(posteriors);
  std::vector<HeardPhone> path = withoutNoise(likeliestPhones(posteriors, likeness, kFurtherPhone));
  if (path.empty()) return made;
  std::size_t done = 0, next = 0;
  const std::size_t sure = open.size() - std::min(open.size(), settles);
  for (; next < path.size() && path[next].end <= sure; ++next) {
    made.push_back(segmentOf(path[next].phone, path[next].first, path[next].end));
    done = path[next].end;
  }
  // A long silence, or sound, is settled in parts.
  const bool is_long =
      next < path.size() && sure > done && sure - done > (path[next].phone == Phone::kSil ? kSettles : kMostOpen);
  if (is_long) {
    made.push_back(segmentOf(path[next].phone, done, sure));
    done = path[next].first = sure;
  }
  for (const PhoneSegment& phone : made) {
    const auto frames = static_cast<std::size_t>(std::lround(phone.span.duration() / kEarStep));
    silent = phone.phone == Phone::kSil ? silent + frames : 0;
  }
  for (; next < path.size(); ++next) guess.push_back(segmentOf(path[next].phone, path[next].first, path[next].end));
  if (words) past.insert(past.end(), open.begin(), open.begin() + signedIndex(done));
  open.erase(open.begin(), open.begin() + signedIndex(done));
  by_network.erase(by_network.begin(), by_network.begin() + signedIndex(done));
  if (past.size() > kPast) past.erase(past.begin(), past.end() - signedIndex(kPast));
  settled += done;
  return made;
}

std::vector<PhoneSegment> LiveEar::hear(std::span<const std::int16_t> samples, const std::function<bool()>& waits) {
  MOUTHPIECE_EXPECT(samples.size() == kHop);
  state_->hearFrames(samples, waits);
  return state_->settle();
}

}  // namespace mouthpiece
