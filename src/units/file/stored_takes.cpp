#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <mutex>
#include <optional>
#include <unordered_map>

#include "base/errors.h"
#include "motion/position_limits.h"
#include "units/file/corpus_tables.h"
#include "units/file/packed_rows.h"

namespace mouthpiece {
namespace {

constexpr std::int64_t kMaxLabels = 1'000'000;             ///< phones, syllables or words of a take
constexpr std::int64_t kMaxFrames = 10'000'000;            ///< of a take: 23 hours at 120 Hz
constexpr std::int64_t kMaxSamples = 4LL * 3600 * 192000;  ///< of a take: four hours
constexpr int kMaxSampleRateHz = 768'000;

std::size_t countBetween(const CheckedQuery& row, int column, const char* what, std::int64_t least, std::int64_t most) {
  const std::int64_t value = row.integer(column);
  if (value < least || value > most) row.fail(fmt::format("found {} {}; expected {} to {}", value, what, least, most));
  return unsignedIndex(value);
}

/// Of `rows` rows of `row_bytes`; rows <= kMaxSamples and row_bytes <= 12 * 100 000 markers: the product fits 64 bits.
[[noreturn]] void failBlob(const CheckedQuery& row, std::string_view blob, std::size_t rows, std::size_t row_bytes) {
  row.fail(fmt::format("found {} bytes; expected {}, or as many packed", blob.size(), rows * row_bytes));
}

/// A sample not seen is NaN on all three axes; anything else is a position within reach of a face.
void checkPositions(const CheckedQuery& row, const FloatMatrix& positions) {
  if (positions.size() == 0 || positions.cwiseAbs().maxCoeff<Eigen::PropagateNaN>() <= kMaxPositionMm) return;
  for (Eigen::Index i = 0; i + 2 < positions.size(); i += 3) {
    const float* xyz = positions.data() + i;
    const bool unseen = std::isnan(xyz[0]) && std::isnan(xyz[1]) && std::isnan(xyz[2]);
    const bool seen =
        std::abs(xyz[0]) <= kMaxPositionMm && std::abs(xyz[1]) <= kMaxPositionMm && std::abs(xyz[2]) <= kMaxPositionMm;
    if (!seen && !unseen) {
      row.fail(fmt::format("frame {} marker {}: found ({}, {}, {}) mm", i / positions.cols(), i % positions.cols() / 3,
                           xyz[0], xyz[1], xyz[2]));
    }
  }
}

/// Of the take whose row of `motion` is at hand: of each frame, whether some marker is not seen in it.
std::vector<bool> readUnseen(const CheckedQuery& row, std::size_t frames, std::size_t markers) {
  const std::string_view blob = row.blob(1);
  const std::size_t row_bytes = 3 * markers * sizeof(float);
  if (blob.size() != frames * row_bytes) {
    std::optional<std::vector<bool>> unseen = unpackedUnseen(blob, frames, signedIndex(3 * markers));
    if (!unseen) failBlob(row, blob, frames, row_bytes);
    return std::move(*unseen);
  }
  std::vector<bool> unseen;
  std::vector<float> positions(3 * markers);
  for (std::size_t frame = 0; frame < frames; ++frame) {
    std::memcpy(positions.data(), blob.data() + frame * row_bytes, row_bytes);
    unseen.push_back(std::any_of(positions.begin(), positions.end(), [](float mm) { return std::isnan(mm); }));
  }
  return unseen;
}

/// Takes that are read when they are asked for.
class StoredTakes {
 public:
  struct Take {
    CorpusTake take;
    TakeSizes sizes;
  };

  StoredTakes(SqliteDatabase& database, StoredColumns stored)
      : file_(database.file()),
        stored_(std::move(stored)),
        rows_(database, "takes", CheckedQuery::ById()),
        labels_(database, CheckedQuery::FromId()) {}

  [[nodiscard]] std::size_t phoneCount(TakeIndex take) const { return stored_.columns->phoneCount(take); }

  [[nodiscard]] std::optional<TakeIndex> named(SqliteDatabase& database, std::string_view name) const {
    CheckedQuery row(database, "takes");
    for (std::size_t take = 0; row.next(); ++take) {
      if (row.text(1) == name && take < stored_.columns->takeCount()) return TakeIndex(take);
    }
    return std::nullopt;
  }

