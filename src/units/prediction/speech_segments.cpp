#include "units/prediction/speech_segments.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace mouthpiece {
namespace {

constexpr Seconds kRelaxationLength = 0.25;  ///< after speech lips come together
constexpr Seconds kLeastRest = 0.1;
constexpr double kMostBreath = 0.6;       ///< of a pause
constexpr double kPauseShare = 0.4;       ///< of a neutral vowel, where pauses do not settle
constexpr double kFirstPartShare = 0.45;  ///< of a diphthong

constexpr double kClosurePace = 0.8;  ///< time constants relative to the component's own
constexpr double kSilencePace = 1.5;

/// A segment's class, as its neighbours see it.
std::string className(Viseme viseme) { return std::string(visemeName(viseme == Viseme::kEr ? Viseme::kUh : viseme)); }

constexpr std::string_view kInPause = "silence pause ";

struct Piece {
  SpeechSegment segment;
  std::string phone_feature;  ///< empty in silence
  Viseme viseme = Viseme::kSil;
};

Piece silencePiece(Seconds start, Seconds end, std::string_view name, bool in_pause = false) {
  Piece silence;
  silence.segment.span = {start, end};
  silence.segment.breath = name == "before";
  silence.segment.pace = SegmentPace::kSilence;
  if (!name.empty()) silence.segment.features.push_back({std::string("silence ").append(name)});
  if (!name.empty() && in_pause) silence.segment.features.push_back({std::string(kInPause).append(name)});
  return silence;
}

/// Between two phrases: the lips settle, rest, and open again, as far as there is time.
std::vector<Piece> pausePieces(const TimeSpan& span, const SilenceTiming& timing) {
  if (!timing.pauses_settle) {
    Piece pause = silencePiece(span.start, span.end, "");
    pause.segment.breath = true;
    pause.segment.features = {{"viseme " + className(Viseme::kUh), kPauseShare}};
    return {pause};
  }
  const Seconds breath = std::min(timing.breathIn(span.duration()), kMostBreath * span.duration());
  const Seconds opens = span.end - breath, settled = std::min(span.start + kRelaxationLength, opens);
  std::vector<Piece> pieces{silencePiece(span.start, settled, "after", true)};
  const bool has_rest = opens - settled > kLeastRest;
  if (has_rest) pieces.push_back(silencePiece(settled, opens, ""));
  pieces.push_back(silencePiece(has_rest ? opens : settled, span.end, "before", true));
  return pieces;
}

std::vector<Piece> silencePieces(const TimeSpan& span, bool first, bool last, const SilenceTiming& timing) {
  if (first && last) return {silencePiece(span.start, span.end, "")};
  if (first) {
    const Seconds breath = timing.breathIn(span.duration());
    if (span.duration() <= breath + kLeastRest) return {silencePiece(span.start, span.end, "before")};
    return {silencePiece(span.start, span.end - breath, ""), silencePiece(span.end - breath, span.end, "before")};
  }
  if (!last) return pausePieces(span, timing);
  if (span.duration() <= kRelaxationLength + kLeastRest) return {silencePiece(span.start, span.end, "after")};
  const Seconds cut = span.start + kRelaxationLength;
  return {silencePiece(span.start, cut, "after"), silencePiece(cut, span.end, "")};
}

std::vector<Piece> speechPieces(const LabelledPhone& phone) {
  const std::string name(phoneName(phone.phone));
  Piece whole;
  whole.segment.span = phone.span;
  whole.segment.phone = phone.phone;
  whole.segment.in_speech = true;
  whole.phone_feature = "phone " + name;
  whole.viseme = firstViseme(phone.phone);
  if (isBilabial(phone.phone) || isLabiodental(phone.phone)) whole.segment.pace = SegmentPace::kClosure;
  if (!isDiphthong(phone.phone)) return {whole};
  Piece second = whole;
  const Seconds cut = phone.span.start + kFirstPartShare * phone.span.duration();
  whole.segment.span.end = second.segment.span.start = cut;
  whole.phone_feature += " 1";
  second.phone_feature += " 2";
  second.viseme = lastViseme(phone.phone);
  second.segment.is_second_half = true;
  return {whole, second};
}

/// The label of P and B holds the burst, when the lips are open already; that of M ends when they part.
void giveBurstsToWhatFollows(std::vector<Piece>& pieces) {
  constexpr Seconds kBurst = 0.020;
  constexpr double kMostOfLabel = 0.4;
  for (std::size_t i = 0; i + 1 < pieces.size(); ++i) {
    SpeechSegment& stop = pieces[i].segment;
    if (!stop.in_speech || !isBilabial(stop.phone) || !isStop(stop.phone)) continue;
    stop.span.end -= std::min(kBurst, kMostOfLabel * stop.span.duration());
    pieces[i + 1].segment.span.start = stop.span.end;
  }
}

std::vector<Piece> cutIntoPieces(const SpeechLabels& labels, const SilenceTiming& timing) {
  std::vector<Piece> pieces;
  for (std::size_t i = 0; i < labels.phones.size(); ++i) {
    const LabelledPhone& phone = labels.phones[i];
    std::vector<Piece> next = phone.phone == Phone::kSil
                                  ? silencePieces(phone.span, i == 0, i + 1 == labels.phones.size(), timing)
                                  : speechPieces(phone);
    for (Piece& piece : next) piece.segment.label = i;
    pieces.insert(pieces.end(), next.begin(), next.end());
  }
  giveBurstsToWhatFollows(pieces);
  for (std::size_t i = pieces.size(); i-- > 0;) {  // HH has the mouth of what follows.
    if (pieces[i].viseme != Viseme::kH) continue;
    const bool vowel_follows = i + 1 < pieces.size() && pieces[i + 1].viseme != Viseme::kSil;
    pieces[i].viseme = vowel_follows ? pieces[i + 1].viseme : Viseme::kUh;
  }
  return pieces;
}

/// The features that a viseme brings in a context; `weight` below 1 for a mixture.
void addVisemeFeatures(std::vector<SegmentFeature>& features, Viseme viseme, const std::vector<std::string>& classes,
                       std::size_t index, double weight) {
  const std::string own(visemeName(viseme));
  const auto neighbour = [&](std::ptrdiff_t distance) -> const std::string& {
    static const std::string kNone = "-";
    const std::ptrdiff_t at = signedIndex(index) + distance;
    return at < 0 || at >= signedIndex(classes.size()) ? kNone : classes[unsignedIndex(at)];
  };
  features.push_back({"viseme " + own, weight});
  features.push_back({"left " + own + " " + neighbour(-1), weight});
  features.push_back({"right " + own + " " + neighbour(1), weight});
  features.push_back({"left2 " + own + " " + neighbour(-2), weight});
  features.push_back({"right2 " + own + " " + neighbour(2), weight});
}

void addSilenceFeatures(SpeechSegment& silence, const std::vector<std::string>& classes, std::size_t index) {
  if (silence.features.empty()) return;  // rest
  const std::string name = silence.features.front().name;
  if (!name.starts_with("silence ")) return;  // pause
  if (index > 0) silence.features.push_back({name + " left " + classes[index - 1]});
  if (index + 1 < classes.size()) silence.features.push_back({name + " right " + classes[index + 1]});
}

constexpr double kDone = 40;  // e^-40: over to the last bit

double paceFactor(SegmentPace pace) {
  return pace == SegmentPace::kClosure ? kClosurePace : pace == SegmentPace::kSilence ? kSilencePace : 1.0;
}

}  // namespace

