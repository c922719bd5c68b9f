#include "corpus_tools/takes/lip_measures.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "motion/lip_gauge.h"

namespace mouthpiece {
namespace {

constexpr Seconds kClosureReach = 0.02;  ///< beyond both ends of a B P M F V: label error
constexpr double kClosureShare = 0.25;   ///< of the curve's own range of openings
constexpr Seconds kProbeStep = 0.005;    ///< openings between the frames are read off straight lines
constexpr double kLeastRangeMm = 1.0;    ///< a mouth that moves less has no closures

double meanOf(const std::vector<double>& values) {
  return LipMeasures::ratio(std::accumulate(values.begin(), values.end(), 0.0), asReal(values.size()));
}

bool isMeasured(const MeasuredStretches& stretches, Seconds time) {
  return stretches.empty() || std::any_of(stretches.begin(), stretches.end(), [&](const TimeSpan& stretch) {
           return time >= stretch.start && time < stretch.end;
         });
}

/// Pearson's r over the frames that both have; NaN for fewer than three or a constant.
double correlation(const std::vector<double>& a, const std::vector<double>& b) {
  double n = 0, mean_a = 0, mean_b = 0, spread_a = 0, spread_b = 0, common = 0;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
    if (!std::isfinite(a[i]) || !std::isfinite(b[i])) continue;
    n += 1;
    const double step_a = a[i] - mean_a, step_b = b[i] - mean_b;  // Welford: a flat curve stays flat to the last bits
    mean_a += step_a / n, mean_b += step_b / n;
    spread_a += step_a * (a[i] - mean_a), spread_b += step_b * (b[i] - mean_b);
    common += step_a * (b[i] - mean_b);
  }
  if (n < 3 || spread_a < 1e-9 || spread_b < 1e-9) return std::numeric_limits<double>::quiet_NaN();
  return common / std::sqrt(spread_a * spread_b);
}

/// Standard deviation of the finite values; 0 of none.
double spread(const std::vector<double>& values) {
  double n = 0, mean = 0, squares = 0;
  for (const double value : values) {
    if (!std::isfinite(value)) continue;
    n += 1;
    const double step = value - mean;
    mean += step / n;
    squares += step * (value - mean);
  }
  return n > 0 ? std::sqrt(squares / n) : 0;
}

/// The lip coordinates of both clips in the frames where all lips are seen in both, the constant difference taken off.
struct LipFrames {
  std::vector<std::size_t> frames;
  Eigen::MatrixXd captured, synthesised;  ///< frames x (3 * lip markers)
};

std::vector<Eigen::Index> lipColumns(const MarkerLayout& layout) {
  std::vector<Eigen::Index> columns;
  for (std::size_t marker = 0; marker < layout.markers.size(); ++marker) {
    if (layout.markers[marker].region != "lip") continue;
    for (std::size_t axis = 0; axis < 3; ++axis) columns.push_back(signedIndex(3 * marker + axis));
  }
  return columns;
}

LipFrames commonLipFrames(const MotionClip& captured, const MotionClip& synthesised, const MarkerLayout& layout) {
  const std::vector<Eigen::Index> columns = lipColumns(layout);
  LipFrames lips;
  for (std::size_t frame = 0; frame < std::min(captured.frameCount(), synthesised.frameCount()); ++frame) {
    const auto row = signedIndex(frame);
    const bool seen = std::all_of(columns.begin(), columns.end(), [&](Eigen::Index column) {
      return std::isfinite(captured.positions_mm(row, column)) && std::isfinite(synthesised.positions_mm(row, column));
    });
    if (seen) lips.frames.push_back(frame);
  }
  const auto rows = signedIndex(lips.frames.size());
  lips.captured.resize(rows, signedIndex(columns.size()));
  lips.synthesised.resize(rows, signedIndex(columns.size()));
  for (Eigen::Index i = 0; i < rows; ++i) {
    const auto row = signedIndex(lips.frames[unsignedIndex(i)]);
    for (std::size_t c = 0; c < columns.size(); ++c) {
      lips.captured(i, signedIndex(c)) = captured.positions_mm(row, columns[c]);
      lips.synthesised(i, signedIndex(c)) = synthesised.positions_mm(row, columns[c]);
    }
  }
  if (rows > 0) {
    const Eigen::RowVectorXd offset = lips.synthesised.colwise().mean() - lips.captured.colwise().mean();
    lips.synthesised.rowwise() -= offset;
  }
  return lips;
}

/// Frames in the stretches alone.
LipFrames within(const LipFrames& lips, const MeasuredStretches& stretches, double frame_rate_hz) {
  if (stretches.empty()) return lips;
  LipFrames part;
  std::vector<Eigen::Index> rows;
  for (std::size_t i = 0; i < lips.frames.size(); ++i) {
    if (!isMeasured(stretches, asReal(lips.frames[i]) / frame_rate_hz)) continue;
    part.frames.push_back(lips.frames[i]);
    rows.push_back(signedIndex(i));
  }
  part.captured = lips.captured(rows, Eigen::all);
  part.synthesised = lips.synthesised(rows, Eigen::all);
  return part;
}

void addErrors(const LipFrames& lips, LipMeasures& measures) {
  const Eigen::MatrixXd difference = lips.synthesised - lips.captured;
  measures.frames = lips.frames.size();
  for (Eigen::Index frame = 0; frame < difference.rows(); ++frame) {
    double largest = 0;
    for (Eigen::Index column = 0; column < difference.cols(); column += 3) {
      const double squared = difference.block<1, 3>(frame, column).squaredNorm();
      measures.squared_error_mm2 += squared;
      ++measures.squared_errors;
      largest = std::max(largest, squared);
    }
    measures.largest_squared_mm2 += largest;
  }
}

double variance(const Eigen::MatrixXd& values) {
  return values.rows() > 0 ? (values.rowwise() - values.colwise().mean()).squaredNorm() : 0.0;
}

/// Squared third differences over runs of frames in a row.
double squaredJerk(const Eigen::MatrixXd& values, const std::vector<std::size_t>& frames) {
  double sum = 0;
  for (Eigen::Index i = 3; i < values.rows(); ++i) {
    if (frames[unsignedIndex(i)] != frames[unsignedIndex(i - 3)] + 3) continue;
    sum += (values.row(i) - 3 * values.row(i - 1) + 3 * values.row(i - 2) - values.row(i - 3)).squaredNorm();
  }
  return sum;
}

/// An opening curve and the level under which the mouth counts as closed.
struct Opening {
  std::vector<double> mm;
  double frame_rate_hz = 0;
  double closed_below_mm = 0;

