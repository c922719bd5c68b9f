#include "hearing/network/word_network.h"

#include <fmt/format.h>

#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <optional>

#include "base/errors.h"
#include "base/index.h"
#include "base/json_fields.h"
#include "base/time.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kProgram = "node", kScript = "hear_words.mjs";
/// An option of V8, in MiB: what has just been made is looked through so early that it takes little memory.
constexpr const char* kYoungSpace = "-max-semi-space-size=2";
constexpr double kRateHz = 16000;
/// A start takes a second, a second of sound a tenth of one: the time after which it hangs.
constexpr Seconds kStartLimit = 60;
constexpr double kSoundLimit = 5;
constexpr std::ptrdiff_t kMostPrograms = 4;     // of 0.3 GB each
constexpr std::size_t kMostWords = 1000;        // of a sound
constexpr std::uint32_t kEncoded = 0xFFFFFFFF;  // in place of a text's bytes: the sound is encoded alone

double logProbabilityOf(const JsonField& field) { return std::min(0.0, field["log_probability"].number()); }

std::vector<NetworkWord> wordsIn(const JsonField& list) {
  std::vector<NetworkWord> words;
  for (const JsonField& word : list.list(0, kMostWords)) words.push_back({word["text"].text(), logProbabilityOf(word)});
  return words;
}

std::vector<NetworkWord> parseWords(std::string_view line) {
  return wordsIn(parseJson(line, kScript, "a list of words"));
}

std::optional<TextScore> parseScore(std::string_view line) {
  constexpr std::int64_t kMostTokens = 10'000;
  const JsonField score = parseJson(line, kScript, "a text's score");
  if (score.isNull()) return std::nullopt;
  TextScore parsed{.words = {},
                   .log_probability = logProbabilityOf(score),
                   .heard = wordsIn(score["heard"]),
                   .heard_log_probability = std::min(0.0, score["heard_log_probability"].number()),
                   .heard_tokens = unsignedIndex(score["heard_tokens"].whole(0, kMostTokens))};
  for (const JsonField& word : score["words"].list(0, kMostWords))
    parsed.words.push_back({logProbabilityOf(word), std::min(0.0, word["behind"].number())});
  return parsed;
}

/// Numbers of 32 bits, of which four digits tell the upper half.
Eigen::MatrixXf parseEncoding(std::string_view line) {
  constexpr std::size_t kDigits = 4, kFrame = kDigits * unsignedIndex(WordNetwork::kEncodedNumbers);
  const JsonField field = parseJson(line, kScript, "an encoding");
  const std::string digits = field.text(line.size());
  const auto frames = signedIndex(digits.size() / kFrame);
  Eigen::MatrixXf encoding(WordNetwork::kEncodedNumbers, frames);
  bool is_well = digits.size() % kFrame == 0;
  for (std::size_t i = 0; is_well && i < unsignedIndex(encoding.size()); ++i) {
    const char *const first = digits.data() + kDigits * i, *const end = first + kDigits;
    std::uint16_t upper = 0;
    is_well = std::from_chars(first, end, upper, 16).ptr == end;
    float& number = encoding.data()[i];
    number = std::bit_cast<float>(std::uint32_t{upper} << 16U);
    is_well = is_well && std::isfinite(number);
  }
  if (!is_well) field.fail(fmt::format("expected frames of {} numbers", WordNetwork::kEncodedNumbers));
  return encoding;
}

template <typename Value>
std::string_view bytesOf(std::span<const Value> values) {
  return {reinterpret_cast<const char*>(values.data()), values.size_bytes()};
}

}  // namespace

