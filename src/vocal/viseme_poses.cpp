#include "vocal/viseme_poses.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/errors.h"
#include "base/index.h"
#include "base/matrix_solvers.h"
#include "base/statistics.h"
#include "vocal/viseme_curves.h"

namespace mouthpiece {
namespace {

constexpr Eigen::Index kVisemes = signedIndex(kVisemeCount);

/// All frames in which every marker was seen, as displacements from the take's own rest, beside the values of the
/// curves there: from take to take a face rests a little differently, which no viseme explains.
struct Observations {
  PositionMatrix displacements;
  Eigen::MatrixXd lips, jaw;                                   ///< frames x visemes
  Eigen::VectorXd activity = Eigen::VectorXd::Zero(kVisemes);  ///< sum of each jaw curve, before
};

constexpr Seconds kUnrest = 0.25;  ///< beside speech, when a silent face still moves
constexpr double kRateHz = 25;     ///< of the frames learnt from, at least

/// Frames within the phones or a little beside them; the face at rest says nothing about visemes.
bool isNearSpeech(const SpeechLabels& labels, Seconds time) {
  constexpr Seconds kMargin = 0.3;
  if (labels.phones.size() < 3) return false;
  return time > labels.phones.front().span.end - kMargin && time < labels.phones.back().span.start + kMargin;
}

/// The mean of the frames in which nothing is said, nor just before or after; the neutral pose where there are none.
Eigen::RowVectorXd restOf(const PoseTake& take, const Eigen::RowVectorXd& neutral) {
  Eigen::RowVectorXd sum = Eigen::RowVectorXd::Zero(neutral.size());
  double count = 0;
  for (const LabelledPhone& phone : take.labels->phones) {
    if (phone.phone != Phone::kSil) continue;
    const bool is_first = &phone == &take.labels->phones.front(), is_last = &phone == &take.labels->phones.back();
    const TimeSpan still{phone.span.start + (is_first ? 0 : kUnrest), phone.span.end - (is_last ? 0 : kUnrest)};
    for (std::size_t frame = 0; frame < take.motion->frameCount(); ++frame) {
      const auto row = take.motion->positions_mm.row(signedIndex(frame));
      if (!still.contains(take.motion->timeOf(FrameIndex(frame))) || !row.allFinite()) continue;
      sum += row;
      ++count;
    }
  }
  return count > 0 ? Eigen::RowVectorXd(sum / count) : neutral;
}

/// Of those near speech in which all is seen, so many as tell something new: neighbours of a fast capture say the same.
std::vector<std::size_t> framesToLearnFrom(const PoseTake& take) {
  const auto stride = static_cast<std::size_t>(std::max(1.0, std::floor(take.motion->frame_rate_hz / kRateHz)));
  std::vector<std::size_t> frames;
  for (std::size_t frame = 0; frame < take.motion->frameCount(); frame += stride) {
    const bool tells = isNearSpeech(*take.labels, take.motion->timeOf(FrameIndex(frame))) &&
                       take.motion->positions_mm.row(signedIndex(frame)).allFinite();
    if (tells) frames.push_back(frame);
  }
  return frames;
}

Observations observe(const std::vector<PoseTake>& takes, const MarkerPositions& neutral) {
  const Eigen::Map<const Eigen::RowVectorXd> rest(neutral.data(), neutral.size());
  std::vector<std::vector<std::size_t>> frames_of;
  std::size_t rows = 0;
  for (const PoseTake& take : takes) rows += frames_of.emplace_back(framesToLearnFrom(take)).size();
  Observations all;
  all.displacements.resize(signedIndex(rows), rest.size());
  all.lips.setZero(signedIndex(rows), kVisemes);
  all.jaw.setZero(signedIndex(rows), kVisemes);
  Eigen::Index row = 0;
  auto frames_now = frames_of.begin();
  for (const PoseTake& take : takes) {
    const Eigen::Index first_row = row;
    const Eigen::RowVectorXd own_rest = restOf(take, rest);
    const std::vector<std::size_t>& frames = *frames_now++;
    std::vector<Seconds> times;
    for (const std::size_t frame : frames) times.push_back(take.motion->timeOf(FrameIndex(frame)));
    const CurveSet curves = visemeCurves(*take.labels, {}, {});
    for (Eigen::Index v = 1; v < kVisemes; ++v) {
      const auto viseme = static_cast<Viseme>(v);
      const AnimationCurve* lip_curve = findCurve(curves, visemeName(viseme));
      const AnimationCurve* jaw_curve = findCurve(curves, jawCurveName(viseme));
      if (lip_curve == nullptr) continue;
      const std::vector<double> values = sampleCurve(*lip_curve, times);
      const std::vector<double> jaw_values = jaw_curve == nullptr ? values : sampleCurve(*jaw_curve, times);
      for (std::size_t k = 0; k < times.size(); ++k) {
        all.lips(row + signedIndex(k), v) = values[k];
        all.jaw(row + signedIndex(k), v) = jaw_values[k];
      }
    }
    for (const std::size_t frame : frames)
      all.displacements.row(row++) = take.motion->positions_mm.row(signedIndex(frame)) - own_rest;
    const Eigen::Index count = row - first_row;
    if (count == 0) continue;
    for (Eigen::Index v = 0; v < kVisemes; ++v) all.activity(v) += all.jaw.col(v).segment(first_row, count).sum();
  }
  return all;
}

/// Weights W with least |values - features W|^2 + ridge |W|^2.
Eigen::MatrixXd ridge(const Eigen::MatrixXd& features, const Eigen::MatrixXd& values, double ridge_frames) {
  Eigen::MatrixXd normal = features.transpose() * features;
  normal.diagonal().array() += ridge_frames;
  return solveSymmetric(std::move(normal), features.transpose() * values);
}

/// What every coordinate does, on average, as `driver` grows by 1.
Eigen::RowVectorXd responseTo(const Eigen::VectorXd& driver, const PositionMatrix& displacements) {
  const double energy = driver.squaredNorm();
  if (!(energy > 0)) return Eigen::RowVectorXd::Zero(displacements.cols());
  return (driver.transpose() * displacements) / energy;
}

/// How far the lips are open in contacts, mm.
struct Contacts {
  double bilabial_mm, labiodental_mm, contact_mm;
};

/// Contacts as they were captured: the tightest opening of each B P M and F V, and how tight it ever gets.
Contacts learnContacts(const std::vector<PoseTake>& takes, const MarkerPositions& neutral, const LipGauge& mouth) {
  constexpr Seconds kAround = 0.02;
  constexpr double kUsualBilabial = 0.4, kUsualLabiodental = 2.0, kUsualContact = -0.8;  // mm, GRID s1
  const double rest = mouth.verticalOpening(Eigen::Map<const Eigen::RowVectorXd>(neutral.data(), neutral.size()));
  std::vector<double> bilabial, labiodental;
  for (const PoseTake& take : takes) {
    const PositionMatrix& rows = take.motion->positions_mm;
    for (const LabelledPhone& phone : take.labels->phones) {
      if (!isBilabial(phone.phone) && !isLabiodental(phone.phone)) continue;
      const double rate = take.motion->frame_rate_hz;
      const auto first = static_cast<Eigen::Index>(std::max(0.0, std::ceil((phone.span.start - kAround) * rate)));
      const auto last = std::min(static_cast<Eigen::Index>((phone.span.end + kAround) * rate), rows.rows() - 1);
      double tightest = std::numeric_limits<double>::infinity();
      for (Eigen::Index frame = first; frame <= last; ++frame) {
        const double opening = mouth.verticalOpening(rows.row(frame)) - rest;
        if (opening < tightest) tightest = opening;  // NaN is never less
      }
      if (std::isfinite(tightest)) (isBilabial(phone.phone) ? bilabial : labiodental).push_back(tightest);
    }
  }
  const double bilabial_mm = std::min(median(bilabial, kUsualBilabial), kUsualBilabial);
  return {bilabial_mm, std::max(bilabial_mm, median(labiodental, kUsualLabiodental)),
          std::min(kUsualContact, bilabial_mm - 0.5)};
}

/// Between the outer canthi, mm; 0 in a layout without them.
double widthOf(const MarkerPositions& neutral, const std::vector<std::string>& names) {
  const auto place = [&](std::string_view name) { return std::find(names.begin(), names.end(), name); };
  const auto right = place("CANTHUS_OUT_R"), left = place("CANTHUS_OUT_L");
  if (right == names.end() || left == names.end()) return 0;
  return (neutral.row(right - names.begin()) - neutral.row(left - names.begin())).norm();
}

/// One viseme's pose.
struct Pose {
  Eigen::RowVectorXd lips;
  double jaw_drop = 0;
};

/// The viseme's pose of another face that is 1 / `scale` as wide, by marker name; markers that it lacks stay.
Pose poseOf(const VisemePoses& generic, std::size_t viseme, double scale, const std::vector<std::string>& names) {
  Pose pose{Eigen::RowVectorXd::Zero(signedIndex(3 * names.size())), scale * generic.jaw_drop[viseme]};
  for (std::size_t marker = 0; marker < names.size(); ++marker) {
    const auto found = std::find(generic.marker_names.begin(), generic.marker_names.end(), names[marker]);
    if (found == generic.marker_names.end()) continue;
    pose.lips.segment<3>(signedIndex(3 * marker)) =
        scale * generic.lips.row(signedIndex(viseme)).segment<3>(3 * (found - generic.marker_names.begin()));
  }
  return pose;
}

/// A viseme that nobody has shown looks like its kin.
Pose poseOfKin(const VisemePoses& poses, std::size_t viseme) {
  const auto& [a, b] = rowOf(static_cast<Viseme>(viseme)).kin;
  if (a == Viseme::kSil) return {Eigen::RowVectorXd::Zero(poses.lips.cols()), 0};
  const auto first = static_cast<std::size_t>(a), second = static_cast<std::size_t>(b);
  return {0.5 * (poses.lips.row(signedIndex(first)) + poses.lips.row(signedIndex(second))),
          0.5 * (poses.jaw_drop[first] + poses.jaw_drop[second])};
}

std::vector<Eigen::Index> mouthColumns(const MarkerLayout& layout) {
  std::vector<Eigen::Index> columns;
  for (std::size_t marker = 0; marker < layout.markers.size(); ++marker) {
    const std::string& region = layout.markers[marker].region;
    if (region != "lip" && region != "chin") continue;
    for (Eigen::Index axis = 0; axis < 3; ++axis) columns.push_back(3 * signedIndex(marker) + axis);
  }
  return columns;
}

/// The poses with what they explain of the motion.
VisemePoses measured(VisemePoses poses, const Observations& seen, const MarkerLayout& layout) {
  const Eigen::Map<const Eigen::VectorXd> drops(poses.jaw_drop.data(), kVisemes);
  const Eigen::MatrixXd made = seen.lips * poses.lips + (seen.jaw * drops) * poses.jaw_direction;
  const Eigen::RowVectorXd mean = seen.displacements.colwise().mean();
  const Eigen::RowVectorXd variance = (seen.displacements.rowwise() - mean).colwise().squaredNorm();
  const Eigen::RowVectorXd rest = (seen.displacements - made).colwise().squaredNorm();
  const double frames = asReal(std::max<Eigen::Index>(1, seen.displacements.rows()));
  poses.variance_mm2 = variance.sum() / frames;
  poses.explained_mm2 = (variance - rest).sum() / frames;
  for (const Eigen::Index column : mouthColumns(layout)) {
    poses.lip_variance_mm2 += variance(column) / frames;
    poses.lip_explained_mm2 += (variance(column) - rest(column)) / frames;
  }
  return poses;
}

}  // namespace

VisemePoses fitVisemePoses(const std::vector<PoseTake>& takes, const MarkerPositions& neutral_mm,
                           const MarkerLayout& layout, const VisemePoses* generic, const PoseFitOptions& options) {
  VisemePoses poses;
  poses.marker_names = layout.markerNames();
  poses.mouth = LipGauge(layout);
  if (!poses.mouth.hasLips() || !poses.mouth.has(MarkerRole::kChin)) {
    throw InputError(layout.name, "", "found no LIP_UP_MID, LIP_LO_MID or CHIN_MID; expected them for viseme curves");
  }
  const Observations seen = observe(takes, neutral_mm);
  if (seen.displacements.rows() < kVisemes)
    throw InputError(layout.name, "", "has too few frames of speech to learn visemes from");
  const Eigen::VectorXd chin = -seen.displacements.col(poses.mouth.column(MarkerRole::kChin) + 1);
  poses.jaw_direction = responseTo(chin, seen.displacements);
  poses.opening_direction = responseTo(poses.mouth.verticalOpenings(seen.displacements), seen.displacements);
  const Contacts contacts = learnContacts(takes, neutral_mm, poses.mouth);
  poses.bilabial_mm = contacts.bilabial_mm;
  poses.labiodental_mm = contacts.labiodental_mm;
  poses.contact_mm = contacts.contact_mm;

  const Eigen::VectorXd drops = ridge(seen.jaw, chin, options.ridge_frames);
  std::copy(drops.begin(), drops.end(), poses.jaw_drop.begin());
  const PositionMatrix left = seen.displacements - (seen.jaw * drops) * poses.jaw_direction;
  poses.lips = ridge(seen.lips, left, options.ridge_frames);

  poses.face_width_mm = widthOf(neutral_mm, poses.marker_names);
  const bool both_widths = generic != nullptr && generic->face_width_mm > 0 && poses.face_width_mm > 0;
  const double scale = both_widths ? poses.face_width_mm / generic->face_width_mm : 1;
  const auto take = [&](std::size_t v, const Pose& pose) {
    poses.lips.row(signedIndex(v)) = pose.lips;
    poses.jaw_drop[v] = pose.jaw_drop;
  };
  for (std::size_t v = 1; v < kVisemeCount; ++v) {
    poses.frames_seen[v] = seen.activity(signedIndex(v));
    if (poses.frames_seen[v] >= options.least_frames_seen) continue;
    poses.frames_seen[v] = 0;
    take(v, generic != nullptr ? poseOf(*generic, v, scale, poses.marker_names)
                               : Pose{Eigen::RowVectorXd::Zero(poses.lips.cols())});
  }
  for (std::size_t v = 1; generic == nullptr && v < kVisemeCount; ++v) {
    if (poses.frames_seen[v] <= 0) take(v, poseOfKin(poses, v));
  }
  return measured(std::move(poses), seen, layout);
}

}  // namespace mouthpiece
