#include <fmt/format.h>
#include <sqlite3.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <mutex>
#include <optional>
#include <span>
#include <unordered_map>
#include <unordered_set>

#include "base/errors.h"
#include "motion/position_limits.h"
#include "units/file/corpus_tables.h"
#include "units/file/packed_rows.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kMaxTakes = 1'000'000;
constexpr std::int64_t kMaxLabels = 1'000'000;             ///< phones, syllables or words of a take
constexpr std::int64_t kMaxFrames = 10'000'000;            ///< of a take: 23 hours at 120 Hz
constexpr std::int64_t kMaxSamples = 4LL * 3600 * 192000;  ///< of a take: four hours
constexpr int kMaxSampleRateHz = 768'000;

std::uint32_t bigEndian32(const std::array<unsigned char, 100>& header, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) value = value << 8U | header[at + i];
  return value;
}

/// Tells apart, before SQLite sees the file: no file, no database, another database, a newer corpus, a cut one. Returns
/// the format version.
std::uint32_t checkHeader(const fs::path& path) {
  const std::string file = path.string();
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (!fs::exists(status)) throw InputError(file, "", "no such file");
  if (!fs::is_regular_file(status)) throw InputError(file, "", "is no regular file; expected a corpus database");
  const std::uint64_t size = fs::file_size(path, error);
  std::ifstream stream(path, std::ios::binary);
  if (error || !stream) throw InputError(file, "", fmt::format("cannot be read: {}", std::strerror(errno)));
  std::array<unsigned char, 100> header{};
  stream.read(reinterpret_cast<char*>(header.data()), header.size());
  constexpr std::string_view kMagic{"SQLite format 3\0", 16};
  if (!stream || std::memcmp(header.data(), kMagic.data(), kMagic.size()) != 0) {
    throw InputError(file, "", "is no corpus database; expected a file made by `corpus build`");
  }
  if (bigEndian32(header, 68) != kCorpusApplicationId) {
    throw InputError(file, "", "is an SQLite database but no corpus; expected a file made by `corpus build`");
  }
  const std::uint32_t version = bigEndian32(header, 60);
  if (version > static_cast<std::uint32_t>(kCorpusFormatVersion)) {
    throw InputError(file, "",
                     fmt::format("has corpus format version {}, made by a newer Mouthpiece; expected at most {}",
                                 version, kCorpusFormatVersion));
  }
  if (version == 0)
    throw InputError(file, "", fmt::format("has corpus format version 0; expected {}", kCorpusFormatVersion));
  const std::uint64_t page = static_cast<std::uint64_t>(header[16]) << 8U | header[17];
  const std::uint64_t expected = (page == 1 ? 65536 : page) * bigEndian32(header, 28);
  if (size < expected) throw InputError(file, "", fmt::format("is cut off: {} bytes; expected {}", size, expected));
  return version;
}

std::span<const CorpusTable> tablesOf(std::uint32_t version) {
  return std::span(kCorpusTables).first(kTablesOfVersion.at(version - 1));
}

/// The tables are ours to the letter: no view, trigger, index or computed column can run or hide behind their names.
void checkSchema(SqliteDatabase& database, std::uint32_t version) {
  struct Found {
    std::span<const CorpusTable> tables;
    std::size_t count = 0;
    bool as_ours = true;
  } found{tablesOf(version)};
  const auto visit = [](void* context, int columns, char** values, char**) {
    auto& state = *static_cast<Found*>(context);
    const auto* table = state.count < state.tables.size() ? &state.tables[state.count] : nullptr;
    ++state.count;
    state.as_ours =
        state.as_ours && table != nullptr && columns == 1 && values[0] != nullptr && table->sql == values[0];
    return state.as_ours ? 0 : 1;
  };
  const int code =
      sqlite3_exec(database.handle(), "SELECT sql FROM sqlite_schema ORDER BY rowid", visit, &found, nullptr);
  if (code != SQLITE_OK && code != SQLITE_ABORT) database.fail(code);
  if (!found.as_ours || found.count != found.tables.size()) {
    throw InputError(database.file(), "", fmt::format("its tables are not those of corpus format version {}", version));
  }
}

std::size_t countBetween(const CheckedQuery& row, int column, const char* what, std::int64_t least, std::int64_t most) {
  const std::int64_t value = row.integer(column);
  if (value < least || value > most) row.fail(fmt::format("found {} {}; expected {} to {}", value, what, least, most));
  return unsignedIndex(value);
}

