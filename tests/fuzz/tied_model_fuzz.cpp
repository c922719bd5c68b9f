// Reader of PocketSphinx' acoustic models: the input is one of the four files as a whole, or a list of edits of a small
// sound model, so that what lies behind the headers is reached too. What is read must weigh sounds to whole scores.
#include <array>
#include <cmath>
#include <cstring>
#include <string>
#include <string_view>

#include "base/errors.h"
#include "hearing/alignment/acoustic_model.h"

namespace {

using namespace mouthpiece;

constexpr std::size_t kPhones = 2, kStates = 3, kSenones = 6, kDensities = 5;
constexpr std::size_t kStreams[] = {2, 1};

void append(std::string& bytes, auto value) { bytes.append(reinterpret_cast<const char*>(&value), sizeof(value)); }

std::string gaussians(float value) {
  std::string bytes = "s3\nversion 1.0\nendhdr\n";
  append(bytes, 0x11223344U);
  std::size_t features = 0;
  for (const std::size_t count : {kPhones, std::size(kStreams), kDensities})
    append(bytes, static_cast<std::int32_t>(count));
  for (const std::size_t size : kStreams) {
    append(bytes, static_cast<std::int32_t>(size));
    features += size;
  }
  const std::size_t total = kPhones * kDensities * features;
  append(bytes, static_cast<std::uint32_t>(total));
  for (std::size_t i = 0; i < total; ++i) append(bytes, value + 0.1F * static_cast<float>(i));
  return bytes;
}

/// Two phones of three states each, no triphones.
std::string phones() {
  std::string bytes = "BMDF";
  append(bytes, std::int32_t{1});
  append(bytes, std::int32_t{4});
  bytes += "text";
  for (const std::int32_t count : {2, 2, 3, 6, 6, 2, 2, 3, 1, 1}) append(bytes, count);
  bytes += std::string("AA\0SIL\0\0", 8);  // padded to four bytes
  bytes += std::string(8, '\0');           // a node of the tree
  for (std::int32_t phone = 0; phone < 2; ++phone) {
    append(bytes, phone);  // its sequence
    append(bytes, phone);
    append(bytes, std::int32_t{0});
  }
  append(bytes, static_cast<std::uint32_t>(kPhones * kStates));
  for (std::uint16_t senone = 0; senone < kSenones; ++senone) append(bytes, senone);
  return bytes;
}

std::string weights() {
  std::string bytes;
  for (const std::string_view line : {std::string_view("cluster_count 0"), std::string_view("mixw")}) {
    append(bytes, static_cast<std::int32_t>(line.size()));
    bytes += line;
  }
  for (const std::size_t number : {std::size_t{0}, kDensities, kSenones})
    append(bytes, static_cast<std::int32_t>(number));
  for (std::size_t i = 0; i < std::size(kStreams) * kDensities * kSenones; ++i) bytes += static_cast<char>(i);
  return bytes;
}

TiedModelFiles soundModel() { return {"fuzz", phones(), gaussians(-1), gaussians(0.5F), weights()}; }

/// What is read of the input, zeros behind its end.
class Bytes {
 public:
  Bytes(const std::uint8_t* data, std::size_t size) : rest_(reinterpret_cast<const char*>(data), size) {}
  [[nodiscard]] bool empty() const { return rest_.empty(); }
  template <typename Value>
  Value take() {
    Value value{};
    const std::size_t count = std::min(sizeof(Value), rest_.size());
    if (count > 0) std::memcpy(&value, rest_.data(), count);
    rest_.remove_prefix(count);
    return value;
  }
  [[nodiscard]] std::string_view rest() const { return rest_; }

 private:
  std::string_view rest_;
};

void edit(std::string& file, Bytes& bytes) {
  const auto kind = bytes.take<std::uint8_t>();
  const std::size_t at = bytes.take<std::uint16_t>() % (file.size() + 1);
  switch (kind % 4) {
    case 0:
      file.resize(at);
      break;
    case 1:
      file.insert(at, bytes.take<std::uint8_t>(), bytes.take<char>());
      break;
    default: {
      const auto value = bytes.take<std::uint32_t>();
      std::memcpy(file.data() + at, &value, std::min(sizeof(value), file.size() - at));
    }
  }
}

void weigh(const TiedModel& model) {
  constexpr Eigen::Index kFrames = 2;
  SenoneScorer scorer(std::make_shared<TiedModel>(model));
  const Eigen::MatrixXf features = Eigen::MatrixXf::Constant(model.featureCount(), kFrames, 3.5F);
  const std::vector<bool> all(model.codebooks.size(), true);
  const SenoneScorer::Scores& scores = scorer.score(features, {all, true, 1});
  MOUTHPIECE_EXPECT(scores.rows() == static_cast<Eigen::Index>(model.senone_count) && scores.cols() == kFrames);
  MOUTHPIECE_EXPECT((scores.array() >= 0).all());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  TiedModelFiles files = soundModel();
  const std::array<std::string*, 4> all{&files.mdef, &files.means, &files.variances, &files.sendump};
  Bytes bytes(data, size);
  const auto which = bytes.take<std::uint8_t>();
  if (which < all.size()) {
    *all[which] = bytes.rest();
  } else {
    while (!bytes.empty()) edit(*all[bytes.take<std::uint8_t>() % all.size()], bytes);
  }
  try {
    const TiedModel model = parseTiedModel(files);
    for (const TiedModel::Codebook& codebook : model.codebooks) {
      for (const Eigen::MatrixXf& rows : codebook.gaussians) MOUTHPIECE_EXPECT(rows.allFinite());
    }
    weigh(model);
  } catch (const InputError&) {
    // An input without edits is the sound model.
    if (which >= all.size() && size == 1) throw;
  }
  return 0;
}
