#include "hearing/live/live_phones.h"

#include <chrono>
#include <cmath>
#include <stop_token>
#include <vector>

#include "base/errors.h"
#include "base/index.h"
#include "hearing/alignment/phone_ear.h"
#include "hearing/live/answering_thread.h"
#include "hearing/network/network_phones.h"

namespace mouthpiece {
namespace {

constexpr double kEncodedRateHz = 16000;
/// How much of the sound is heard at once and how often, in hops.
struct Pace {
  std::size_t at_once, every;
};
/// What is shown soon is heard less, for processor time; what has more time by more of its sound, and more often.
constexpr Pace kSoon{20, 4}, kLater{25, 3};
constexpr Seconds kLaterFrom = 0.5;
/// What lies nearer to a window's beginning was heard better by the one before.
constexpr Seconds kBeginning = 0.4;
/// A hearing, which takes some 10 ms, is waited for so long, once.
constexpr std::chrono::milliseconds kLongestStart{10000}, kLongestWait{1000};
/// After so many hearings in a row that failed none is tried for so many hops.
constexpr std::size_t kMostFailedInARow = 3, kEncodedAgain = 1500;

/// The last seconds of a sound.
struct Passage {
  std::vector<std::int16_t> samples;
  std::size_t first = 0;  ///< sample of the whole sound
};

}  // namespace

struct LivePhones::State {
  State(std::shared_ptr<WordNetwork> network, Seconds look_ahead, const Language& language)
      : pace(look_ahead < kLaterFrom ? kSoon : kLater),
        worker([network = std::move(network), &language](
                   const Passage& of, const std::stop_token& stop) { return heardIn(*network, of, language, stop); },
               {}) {}

  static Heard heardIn(WordNetwork& network, const Passage& of, const Language& language, const std::stop_token& stop);
  void take(std::span<const std::int16_t> samples);
  void ask();
  void collect(std::optional<Heard>& found);

  const Pace pace;
  std::vector<std::int16_t> passage;
  std::size_t hops = 0;         ///< of the sound
  std::size_t since_asked = 0;  ///< in hops
  std::size_t failed_in_a_row = 0;
  bool is_asked = false;
  bool is_late = false;  ///< it was waited for in vain
  AnsweringThread<Passage, Heard> worker;
};

LivePhones::Heard LivePhones::State::heardIn(WordNetwork& network, const Passage& of, const Language& language,
                                             const std::stop_token& stop) {
  const Eigen::MatrixXf encoded = network.encode(of.samples, stop);
  if (encoded.cols() == 0) return {};
  const Seconds start = asReal(of.first) / kEncodedRateHz, end = start + asReal(of.samples.size()) / kEncodedRateHz;
  const auto frameAt = [](Seconds time) { return std::max(0.0, std::ceil((time - kEarShift) / kEarStep)); };
  const auto first = static_cast<std::size_t>(of.first == 0 ? 0.0 : frameAt(start + kBeginning)),
             after = static_cast<std::size_t>(frameAt(end - kEarStep));
  if (after <= first) return {};
  return {first,
          atFramesOfEar(phonesOfEncoded(encoded, language), start, signedIndex(first), signedIndex(after - first))};
}

void LivePhones::State::take(std::span<const std::int16_t> samples) {
  ++hops;
  ++since_asked;
  passage.insert(passage.end(), samples.begin(), samples.end());
  if (passage.size() > pace.at_once * kHop)
    passage.erase(passage.begin(), passage.end() - signedIndex(pace.at_once * kHop));
}

void LivePhones::State::ask() {
  const std::size_t every = failed_in_a_row < kMostFailedInARow ? pace.every : kEncodedAgain;
  if (is_asked || since_asked < every) return;
  is_asked = worker.ask({passage, hops * kHop - passage.size()});
  since_asked = 0;
}

/// What is there by now, if it was asked for; `found` stays where nothing is.
void LivePhones::State::collect(std::optional<Heard>& found) {
  if (!is_asked || !worker.isDone({}, {})) return;
  is_asked = is_late = false;
  std::optional<Heard> heard = worker.take();
  failed_in_a_row = heard ? 0 : failed_in_a_row + 1;
  if (heard && heard->posteriors.cols() > 0) found = std::move(heard);
}

LivePhones::LivePhones(std::shared_ptr<WordNetwork> network, Seconds look_ahead, const Language& language)
    : state_(std::make_unique<State>(std::move(network), look_ahead, language)) {
  state_->worker.isDone(kLongestStart, {});
  if (!state_->worker.take()) state_->failed_in_a_row = kMostFailedInARow;
}
LivePhones::~LivePhones() = default;
LivePhones::LivePhones(LivePhones&&) noexcept = default;
LivePhones& LivePhones::operator=(LivePhones&&) noexcept = default;

std::optional<LivePhones::Heard> LivePhones::hear(std::span<const std::int16_t> samples, bool is_speech) {
  MOUTHPIECE_EXPECT(samples.size() == kHop);
  State& state = *state_;
  state.take(samples);
  std::optional<Heard> found;
  state.collect(found);
  if (is_speech) state.ask();
  if (state.is_asked && !state.is_late) state.is_late = !state.worker.isDone(kLongestWait, {});
  state.collect(found);
  return found;
}

}  // namespace mouthpiece