  const Take& of(TakeIndex take) {
    const auto found = known_.find(take.value);
    return found != known_.end() ? *found->second : *known_.emplace(take.value, read(take)).first->second;
  }

 private:
  std::unique_ptr<Take> read(TakeIndex take) {
    auto read = std::make_unique<Take>();
    rows_.find(signedIndex(take.value));
    read->sizes = readTake(rows_, file_, read->take);
    const LabelCounts before = stored_.before(take), next = stored_.before(TakeIndex(take.value + 1));
    const LabelCounts& counts = read->sizes.labels;
    if (before.phones + counts.phones != next.phones || before.words + counts.words != next.words ||
        before.syllables + counts.syllables != next.syllables)
      rows_.fail("has other labels than phone_columns");
    labels_.startAt(before);
    read->take.labels = labels_.read(take.value, counts);
    const PhoneColumns& columns = *stored_.columns;
    for (std::size_t i = 0; i < counts.phones; ++i) {
      const LabelledPhone& phone = read->take.labels.phones[i];
      if (phone.phone != columns.phones[before.phones + i] ||
          phone.span.duration() != columns.durations[before.phones + i])
        rows_.fail("has other phones than phone_columns");
    }
    return read;
  }

  std::string file_;
  StoredColumns stored_;
  CheckedQuery rows_;
  LabelReader labels_;
  std::unordered_map<std::size_t, std::unique_ptr<Take>> known_;
};

/// Keeps the file open.
class FileTakeSource : public TakeSource {
 public:
  /// `sizes` of all takes, or `stored` of a corpus with phone_columns.
  FileTakeSource(SqliteDatabase database, std::vector<TakeSizes> sizes, StoredColumns stored, const Corpus& corpus)
      : database_(std::move(database)),
        sizes_(std::move(sizes)),
        marker_names_(corpus.layout.markerNames()),
        motion_(database_, "motion", CheckedQuery::ById()),
        audio_(database_, "audio", CheckedQuery::ById()) {
    if (stored.columns != nullptr) takes_.emplace(database_, std::move(stored));
    if (corpus.trajectory_model == nullptr) return;
    shape_components_ = shapeComponents(*corpus.trajectory_model);
    shapes_.emplace(database_, "phone_shapes", CheckedQuery::ById());
  }

  [[nodiscard]] const CorpusTake& take(TakeIndex take) const override {
    const std::scoped_lock lock(mutex_);
    return takes_->of(take).take;
  }

  [[nodiscard]] std::optional<TakeIndex> takeNamed(std::string_view name) const override {
    const std::scoped_lock lock(mutex_);
    return takes_->named(database_, name);
  }

  [[nodiscard]] MotionClip load(TakeIndex take) const override {
    const std::scoped_lock lock(mutex_);
    motion_.find(signedIndex(take.value));
    MotionClip clip{sizesOf(take).frame_rate_hz, marker_names_, {}};
    readPositions(motion_, sizesOf(take).frames, clip);
    return clip;
  }

  [[nodiscard]] std::optional<std::vector<bool>> loadUnseen(TakeIndex take) const override {
    const std::scoped_lock lock(mutex_);
    motion_.find(signedIndex(take.value));
    return readUnseen(motion_, sizesOf(take).frames, marker_names_.size());
  }

  [[nodiscard]] PhoneShapes loadShapes(TakeIndex take) const override {
    const std::scoped_lock lock(mutex_);
    const std::size_t phones = phoneCount(take);
    shapes_->find(signedIndex(take.value));
    return readShapes(*shapes_, phones, shape_components_, 0, phones);
  }

  [[nodiscard]] PhoneShapes loadSomeShapes(TakeIndex take, std::size_t first, std::size_t count) const override {
    const std::scoped_lock lock(mutex_);
    shapes_->find(signedIndex(take.value));
    return readShapes(*shapes_, phoneCount(take), shape_components_, first, count);
  }

  [[nodiscard]] AudioClip loadAudio(TakeIndex take) const override {
    const std::scoped_lock lock(mutex_);
    audio_.find(signedIndex(take.value));
    AudioClip audio{sizesOf(take).sample_rate_hz, {}};
    readSamples(audio_, sizesOf(take).samples, audio);
    return audio;
  }