  [[nodiscard]] double at(Seconds time) const {
    const double frame = std::clamp(time * frame_rate_hz, 0.0, asReal(mm.size() - 1));
    const auto before = static_cast<std::size_t>(frame);
    const std::size_t after = std::min(before + 1, mm.size() - 1);
    const double share = frame - asReal(before);
    return share > 0 ? (1 - share) * mm[before] + share * mm[after] : mm[before];
  }
  [[nodiscard]] bool closesIn(const LabelledPhone& phone) const {
    // Others than B P M F V get no reach: they would be charged with their neighbours' closures.
    const Seconds reach = isBilabial(phone.phone) || isLabiodental(phone.phone) ? kClosureReach : 0;
    for (Seconds time = phone.span.start - reach; time <= phone.span.end + reach; time += kProbeStep) {
      if (at(time) < closed_below_mm) return true;
    }
    return false;
  }
};

Opening openingOf(const std::vector<double>& mm, double frame_rate_hz) {
  Opening opening{mm, frame_rate_hz, -1};
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const double value : mm) {
    if (!std::isfinite(value)) continue;
    low = std::min(low, value);
    high = std::max(high, value);
  }
  if (high - low >= kLeastRangeMm) opening.closed_below_mm = low + kClosureShare * (high - low);
  return opening;
}

void addClosures(const Opening& captured, const Opening& synthesised, const SpeechLabels& labels,
                 const MeasuredStretches& stretches, LipMeasures& measures) {
  if (captured.mm.empty() || synthesised.mm.empty()) return;
  for (const LabelledPhone& phone : labels.phones) {
    if (phone.phone == Phone::kSil || isLabiodental(phone.phone)) continue;
    if (!isMeasured(stretches, phone.span.middle())) continue;
    const bool closes = captured.closesIn(phone);
    const bool shut = synthesised.closesIn(phone);
    if (isVowel(phone.phone)) {
      ++measures.vowels;
      measures.vowels_shut += shut ? 1U : 0U;
      measures.captured_vowels_shut += closes ? 1U : 0U;
    }
    if (isBilabial(phone.phone) && closes) {
      ++measures.closures;
      if (shut) ++measures.closures_kept;
    } else if (!isBilabial(phone.phone) && !closes) {
      ++measures.open_phones;
      if (shut) ++measures.false_closures;
    }
  }
}

