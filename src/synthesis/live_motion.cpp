#include "synthesis/live_motion.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string_view>
#include <utility>

#include "base/errors.h"
#include "base/index.h"
#include "motion/blend.h"
#include "synthesis/lips.h"
#include "synthesis/stages.h"
#include "synthesis/tongue.h"

namespace mouthpiece {
namespace {

/// Of a window: what is said so long before and after the frames is looked at, and so much around them is rendered, so
/// that contacts (0.25 s) and the smoothing of detail (three deviations of up to 50 ms) are as in the whole line.
constexpr Seconds kBehind = 1.6, kAhead = 1.2, kAround = 0.30;
/// A silence this long ends a phrase; the mouth comes to rest in it, and opens for the next phrase this long before.
constexpr Seconds kPhraseGap = 0.60, kOpens = 0.45, kCloses = 0.25;
/// After so much silence the face rests.
constexpr Seconds kComesToRest = 1.2;
/// A difference to what was shown fades within this.
constexpr Seconds kLedAway = 0.070;
/// How much of what is said is kept in mind.
constexpr Seconds kKept = 4.0;
constexpr Eigen::Index kLipNumbers = 4, kTongueNumbers = 3;

Eigen::RowVectorXd rowOf(const LiveFrames& frames, Eigen::Index frame) {
  const Eigen::Index markers = frames.positions_mm.cols();
  Eigen::RowVectorXd row(markers + kLipNumbers + kTongueNumbers);
  const LipPose& lips = frames.lips[unsignedIndex(frame)];
  const TonguePose& tongue = frames.tongue[unsignedIndex(frame)];
  row << frames.positions_mm.row(frame), double{lips.seal}, double{lips.parting}, double{lips.tuck},
      double{lips.rounding}, double{tongue.tip_up}, double{tongue.tip_forward}, double{tongue.back_up};
  return row;
}

void setRow(LiveFrames& frames, Eigen::Index frame, const Eigen::RowVectorXd& row) {
  const Eigen::Index markers = frames.positions_mm.cols();
  frames.positions_mm.row(frame) = row.head(markers);
  const auto number = [&](Eigen::Index i) { return asFloat(std::clamp(row(markers + i), 0.0, 1.0)); };
  LipPose& lips = frames.lips[unsignedIndex(frame)];
  lips.seal = number(0);
  lips.parting = number(1);
  lips.tuck = number(2);
  lips.rounding = number(3);
  frames.tongue[unsignedIndex(frame)] = {number(4), number(5), number(6)};
}

bool isSilent(const PhoneSegment& segment) { return segment.phone == Phone::kSil; }

SpeechLabels labelsOf(std::vector<PhoneSegment> segments, Seconds origin, const Language& language) {
  std::size_t first_word = std::numeric_limits<std::size_t>::max(), words = 0;
  for (const PhoneSegment& segment : segments) {
    if (segment.word) first_word = std::min(first_word, *segment.word);
  }
  for (PhoneSegment& segment : segments) {
    segment.span = {segment.span.start - origin, segment.span.end - origin};
    if (!segment.word) continue;
    *segment.word -= first_word;
    words = std::max(words, *segment.word + 1);
  }
  const Seconds duration = segments.back().span.end;
  return buildSpeechLabels(std::move(segments), std::vector<std::string>(words), duration, language);
}

/// 1 while lips are said to touch each other, 0 from 50 ms before and after.
std::vector<double> touchingLips(const SpeechLabels& labels, std::span<const Seconds> times) {
  constexpr Seconds kComes = 0.050;
  std::vector<double> touching(times.size(), 0.0);
  for (const LabelledPhone& phone : labels.phones) {
    if (!isBilabial(phone.phone)) continue;
    for (std::size_t i = 0; i < times.size(); ++i) {
      const Seconds away = std::max({phone.span.start - times[i], times[i] - phone.span.end, 0.0});
      touching[i] = std::max(touching[i], blendWeight(BlendKind::kSmooth, away / kComes));
    }
  }
  return touching;
}

/// The units that play around `times`.
std::vector<SelectedUnit> unitsNear(const std::vector<SelectedUnit>& units, const SpeechLabels& labels,
                                    std::span<const Seconds> times) {
  constexpr Seconds kNear = 0.10;
  std::vector<SelectedUnit> near;
  for (const SelectedUnit& unit : units) {
    const TimeSpan span = labels.spanOf(unit.phones);
    if (span.end > times.front() - kNear && span.start < times.back() + kNear) near.push_back(unit);
  }
  return near;
}

/// How far a face may go, and where its contacts are, is known of a whole line alone.
void expectUnset(bool is_unset, std::string_view name) {
  if (!is_unset)
    throw InputError(fmt::format("found {} for a stream; expected none, since the line is not known as a whole", name));
}

}  // namespace

LiveMotion::LiveMotion(const UnitDatabase& database, const SynthesisOptions& options, const Language& language)
    : database_(database), options_(options), language_(language), likely_words_(language) {
  const SelectionOptions& selection = options.selection;
  if (selection.method != SelectionMethod::kViterbi || selection.units != UnitScales::kAny || options.curves.alone ||
      !options.context.enabled || options.curves.model == nullptr) {
    throw InputError("a line can be followed while it is said by the method guided, with units of any kind, alone");
  }
  for (const DialRow& dial : kSpeechDials) expectUnset(isUsual(dial, options.dials), dial.name);
  const CurveOptions& curves = options.curves;
  const LineEdits& edits = options.edits;
  for (const auto& [name, wish] :
       {std::pair("ma", &curves.ma), {"ps", &curves.ps}, {"ja", &curves.ja}, {"li", &curves.li}})
    expectUnset(!wish->given && !wish->automatic, name);
  expectUnset(edits.curves.empty() && edits.dials.empty() && edits.borders.empty() && edits.words.empty() &&
                  edits.units.empty(),
              "edits");
  if (database.corpus().trajectory_model == nullptr)
    throw InputError(database.corpus().name + ": predicts no movement; expected a corpus with a trajectory model");
  for (const TakeIndex take : evenlySpreadTakes(database.corpus(), kTakesOfWords))
    likely_words_.add(database.takeOf(take).labels);
}

Seconds LiveMotion::timeOf(std::size_t frame) const { return asReal(frame) / options_.frame_rate_hz; }

void LiveMotion::say(const PhoneSegment& phone) {
  constexpr Seconds kLeastSilence = 0.020;
  constexpr double kMostOfPhone = 0.25;
  MOUTHPIECE_EXPECT(phone.span.duration() > 0);
  PhoneSegment next = phone;
  if (said_.empty() && !isSilent(phone)) {  // a line begins in silence
    next.span.start += std::min(kLeastSilence, kMostOfPhone * phone.span.duration());
    said_.push_back({{.phone = Phone::kSil, .span = {phone.span.start, next.span.start}}});
  }
  if (!said_.empty()) next.span.start = said_.back().segment.span.end;
  if (!said_.empty() && isSilent(next) && isSilent(said_.back().segment)) {
    said_.back().segment.span.end = next.span.end;
    return;
  }
  said_.push_back({next});
}

LiveMotion::Window LiveMotion::windowAt(const TimeSpan& frames, std::span<const PhoneSegment> guess) const {
  const auto [time, until] = frames;
  std::vector<PhoneSegment> all;
  for (const Said& said : said_) all.push_back(said.segment);
  for (const PhoneSegment& segment : guess) {
    const bool goes_on = !all.empty() && isSilent(all.back()) && isSilent(segment);
    if (goes_on) all.back().span.end = segment.span.end;
    if (!goes_on) all.push_back(segment);
  }
  Window window;
  window.until = std::numeric_limits<Seconds>::infinity();
  // Which phrase the frame is in.
  std::size_t first = 0, end = all.size();
  for (std::size_t i = 1; i + 1 < all.size(); ++i) {
    if (!isSilent(all[i]) || all[i].span.duration() < kPhraseGap) continue;
    const Seconds turn = std::max(all[i].span.start + kCloses, all[i].span.end - kOpens);
    if (turn <= time) {
      first = i;
    } else {
      window.until = turn;
      end = i + 1;
      break;
    }
  }
  bool is_said = false;
  for (std::size_t i = first; i < end && !is_said; ++i)
    is_said = !isSilent(all[i]) && all[i].span.end > time - kComesToRest;
  window.is_silent = !is_said;
  if (window.is_silent) return window;
  // What lies further back stands for a silence.
  std::size_t begin = first;
  while (begin + 2 < end && all[begin + 1].span.end < time - kBehind) ++begin;
  while (end > begin + 2 && all[end - 1].span.start > until + kAhead) --end;
  window.first = begin;
  std::vector<PhoneSegment> segments(all.begin() + signedIndex(begin), all.begin() + signedIndex(end));
  segments.front() = {.phone = Phone::kSil, .span = segments.front().span};
  if (segments.size() > 1 && isSilent(segments[1])) {
    segments[1].span.start = segments[0].span.start;
    segments.erase(segments.begin());
    ++window.first;
  }
  addLikelyFuture(segments);
  window.origin = segments.front().span.start;
  const std::size_t count = segments.size();
  window.labels = likely_words_.complete(labelsOf(std::move(segments), window.origin, language_));
  MOUTHPIECE_EXPECT(window.labels.phones.size() == count);
  window.predicted =
      std::make_shared<PredictedLine>(*database_.corpus().trajectory_model, window.labels, LinePrediction::Keeps::kAll);
  return window;
}

/// What is likely after the last phone that is known: what the corpus says most often after as many of the last phones
/// as it has in a row.
void LiveMotion::addLikelyFuture(std::vector<PhoneSegment>& segments) const {
  constexpr Seconds kFuture = 0.400, kSilence = 0.250;
  constexpr std::size_t kMostContext = 5, kMostPlaces = 300;
  const Seconds end = segments.back().span.end;
  std::vector<Phone> said;
  for (const PhoneSegment& segment : segments) said.push_back(segment.phone);
  while (!isSilent(segments.back()) && segments.back().span.end < end + kFuture) {
    struct Follower {
      std::size_t count = 0;
      Seconds length = 0;
    };
    std::array<Follower, kPhoneCount> followers{};
    bool any = false;
    for (std::size_t context = std::min(kMostContext, said.size()); context > 0 && !any; --context) {
      const std::vector<PhonePlace> places = database_.index().placesOf(std::span(said).last(context));
      const std::size_t every = places.size() / kMostPlaces + 1;
      for (std::size_t i = 0; i < places.size(); i += every) {
        const PhonePlace next = advance(places[i], context);
        if (next.phone.value >= database_.takeOf(next).labels.phones.size()) continue;
        const LabelledPhone& phone = database_.phoneAt(next);
        Follower& follower = followers[static_cast<std::size_t>(phone.phone)];
        ++follower.count;
        follower.length += phone.span.duration();
        any = true;
      }
    }
    const auto likeliest = std::max_element(followers.begin(), followers.end(),
                                            [](const Follower& a, const Follower& b) { return a.count < b.count; });
    const auto phone = any ? static_cast<Phone>(likeliest - followers.begin()) : Phone::kSil;
    const Seconds length = phone == Phone::kSil ? kSilence : likeliest->length / asReal(likeliest->count);
    const Seconds from = segments.back().span.end;
    segments.push_back({.phone = phone, .span = {from, from + length}});
    said.push_back(phone);
  }
  if (!isSilent(segments.back())) {
    const Seconds from = segments.back().span.end;
    segments.push_back({.phone = Phone::kSil, .span = {from, from + kSilence}});
  }
}

std::vector<SelectedUnit> LiveMotion::unitsFor(const Window& window) const {
  SelectionOptions selection = options_.selection;
  selection.predicted = window.predicted;
  const std::size_t pairs = window.labels.phones.size() - 1;
  for (std::size_t i = 0; i < pairs && window.first + i + 1 < said_.size(); ++i)
    selection.settled.push_back(i == 0 && !isSilent(said_[window.first].segment) ? std::nullopt
                                                                                 : said_[window.first + i].place);
  selection.settled.resize(std::max<std::size_t>(1, selection.settled.size()));
  if (!isCovered(window.labels, database_, selection)) return {};
  return selectUnits(window.labels, database_, selection);
}

void LiveMotion::settle(const Window& window, const std::vector<SelectedUnit>& units, Seconds shown_until) {
  for (const SelectedUnit& unit : units) {
    for (std::size_t i = unit.phones.first.value; i < unit.phones.last.value; ++i) {
      const std::size_t said = window.first + i;
      if (said + 1 >= said_.size() || said_[said + 1].segment.span.start > shown_until) return;
      if (i == 0 && !isSilent(said_[said].segment)) continue;  // it only stands for a silence
      if (!said_[said].place) said_[said].place = advance(unit.source, i - unit.phones.first.value);
    }
  }
}

LiveFrames LiveMotion::resting(std::size_t count) const {
  const MarkerPositions& neutral = database_.corpus().neutral_pose_mm;
  LiveFrames frames;
  frames.positions_mm =
      Eigen::Map<const Eigen::RowVectorXd>(neutral.data(), neutral.size()).replicate(signedIndex(count), 1);
  frames.lips.assign(count, LipPose{1, 0});
  frames.tongue.assign(count, TonguePose{});
  return frames;
}

LiveFrames LiveMotion::renderPhrase(std::size_t count, const Window& window) {
  // The frame before the first is rendered, too: it says how far this window departs from what was shown.
  const auto around = static_cast<std::size_t>(std::ceil(kAround * options_.frame_rate_hz));
  const std::size_t before = std::min(around, next_frame_), frames = before + count + around;
  LiveFrames whole;
  std::vector<double> touching(frames, 0.0);
  if (window.is_silent) {
    whole = resting(frames);
  } else {
    std::vector<Seconds> times;
    for (std::size_t i = 0; i < frames; ++i) times.push_back(timeOf(next_frame_ - before + i) - window.origin);
    const std::vector<SelectedUnit> units = unitsFor(window);
    const std::vector<SelectedUnit> near = unitsNear(units, window.labels, times);
    const LineToRender line{window.labels, options_,       database_,    *options_.curves.model, times, {}, {}, {},
                            &predictions_, &recent_joins_, window.origin};
    const auto columns = database_.corpus().neutral_pose_mm.size();
    PositionMatrix residuals = near.empty() ? PositionMatrix(PositionMatrix::Zero(signedIndex(frames), columns))
                                            : blendUnits(near, times, line, true).positions_mm;
    ContextOptions context = options_.context;
    context.hear = false;
    context.predicted = window.predicted;
    whole.positions_mm =
        transferContext(std::move(residuals), window.labels, database_, near, times, context).positions_mm;
    whole.lips = lipsFromPhones(window.labels, times);
    whole.tongue = tongueFromPhones(window.labels, times);
    touching = touchingLips(window.labels, times);
    settle(window, units, timeOf(next_frame_ + count - 1));
  }
  const auto first = signedIndex(before);
  if (shown_.size() > 0 && before > 0) led_ = shown_ - rowOf(whole, first - 1);
  LiveFrames made{whole.positions_mm.middleRows(first, signedIndex(count)),
                  {whole.lips.begin() + first, whole.lips.begin() + first + signedIndex(count)},
                  {whole.tongue.begin() + first, whole.tongue.begin() + first + signedIndex(count)}};
  for (Eigen::Index i = 0; i < signedIndex(count); ++i) {
    const Seconds since = asReal(i + 1) / options_.frame_rate_hz;
    Eigen::RowVectorXd row = rowOf(made, i);
    const double free = 1 - touching[unsignedIndex(first + i)];  // of what would part lips that touch
    if (led_.size() == row.size()) row += free * blendWeight(BlendKind::kSmooth, since / kLedAway) * led_;
    setRow(made, i, row);
    shown_ = row;
  }
  next_frame_ += count;
  return made;
}

LiveFrames LiveMotion::render(std::size_t count, std::span<const PhoneSegment> guess) {
  LiveFrames all;
  all.positions_mm.resize(0, database_.corpus().neutral_pose_mm.size());
  while (all.lips.size() < count) {
    const TimeSpan frames{timeOf(next_frame_), timeOf(next_frame_ + count - all.lips.size())};
    const Window window = windowAt(frames, guess);
    std::size_t now = 1;
    while (all.lips.size() + now < count && timeOf(next_frame_ + now) < window.until) ++now;
    const LiveFrames part = renderPhrase(now, window);
    all.positions_mm.conservativeResize(all.positions_mm.rows() + signedIndex(now), Eigen::NoChange);
    all.positions_mm.bottomRows(signedIndex(now)) = part.positions_mm;
    all.lips.insert(all.lips.end(), part.lips.begin(), part.lips.end());
    all.tongue.insert(all.tongue.end(), part.tongue.begin(), part.tongue.end());
  }
  forget();
  return all;
}

void LiveMotion::skip(std::size_t count, const LiveFrames& last) {
  next_frame_ += count;
  shown_ = rowOf(last, 0);
}

void LiveMotion::forget() {
  const Seconds time = timeOf(next_frame_);
  while (said_.size() > 2 && said_[1].segment.span.end < time - kKept) said_.pop_front();
}

}  // namespace mouthpiece