 private:
  [[nodiscard]] std::size_t phoneCount(TakeIndex take) const {
    return takes_ ? takes_->phoneCount(take) : sizes_[take.value].labels.phones;
  }
  [[nodiscard]] const TakeSizes& sizesOf(TakeIndex take) const {
    return takes_ ? takes_->of(take).sizes : sizes_[take.value];
  }

  mutable std::mutex mutex_;
  mutable SqliteDatabase database_;
  std::vector<TakeSizes> sizes_;
  std::vector<std::string> marker_names_;
  Eigen::Index shape_components_ = 0;
  mutable CheckedQuery motion_, audio_;
  mutable std::optional<CheckedQuery> shapes_;
  mutable std::optional<StoredTakes> takes_;
};

}  // namespace

void expectId(const CheckedQuery& row, std::size_t expected) {
  if (row.integer(0) != signedIndex(expected))
    row.fail(fmt::format("found id {}; expected {}", row.integer(0), expected));
}

TakeSizes readTake(const CheckedQuery& row, const std::string& file, CorpusTake& take) {
  TakeSizes size;
  take.name = row.text(1);
  take.text = row.text(2);
  size.labels.phones = countBetween(row, 3, "phones", 1, kMaxLabels);
  size.labels.syllables = countBetween(row, 4, "syllables", 0, kMaxLabels);
  size.labels.words = countBetween(row, 5, "words", 0, kMaxLabels);
  size.frames = countBetween(row, 6, "frames", 1, kMaxFrames);
  take.motion.frame_rate_hz = size.frame_rate_hz = row.real(7);
  expectFrameRate(size.frame_rate_hz, file, row.place());
  if (size.frame_rate_hz < 1)
    row.fail(fmt::format("found {} frames a second; expected at least 1", size.frame_rate_hz));
  size.samples = countBetween(row, 8, "samples", 0, kMaxSamples);
  size.sample_rate_hz = static_cast<int>(countBetween(row, 9, "samples a second", 0, kMaxSampleRateHz));
  take.audio.sample_rate_hz = size.sample_rate_hz;
  return size;
}

void readPositions(const CheckedQuery& row, std::size_t frames, MotionClip& clip) {
  const auto columns = signedIndex(3 * clip.marker_names.size());
  const std::string_view blob = row.blob(1);
  const std::size_t row_bytes = unsignedIndex(columns) * sizeof(float);
  FloatMatrix positions;
  if (blob.size() == frames * row_bytes) {
    positions.resize(signedIndex(frames), columns);
    if (!blob.empty()) std::memcpy(positions.data(), blob.data(), blob.size());
  } else if (std::optional<FloatMatrix> unpacked = unpackedPositions(blob, frames, columns)) {
    positions = std::move(*unpacked);
  } else {
    failBlob(row, blob, frames, row_bytes);
  }
  checkPositions(row, positions);
  clip.positions_mm = positions.cast<double>();
}

void readSamples(const CheckedQuery& row, std::size_t count, AudioClip& audio) {
  const std::string_view blob = row.blob(1);
  if (blob.size() != count * sizeof(std::int16_t)) {
    std::optional<std::vector<float>> unpacked = unpackedSamples(blob, count);
    if (!unpacked) failBlob(row, blob, count, sizeof(std::int16_t));
    audio.samples = std::move(*unpacked);
    return;
  }
  std::vector<std::int16_t> pcm(count);
  if (!pcm.empty()) std::memcpy(pcm.data(), blob.data(), blob.size());
  audio.samples.resize(pcm.size());
  for (std::size_t i = 0; i < pcm.size(); ++i) audio.samples[i] = static_cast<float>(pcm[i]) / 32768.0F;
}

std::shared_ptr<const TakeSource> takeSourceOf(SqliteDatabase database, std::vector<TakeSizes> sizes,
                                               StoredColumns stored, const Corpus& corpus) {
  return std::make_shared<FileTakeSource>(std::move(database), std::move(sizes), std::move(stored), corpus);
}

}  // namespace mouthpiece
