#include "hearing/alignment/acoustic_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <numbers>
#include <numeric>
#include <string_view>
#include <tuple>

#include "base/byte_reader.h"
#include "base/errors.h"
#include "base/files.h"
#include "base/index.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMostModelBytes = 256U << 20U;
/// Smaller variances are taken for this (PocketSphinx' -varfloor).
constexpr double kSmallestVariance = 1e-4;
/// Cepstra and their variances are smaller by far; what is larger would not stay finite when it is weighed.
constexpr float kLargestValue = 1e6F;

/// A count between 1 and `most`.
std::size_t readCount(ByteReader& reader, std::size_t most, std::string_view what) {
  const std::int32_t count = reader.readI32();
  if (count < 1 || unsignedIndex(count) > most)
    reader.fail(fmt::format("found {} {}; expected 1 to {}", count, what, most));
  return unsignedIndex(count);
}

constexpr std::size_t kMostCodebooks = 1000;
constexpr std::size_t kMostStreams = 16;
constexpr std::size_t kMostDensities = 1024;
constexpr std::size_t kMostFeatures = 128;
constexpr std::size_t kMostSenones = 32767;

/// Means or variances: float32 by codebook, stream, density and feature.
struct GaussianFile {
  std::size_t codebooks = 0, densities = 0;
  std::vector<std::size_t> streams;
  std::vector<float> values;
};

GaussianFile parseGaussians(std::string_view bytes, const fs::path& path) {
  ByteReader reader(bytes, path.string());
  const std::size_t header = bytes.find("endhdr\n");
  if (!bytes.starts_with("s3\n") || header == std::string::npos) reader.fail("is no parameter file of PocketSphinx");
  reader.seek(header + 7);
  if (reader.readU32() != 0x11223344U) reader.fail("found another byte order; expected little-endian");
  GaussianFile file;
  file.codebooks = readCount(reader, kMostCodebooks, "codebooks");
  file.streams.resize(readCount(reader, kMostStreams, "streams"));
  file.densities = readCount(reader, kMostDensities, "densities");
  if (file.densities < SenoneScorer::kKept)
    reader.fail(fmt::format("found {} densities; expected more", file.densities));
  std::size_t features = 0;
  for (std::size_t& size : file.streams) features += size = readCount(reader, kMostFeatures, "features");
  const auto total = unsignedIndex(reader.readU32());
  if (total != file.codebooks * file.densities * features || reader.remaining() < 4 * total)
    reader.fail(fmt::format("holds {} values; expected {}", total, file.codebooks * file.densities * features));
  file.values.resize(total);
  for (float& value : file.values) {
    value = reader.readF32();
    if (!(std::abs(value) <= kLargestValue))
      reader.fail(fmt::format("found {}; expected a number up to {:g}", value, kLargestValue));
  }
  return file;
}

}  // namespace

/// log N(x; m, s) = sum of -x^2 / 2s + x m / s - m^2 / 2s - log(2 pi s) / 2.
Densities densitiesOf(const Eigen::MatrixXf& rows) {
  const Eigen::Index size = (rows.cols() - 1) / 2;
  Densities densities;
  densities.variances = (-0.5 * rows.leftCols(size).cast<double>().cwiseInverse()).transpose();
  densities.means = rows.middleCols(size, size).cast<double>().transpose().cwiseProduct(densities.variances);
  return densities;
}

Eigen::RowVectorXf densityRow(const Eigen::VectorXd& mean, const Eigen::VectorXd& variance) {
  const Eigen::Index n = mean.size();
  const Eigen::ArrayXd held = variance.array().max(kSmallestVariance);
  Eigen::RowVectorXf row(2 * n + 1);
  row.head(n) = (-0.5 / held).cast<float>();
  row.segment(n, n) = (mean.array() / held).cast<float>();
  row[2 * n] = asFloat(-0.5 * (mean.array().square() / held + (2 * std::numbers::pi * held).log()).sum());
  return row;
}