/// A program of the network for as long as this lives; it waits for the next one then, unless it failed.
class WordNetwork::Asking {
 public:
  explicit Asking(WordNetwork& network) : network_(network), turn_(network.turns_) {
    {
      const std::scoped_lock lock(network_.changing_);
      if (!network_.waiting_.empty()) {
        child_ = std::move(network_.waiting_.back());
        network_.waiting_.pop_back();
        return;
      }
    }
    const std::optional<fs::path> program = findProgram(kProgram);
    if (!program) throw InputError(std::string(kProgram), "", "is not there; sudo apt-get install nodejs");
    const std::vector<std::string> arguments{kYoungSpace, fs::absolute(network_.folder_ / kScript).string()};
    child_ = std::make_unique<AnsweringChild>(*program, arguments, std::string(kScript));
  }
  Asking(const Asking&) = delete;
  Asking& operator=(const Asking&) = delete;
  ~Asking() {
    if (!is_well_) return;
    const std::scoped_lock lock(network_.changing_);
    network_.waiting_.push_back(std::move(child_));
  }

  /// What `parse` makes of the line of JSON that answers a sound. `text`: its words, empty where they are asked for;
  /// none: the sound is to be encoded.
  template <typename Parse>
  auto answerTo(std::span<const std::int16_t> sound, std::optional<std::string_view> text, Parse parse,
                const std::stop_token& stop = {}) {
    const std::array<std::uint32_t, 2> head{static_cast<std::uint32_t>(sound.size()),
                                            text ? static_cast<std::uint32_t>(text->size()) : kEncoded};
    std::string request(bytesOf(std::span<const std::uint32_t>(head)));
    request.append(bytesOf(sound)).append(text.value_or(""));
    is_well_ = false;
    auto parsed = parse(child_->ask(request, kStartLimit + kSoundLimit * asReal(sound.size()) / kRateHz, stop));
    is_well_ = true;
    return parsed;
  }

 private:
  struct Turn {
    explicit Turn(std::counting_semaphore<>& turns) : of(turns) { of.acquire(); }
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;
    ~Turn() { of.release(); }
    std::counting_semaphore<>& of;
  };

  WordNetwork& network_;
  Turn turn_;
  std::unique_ptr<AnsweringChild> child_;
  bool is_well_ = true;
};

WordNetwork::WordNetwork(fs::path folder) : folder_(std::move(folder)), turns_(kMostPrograms) {}
WordNetwork::~WordNetwork() = default;

bool WordNetwork::isThere() const {
  std::error_code error;  // the script reads samples as they lie in memory
  return std::endian::native == std::endian::little && !folder_.empty() && fs::exists(folder_ / kScript, error) &&
         findProgram(kProgram).has_value();
}

std::vector<std::vector<NetworkWord>> WordNetwork::hear(std::span<const std::span<const std::int16_t>> sounds,
                                                        const std::stop_token& stop) {
  Asking asking(*this);
  std::vector<std::vector<NetworkWord>> words;
  for (const auto sound : sounds) words.push_back(asking.answerTo(sound, "", parseWords, stop));
  return words;
}

Eigen::MatrixXf WordNetwork::encode(std::span<const std::int16_t> sound, const std::stop_token& stop) {
  return Asking(*this).answerTo(sound, std::nullopt, parseEncoding, stop);
}

void WordNetwork::endWaiting() {
  std::vector<std::unique_ptr<AnsweringChild>> ended;
  const std::scoped_lock lock(changing_);
  ended.swap(waiting_);
}

std::vector<std::optional<TextScore>> WordNetwork::score(std::span<const std::span<const std::int16_t>> sounds,
                                                         std::span<const std::vector<std::string>> texts) {
  MOUTHPIECE_EXPECT(texts.size() == sounds.size());
  Asking asking(*this);
  std::vector<std::optional<TextScore>> scores;
  for (std::size_t i = 0; i < texts.size(); ++i) {
    const std::string text = fmt::format("{}", fmt::join(texts[i], " "));
    scores.push_back(asking.answerTo(sounds[i], text, parseScore));
    if (scores[i] && scores[i]->words.size() != texts[i].size() + 1)
      throw InputError(std::string(kScript), "",
                       fmt::format("found {} scores; expected {}", scores[i]->words.size(), texts[i].size() + 1));
  }
  return scores;
}

}  // namespace mouthpiece
