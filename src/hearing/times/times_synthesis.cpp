// What programs that speak tell of their own speech, each by its documentation (docs/formats/times.md).
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/text_numbers.h"
#include "hearing/times/times_reader.h"

namespace mouthpiece {
namespace {

/// Azure's viseme ids, 0 to 21, each by a phone of its row in the documentation.
std::optional<Phone> phoneOfViseme(std::int64_t id) {
  using enum Phone;
  constexpr std::array<Phone, 22> kPhones = {kSil, kAE, kAA, kAO, kEH, kER, kIY, kUW, kOW, kAW, kOY,
                                             kAY,  kHH, kR,  kL,  kS,  kSH, kDH, kF,  kT,  kK,  kP};
  const Phone phone = kPhones[static_cast<std::size_t>(id)];
  return phone == kSil ? std::nullopt : std::optional<Phone>(phone);
}

/// Piper's phoneme alignments: eSpeak's symbols one code point each, and how many samples each lasts.
class PiperReader {
 public:
  PiperReader(TimesBuilder& builder, const Language& language) : builder_(builder), language_(language) {}

  void addChunk(const JsonField& chunk) {
    const double step = 1 / chunk["sample_rate"].number(1000, 768000);
    for (const JsonField& entry : chunk["phoneme_alignments"].list()) {
      const std::string symbol = entry["phoneme"].text(64);
      const Seconds end = at_ + entry["num_samples"].number(0, 1e12) * step;
      add(symbol, {at_, end}, entry.path());
      at_ = end;
    }
    flush();
  }

 private:
  /// A stress mark's and a length mark's time is the sound's beside it; what modifies the sound before it joins that.
  void add(const std::string& symbol, const TimeSpan& span, const std::string& place) {
    if (symbol == "ˈ" || symbol == "ˌ") {
      flush();
      stress_ = symbol == "ˈ" ? 1 : 2;
      start_early_ = start_early_.value_or(span.start);
      return;
    }
    std::vector<std::string> unknown;
    const bool modifies = phonesOfSymbol(symbol, PhoneSet::kIpa, language_, unknown).empty() && unknown.empty();
    const std::string both = pending_ + symbol;
    if (!pending_.empty() && (modifies ? isMark(symbol) : phoneFromName(both, PhoneSet::kIpa, language_).has_value())) {
      pending_ = both;
      span_.end = span.end;
      return;
    }
    flush();
    if (!modifies) {
      pending_ = symbol;
      span_ = {start_early_.value_or(span.start), span.end};
      place_ = place;
    }
    start_early_.reset();
  }

  /// Neither a blank nor one of ASCII's signs: those are pauses.
  static bool isMark(std::string_view symbol) {
    return !symbol.empty() && static_cast<unsigned char>(symbol.front()) >= 0x80;
  }

  void flush() {
    if (pending_.empty()) return;
    std::vector<std::string> unknown;
    const std::vector<SpelledPhone> phones = phonesOfSymbol(pending_, PhoneSet::kIpa, language_, unknown);
    for (const std::string& symbol : unknown) builder_.addNotSaid(symbol);
    builder_.addPhones(phones, span_, place_, false, stress_);
    if (std::ranges::any_of(phones, [](const SpelledPhone& each) { return isVowel(each.phone); })) stress_ = 0;
    pending_.clear();
  }

  TimesBuilder& builder_;
  const Language& language_;
  Seconds at_ = 0;
  std::string pending_, place_;
  TimeSpan span_;
  std::optional<Seconds> start_early_;
  int stress_ = 0;  ///< of the next vowel
};

/// Characters with their times, which follow one another over several pieces of sound; blanks part words.
class CharacterReader {
 public:
  explicit CharacterReader(TimesBuilder& builder) : builder_(builder) {}

  void add(const std::string& character, const TimeSpan& own, const std::string& place) {
    end_ = own.end;
    if (trimmed(character).empty() || character == "\n") return finish();
    if (word_.empty()) {
      span_.start = own.start;
      place_ = place;
    }
    word_ += character;
    span_.end = own.end;
  }
  void finish() {
    if (!word_.empty()) builder_.addWord(word_, span_, place_);
    word_.clear();
  }
  [[nodiscard]] const std::string& word() const { return word_; }
  /// Of the last character, a blank's too.
  [[nodiscard]] Seconds end() const { return end_; }

