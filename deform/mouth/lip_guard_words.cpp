// What a guard found out about its face, as 32-bit words for the `.face` file (docs/formats/face.md).
#include <algorithm>
#include <cmath>
#include <cstring>
#include <type_traits>

#include "base/errors.h"
#include "deform/mouth/lip_guard.h"

namespace mouthpiece {
namespace {

/// Rises with each change of what is found or how: words of another version are not read.
constexpr std::uint32_t kVersion = 2;

// Eigen's bit_cast: the page engine's standard library has none.

/// Lists of records of words, nets and numbers one after the other, each list after its length.
class WordWriter {
 public:
  explicit WordWriter(std::vector<std::uint32_t>& words) : words_(words) {}

  template <typename Record>
  void operator()(const std::vector<Record>& records) const {
    words_.push_back(static_cast<std::uint32_t>(records.size()));
    append(records.data(), records.size());
  }
  template <typename Net>
  void operator()(const Eigen::PlainObjectBase<Net>& net) const {
    words_.push_back(static_cast<std::uint32_t>(net.rows()));
    words_.push_back(static_cast<std::uint32_t>(net.cols()));
    append(net.data(), unsignedIndex(net.size()));
  }
  void operator()(float number) const { words_.push_back(Eigen::numext::bit_cast<std::uint32_t>(number)); }
  void operator()(bool flag) const { words_.push_back(flag ? 1 : 0); }

 private:
  template <typename Record>
  void append(const Record* records, std::size_t count) const {
    static_assert(sizeof(Record) % sizeof(std::uint32_t) == 0 && std::is_standard_layout_v<Record>);
    if (count == 0) return;
    const std::size_t before = words_.size();
    words_.resize(before + count * sizeof(Record) / sizeof(std::uint32_t));
    std::memcpy(&words_[before], records, count * sizeof(Record));
  }

  std::vector<std::uint32_t>& words_;
};

class WordReader {
 public:
  explicit WordReader(std::span<const std::uint32_t>& words) : words_(words) {}

  template <typename Record>
  void operator()(std::vector<Record>& records) const {
    const std::size_t count = next();
    expectWords(count, sizeof(Record));
    records.resize(count);
    copyTo(records.data(), count);
  }
  template <typename Net>
  void operator()(Eigen::PlainObjectBase<Net>& net) const {
    const std::uint64_t rows = next(), columns = next();
    if (Net::ColsAtCompileTime == 1 && columns != 1) throw InputError("found a net of the wrong shape");
    expectWords(std::max({rows, columns, rows * columns}), sizeof(float));
    net.resize(signedIndex(rows), signedIndex(columns));
    copyTo(net.data(), unsignedIndex(net.size()));
  }
  void operator()(float& number) const { number = Eigen::numext::bit_cast<float>(next()); }
  void operator()(bool& flag) const { flag = next() != 0; }

 private:
  [[nodiscard]] std::uint32_t next() const {
    expectWords(1, sizeof(std::uint32_t));
    const std::uint32_t word = words_.front();
    words_ = words_.subspan(1);
    return word;
  }
  void expectWords(std::uint64_t count, std::size_t size) const {
    if (count > words_.size_bytes() / size) throw InputError("ends too early");
  }
  template <typename Record>
  void copyTo(Record* records, std::size_t count) const {
    if (count == 0) return;
    std::memcpy(static_cast<void*>(records), words_.data(), count * sizeof(Record));
    words_ = words_.subspan(count * sizeof(Record) / sizeof(std::uint32_t));
  }

