#include "hearing/recognition/word_network.h"

#include <fmt/format.h>

#include <bit>

#include "base/child_process.h"
#include "base/errors.h"
#include "base/files.h"
#include "base/index.h"
#include "base/json_fields.h"
#include "base/time.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kProgram = "node", kScript = "hear_words.mjs", kAnswers = "answers", kTexts = "texts";
constexpr double kRateHz = 16000;
/// A start takes a second, a second of sound a tenth of one: the time after which it hangs.
constexpr Seconds kStartLimit = 60;
constexpr double kSoundLimit = 5;
constexpr std::size_t kMostWords = 1000;  // of a sound
constexpr std::size_t kLongestSaid = 300;

std::vector<NetworkWord> parseWords(std::string_view line) {
  std::vector<NetworkWord> words;
  for (const JsonField& word : parseJson(line, kScript, "a list of words").list(0, kMostWords))
    words.push_back({word["text"].text(), std::min(0.0, word["log_probability"].number())});
  return words;
}

std::vector<WordScore> parseScores(std::string_view line) {
  std::vector<WordScore> scores;
  for (const JsonField& score : parseJson(line, kScript, "a list of scores").list(0, kMostWords))
    scores.push_back({std::min(0.0, score["log_probability"].number()), std::min(0.0, score["behind"].number())});
  return scores;
}

template <typename Value>
std::string_view bytesOf(std::span<const Value> values) {
  return {reinterpret_cast<const char*>(values.data()), values.size_bytes()};
}

/// A line of JSON of each sound, by `parse`. `texts`: a line of each, or nothing.
template <typename Parse>
auto answersOf(const fs::path& folder, std::span<const std::span<const std::int16_t>> sounds, const std::string& texts,
               Parse parse) {
  const std::optional<fs::path> program = findProgram(kProgram);
  if (!program) throw InputError(std::string(kProgram), "", "is not there; sudo apt-get install nodejs");
  const PrivateFolder scratch;
  const fs::path answers = scratch.path() / kAnswers;
  Seconds length = 0;
  for (const auto sound : sounds) length += asReal(sound.size()) / kRateHz;
  std::vector<std::string> arguments{fs::absolute(folder / kScript).string(), answers.string()};
  if (!texts.empty()) {
    arguments.push_back((scratch.path() / kTexts).string());
    writeFileAtomically(arguments.back(), texts);
  }
  const ChildResult result =
      runChild(*program, arguments, scratch.path(), kStartLimit + kSoundLimit * length, [&](const ChildInput& send) {
        for (const auto sound : sounds) {
          const auto count = static_cast<std::uint32_t>(sound.size());
          if (!send(bytesOf(std::span(&count, 1))) || !send(bytesOf(sound))) return;
        }
      });
  if (result.timed_out) throw InputError(std::string(kScript), "", "hung");
  if (result.exit_code != 0) {
    throw InputError(std::string(kScript), "", fmt::format("failed: {}", printable(result.output, kLongestSaid)));
  }
  std::vector<decltype(parse(std::string_view()))> parsed;
  const std::string text = readFile(answers);
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    parsed.push_back(parse(std::string_view(text).substr(at, end - at)));
    at = end + 1;
  }
  if (parsed.size() != sounds.size()) {
    throw InputError(std::string(kScript), "",
                     fmt::format("found {} answers; expected {}", parsed.size(), sounds.size()));
  }
  return parsed;
}

}  // namespace

bool hasWordNetwork(const fs::path& folder) {
  std::error_code error;  // the script reads samples as they lie in memory
  return std::endian::native == std::endian::little && !folder.empty() && fs::exists(folder / kScript, error) &&
         findProgram(kProgram).has_value();
}

std::vector<std::vector<NetworkWord>> hearWords(const fs::path& folder,
                                                std::span<const std::span<const std::int16_t>> sounds) {
  return answersOf(folder, sounds, "", parseWords);
}

std::vector<std::vector<WordScore>> scoreWords(const fs::path& folder,
                                               std::span<const std::span<const std::int16_t>> sounds,
                                               std::span<const std::vector<std::string>> texts) {
  MOUTHPIECE_EXPECT(texts.size() == sounds.size());
  std::string lines;
  for (const std::vector<std::string>& words : texts) lines += fmt::format("{}\n", fmt::join(words, " "));
  std::vector<std::vector<WordScore>> scores = answersOf(folder, sounds, lines, parseScores);
  for (std::size_t i = 0; i < texts.size(); ++i) {
    if (!scores[i].empty() && scores[i].size() != texts[i].size() + 1)
      throw InputError(std::string(kScript), "",
                       fmt::format("found {} scores; expected {}", scores[i].size(), texts[i].size() + 1));
  }
  return scores;
}

}  // namespace mouthpiece
