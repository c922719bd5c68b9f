#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "base/files.h"
#include "programs/corpus/command_support.h"
#include "base/text_encoding.h"
#include "phonetics/labels/textgrid.h"
#include "hearing/alignment/forced_alignment.h"

namespace mouthpiece {
namespace {

constexpr std::uint64_t kMaxTranscriptBytes = 1 << 20;

struct AlignCommand {
  bool quiet = false, json = false, sung = false;
  std::filesystem::path audio, transcript_file, lexicon, output;
  std::string transcript;
};

std::string transcriptOf(const AlignCommand& command) {
  if (command.transcript_file.empty()) return command.transcript;
  const std::string file = command.transcript_file.string();
  return decodeText(readFile(command.transcript_file, kMaxTranscriptBytes), file);
}

void printWords(const ForcedAlignment& alignment) {
  nlohmann::json words = nlohmann::json::array();
  for (std::size_t i = 0; i < alignment.labels.words.size(); ++i) {
    const LabelledWord& word = alignment.labels.words[i];
    const TimeSpan span = alignment.labels.spanOf(word.phones);
    words.push_back({{"word", word.text},
                     {"start_s", span.start},
                     {"end_s", span.end},
                     {"confidence", alignment.confidence[i]},
                     {"doubtful", alignment.confidence[i] < kDoubtfulConfidence}});
  }
  printJson(nlohmann::json{{"words", words}});
}

void noteDoubtfulWords(const ForcedAlignment& alignment, bool quiet) {
  for (const std::size_t i : alignment.doubtfulWords()) {
    const LabelledWord& word = alignment.labels.words[i];
    const TimeSpan span = alignment.labels.spanOf(word.phones);
    printNotice(fmt::format("doubtful: '{}' at {:.2f} to {:.2f} s (confidence {:.2f})", word.text, span.start, span.end,
                            alignment.confidence[i]),
                quiet);
  }
}

int runAlign(const AlignCommand& command) {
  const Lexicon lexicon = lexiconFrom(command.lexicon);
  const AudioClip audio = readAudio(command.audio);
  const std::vector<TranscriptWord> words = Pronouncer(&lexicon).wordsOf(transcriptOf(command));
  const SpeechKind kind = command.sung ? SpeechKind::kSung : SpeechKind::kSpoken;
  const ForcedAlignment alignment = ForcedAligner().align(audio, words, command.audio.string(), kind);
  writeTextGrid(command.output, alignment.labels);
  noteDoubtfulWords(alignment, command.quiet);
  if (command.json) {
    printWords(alignment);
  } else if (!command.quiet) {
    printText(fmt::format("{} words, {} doubtful: {}\n", alignment.labels.words.size(),
                          alignment.doubtfulWords().size(), command.output.string()));
  }
  return kExitDone;
}

}  // namespace

void addAlignCommand(CLI::App& app, ChosenAction& chosen) {
  const auto options = std::make_shared<AlignCommand>();
  CLI::App& align =
      addCommand(app, chosen, "align", "When each phone of a known text is said in a sound",
                 "corpus align a.wav --transcript \"the time is now\" --out a.TextGrid", options, runAlign);
  align.add_option("sound", options->audio, "A.wav (.flac)")->required();
  CLI::Option_group& text = *align.add_option_group("what is said", "One of");
  text.add_option("--transcript", options->transcript, "The words");
  text.add_option("--transcript-file", options->transcript_file, "A file with the words");
  text.require_option(1);
  align.add_option("--out,-o", options->output, "The TextGrid to write")->required();
  align.add_flag("--sung", options->sung, "The words are sung: long vowels and pauses");
  addLexiconOption(align, options->lexicon);
  addJsonFlag(align, options->json);
}

}  // namespace mouthpiece
