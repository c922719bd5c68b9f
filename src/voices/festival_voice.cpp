#include <fmt/format.h>

#include <filesystem>
#include <optional>
#include <stdexcept>
#include <utility>

#include "base/child_process.h"
#include "base/errors.h"
#include "base/files.h"
#include "base/index.h"
#include "phonetics/text/speakable_text.h"
#include "voices/engines.h"
#include "voices/festival_script.h"
#include "voices/spoken_line_builder.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

/// 10,000 characters took 12 s of processor time; a loaded machine may be ten times slower.
constexpr Seconds kTimeLimit = 30;
constexpr Seconds kTimeLimitPerCharacter = 0.012;

/// The default heap (10,000,000 cells) costs 0.3 s and 330 MB before the first word.
constexpr std::string_view kHeapCells = "1000000";

std::string debianPackage(std::string_view voice) {
  return voice == "kal_diphone" ? "festvox-kallpc16k" : "festvox-us-slt-hts";
}

/// The first line of Festival's own complaint.
std::string complaint(const ChildResult& result) {
  const auto error = result.output.find("ERROR");
  const auto line_start = error == std::string::npos ? 0 : result.output.rfind('\n', error) + 1;
  std::string line = result.output.substr(line_start, result.output.find('\n', line_start) - line_start);
  return line.empty() ? fmt::format("exit code {}", result.exit_code) : printable(line, 200);
}

void checkResult(const ChildResult& result, std::string_view voice, bool has_labels) {
  if (result.timed_out) throw InputError("festival", "", "took too long and was stopped");
  if (result.output.find(fmt::format("unbound variable : voice_{}", voice)) != std::string::npos) {
    throw InputError("festival", "",
                     fmt::format("has no voice {}. Get it with: sudo apt-get install {}", voice, debianPackage(voice)));
  }
  if (result.exit_code != 0 || !has_labels) {
    throw InputError("festival", "", fmt::format("failed: {}; expected sound and labels", complaint(result)));
  }
}

/// Festival while it answers; once it hangs, fails or answers nonsense, the voice in its place, which says why.
class FestivalVoice : public Voice {
 public:
  /// `voice` becomes part of a Scheme program: one of the table's. No `program`: Festival is not installed.
  FestivalVoice(std::optional<fs::path> program, std::string voice, const Language& language,
                const VoiceOptions& options)
      : program_(std::move(program)), voice_(std::move(voice)), language_(language), options_(options) {
    if (!program_) why_not_ = "Festival is not installed (sudo apt-get install festival festvox-us-slt-hts)";
  }

  SpokenLine speak(std::string_view text) override {
    const std::string speakable = speakableText(text, language_, [&](std::string_view word) {
      return options_.lexicon != nullptr && isSaidByLexicon(word, *options_.lexicon);
    });
    if (why_not_.empty()) {
      try {
        return askFestival(speakable);
      } catch (const FestivalError& error) {
        why_not_ = error.what();
      }
    }
    return speakInItsPlace(text);
  }

 private:
  /// Throws FestivalError, whatever it is that cannot be used.
  [[nodiscard]] SpokenLine askFestival(const std::string& speakable) const {
    const FestivalJob job = makeFestivalJob(voice_, speakable, options_.lexicon);
    const PrivateFolder folder;
    writeFileAtomically(folder.path() / "speak.scm", job.script);
    writeFileAtomically(folder.path() / kFestivalTextFile, job.text);
    const Seconds time_limit = kTimeLimit + kTimeLimitPerCharacter * asReal(job.text.size());
    try {
      const ChildResult result =
          runChild(*program_, {"--heap", std::string(kHeapCells), "-b", "speak.scm"}, folder.path(), time_limit);
      const fs::path labels_path = folder.path() / kFestivalLabelsFile;
      checkResult(result, voice_, fs::exists(labels_path));
      SpokenLineBuilder builder(language_);
      std::size_t number = 0;
      for (FestivalUtterance& utterance : parseFestivalLabels(readFile(labels_path)))
        builder.add(readAudio(folder.path() / festivalWaveFile(number++)), std::move(utterance.phones),
                    utterance.words);
      if (number == 0) throw InputError("festival", "", "said nothing; expected sound and labels");
      return builder.build(speakable, "festival:" + voice_);
    } catch (const InputError& error) {
      throw FestivalError(error.what());
    }
  }

  SpokenLine speakInItsPlace(std::string_view text) {
    constexpr std::string_view kStandIn = "slt";
    if (!stand_in_) stand_in_ = makeFliteVoice(kStandIn, language_, options_);
    SpokenLine line = stand_in_->speak(text);
    line.notice = fmt::format("{}: speaking with flite:{}", why_not_, kStandIn);
    return line;
  }

  struct FestivalError : std::runtime_error {
    using std::runtime_error::runtime_error;
  };

  std::optional<fs::path> program_;
  std::string voice_;
  const Language& language_;
  VoiceOptions options_;
  std::unique_ptr<Voice> stand_in_;
  std::string why_not_;
};

}  // namespace

std::unique_ptr<Voice> makeFestivalVoice(std::string_view name, const Language& language, const VoiceOptions& options) {
  return std::make_unique<FestivalVoice>(findProgram("festival"), std::string(name), language, options);
}

}  // namespace mouthpiece
