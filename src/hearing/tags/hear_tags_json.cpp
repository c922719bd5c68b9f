#include <array>
#include <string>
#include <string_view>
#include <utility>

#include "base/text_numbers.h"
#include "hearing/tags/hear_tags.h"

namespace mouthpiece {
namespace {

/// Writes the rows of a list, a line each: several times faster than a tree of values, for there are 100 a second.
class RowWriter {
 public:
  RowWriter(std::string& text, std::string_view name) : text_(text) {
    text_ += text_.empty() ? "{\"" : ",\n\"";
    text_ += name;
    text_ += "\":[";
  }
  RowWriter(const RowWriter&) = delete;
  RowWriter& operator=(const RowWriter&) = delete;
  ~RowWriter() { text_ += "]"; }

  void beginRow() {
    text_ += is_first_row_ ? "\n{" : ",\n{";
    is_first_row_ = false;
    is_first_field_ = true;
  }
  void endRow() { text_ += '}'; }
  void number(std::string_view key, double value, int decimals) {
    this->key(key);
    appendFixed(text_, value, decimals);
  }
  void flag(std::string_view key, bool value) {
    this->key(key);
    text_ += value ? "true" : "false";
  }
  void span(const TimeSpan& span) {
    number("start_s", span.start, 4);
    number("end_s", span.end, 4);
  }

 private:
  void key(std::string_view key) {
    if (!is_first_field_) text_ += ',';
    is_first_field_ = false;
    text_ += '"';
    text_ += key;
    text_ += "\":";
  }

  std::string& text_;
  bool is_first_row_ = true;
  bool is_first_field_ = true;
};

template <typename List, typename Write>
void writeList(std::string& text, std::string_view name, const List& list, Write write) {
  RowWriter rows(text, name);
  for (const auto& entry : list) {
    rows.beginRow();
    write(rows, entry);
    rows.endRow();
  }
}

}  // namespace

std::string formatTagsJson(const AudioTags& tags) {
  std::string text;
  writeList(text, "f0", tags.f0, [](RowWriter& row, const PitchSample& sample) {
    row.number("time_s", sample.time, 2);
    row.number("hz", sample.hz, 2);
    row.flag("voiced", sample.voiced);
  });
  writeList(text, "notes", tags.notes, [](RowWriter& row, const SungNote& note) {
    row.span(note.span);
    row.number("hz", note.hz, 2);
  });
  writeList(text, "vibrato", tags.vibrato, [](RowWriter& row, const VibratoSpan& vibrato) {
    row.span(vibrato.span);
    row.number("rate_hz", vibrato.rate_hz, 3);
    row.number("depth_semitones", vibrato.depth_semitones, 3);
  });
  writeList(text, "vowels", tags.vowels, [](RowWriter& row, const VowelLikelihood& vowel) {
    row.number("time_s", vowel.time, 2);
    const std::array<std::pair<std::string_view, double>, 6> shares{
        {{"A", vowel.a}, {"E", vowel.e}, {"I", vowel.i}, {"O", vowel.o}, {"U", vowel.u}, {"silence", vowel.silence}}};
    for (const auto& [name, share] : shares) row.number(name, share, 4);
  });
  writeList(text, "consonants", tags.consonants, [](RowWriter& row, const ConsonantEnergy& consonant) {
    row.number("phone", static_cast<double>(consonant.phone.value), 0);
    row.span(consonant.span);
    row.number("energy", consonant.energy, 9);
  });
  text += "}\n";
  return text;
}

}  // namespace mouthpiece