void addContacts(const Opening& captured, const Opening& synthesised, const SpeechLabels& labels,
                 const MeasuredStretches& stretches, LipMeasures& measures) {
  if (captured.mm.empty() || synthesised.mm.empty()) return;
  for (const LabelledPhone& phone : labels.phones) {
    if (!isLabiodental(phone.phone) || !isMeasured(stretches, phone.span.middle())) continue;
    if (!captured.closesIn(phone)) continue;
    ++measures.contacts;
    if (synthesised.closesIn(phone)) ++measures.contacts_kept;
  }
}

}  // namespace

double LipMeasures::ratio(double part, double whole) {
  return whole > 0 ? part / whole : std::numeric_limits<double>::quiet_NaN();
}
double LipMeasures::openingCorrelation() const { return meanOf(opening_r); }
double LipMeasures::widthCorrelation() const { return meanOf(width_r); }
double LipMeasures::protrusionCorrelation() const { return meanOf(protrusion_r); }

LipMeasures& LipMeasures::operator+=(const LipMeasures& other) {
  using M = LipMeasures;
  for (const auto count :
       {&M::frames, &M::squared_errors, &M::closures, &M::closures_kept, &M::contacts, &M::contacts_kept,
        &M::open_phones, &M::false_closures, &M::vowels, &M::vowels_shut, &M::captured_vowels_shut})
    this->*count += other.*count;
  for (const auto sum : {&M::squared_error_mm2, &M::largest_squared_mm2, &M::variance_mm2, &M::captured_variance_mm2,
                         &M::jerk, &M::captured_jerk, &M::protrusion_spread_mm, &M::captured_protrusion_spread_mm})
    this->*sum += other.*sum;
  opening_r.insert(opening_r.end(), other.opening_r.begin(), other.opening_r.end());
  width_r.insert(width_r.end(), other.width_r.begin(), other.width_r.end());
  protrusion_r.insert(protrusion_r.end(), other.protrusion_r.begin(), other.protrusion_r.end());
  return *this;
}

LipMeasures measureLips(const MotionClip& captured, const MotionClip& synthesised, const SpeechLabels& labels,
                        const MarkerLayout& layout, const MeasuredStretches& stretches) {
  const LipGauge gauge = LipGauge::whole(layout);
  const auto curve = [&](LipGauge::Measure measure, const MotionClip& clip) {
    return gauge.overFrames(measure, clip.positions_mm);
  };
  const auto measured = [&](std::vector<double> values, double frame_rate_hz) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (!isMeasured(stretches, asReal(i) / frame_rate_hz)) values[i] = std::numeric_limits<double>::quiet_NaN();
    }
    return values;
  };
  LipMeasures measures;
  const LipFrames lips = within(commonLipFrames(captured, synthesised, layout), stretches, captured.frame_rate_hz);
  addErrors(lips, measures);
  measures.variance_mm2 = variance(lips.synthesised);
  measures.captured_variance_mm2 = variance(lips.captured);
  measures.jerk = squaredJerk(lips.synthesised, lips.frames);
  measures.captured_jerk = squaredJerk(lips.captured, lips.frames);
  // A flat curve has no correlation; it counts as none rather than dropping out of the mean.
  const auto correlationOf = [&](LipGauge::Measure measure) {
    const double r = correlation(measured(curve(measure, captured), captured.frame_rate_hz),
                                 measured(curve(measure, synthesised), synthesised.frame_rate_hz));
    return std::isfinite(r) ? r : 0.0;
  };
  const auto spreadOf = [&](const MotionClip& clip) {
    return spread(measured(curve(&LipGauge::protrusion, clip), clip.frame_rate_hz));
  };
  measures.opening_r.push_back(correlationOf(&LipGauge::opening));
  measures.width_r.push_back(correlationOf(&LipGauge::width));
  measures.protrusion_r.push_back(correlationOf(&LipGauge::protrusion));
  measures.protrusion_spread_mm = spreadOf(synthesised);
  measures.captured_protrusion_spread_mm = spreadOf(captured);
  const auto openingIn = [&](const MotionClip& clip, LipGauge::Measure measure) {
    return openingOf(curve(measure, clip), clip.frame_rate_hz);
  };
  addClosures(openingIn(captured, &LipGauge::opening), openingIn(synthesised, &LipGauge::opening), labels, stretches,
              measures);
  addContacts(openingIn(captured, &LipGauge::lowerLipDrop), openingIn(synthesised, &LipGauge::lowerLipDrop), labels,
              stretches, measures);
  return measures;
}

}  // namespace mouthpiece