Seconds SilenceTiming::breathIn(Seconds silence) const {
  constexpr Seconds kHalfSecond = 0.5;
  // Readers refuse a least over the most; where one is made all the same the most counts.
  const Seconds breath = breath_at_half_second + breath_share * (silence - kHalfSecond);
  return std::min(std::max(breath, least_breath), most_breath);
}

std::vector<SpeechSegment> speechSegments(const SpeechLabels& labels, const SilenceTiming& timing) {
  std::vector<Piece> pieces = cutIntoPieces(labels, timing);
  std::vector<std::string> classes;
  for (const Piece& piece : pieces) classes.push_back(className(piece.viseme));
  std::vector<SpeechSegment> segments;
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    SpeechSegment segment = pieces[i].segment;
    if (!segment.in_speech) {
      addSilenceFeatures(segment, classes, i);
    } else {
      segment.features.push_back({pieces[i].phone_feature});
      if (pieces[i].viseme == Viseme::kEr) {
        addVisemeFeatures(segment.features, Viseme::kR, classes, i, 0.5);
        addVisemeFeatures(segment.features, Viseme::kUh, classes, i, 0.5);
      } else {
        addVisemeFeatures(segment.features, pieces[i].viseme, classes, i, 1.0);
      }
    }
    segments.push_back(std::move(segment));
  }
  return segments;
}

