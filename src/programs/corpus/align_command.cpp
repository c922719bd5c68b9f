#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "base/counted.h"
#include "base/errors.h"
#include "base/files.h"
#include "base/text_encoding.h"
#include "hearing/alignment/forced_alignment.h"
#include "hearing/alignment/untold_speech.h"
#include "hearing/network/network_doubt.h"
#include "hearing/network/network_phones.h"
#include "phonetics/labels/label_files.h"
#include "programs/corpus/command_support.h"
#include "programs/corpus/commands.h"
#include "programs/outputs.h"
#include "speaker/shared_files.h"

namespace mouthpiece {
namespace {

constexpr std::uint64_t kMaxTranscriptBytes = 1 << 20;

struct AlignArguments {
  bool quiet = false, json = false, sung = false;
  std::filesystem::path audio, transcript_file, lexicon, output;
  std::string transcript, language = "en";
};

std::string transcriptOf(const AlignArguments& given) {
  if (given.transcript_file.empty()) return given.transcript;
  const std::string file = given.transcript_file.string();
  return decodeText(readFile(given.transcript_file, kMaxTranscriptBytes), file);
}

void printWords(const ForcedAlignment& alignment) {
  nlohmann::json words = nlohmann::json::array();
  const std::vector<std::size_t> doubtful = alignment.doubtfulWords();
  for (std::size_t i = 0; i < alignment.labels.words.size(); ++i) {
    const LabelledWord& word = alignment.labels.words[i];
    const TimeSpan span = alignment.labels.spanOf(word.phones);
    words.push_back({{"word", word.text},
                     {"start_s", span.start},
                     {"end_s", span.end},
                     {"confidence", alignment.confidence[i]},
                     {"doubtful", std::find(doubtful.begin(), doubtful.end(), i) != doubtful.end()}});
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

int runAlign(const AlignArguments& given) {
  const Language& language = languageOf(given.language);
  const Lexicon lexicon = lexiconFrom(given.lexicon, language);
  const AudioClip audio = readAudio(given.audio);
  const Pronouncer pronouncer(&lexicon, language);
  const std::vector<TranscriptWord> words = pronouncer.wordsOf(transcriptOf(given));
  const SpeechKind kind = given.sung ? SpeechKind::kSung : SpeechKind::kSpoken;
  const SamplesToHear to_hear(audio);
  ForcedAligner aligner({}, language);
  const std::shared_ptr<WordNetwork> network = sharedWordNetwork();
  std::string fault;
  HeardPhones heard;
  if (!given.sung) heard = phonesBesideText(*network, to_hear.all(), language, fault);
  ForcedAlignment alignment =
      aligner.align(to_hear, audio.duration(), words, given.audio.string(), kind, BorderTimes::kFine, heard);
  if (fault.empty()) fault = judgeByNetwork(*network, pronouncer, to_hear, alignment);
  if (!fault.empty()) printNotice(fault, given.quiet);
  writeLabels(given.output, alignment.labels, {.name = given.audio.stem().string()});
  noteDoubtfulWords(alignment, given.quiet);
  const std::string untold = given.sung ? "" : untoldSpeech(to_hear.all(), alignment.labels);
  if (!untold.empty()) printNotice(untold, given.quiet);
  if (given.json) {
    printWords(alignment);
  } else if (!given.quiet) {
    printText(fmt::format("{}, {} doubtful: {}\n", counted(alignment.labels.words.size(), "word"),
                          alignment.doubtfulWords().size(), given.output.string()));
  }
  return kExitDone;
}

void addOptions(CLI::App& command, AlignArguments& options) {
  command.add_option("sound", options.audio, "A.wav (.flac)")->required();
  CLI::Option_group& text = *command.add_option_group("what is said", "One of");
  text.add_option("--transcript", options.transcript, "The words");
  text.add_option("--transcript-file", options.transcript_file, "A file with the words");
  text.require_option(1);
  command.add_option("--out,-o", options.output, "The labels to write: .TextGrid .lab .phn .ctm .txt")->required();
  checkOutputs(command, {{"--out", OutputKind::kLabels}});
  command.add_flag("--sung", options.sung, "The words are sung: long vowels and pauses");
  addLexiconOption(command, options.lexicon);
  addLanguageOption(command, options.language);
  addJsonFlag(command, options.json);
}

}  // namespace

Command alignCommand() {
  return makeCommand("align", "When each phone of a known text is said in a sound",
                     "corpus align a.wav --transcript \"the time is now\" --out a.TextGrid", addOptions, runAlign);
}

}  // namespace mouthpiece
