#include "hearing/live/live_words.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <stop_token>
#include <string>
#include <utility>

#include "base/errors.h"
#include "base/index.h"
#include "hearing/alignment/forced_alignment.h"
#include "hearing/alignment/pronouncer.h"
#include "hearing/live/answering_thread.h"
#include "hearing/recognition/collected_speech.h"
#include "hearing/recognition/hearing_odds.h"

namespace mouthpiece {
namespace {

constexpr int kPhraseRateHz = 16000;
/// In hops: a phrase is heard so often, first when so much of it was said; what is found is due so much later.
constexpr std::size_t kHeardEvery = 6, kFirstHeard = 8, kDue = 5;
/// A phrase is heard once more when nothing was said for so long, and over when nothing was for longer.
constexpr std::size_t kHeardLast = 2, kPhraseEnds = 15;
/// So much of what lies before a phrase is heard with it. A longer one is cut where a word ends, near its middle.
constexpr std::size_t kBeforePhrase = 5, kLongestPhrase = 75;
/// A word that ends nearer to the newest sound may not have ended.
constexpr Seconds kMayGoOn = 0.2;
/// The start is waited for so long. After so many in a row that failed none is heard for so many hops.
constexpr std::chrono::milliseconds kLatestStart{10000};
constexpr std::size_t kLatestHops = 25, kMostMissedInARow = 3, kTriedAgain = 1500;
constexpr std::chrono::milliseconds kDueTime{kDue * 40};

using Clock = std::chrono::steady_clock;

/// What was said since a pause.
struct Phrase {
  std::vector<std::int16_t> samples;
  Seconds start = 0;  ///< on the clock of the whole sound
  bool is_over = false;
};

/// Hears whole phrases.
class PhraseHearing {
 public:
  PhraseHearing(std::shared_ptr<WordNetwork> network, const Lexicon* lexicon, const Language& language)
      : network_(std::move(network)), pronouncer_(lexicon, language), aligner_(std::filesystem::path(), language) {}

  /// Of no sound once the network has started. Throws InputError where the network fails.
  HeardPhrase wordsIn(const Phrase& phrase, const std::stop_token& stop);

 private:
  std::shared_ptr<WordNetwork> network_;
  Pronouncer pronouncer_;
  ForcedAligner aligner_;
};

HeardPhrase PhraseHearing::wordsIn(const Phrase& phrase, const std::stop_token& stop) {
  const std::array<std::span<const std::int16_t>, 1> sound{phrase.samples};
  const std::vector<NetworkWord> words = network_->hear(sound, stop).front();
  std::string text;
  double sure = 0;
  for (const NetworkWord& word : words) {
    text += (text.empty() ? "" : " ") + word.text;
    sure += word.log_probability / asReal(words.size());
  }
  HeardPhrase heard{.span = {phrase.start, phrase.start + asReal(phrase.samples.size()) / kPhraseRateHz}};
  if (text.empty()) return heard;
  AudioClip clip{kPhraseRateHz, {}};
  for (const std::int16_t sample : phrase.samples) clip.samples.push_back(static_cast<float>(sample) / 32768.0F);
  ForcedAlignment alignment;
  try {
    alignment =
        aligner_.align(clip, pronouncer_.wordsOf(text), "phrase", SpeechKind::kSpoken, BorderTimes::kFirstHeard);
  } catch (const InputError&) {  // the phrase is too short for them
    return heard;
  }
  const SpeechLabels& labels = alignment.labels;
  const Seconds ended = phrase.is_over ? labels.duration() : labels.duration() - kMayGoOn;
  for (std::size_t i = 0; i < labels.words.size(); ++i) {
    const PhoneRange of_word = labels.words[i].phones;
    // A word that is written as several is aligned as these.
    const double word_sure = words.size() == labels.words.size() ? words[i].log_probability : sure;
    const double believed = oddsOfConfidence(alignment.confidence[i]);
    heard.word_odds += believed / asReal(labels.words.size());
    const double odds = oddsOfNetworkWord(believed, word_sure);
    if (odds >= kLiveWordUnlikely || labels.spanOf(of_word).end > ended) continue;
    for (std::size_t k = of_word.first.value; k <= of_word.last.value; ++k) {
      const TimeSpan& span = labels.phones[k].span;
      heard.phones.push_back(
          {.phone = labels.phones[k].phone, .span = {span.start + phrase.start, span.end + phrase.start}, .word = i});
    }
  }
  shortenHeldPhones(heard.phones);
  return heard;
}

}  // namespace

struct LiveWords::State {
  State(std::shared_ptr<WordNetwork> network, const Lexicon* lexicon, const Language& language,
        std::chrono::milliseconds given_latest)
      : latest(given_latest),
        worker([hearing = std::make_shared<PhraseHearing>(std::move(network), lexicon, language)](
                   const Phrase& of, const std::stop_token& stop) { return hearing->wordsIn(of, stop); },
               {}) {}

