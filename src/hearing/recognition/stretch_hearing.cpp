#include "hearing/recognition/stretch_hearing.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/index.h"

namespace mouthpiece {

StretchHearing::StretchHearing(Eigen::MatrixXf posteriors, const Eigen::MatrixXf& likeness)
    : posteriors_(std::move(posteriors)),
      likeness_(likeness),
      row_(likeliestPhones(posteriors_, likeness_, kFurtherPhone)) {
  double frames = 0;
  for (const HeardPhone& phone : row_) {
    if (phone.phone == Phone::kSil) continue;
    const Eigen::Index count = signedIndex(phone.end - phone.first);
    const auto heard = posteriors_.middleCols(signedIndex(phone.first), count);
    fit_ += double{(likeness_.row(static_cast<Eigen::Index>(phone.phone)) * heard).sum()};
    frames += asReal(count);
  }
  fit_ /= std::max(frames, 1.0);
  heard_for_ = frames * kEarStep;
}

std::pair<Eigen::Index, Eigen::Index> StretchHearing::framesOf(const TimeSpan& span) const {
  const auto frame = [&](Seconds time, Eigen::Index least) {
    return std::clamp<Eigen::Index>(std::lround((time - kEarShift) / kEarStep), least, posteriors_.cols());
  };
  const Eigen::Index first = frame(span.start, 0);
  return {first, frame(span.end, first)};
}

double StretchHearing::fitOf(Phone phone, const TimeSpan& span) const {
  const auto [first, end] = framesOf(span);
  if (end <= first) return 0;
  return (likeness_.row(signedIndex(static_cast<std::size_t>(phone))) * posteriors_.middleCols(first, end - first))
      .mean();
}

double StretchHearing::apartFrom(const SpeechLabels& words) const {
  std::vector<Phone> row;
  for (const HeardPhone& phone : row_) {
    if (phone.phone != Phone::kSil) row.push_back(phone.phone);
  }
  std::vector<std::size_t> changes(row.size() + 1);
  std::iota(changes.begin(), changes.end(), 0U);
  std::size_t count = 0;
  for (const LabelledPhone& phone : words.phones) {
    if (phone.phone == Phone::kSil) continue;
    std::size_t before = std::exchange(changes[0], ++count);
    for (std::size_t i = 0; i < row.size(); ++i) {
      const std::size_t exchanged = before + (row[i] == phone.phone ? 0U : 1U);
      before = changes[i + 1];
      changes[i + 1] = std::min({exchanged, before + 1, changes[i] + 1});
    }
  }
  return asReal(changes.back()) / std::max(1.0, asReal(std::max(count, row.size())));
}

}  // namespace mouthpiece
