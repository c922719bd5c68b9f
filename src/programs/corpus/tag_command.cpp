#include <fmt/format.h>

#include "base/files.h"
#include "programs/corpus/command_support.h"
#include "phonetics/labels/textgrid.h"
#include "hearing/tags/hear_tags.h"
#include "hearing/alignment/forced_alignment.h"
#include "hearing/alignment/lyrics.h"

namespace mouthpiece {
namespace {

struct TagCommand {
  bool quiet = false;
  std::filesystem::path audio, phones, lyrics, lexicon, output;
};

/// The phones that are given, or those of the lyrics where they are heard; null without either.
std::optional<SpeechLabels> labelsFor(const TagCommand& command, const AudioClip& audio) {
  if (!command.phones.empty()) return readTextGrid(command.phones);
  if (command.lyrics.empty()) return std::nullopt;
  const Lexicon lexicon = lexiconFrom(command.lexicon);
  ForcedAlignment alignment = ForcedAligner().align(audio, Pronouncer(&lexicon).wordsOf(readLyrics(command.lyrics)),
                                                    command.audio.string(), SpeechKind::kSung);
  if (const std::string doubts = doubtsAbout(alignment); !doubts.empty())
    printNotice(fmt::format("{}: {}", command.audio.string(), doubts), command.quiet);
  return std::move(alignment.labels);
}

int runTag(const TagCommand& command) {
  const AudioClip audio = readAudio(command.audio);
  const std::optional<SpeechLabels> labels = labelsFor(command, audio);
  const SpeechLabels* known = labels ? &*labels : nullptr;
  const AudioTags tags = hearTags(audio, known);
  writeFileAtomically(command.output, formatTagsJson(tags));
  for (const std::string& warning : soundWarnings(audio, known, tags)) {
    printNotice(fmt::format("{}: {}", command.audio.string(), warning), command.quiet);
  }
  printNotice(fmt::format("{:.2f} s: {} notes, {} with vibrato, {} consonants", audio.duration(), tags.notes.size(),
                          tags.vibrato.size(), tags.consonants.size()),
              command.quiet);
  return kExitDone;
}

}  // namespace

void addTagCommand(CLI::App& app, ChosenAction& chosen) {
  const auto options = std::make_shared<TagCommand>();
  CLI::App& tag = addCommand(app, chosen, "tag", "Pitch, notes, vibrato and sung vowels of a sound",
                             "corpus tag song.wav --phones song.TextGrid --out tags.json", options, runTag);
  tag.add_option("audio", options->audio, "Sound: a voice alone")->required();
  CLI::Option* phones = tag.add_option("--phones", options->phones,
                                       "Its phones (TextGrid); without, every voiced stretch counts as a vowel");
  tag.add_option("--lyrics", options->lyrics, "A file with the words that are sung: its phones are found")
      ->excludes(phones);
  addLexiconOption(tag, options->lexicon);
  tag.add_option("--out", options->output, "tags.json to write")->required();
}

}  // namespace mouthpiece