  void take(std::span<const std::int16_t> samples, bool is_speech);
  void shorten();
  [[nodiscard]] bool wantsHearing() const;
  [[nodiscard]] bool isTooLate() const;
  void ask();
  std::optional<HeardPhrase> found();

  const std::chrono::milliseconds latest;

  // In hops.
  std::vector<std::int16_t> phrase;
  std::size_t hops = 0;    ///< of the sound
  std::size_t spoken = 0;  ///< of the phrase
  std::size_t quiet = 0;   ///< since something was said
  std::size_t since_asked = 0;
  bool was_heard_last = false;
  std::optional<std::size_t> due;  ///< when what is asked for is
  Clock::time_point asked_at;
  std::vector<Seconds> word_ends;  ///< as they were found last
  std::size_t missed = 0, missed_in_a_row = 0;
  AnsweringThread<Phrase, HeardPhrase> worker;
};

/// Samples of the phrase, or of what lies before the next one.
void LiveWords::State::take(std::span<const std::int16_t> samples, bool is_speech) {
  ++hops;
  ++since_asked;
  phrase.insert(phrase.end(), samples.begin(), samples.end());
  quiet = is_speech ? 0 : quiet + 1;
  spoken = quiet < kPhraseEnds ? spoken + (is_speech ? 1 : 0) : 0;
  if (is_speech) was_heard_last = false;
  if (phrase.size() > kHop * (spoken == 0 ? kBeforePhrase : kLongestPhrase)) shorten();
}

void LiveWords::State::shorten() {
  std::size_t cut = phrase.size() - std::min(phrase.size(), kHop * kBeforePhrase);
  if (spoken > 0) {
    const Seconds length = asReal(phrase.size()) / kPhraseRateHz;
    const Seconds start = asReal(hops * kHop) / kPhraseRateHz - length;
    Seconds at = length / 2;
    const auto nearest = std::min_element(word_ends.begin(), word_ends.end(), [&](Seconds a, Seconds b) {
      return std::abs(a - start - at) < std::abs(b - start - at);
    });
    if (nearest != word_ends.end() && std::abs(*nearest - start - at) < length / 4) at = *nearest - start;
    cut = static_cast<std::size_t>(std::lround(at * kPhraseRateHz));
  }
  phrase.erase(phrase.begin(), phrase.begin() + signedIndex(cut));
}

bool LiveWords::State::wantsHearing() const {
  if (due || spoken < kFirstHeard) return false;
  if (missed_in_a_row >= kMostMissedInARow && since_asked < kTriedAgain) return false;
  return quiet < kHeardLast ? since_asked >= kHeardEvery : !was_heard_last;
}

void LiveWords::State::ask() {
  const bool is_last = quiet >= kHeardLast;
  if (!worker.ask({phrase, asReal(hops * kHop - phrase.size()) / kPhraseRateHz, is_last}))
    return;  // it is busy with what came too late
  was_heard_last = is_last;
  since_asked = 0;
  due = hops + kDue;
  asked_at = Clock::now();
}

/// By the sound and by the clock: sound that waited comes faster than it was said.
bool LiveWords::State::isTooLate() const {
  return hops >= *due + kLatestHops && Clock::now() - asked_at >= kDueTime + latest;
}

/// What the other thread found; nothing where it failed or is still busy.
std::optional<HeardPhrase> LiveWords::State::found() {
  due.reset();
  std::optional<HeardPhrase> answer = worker.take();
  missed += answer ? 0U : 1U;
  missed_in_a_row = answer ? 0 : missed_in_a_row + 1;
  return answer;
}

LiveWords::LiveWords(std::shared_ptr<WordNetwork> network, const Lexicon* lexicon, const Language& language,
                     std::chrono::milliseconds latest)
    : state_(std::make_unique<State>(std::move(network), lexicon, language, latest)) {
  state_->worker.isDone(std::max(latest, kLatestStart), {});
  static_cast<void>(state_->found());
}
LiveWords::~LiveWords() = default;
LiveWords::LiveWords(LiveWords&&) noexcept = default;
LiveWords& LiveWords::operator=(LiveWords&&) noexcept = default;
std::size_t LiveWords::missed() const { return state_->missed; }

std::optional<HeardPhrase> LiveWords::hear(std::span<const std::int16_t> samples, bool is_speech,
                                           const std::function<bool()>& waits) {
  MOUTHPIECE_EXPECT(samples.size() == kHop);
  State& state = *state_;
  state.take(samples, is_speech);
  std::optional<HeardPhrase> found;
  if (state.due && state.hops >= *state.due &&
      (state.worker.isDone(state.latest, waits) || !waits || waits() || state.isTooLate())) {
    found = state.found();
    state.word_ends.clear();
    const std::vector<PhoneSegment> phones = found ? found->phones : std::vector<PhoneSegment>();
    for (std::size_t i = 0; i < phones.size(); ++i) {
      if (i + 1 == phones.size() || phones[i + 1].word != phones[i].word) state.word_ends.push_back(phones[i].span.end);
    }
  }
  if (state.wantsHearing()) state.ask();
  return found;
}

}  // namespace mouthpiece
