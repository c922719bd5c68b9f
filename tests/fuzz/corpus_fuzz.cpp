// Corpus reader: the input is either a whole file, or a list of edits of a small sound corpus whose checksums are
// then made right again, so that what lies behind them is reached too.
#include <fcntl.h>
#include <unistd.h>

#include <bit>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <variant>
#include <vector>

#include "base/errors.h"
#include "motion/marker_layout.h"
#include "synthesis/curve_model.h"
#include "synthesis/synthesis.h"
#include "units/file/corpus.h"
#include "units/file/corpus_tables.h"

namespace {

using namespace mouthpiece;

struct Blob {
  std::string bytes;
};
using Value = std::variant<std::monostate, std::int64_t, double, std::string, Blob>;
using Row = std::vector<Value>;
using Table = std::vector<Row>;

Value integer(std::int64_t value) { return value; }
Value text(const char* value) { return std::string(value); }

MarkerLayout twoMarkers() {
  MarkerLayout layout;
  layout.name = "two";
  for (const char* name : {"LIP_UP_MID", "LIP_LO_MID"}) {
    LayoutMarker marker;
    marker.name = name;
    marker.region = "lip";
    marker.mirror = MarkerIndex(layout.markers.size());
    layout.markers.push_back(marker);
  }
  return layout;
}

Blob numbers(const std::vector<float>& values) {
  return {{reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float)}};
}

/// Two components of two markers.
Table modelTable() {
  const std::vector<std::pair<const char*, std::vector<float>>> rows = {
      {"level", {1, 0}},
      {"analysis", {0, 0, 1, 0, 0, 1, 0, 0, -1, 0, 0, 1}},
      {"shapes", {0, 0.5F, 0, 0, -0.5F, 0, 0, 0, 0.5F, 0, 0, 0.5F}},
      {"time constants", {0.02F, 0.03F}},
      {"leads", {0, 0.01F}},
      {"gain", {1.1F}},
      {"closing", {0, 0.5F, 0, 0, -0.5F, 0}},
      {"closed opening", {2}},
      {"lattice weights", {0.16F, 0.65F, 1, 0.5F, 0.1F, 0.1F, 0.1F, 0.5F, 0.2F, 0.004F, 0.05F, 0.1F, 10}},
      {"target phone T", {-1, 0}},
      {"target viseme Uh", {1, 0.5F}}};
  Table table;
  for (const auto& [name, values] : rows)
    table.push_back({integer(static_cast<std::int64_t>(table.size())), text(name), numbers(values)});
  return table;
}

template <typename T>
Blob column(const std::vector<T>& values) {
  return {{reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)}};
}

/// Of "sil T AH sil", one stressed syllable.
Table columnsTable() {
  std::vector<double> durations;
  for (int i = 0; i < 4; ++i) durations.push_back(0.1 * (i + 1) - 0.1 * i);
  using Bytes = std::vector<std::uint8_t>;
  using Counts = std::vector<std::uint32_t>;
  return {{integer(0), text("take begin"), column(Counts{0, 4})},
          {integer(1), text("word begin"), column(Counts{0, 1})},
          {integer(2), text("syllable begin"), column(Counts{0, 1})},
          {integer(3), text("phones"), column(Bytes{0, 33, 3, 0})},
          {integer(4), text("marks"), column(Bytes{0, 85, 106, 0})},
          {integer(5), text("durations"), column(durations)},
          {integer(6), text("suffixes"), column(Counts{3, 0, 2, 1})}};
}

/// Poses that move nothing: what edits of their text lead to is what counts.
std::string posesText() {
  VisemePoses poses;
  poses.marker_names = twoMarkers().markerNames();
  poses.jaw_direction = poses.opening_direction = Eigen::RowVectorXd::Zero(6);
  poses.lips = PositionMatrix::Zero(static_cast<Eigen::Index>(kVisemeCount), 6);
  return posesToJson(poses);
}

/// In the order of kCorpusTables, without the checksum column.
std::vector<Table> soundTables() {
  std::vector<float> positions;
  for (int i = 0; i < 6 * 12; ++i) positions.push_back(static_cast<float>(i % 7));
  const std::string motion(reinterpret_cast<const char*>(positions.data()), positions.size() * sizeof(float));
  Table phones;
  const char* names[] = {"sil", "T", "AH", "sil"};
  for (int i = 0; i < 4; ++i) {
    const bool speech = i == 1 || i == 2;
    const Value owner = speech ? integer(0) : Value();
    phones.push_back({integer(i), integer(0), text(names[i]), 0.1 * i, 0.1 * (i + 1), owner, owner});
  }
  return {{{integer(0), text("takes"), text("1")}, {integer(1), text("log:built_with"), text("fuzz")}},
          {{integer(0), layoutToJson(twoMarkers())}},
          {{integer(0), text("LIP_UP_MID"), 0.0, 1.0, 2.0}, {integer(1), text("LIP_LO_MID"), 0.0, -1.0, 2.0}},
          {{integer(0), text("a"), text("t ah"), integer(4), integer(1), integer(1), integer(12), 25.0, integer(2),
            integer(8000)}},
          {{integer(0), integer(0), text("tah"), integer(1), integer(2)}},
          {{integer(0), integer(0), integer(1), integer(2), integer(1)}},
          phones,
          {{integer(0), Blob{motion}}},
          {{integer(0), Blob{std::string(4, '\1')}}},
          modelTable(),
          {{integer(0), numbers(std::vector<float>(4 * (2 * 5 * 2 + 1), 1.0F))}},
          {{integer(0), posesText()}},
          columnsTable()};
}