 private:
  TimesBuilder& builder_;
  std::string word_, place_;
  TimeSpan span_;
  Seconds end_ = 0;
};

/// One of Amazon's visemes, by the phone that looks so.
struct PollyViseme {
  std::string_view name;
  Phone phone;
  std::string_view ipa = {};
};

/// Those of English and Spanish. [β] is a B whose lips do not touch.
const PollyViseme* pollyViseme(std::string_view name) {
  using enum Phone;
  static constexpr std::array<PollyViseme, 19> kVisemes = {{{"p", kP},
                                                            {"t", kT},
                                                            {"S", kSH},
                                                            {"T", kTH},
                                                            {"f", kF},
                                                            {"k", kK},
                                                            {"i", kIY},
                                                            {"r", kR},
                                                            {"s", kS},
                                                            {"u", kUW},
                                                            {"@", kAH},
                                                            {"a", kAA},
                                                            {"e", kEY},
                                                            {"E", kEH},
                                                            {"o", kOW},
                                                            {"O", kAO},
                                                            {"B", kB, "β"},
                                                            {"J", kY},
                                                            {"sil", kSil}}};
  const auto* const found = std::ranges::find_if(kVisemes, [&](const PollyViseme& row) { return row.name == name; });
  return found == kVisemes.end() ? nullptr : found;
}

}  // namespace

TimesFile parseAzureEvents(const std::vector<TimesEntry>& events, std::string_view name) {
  TimesBuilder builder(name, "Azure visemes");
  builder.setShapes();
  std::optional<Phone> shape;
  double start = -1;
  for (const auto& [event, place] : events) {
    const double time = either(event, {"AudioOffset", "audio_offset", "audioOffset"}).number() * kTick;
    const JsonField viseme = either(event, {"VisemeId", "viseme_id", "visemeId"});
    if (!viseme.exists()) {
      const double end = time + either(event, {"Duration", "duration"}).number() * kTick;
      builder.addWord(either(event, {"Text", "text"}).text(), {time, end}, place);
      continue;
    }
    if (start >= 0) builder.addPhone(shape, {start, time}, place);
    shape = phoneOfViseme(viseme.whole(0, 21));
    start = time;
  }
  constexpr Seconds kLast = 0.1;
  if (start >= 0) builder.addPhone(shape, {start, start + kLast}, events.back().place);
  return builder.finish();
}

TimesFile parseElevenLabs(const std::vector<TimesEntry>& chunks, std::string_view name) {
  TimesBuilder builder(name, "ElevenLabs JSON");
  CharacterReader reader(builder);
  for (const TimesEntry& chunk : chunks) {
    const JsonField& json = chunk.json;
    JsonField alignment = either(json, {"alignment", "normalized_alignment", "normalizedAlignment"});
    if (alignment.exists() && alignment.isNull())
      alignment = either(json, {"normalized_alignment", "normalizedAlignment"});
    if (alignment.exists() && alignment.isNull()) continue;  // the last piece of a stream has none
    if (!alignment.exists()) {
      if (chunks.size() > 1) continue;
      alignment = json;
    }
    const bool is_socket = alignment["chars"].exists();  // milliseconds, and lengths in place of ends
    const std::vector<JsonField> characters = alignment[is_socket ? "chars" : "characters"].list();
    if (!characters.empty() && characters.front().isObject()) {  // of a recording whose words were given
      for (const JsonField& each : characters)
        reader.add(each["text"].text(64), {each["start"].number(), each["end"].number()}, each.path());
      continue;
    }
    const auto timesIn = [&](std::initializer_list<std::string_view> keys) {
      return either(alignment, keys).list(characters.size(), characters.size());
    };
    const double unit = is_socket ? kMillisecond : 1;
    const std::vector<JsonField> starts =
        is_socket ? timesIn({"charStartTimesMs", "char_start_times_ms"}) : timesIn({"character_start_times_seconds"});
    const std::vector<JsonField> ends =
        is_socket ? timesIn({"charDurationsMs", "char_durations_ms", "charsDurationsMs", "chars_durations_ms"})
                  : timesIn({"character_end_times_seconds"});
    constexpr Seconds kForgiven = 0.05;
    // A piece of a stream counts from its own beginning, or from the whole's.
    const bool from_own = !starts.empty() && starts.front().number() * unit < reader.end() - kForgiven;
    const Seconds before = from_own && chunks.size() > 1 ? reader.end() : 0;
    for (std::size_t i = 0; i < characters.size(); ++i) {
      const Seconds start = before + starts[i].number() * unit;
      const Seconds end = is_socket ? start + ends[i].number() * unit : before + ends[i].number();
      if (!reader.word().empty() && start < reader.end() - kForgiven)
        starts[i].refuse(fmt::format("a time from {} s on", reader.end()));
      reader.add(characters[i].text(64), {start, end}, characters[i].path());
    }
    // Within a word a piece may end, after a sentence no blank need follow.
    if (!reader.word().empty() && std::string_view(".!?;:").find(reader.word().back()) != std::string_view::npos)
      reader.finish();
  }
  reader.finish();
  return builder.finish();
}

TimesFile parsePiper(const std::vector<TimesEntry>& chunks, std::string_view name, const Language& language) {
  TimesBuilder builder(name, "Piper JSON");
  PiperReader reader(builder, language);
  for (const TimesEntry& chunk : chunks) reader.addChunk(chunk.json);
  return builder.finish();
}

/// In milliseconds and without ends: each lasts until the next.
TimesFile parsePolly(const std::vector<TimesEntry>& marks, std::string_view name) {
  TimesBuilder builder(name, "Polly speech marks");
  std::string word, word_place;
  double word_start = -1, shape_start = -1, last = 0;
  const PollyViseme* shape = nullptr;
  std::optional<JsonField> unknown;
  const auto finishWord = [&](double end) {
    if (word_start >= 0) builder.addWord(word, {word_start, end}, word_place);
    word_start = -1;
  };
  const auto finishShape = [&](double end, const std::string& place) {
    if (shape != nullptr && shape_start >= 0)
      builder.addPhone({.phone = shape->phone, .span = {shape_start, end}, .ipa = std::string(shape->ipa)}, place);
  };
  for (const auto& [mark, place] : marks) {
    const std::string type = mark["type"].name(32);
    const double time = mark["time"].number(0) * kMillisecond;
    last = time;
    if (type == "word") {
      finishWord(time);
      word = mark["value"].text();
      word_start = time;
      word_place = place;
    } else if (type == "viseme") {
      finishShape(time, place);
      shape = pollyViseme(mark["value"].name(16));
      if (shape == nullptr && !unknown) unknown = mark["value"];
      // A word ends where the mouth comes to rest.
      if (shape != nullptr && shape->phone == Phone::kSil) finishWord(time);
      shape_start = time;
    }
  }
  constexpr Seconds kLast = 0.3;
  finishWord(last + kLast);
  finishShape(shape_start + 0.1, "end");
  builder.setShapes();
  TimesFile times = builder.finish();
  // Where there are words the shapes are not needed.
  if (unknown && times.words.empty()) unknown->refuse("one of Amazon Polly's visemes");
  return times;
}

}  // namespace mouthpiece