namespace {

Eigen::VectorXd valuesAt(const GaussianFile& file, std::size_t at, std::size_t size) {
  return Eigen::Map<const Eigen::VectorXf>(&file.values[at], signedIndex(size)).cast<double>();
}

void addGaussians(TiedModel& model, const TiedModelFiles& files) {
  const fs::path& folder = files.folder;
  const GaussianFile means = parseGaussians(files.means, folder / "means"),
                     variances = parseGaussians(files.variances, folder / "variances");
  if (means.streams != variances.streams || means.codebooks != variances.codebooks ||
      means.densities != variances.densities)
    throw InputError((folder / "variances").string(), "", "has another shape than the means");
  if (means.codebooks != model.codebooks.size()) {
    throw InputError(
        (folder / "means").string(), "",
        fmt::format("has {} codebooks; expected one for each of {} phones", means.codebooks, model.codebooks.size()));
  }
  for (const std::size_t size : means.streams) model.stream_sizes.push_back(signedIndex(size));
  std::size_t at = 0;
  for (TiedModel::Codebook& codebook : model.codebooks) {
    for (const std::size_t size : means.streams) {
      auto& rows = codebook.gaussians.emplace_back(means.densities, 2 * size + 1);
      for (std::size_t density = 0; density < means.densities; ++density, at += size)
        rows.row(signedIndex(density)) = densityRow(valuesAt(means, at, size), valuesAt(variances, at, size));
    }
  }
}

bool comesBefore(const TiedModel::Triphone& a, const TiedModel::Triphone& b) {
  return std::tie(a.base, a.left, a.right) < std::tie(b.base, b.left, b.right);
}

/// Which phone each senone belongs to, and the phones' names.
void addPhones(TiedModel& model, std::string_view bytes, const fs::path& path) {
  ByteReader reader(bytes, path.string());
  if (reader.readBytes(4) != "BMDF") reader.fail("is no binary model definition of PocketSphinx");
  if (reader.readI32() != 1) reader.fail("found another version or byte order; expected version 1, little-endian");
  reader.skip(readCount(reader, 1U << 16U, "bytes of description"));
  const std::size_t names = readCount(reader, kMostCodebooks, "base phones");
  const std::size_t phones = readCount(reader, 1U << 24U, "phones");
  if (phones < names)
    reader.fail(fmt::format("found {} phones; expected the {} base phones among them", phones, names));
  const std::size_t states = readCount(reader, 16, "states a phone");
  reader.skip(4);  // senones of the base phones: they come first
  model.senone_count = readCount(reader, kMostSenones, "senones");
  reader.skip(4);  // transition matrices
  const std::size_t sequences = readCount(reader, 1U << 20U, "senone sequences");
  reader.skip(4);  // phones of context
  const std::size_t tree_nodes = readCount(reader, 1U << 24U, "nodes of the tree");
  reader.skip(4);  // the silence
  for (std::size_t i = 0, length = 0; i < names; ++i, length = 0) {
    std::string name;
    while (const std::uint8_t c = reader.readU8()) {
      if (++length > 64) reader.fail("found a phone's name of more than 64 letters");
      name += static_cast<char>(c);
    }
    model.codebooks.push_back({std::move(name), {}, {}, {}});
  }
  // The names are padded to a multiple of four bytes; the rest goes to the end of the file.
  constexpr std::size_t kPhoneBytes = 12, kNodeBytes = 8;
  const std::size_t rest = tree_nodes * kNodeBytes + phones * kPhoneBytes + 4 + 2 * sequences * states;
  if (rest > reader.remaining()) reader.fail(fmt::format("ends early; expected {} bytes more", rest));
  const std::size_t padding = reader.remaining() - rest;
  if (padding > 3) reader.fail(fmt::format("has {} bytes too many", padding));
  reader.skip(padding + tree_nodes * kNodeBytes);
  std::vector<TiedModel::Triphone> entries(phones);
  for (std::size_t i = 0; i < phones; ++i) {
    const std::int32_t sequence = reader.readI32();
    reader.skip(4);
    const auto place = static_cast<TiedModel::WordPlace>(reader.readU8());
    const std::uint16_t first = reader.readU8(), left = reader.readU8(), right = reader.readU8();
    const std::uint16_t base = i < names ? static_cast<std::uint16_t>(i) : first;
    if (sequence < 0 || unsignedIndex(sequence) >= sequences || base >= names)
      reader.fail("found a phone of no sequence or base");
    entries[i] = {base, left, right, place, static_cast<std::uint32_t>(unsignedIndex(sequence) * states)};
  }
  if (reader.readU32() != sequences * states) reader.fail("found another number of states than the header tells");
  model.states = states;
  model.sequences.resize(sequences * states);
  for (int& senone : model.sequences) {
    senone = reader.readU16();
    if (unsignedIndex(senone) >= model.senone_count)
      reader.fail(fmt::format("found senone {} of {}", senone, model.senone_count));
  }
  for (std::size_t i = 0; i < names; ++i) {
    const std::span<const int> own = model.senonesOf(entries[i]);
    model.alone.emplace_back(own.begin(), own.end());
  }
  std::copy_if(entries.begin() + signedIndex(names), entries.end(), std::back_inserter(model.triphones),
               [&](const TiedModel::Triphone& entry) { return entry.left < names && entry.right < names; });
  if (!std::is_sorted(model.triphones.begin(), model.triphones.end(), comesBefore))
    std::sort(model.triphones.begin(), model.triphones.end(), comesBefore);
  std::vector<std::size_t> owner(model.senone_count, names);
  for (const TiedModel::Triphone& entry : entries) {
    for (const int senone : model.senonesOf(entry)) owner[unsignedIndex(senone)] = entry.base;
  }
  for (std::size_t senone = 0; senone < owner.size(); ++senone) {
    if (owner[senone] < names) model.codebooks[owner[senone]].senones.push_back(static_cast<int>(senone));
  }
}

/// Weights: a byte by stream, density and senone, -log of it in units of kScoreUnit.
void addWeights(TiedModel& model, std::string_view bytes, const fs::path& path) {
  ByteReader reader(bytes, path.string());
  for (std::int32_t length = reader.readI32(); length != 0; length = reader.readI32()) {
    if (length < 0 || length > 4096) reader.fail("is no file of senone weights of PocketSphinx");
    const std::string_view line = reader.readBytes(unsignedIndex(length));
    if (line.starts_with("cluster_count ") && !line.starts_with("cluster_count 0"))
      reader.fail("found clustered weights; expected a byte for each");
  }
  const std::size_t densities = readCount(reader, kMostDensities, "densities");
  const std::size_t senones = readCount(reader, kMostSenones, "senones");
  const std::size_t streams = model.stream_sizes.size();
  if (senones != model.senone_count || signedIndex(densities) != model.codebooks[0].gaussians[0].rows())
    reader.fail(fmt::format("has {} densities and {} senones; expected {} and {}", densities, senones,
                            model.codebooks[0].gaussians[0].rows(), model.senone_count));
  const std::string_view ids = reader.readBytes(streams * densities * senones);
  std::array<float, 256> weight_of{};
  for (std::size_t id = 0; id < weight_of.size(); ++id) weight_of[id] = asFloat(std::exp(-kScoreUnit * asReal(id)));
  for (TiedModel::Codebook& codebook : model.codebooks) {
    for (std::size_t stream = 0; stream < streams; ++stream) {
      auto& weights = codebook.weights.emplace_back(codebook.senones.size(), densities);
      for (std::size_t density = 0; density < densities; ++density) {
        for (std::size_t i = 0; i < codebook.senones.size(); ++i) {
          const auto id = static_cast<unsigned char>(
              ids[(stream * densities + density) * senones + unsignedIndex(codebook.senones[i])]);
          weights(signedIndex(i), signedIndex(density)) = weight_of[id];
        }
      }
    }
  }
}

}  // namespace