class Bytes {
 public:
  Bytes(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}
  bool empty() const { return at_ >= size_; }
  std::uint8_t byte() { return empty() ? 0 : data_[at_++]; }
  std::uint64_t word() {
    std::uint64_t value = 0;
    for (int i = 0; i < 8; ++i) value = value << 8U | byte();
    return value;
  }
  std::string string() {
    std::string value;
    for (std::size_t length = byte(); length > 0 && !empty(); --length) value += static_cast<char>(byte());
    return value;
  }

 private:
  const std::uint8_t* data_;
  std::size_t size_;
  std::size_t at_ = 0;
};

void edit(std::vector<Table>& tables, Bytes& bytes) {
  Table& table = tables[bytes.byte() % tables.size()];
  if (table.empty()) return;
  const std::size_t at = bytes.byte() % table.size();
  const std::size_t column = bytes.byte() % table[at].size();
  Value& value = table[at][column];
  switch (bytes.byte() % 9) {
    case 0:
      value = static_cast<std::int64_t>(bytes.word());
      break;
    case 1:
      value = static_cast<std::int64_t>(static_cast<std::int8_t>(bytes.byte()));
      break;
    case 2:
      value = std::bit_cast<double>(bytes.word());
      break;
    case 3:
      value = 0.05 * static_cast<std::int8_t>(bytes.byte());
      break;
    case 4:
      value = bytes.string();
      break;
    case 5:
      value = Blob{bytes.string()};
      break;
    case 6:
      value = std::monostate();
      break;
    case 7:
      table.erase(table.begin() + static_cast<std::ptrdiff_t>(at));
      break;
    default:
      table.push_back(table[at]);
      table.back()[0] = integer(static_cast<std::int64_t>(table.size()) - 1);
      break;
  }
}

void add(CheckedInsert& insert, const Value& value) {
  if (const auto* number = std::get_if<std::int64_t>(&value))
    insert.integer(*number);
  else if (const auto* real = std::get_if<double>(&value))
    insert.real(*real);
  else if (const auto* string = std::get_if<std::string>(&value))
    insert.text(*string);
  else if (const auto* blob = std::get_if<Blob>(&value))
    insert.blob(blob->bytes);
  else
    insert.null();
}

void writeTables(const std::filesystem::path& path, const std::vector<Table>& tables) {
  std::filesystem::remove(path);
  SqliteDatabase database = SqliteDatabase::create(path, path);
  database.execute("PRAGMA page_size=512; PRAGMA journal_mode=OFF; PRAGMA synchronous=OFF; BEGIN");
  database.execute("PRAGMA application_id=" + std::to_string(kCorpusApplicationId) +
                   "; PRAGMA user_version=" + std::to_string(kCorpusFormatVersion));
  for (std::size_t i = 0; i < tables.size(); ++i) {
    database.execute(std::string(kCorpusTables[i].sql));
    CheckedInsert insert(database, std::string(kCorpusTables[i].name), kCorpusTables[i].columns);
    for (const Row& row : tables[i]) {
      for (const Value& value : row) add(insert, value);
      insert.insert();
    }
  }
  database.execute("COMMIT");
  database.close();
}

/// What was accepted must hold its promises and be usable.
void use(const Corpus& corpus) {
  const std::size_t markers = corpus.take_source == nullptr ? corpus.layout.markers.size() : 0;  // else read on demand
  for (const CorpusTake& take : corpus.takes)
    MOUTHPIECE_EXPECT(take.motion.positions_mm.cols() == static_cast<Eigen::Index>(3 * markers));
  if (takeCount(corpus) == 0) return;
  for (std::size_t take = 0; take < takeCount(corpus); ++take) expectConsistent(takeOf(corpus, TakeIndex(take)).labels);
  try {
    storedPoses(corpus);
  } catch (const InputError&) {
  }
  SynthesisRequest request;
  request.labels = takeOf(corpus, TakeIndex(0)).labels;
  for (LabelledPhone& phone : request.labels.phones) phone.span.end += 1e-9;  // not to the bit its own timing
  constexpr Seconds kLongLine = 10;
  if (request.labels.duration() > kLongLine) return;
  try {
    const UtteranceAnimation animation = synthesise(request, corpus);
    MOUTHPIECE_EXPECT(animation.motion.positions_mm.allFinite());
  } catch (const InputError&) {
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  static const std::filesystem::path path =
      std::filesystem::temp_directory_path() / ("corpus_fuzz." + std::to_string(::getpid()));
  try {
    if (data[0] == 'S') {
      std::ofstream(path, std::ios::binary)
          .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
    } else {
      std::vector<Table> tables = soundTables();
      for (Bytes bytes(data, size); !bytes.empty();) edit(tables, bytes);
      writeTables(path, tables);
    }
  } catch (const InputError&) {
  }
  for (const auto& [audio, motion] : {std::pair(CorpusAudio::kLoad, CorpusMotion::kLoad),
                                      std::pair(CorpusAudio::kSkip, CorpusMotion::kTakesOnDemand)}) {
    try {
      use(readCorpus(path, audio, motion));
    } catch (const InputError&) {
    }
  }
  std::filesystem::remove(path);
  return 0;
}
