// Sound, labels and texts in as they come, frames out: LiveStream.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <utility>

#include "audio/audio_clip.h"
#include "base/errors.h"
#include "base/index.h"
#include "speaker/live_data.h"
#include "speaker/speaker_data.h"

namespace mouthpiece {
namespace {

/// Of chunks that wait: all.
constexpr std::uint64_t kAllWaiting = ~std::uint64_t{0};
constexpr Seconds kHearingHop = asReal(LiveEar::kHop) / LiveEar::kRateHz;
constexpr Seconds kMostUnpulled = 600;
constexpr Seconds kFurthest = 24 * 3600.0 * 365;
constexpr Seconds kWaitsFrom = 0.3;  ///< words are waited for where sound is so far ahead of who says it

void expectUsable(const LiveOptions& options) {
  if (!(options.look_ahead >= 0.05 && options.look_ahead <= 5))
    throw InputError(fmt::format("found a look-ahead of {} s; expected 0.05 to 5 s", options.look_ahead));
  if (!(options.sample_rate_hz >= 16000 && options.sample_rate_hz <= 48000))
    throw InputError(fmt::format("found sound at {} Hz; expected 16,000 to 48,000 Hz", options.sample_rate_hz));
}

void expectSpan(const TimeSpan& span) {
  if (!(span.start >= 0 && span.end > span.start && span.end < kFurthest))
    throw InputError(
        fmt::format("found times {} to {} s; expected a start from 0 s on and a later end, before {:.0f} s", span.start,
                    span.end, kFurthest));
}

}  // namespace

LiveStream::Data::Data(LiveSetup made_of, const LiveOptions& wanted)
    : setup(std::move(made_of)),
      options(wanted),
      rate_hz(setup.synthesis.frame_rate_hz),
      motion(setup.corpus.data().units, setup.synthesis, *setup.language),
      upper_face(setup.synthesis.expression, rate_hz),
      upper_columns(upperFaceColumns(setup.corpus.data().corpus.layout)),
      resampler(wanted.sample_rate_hz, LiveEar::kRateHz),
      order(wanted.sample_rate_hz) {
  weights_clip = {rate_hz, setup.corpus.markerNames(), PositionMatrix(0, setup.corpus.data().actor.neutral_mm.size())};
  if (options.source == LiveOptions::Source::kSound) ear = makeLiveEar(setup, options);
  if (options.source == LiveOptions::Source::kText) makeOwnVoice();
  resting = restingFrame();
  current = stalled_from = resting;
  if (setup.face) setup.face->data().rig().deform(FacePose(resting.face_markers, resting.lip_gaps), {}, vertices);
  clock = SoundClock(SoundClock::Clock::now());  // the start is over: sound that waits for it is no pause's
}

void LiveStream::Data::makeOwnVoice() {
  if (voice) return;
  voice = makeVoice(setup.voice.empty() ? voiceFor(*setup.language) : setup.voice,
                    VoiceOptions{setup.lexicon ? &*setup.lexicon : nullptr, &setup.corpus.data().units,
                                 setup.synthesis.selection, setup.rate});
}

void LiveStream::Data::makePronouncer() {
  if (pronouncer) return;
  pronouncer = std::make_unique<Pronouncer>(setup.lexicon ? &*setup.lexicon : nullptr, *setup.language);
  const Corpus& corpus = setup.corpus.data().corpus;
  for (const TakeIndex take : evenlySpreadTakes(corpus, kTakesOfWords)) lengths.add(takeOf(corpus, take).labels);
}

/// A word that is said within `span`, as the language says it; a number may be several.
std::vector<PhoneSegment> LiveStream::Data::phonesOfWord(std::string_view word, const TimeSpan& span) {
  makePronouncer();
  std::vector<PhoneSegment> segments;
  Seconds length = 0;
  has_small_letters |= std::ranges::any_of(word, [](char c) { return c >= 'a' && c <= 'z'; });
  const std::vector<TranscriptWord> all = pronouncer->wordsOf(word, !has_small_letters);
  if (told_words) segments = told_words->phonesOf(all, span, words);
  if (!segments.empty()) {
    words += all.size();
    return segments;
  }
  for (const TranscriptWord& said : all) {
    for (const Phone phone : said.ways.front().phones) {
      segments.push_back({.phone = phone, .span = {length, length + lengths.of(phone)}, .word = words});
      length += lengths.of(phone);
    }
    ++words;
  }
  for (PhoneSegment& segment : segments) {
    segment.span.start = std::lerp(span.start, span.end, segment.span.start / length);
    segment.span.end = std::lerp(span.start, span.end, segment.span.end / length);
  }
  return segments;
}

void LiveStream::Data::expectOpen(bool of_sound) {
  const std::scoped_lock lock(mutex);
  if (is_finished) throw InputError("the stream is finished; expected nothing more to say");
  if (of_sound ? is_labels : is_sound) throw InputError("found labels and sound in one stream; expected one of them");
  (of_sound ? is_sound : is_labels) = true;
  if (asReal(ring.size()) > kMostUnpulled * rate_hz)
    throw InputError(
        fmt::format("{:.0f} s of frames wait to be pulled; expected somebody to pull them", kMostUnpulled));
}

/// What nextNow() showed by itself has happened: sound that follows is later by as much.
void LiveStream::Data::catchUp() {
  LiveFrames last;
  std::size_t count = 0;
  {
    const std::scoped_lock lock(mutex);
    count = std::exchange(unshown, 0);
    if (count == 0) return;
    last.positions_mm = Eigen::Map<const Eigen::RowVectorXd>(current.markers_mm.data(), std::ssize(current.markers_mm));
    last.lips = {current.lips};
    last.tongue = {current.tongue};
  }
  weights_clip.positions_mm = last.positions_mm;
  weights_lips = last.lips;
  motion.skip(count, last);
  if (!is_sound) return;
  const auto samples = static_cast<std::size_t>(std::lround(asReal(count) / rate_hz * options.sample_rate_hz));
  order.passOver(samples);
  hearSilence(samples);
}

void LiveStream::Data::hearSilence(std::size_t samples) {
  const std::vector<float> silence(std::min<std::size_t>(samples, 4096), 0.0F);
  for (std::size_t done = 0; done < samples; done += silence.size())
    heard(std::span(silence).first(std::min(silence.size(), samples - done)));
}

void LiveStream::Data::heard(std::span<const float> samples) {
  sound_samples += samples.size();
  resampler.push(samples, waiting);
  hearWhole();
}

/// Words are waited for where no one waits for frames: neither nextNow(), nor who speaks and goes on.
bool LiveStream::Data::waitsForWords() const {
  return !is_in_time && (is_ending || clock.ahead(SoundClock::Clock::now(), sound_come) > kWaitsFrom);
}

void LiveStream::Data::hearWhole() {
  std::size_t at = 0;
  std::array<std::int16_t, LiveEar::kHop> hop{};
  for (; waiting.size() - at >= LiveEar::kHop; at += LiveEar::kHop) {
    std::transform(waiting.begin() + signedIndex(at), waiting.begin() + signedIndex(at + LiveEar::kHop), hop.begin(),
                   [](float sample) { return static_cast<std::int16_t>(std::lrint(32767.0F * sample)); });
    for (const PhoneSegment& phone : ear->hear(hop, [this] { return waitsForWords(); })) motion.say(phone);
    if (ear->missedWords() > 0) {
      const std::scoped_lock lock(mutex);
      counts.words_missed = ear->missedWords();
    }
    ++hops;
    makeFrames(asReal(hops) * kHearingHop, ear->guess());
  }
  waiting.erase(waiting.begin(), waiting.begin() + signedIndex(at));
}

void LiveStream::Data::pushSound(std::span<const float> samples, std::optional<std::uint64_t> at) {
  if (samples.empty()) return;
  expectOpen(true);
  if (!ear) ear = makeLiveEar(setup, options);
  catchUp();
  if (at && !ahead.contains(*at) && order.mayWait(*at, samples.size())) {
    ahead.emplace(*at, std::vector<float>(samples.begin(), samples.end()));
    return;
  }
  takeWaiting(at.value_or(kAllWaiting));
  takeSound(samples, at);
  takeWaiting(0);
}

void LiveStream::Data::takeWaiting(std::uint64_t before) {
  while (!ahead.empty() && (ahead.begin()->first < before || !order.isAhead(ahead.begin()->first))) {
    const auto next = ahead.extract(ahead.begin());
    takeSound(next.mapped(), next.key());
  }
}

void LiveStream::Data::takeSound(std::span<const float> samples, std::optional<std::uint64_t> at) {
  ChunkOrder::Place place;
  std::vector<float> usable(samples.begin(), samples.end());
  {
    const std::scoped_lock lock(mutex);
    ++counts.chunks;
    if (at) place = order.place(*at, samples.size(), counts);
    if (!at) order.follow(samples.size());
    for (float& sample : usable) {
      const bool is_usable = sample >= -1 && sample <= 1;
      counts.unusable_samples += is_usable ? 0U : 1U;
      if (!is_usable) sample = std::isnan(sample) ? 0.0F : std::clamp(sample, -1.0F, 1.0F);
    }
  }
  const auto secondsOf = [&](std::size_t count) { return asReal(count) / asReal(options.sample_rate_hz); };
  const Seconds before =
      std::exchange(sound_come, secondsOf(sound_samples + place.silence + usable.size() - place.skipped));
  clock.come(SoundClock::Clock::now(), before, std::max(0.0, sound_come - before));
  hearSilence(place.silence);
  heard(std::span(usable).subspan(place.skipped));
  clock.leave(SoundClock::Clock::now());
}

/// What was said before `phones` begin is silence; what lies before what was said is passed over.
void LiveStream::Data::pushPhones(const std::vector<PhoneSegment>& phones) {
  constexpr Seconds kShortest = 1e-4;
  for (PhoneSegment phone : phones) {
    const Seconds said = motion.saidUntil();
    {
      const std::scoped_lock lock(mutex);
      ++counts.chunks;
      const bool is_gone = phone.span.end < said + kShortest, is_unseen = phone.span.end < now();
      counts.doubled += is_gone ? 1U : 0U;
      counts.late += is_unseen && !is_gone ? 1U : 0U;
      if (is_gone) continue;
    }
    if (phone.span.start > said + kShortest || motion.saidUntil() == 0)
      motion.say({.phone = Phone::kSil, .span = {said, std::max(phone.span.start, said + kShortest)}});
    phone.span.start = motion.saidUntil();
    if (phone.span.duration() > 0) motion.say(phone);
    makeFrames(motion.saidUntil(), {});
  }
}

/// Says labels from now on, as long as they last, and makes their frames. Returns when they begin.
Seconds LiveStream::Data::sayLabels(const SpeechLabels& labels) {
  constexpr Seconds kAtOnce = 0.25;
  catchUp();
  const Seconds begin = std::max(motion.saidUntil(), now());
  if (begin > motion.saidUntil()) motion.say({.phone = Phone::kSil, .span = {motion.saidUntil(), begin}});
  for (const LabelledPhone& phone : labels.phones) {
    PhoneSegment said{
        .phone = phone.phone, .span = {begin + phone.span.start, begin + phone.span.end}, .ipa = phone.ipa};
    if (phone.word) said.word = words + *phone.word;
    said.syllable = phone.syllable;
    if (phone.syllable && isVowel(phone.phone)) said.stress = labels.syllables[*phone.syllable].stress;
    if (said.span.duration() > 0) motion.say(said);
  }
  words += labels.words.size();
  // They end in silence: no frame of them waits for what follows.
  const Seconds end = motion.saidUntil();
  const std::array<PhoneSegment, 1> after{PhoneSegment{.phone = Phone::kSil, .span = {end, end + options.look_ahead}}};
  for (Seconds until = now(); until < end;) {
    until = std::min(end, until + kAtOnce);
    makeFrames(until + options.look_ahead, after);
  }
  return begin;
}

LiveStream makeLiveStream(LiveSetup setup, const LiveOptions& options) {
  expectUsable(options);
  return LiveStream(std::make_unique<LiveStream::Data>(std::move(setup), options));
}

LiveStream::LiveStream(std::unique_ptr<Data> data) : data_(std::move(data)) {}
LiveStream::LiveStream(LiveStream&&) noexcept = default;
LiveStream& LiveStream::operator=(LiveStream&&) noexcept = default;
LiveStream::~LiveStream() = default;

void LiveStream::push(std::span<const float> samples) { data_->pushSound(samples, std::nullopt); }
void LiveStream::push(std::span<const float> samples, std::uint64_t at) { data_->pushSound(samples, at); }

namespace {

std::vector<float> floatsOf(std::span<const std::int16_t> samples) {
  std::vector<float> made(samples.size());
  std::transform(samples.begin(), samples.end(), made.begin(),
                 [](std::int16_t sample) { return static_cast<float>(sample) / 32768.0F; });
  return made;
}

}  // namespace

void LiveStream::push(std::span<const std::int16_t> samples) { data_->pushSound(floatsOf(samples), std::nullopt); }
void LiveStream::push(std::span<const std::int16_t> samples, std::uint64_t at) {
  data_->pushSound(floatsOf(samples), at);
}

void LiveStream::push(const LivePhone& phone) {
  expectSpan(phone.span);
  std::vector<PhoneSegment> segments;
  if (isSilenceName(phone.phone) && !phone.phone.empty()) {
    segments.push_back({.phone = Phone::kSil, .span = phone.span});
  } else {
    std::vector<std::string> unknown;
    std::vector<SpelledPhone> spelled =
        phonesOfSymbol(phone.phone, PhoneSet::kArpabet, *data_->setup.language, unknown);
    if (spelled.empty() || !unknown.empty()) {
      unknown.clear();
      spelled = phonesOfIpa(phone.phone, unknown);
    }
    if (spelled.empty() || !unknown.empty())
      throw InputError(fmt::format("found the phone '{}'; expected ARPAbet, IPA or sil", printable(phone.phone)));
    const Seconds length = phone.span.duration() / asReal(spelled.size());
    for (std::size_t i = 0; i < spelled.size(); ++i) {
      const Seconds start = phone.span.start + asReal(i) * length;
      segments.push_back({.phone = spelled[i].phone,
                          .span = {start, i + 1 == spelled.size() ? phone.span.end : start + length},
                          .word = phone.word,
                          .stress = stressOfName(phone.phone),
                          .ipa = spelled[i].ipa});
    }
  }
  data_->expectOpen(false);
  data_->catchUp();
  data_->pushPhones(segments);
}

void LiveStream::push(std::string_view word, const TimeSpan& span) {
  expectSpan(span);
  Data& data = *data_;
  const std::vector<PhoneSegment> segments = data.phonesOfWord(word, span);
  data.expectOpen(false);
  data.catchUp();
  data.pushPhones(segments);
}

void LiveStream::pushSoundOfWords(std::span<const float> samples) {
  Data& data = *data_;
  data.expectOpen(false);
  if (!data.told_words)
    data.told_words = std::make_unique<ToldWords>(data.options.sample_rate_hz, *data.setup.language);
  data.told_words->push(samples);
}

void LiveStream::silence(Seconds until) {
  Data& data = *data_;
  data.expectOpen(false);
  data.catchUp();
  if (!(until >= 0 && until < kFurthest))
    throw InputError(fmt::format("found silence until {} s; expected 0 to {:.0f} s", until, kFurthest));
  if (until > data.motion.saidUntil())
    data.pushPhones({{.phone = Phone::kSil, .span = {data.motion.saidUntil(), until}}});
}

Sound LiveStream::say(std::string_view text) {
  Data& data = *data_;
  data.expectOpen(false);
  data.makeOwnVoice();
  const SpokenLine line = data.voice->speak(text);
  data.sayLabels(line.labels);
  return {line.audio.sample_rate_hz, line.audio.samples};
}

void LiveStream::say(std::string_view text, const std::function<void(Seconds begin, const Sound& piece)>& take) {
  Data& data = *data_;
  data.expectOpen(false);
  data.makeOwnVoice();
  Seconds sounded_until = 0;
  const auto waitForSound = [&] {
    if (sounded_until > data.motion.saidUntil())
      data.motion.say({.phone = Phone::kSil, .span = {data.motion.saidUntil(), sounded_until}});
  };
  data.voice->speakInPieces(text, [&](const SpokenPiece& piece) {
    if (!piece.labels.phones.empty()) {
      waitForSound();
      sounded_until = data.sayLabels(piece.labels);
    }
    if (piece.audio.samples.empty()) return;
    take(sounded_until, {piece.audio.sample_rate_hz, piece.audio.samples});
    sounded_until += piece.audio.duration();
  });
  waitForSound();
}

void LiveStream::finish() {
  Data& data = *data_;
  {
    const std::scoped_lock lock(data.mutex);
    if (data.is_finished) return;
  }
  data.catchUp();
  data.takeWaiting(kAllWaiting);
  Seconds end = data.motion.saidUntil();
  if (data.is_sound) {
    constexpr Seconds kHeardWithin = 0.5;
    end = asReal(data.sound_samples) / data.options.sample_rate_hz;
    data.frames_at_most = static_cast<std::size_t>(std::ceil(end * data.rate_hz - 1e-6));
    data.is_ending = true;
    data.hearSilence(static_cast<std::size_t>((kHeardWithin + data.options.look_ahead) * data.options.sample_rate_hz));
  } else {
    const std::array<PhoneSegment, 1> after{PhoneSegment{.phone = Phone::kSil, .span = {end, end + 0.5}}};
    data.frames_at_most = static_cast<std::size_t>(std::ceil(end * data.rate_hz - 1e-6));
    data.makeFrames(end + data.options.look_ahead, after);
  }
  const std::scoped_lock lock(data.mutex);
  data.is_finished = true;
}

}  // namespace mouthpiece