void expectId(const CheckedQuery& row, std::size_t expected) {
  if (row.integer(0) != signedIndex(expected))
    row.fail(fmt::format("found id {}; expected {}", row.integer(0), expected));
}

/// Returns the number of takes that the file promises.
std::size_t readMeta(SqliteDatabase& database, Corpus& corpus) {
  CheckedQuery row(database, "meta");
  std::optional<std::size_t> takes;
  while (row.next()) {
    const std::string_view key = row.text(1);
    const std::string_view value = row.text(2);
    if (key == "takes") {
      std::int64_t count = -1;
      const auto [end, code] = std::from_chars(value.data(), value.data() + value.size(), count);
      if (code != std::errc() || end != value.data() + value.size() || count < 0 || count > kMaxTakes) {
        row.fail(fmt::format("found {} takes; expected 0 to {}", printable(value), kMaxTakes));
      }
      takes = unsignedIndex(count);
    } else if (key.starts_with("log:")) {
      corpus.build_log.emplace(key.substr(4), value);
    } else {
      row.fail(fmt::format("found key {}; expected takes or log:...", printable(key)));
    }
  }
  if (!takes) throw InputError(database.file(), "meta", "has no number of takes");
  return *takes;
}

MarkerLayout readLayout(SqliteDatabase& database) {
  CheckedQuery row(database, "layout");
  if (!row.next()) throw InputError(database.file(), "layout", "is missing");
  return parseLayout(row.text(1), database.file());
}

MarkerPositions readNeutralPose(SqliteDatabase& database, const MarkerLayout& layout) {
  MarkerPositions pose(signedIndex(layout.markers.size()), 3);
  CheckedQuery row(database, "neutral_pose");
  std::size_t count = 0;
  for (; row.next(); ++count) {
    expectId(row, count);
    if (count == layout.markers.size() || row.text(1) != layout.markers[count].name)
      row.fail("marker differs from the layout's");
    for (int axis = 0; axis < 3; ++axis) {
      const double value = row.real(2 + axis);
      if (!(std::abs(value) <= kMaxPositionMm)) row.fail(fmt::format("found position {} mm", value));
      pose(signedIndex(count), axis) = value;
    }
  }
  if (count != layout.markers.size()) {
    throw InputError(database.file(), "neutral_pose",
                     fmt::format("has {} markers; expected {}", count, layout.markers.size()));
  }
  return pose;
}

/// A take's row; its samples and labels follow from other tables.
struct TakeSizes {
  LabelCounts labels;
  std::size_t frames = 0;
  double frame_rate_hz = 0;
  std::size_t samples = 0;
  int sample_rate_hz = 0;
};

/// The row at hand, all but the labels of which goes into `take`.
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