double movementStep(Seconds time, Seconds time_constant) {
  if (time <= 0) return 0;
  if (time > kDone * time_constant) return 1;
  // 1 - exp(-x) (1 + x + ... + x^(n-1) / (n-1)!): the integral of n exponential stages in a row.
  const double x = time / time_constant;
  double term = 1, sum = 1;
  for (int stage = 1; stage < kMovementStages; ++stage) {
    term *= x / stage;
    sum += term;
  }
  return 1 - std::exp(-x) * sum;
}

namespace {

/// Into a segment. The response is half done about n stages after its input steps: the input comes that much earlier.
struct Movement {
  Movement(const SpeechSegment& segment, Seconds time_constant, Seconds lead)
      : stage(time_constant * paceFactor(segment.pace)),
        begin(segment.span.start - lead - kMovementStages * stage),
        end(begin + kDone * stage) {}
  [[nodiscard]] double at(Seconds time) const { return movementStep(time - begin, stage); }

  Seconds stage, begin, end;
};

}  // namespace

Eigen::MatrixXd segmentWeights(const std::vector<SpeechSegment>& segments, Seconds time_constant, Seconds lead,
                               std::span<const Seconds> times) {
  const auto rows = signedIndex(times.size());
  const auto count = signedIndex(segments.size());
  Eigen::MatrixXd weights = Eigen::MatrixXd::Zero(rows, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Movement movement(segments[unsignedIndex(i)], time_constant, lead);
    for (Eigen::Index row = 0; row < rows; ++row) {
      const double step = i == 0 ? 1.0 : movement.at(times[unsignedIndex(row)]);
      weights(row, i) += step;
      if (i > 0) weights(row, i - 1) -= step;
    }
  }
  return weights;
}

Eigen::MatrixXd segmentWeights(const std::vector<SpeechSegment>& segments, Seconds time_constant, Seconds lead,
                               double frame_rate_hz, std::size_t frame_count) {
  std::vector<Seconds> times;
  for (std::size_t frame = 0; frame < frame_count; ++frame) {
    times.push_back(asReal(frame) / frame_rate_hz);
  }
  return segmentWeights(segments, time_constant, lead, times);
}

Eigen::MatrixXd segmentResponse(const std::vector<SpeechSegment>& segments, Seconds time_constant, Seconds lead,
                                std::span<const Seconds> times, const Eigen::MatrixXd& targets) {
  std::vector<Movement> movements;
  for (const SpeechSegment& segment : segments) movements.emplace_back(segment, time_constant, lead);
  // When all up to a movement are over, and before when none from it on has begun; both only rise.
  std::vector<Seconds> over(movements.size()), begun(movements.size());
  for (std::size_t i = 0; i < movements.size(); ++i)
    over[i] = i == 0 ? std::numeric_limits<Seconds>::lowest() : std::max(over[i - 1], movements[i].end);
  for (std::size_t i = movements.size(); i-- > 0;)
    begun[i] = i + 1 == movements.size() ? movements[i].begin : std::min(begun[i + 1], movements[i].begin);
  Eigen::MatrixXd response(signedIndex(times.size()), targets.cols());
  for (Eigen::Index row = 0; row < response.rows(); ++row) {
    const Seconds time = times[unsignedIndex(row)];
    auto next = unsignedIndex(std::upper_bound(over.begin(), over.end(), time) - over.begin());
    response.row(row) = targets.row(signedIndex(next) - 1);  // the first was always over
    for (; next < movements.size() && begun[next] < time; ++next) {
      const auto to = signedIndex(next);
      response.row(row) += movements[next].at(time) * (targets.row(to) - targets.row(to - 1));
    }
  }
  return response;
}

}  // namespace mouthpiece