Eigen::Index TiedModel::featureCount() const {
  return std::accumulate(stream_sizes.begin(), stream_sizes.end(), Eigen::Index{0});
}

std::span<const int> TiedModel::senonesOf(std::size_t base, std::size_t left, std::size_t right,
                                          WordPlace place) const {
  const Triphone wanted{static_cast<std::uint16_t>(base), static_cast<std::uint16_t>(left),
                        static_cast<std::uint16_t>(right)};
  const auto [first, last] = std::equal_range(triphones.begin(), triphones.end(), wanted, comesBefore);
  if (first == last) return alone[base];
  const auto there = std::find_if(first, last, [&](const Triphone& triphone) { return triphone.place == place; });
  return senonesOf(there != last ? *there : *first);
}

TiedModel parseTiedModel(const TiedModelFiles& files) {
  TiedModel model;
  addPhones(model, files.mdef, files.folder / "mdef");
  addGaussians(model, files);
  addWeights(model, files.sendump, files.folder / "sendump");
  return model;
}

TiedModel readTiedModel(const fs::path& folder) {
  const auto bytes_of = [&](const char* name) { return readFile(folder / name, kMostModelBytes); };
  return parseTiedModel({folder, bytes_of("mdef"), bytes_of("means"), bytes_of("variances"), bytes_of("sendump")});
}

}  // namespace mouthpiece