std::vector<TakeSizes> readTakes(SqliteDatabase& database, std::size_t promised, Corpus& corpus) {
  std::vector<TakeSizes> sizes;
  std::unordered_set<std::string> names;
  for (CheckedQuery row(database, "takes"); row.next();) {
    expectId(row, sizes.size());
    CorpusTake& take = corpus.takes.emplace_back();
    sizes.push_back(readTake(row, database.file(), take));
    if (take.name.empty() || !names.insert(take.name).second)
      row.fail(fmt::format("found the name '{}'; expected one that no other take has", printable(take.name)));
  }
  if (sizes.size() != promised)
    throw InputError(database.file(), "takes", fmt::format("has {} rows; expected {}", sizes.size(), promised));
  return sizes;
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

/// The clip of the take whose row of `motion` is at hand, all but the positions of which is in `clip`.
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

/// Calls read(row, take) for each row of a table that has one a take.
template <typename Read>
void readTakeRows(SqliteDatabase& database, const char* table, std::size_t takes, const Read& read) {
  CheckedQuery row(database, table);
  std::size_t take = 0;
  for (; row.next(); ++take) {
    expectId(row, take);
    if (take == takes) row.fail("no such take");
    read(row, take);
  }
  if (take != takes) throw InputError(database.file(), table, fmt::format("has {} rows; expected {}", take, takes));
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
class FileMotionSource : public MotionSource {
 public:
  /// `sizes` of all takes, or `stored` of a corpus with phone_columns.
  FileMotionSource(SqliteDatabase database, std::vector<TakeSizes> sizes, StoredColumns stored, const Corpus& corpus)
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

struct OpenCorpus {
  SqliteDatabase database;
  std::uint32_t version;
};

OpenCorpus openCorpus(const fs::path& path) {
  const std::uint32_t version = checkHeader(path);
  SqliteDatabase database = SqliteDatabase::openReadOnly(path);
  checkSchema(database, version);
  return {std::move(database), version};
}

/// Their JSON is looked into by who uses it; here it is only what was written.
void readVisemePoses(SqliteDatabase& database, Corpus& corpus) {
  CheckedQuery row(database, "viseme_poses");
  if (!row.next()) return;
  expectId(row, 0);
  corpus.viseme_poses = row.text(1);
  if (corpus.viseme_poses.empty()) row.fail("found no text; expected viseme poses");
  if (row.next()) row.fail("found a second row; expected one");
}

/// Every row of every table against its checksum.
void checkRows(OpenCorpus& corpus, std::vector<std::string>& problems) {
  constexpr std::size_t kMostProblems = 100;
  SqliteDatabase& database = corpus.database;
  for (const CorpusTable& table : tablesOf(corpus.version)) {
    try {
      for (CheckedQuery row(database, std::string(table.name)); row.nextUnchecked();) {
        if (problems.size() >= kMostProblems) return;
        if (!row.isIntact()) problems.push_back(fmt::format("{}:{}: checksum differs", database.file(), row.place()));
      }
    } catch (const InputError& error) {
      problems.emplace_back(error.what());
    }
  }
}

}  // namespace

Corpus readCorpus(const fs::path& path, CorpusAudio audio, CorpusMotion motion) {
  OpenCorpus open = openCorpus(path);
  SqliteDatabase& database = open.database;
  Corpus corpus;
  corpus.name = path.stem().string();
  const std::size_t promised = readMeta(database, corpus);
  corpus.layout = readLayout(database);
  corpus.neutral_pose_mm = readNeutralPose(database, corpus.layout);
  StoredColumns stored;
  if (motion == CorpusMotion::kTakesOnDemand && open.version > 6) stored = readColumns(database, promised);
  corpus.phone_columns = stored.columns;
  std::vector<TakeSizes> sizes;
  if (corpus.phone_columns == nullptr) {
    sizes = readTakes(database, promised, corpus);
    LabelReader labels(database);
    for (std::size_t take = 0; take < sizes.size(); ++take)
      corpus.takes[take].labels = labels.read(take, sizes[take].labels);
    labels.expectEnd();
  }
  if (open.version > 1) readTrajectoryModel(database, corpus);
  if (open.version > 2) readVisemePoses(database, corpus);
  if (motion == CorpusMotion::kLoad) {
    readTakeRows(database, "motion", sizes.size(), [&](const CheckedQuery& row, std::size_t take) {
      corpus.takes[take].motion.marker_names = corpus.layout.markerNames();
      readPositions(row, sizes[take].frames, corpus.takes[take].motion);
    });
  }
  if (audio == CorpusAudio::kLoad) {
    readTakeRows(database, "audio", sizes.size(), [&](const CheckedQuery& row, std::size_t take) {
      readSamples(row, sizes[take].samples, corpus.takes[take].audio);
    });
  }
  if (motion != CorpusMotion::kLoad)
    corpus.motion_source =
        std::make_shared<FileMotionSource>(std::move(database), std::move(sizes), std::move(stored), corpus);
  return corpus;
}

std::vector<std::string> checkCorpus(const fs::path& path) {
  std::vector<std::string> problems;
  try {
    OpenCorpus corpus = openCorpus(path);
    checkRows(corpus, problems);
    if (problems.empty()) {
      const Corpus read = readCorpus(path, CorpusAudio::kLoad);
      if (read.trajectory_model != nullptr) readAllShapes(corpus.database, read);
      if (corpus.version > 6) {
        if (const std::string fault = faultOfColumns(corpus.database, read); !fault.empty())
          problems.push_back(fmt::format("{}:{}", corpus.database.file(), fault));
      }
    }
  } catch (const InputError& error) {
    problems.emplace_back(error.what());
  }
  return problems;
}

}  // namespace mouthpiece