  std::span<const std::uint32_t>& words_;
};

/// Lengths and their squares on any mesh that is read.
constexpr float kMost = 1e18F;

bool isWithin(float number, float least, float most) { return number >= least && number <= most; }
bool isUsable(float number) { return isWithin(number, -kMost, kMost); }
bool areUsable(const auto& numbers) { return std::all_of(std::begin(numbers), std::end(numbers), isUsable); }

}  // namespace

template <typename Guard, typename Visit>
void LipGuard::visitFound(Guard& guard, const Visit& visit) {
  visit(guard.lips_);
  visit(guard.at_upper_teeth_);
  visit(guard.at_lower_teeth_);
  visit(guard.drawn_);
  visit(guard.levelled_);
  visit(guard.watched_columns_);
  visit(guard.resting_gaps_);
  visit(guard.drawn_further_);
  for (auto* const shell : {&guard.upper_teeth_, &guard.lower_teeth_}) {
    visit(shell->reach_);
    visit(shell->edge_);
    visit(shell->bounds_);
    visit(shell->columns_per_turn_);
    visit(shell->middle_column_);
    visit(shell->rows_per_height_);
    visit(shell->bounded_rows_);
    visit(shell->axis_x_);
    visit(shell->axis_z_);
    visit(shell->lowest_);
    visit(shell->cell_);
    visit(shell->farthest_);
    visit(shell->hangs_);
  }
}

std::vector<std::uint32_t> LipGuard::words() const {
  std::vector<std::uint32_t> words{kVersion};
  visitFound(*this, WordWriter(words));
  return words;
}

bool LipGuard::takeFound(std::span<const std::uint32_t> words, std::size_t vertex_count) {
  if (words.empty() || words.front() != kVersion) return false;
  words = words.subspan(1);
  visitFound(*this, WordReader(words));
  const auto expect = [](bool holds, const char* what) {
    if (!holds) throw InputError(std::string("found ") + what);
  };
  const auto isVertex = [&](std::uint32_t v) { return v < vertex_count; };
  const auto isColumn = [](std::uint32_t c) { return c < kColumns; };
  expect(words.empty(), "more than a guard");
  for (const LipWatch& watch : lips_) {
    expect(std::all_of(watch.own.ends, std::end(watch.own.ends), isVertex) &&
               std::all_of(watch.corners, std::end(watch.corners), isVertex) && isColumn(watch.column),
           "a watch of no vertex or column");
    expect(isWithin(watch.own.along, 0, 1) && isWithin(watch.firm, 0, 1) && isWithin(watch.unsure, 0, kUnsure) &&
               areUsable(watch.weights) && areUsable(watch.bend) && areUsable(watch.away) && isUsable(watch.allowed),
           "a watch with no usable numbers");
  }
  for (const auto* const watches : {&at_upper_teeth_, &at_lower_teeth_}) {
    for (const ToothWatch& watch : *watches) {
      expect(isVertex(watch.vertex) && isUsable(watch.allowed) && isUsable(watch.free) && areUsable(watch.rest),
             "a watch at the teeth of no vertex or with no usable numbers");
    }
  }
  for (const Drawn& drawn : drawn_) {
    expect(isVertex(drawn.vertex) && drawn.column < kColumns - 1 && isWithin(drawn.next, 0, 1) &&
               isWithin(drawn.share, -1, 1),
           "a vertex that is drawn from nowhere");
  }
  for (const Levelled& levelled : levelled_)
    expect(isVertex(levelled.vertex) && isColumn(levelled.column) && isUsable(levelled.way),
           "a vertex levelled nowhere");
  expect(std::all_of(watched_columns_.begin(), watched_columns_.end(), isColumn), "a column that is none");
  expect(resting_gaps_.size() == kColumns && drawn_further_.size() == kColumns && areUsable(drawn_further_) &&
             std::none_of(resting_gaps_.begin(), resting_gaps_.end(), [](float gap) { return std::isnan(gap); }),
         "no gaps of the columns");
  for (const TeethShell* const shell : {&upper_teeth_, &lower_teeth_}) {
    expect(shell->edge_.size() == shell->reach_.cols() && shell->bounds_.rows() == shell->reach_.rows() &&
               shell->bounds_.cols() == shell->reach_.cols(),
           "nets of teeth that differ");
    expect(areUsable(shell->reach_.reshaped()) && areUsable(shell->bounds_.reshaped()) && shell->cell_ > 0 &&
               areUsable(std::array{shell->columns_per_turn_, shell->middle_column_, shell->rows_per_height_,
                                    shell->bounded_rows_, shell->axis_x_, shell->axis_z_, shell->lowest_, shell->cell_,
                                    shell->farthest_}),
           "teeth with no usable numbers");
  }
  return true;
}

}  // namespace mouthpiece
