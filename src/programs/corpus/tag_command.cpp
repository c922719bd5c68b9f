#include <fmt/format.h>

#include "base/counted.h"
#include "base/files.h"
#include "hearing/alignment/forced_alignment.h"
#include "hearing/alignment/lyrics.h"
#include "hearing/tags/hear_tags.h"
#include "phonetics/labels/textgrid.h"
#include "programs/corpus/command_support.h"
#include "programs/corpus/commands.h"
#include "programs/outputs.h"

namespace mouthpiece {
namespace {

struct TagArguments {
  bool quiet = false;
  std::filesystem::path audio, phones, lyrics, lexicon, output;
};

/// The phones that are given, or those of the lyrics where they are heard; null without either.
std::optional<SpeechLabels> labelsFor(const TagArguments& given, const AudioClip& audio) {
  if (!given.phones.empty()) return readTextGrid(given.phones);
  if (given.lyrics.empty()) return std::nullopt;
  const Lexicon lexicon = lexiconFrom(given.lexicon);
  ForcedAlignment alignment = ForcedAligner().align(audio, Pronouncer(&lexicon).wordsOf(readLyrics(given.lyrics)),
                                                    given.audio.string(), SpeechKind::kSung);
  if (const std::string doubts = doubtsAbout(alignment); !doubts.empty())
    printNotice(fmt::format("{}: {}", given.audio.string(), doubts), given.quiet);
  return std::move(alignment.labels);
}

int runTag(const TagArguments& given) {
  constexpr Seconds kLongestSong = 900;  // 25 MB a minute are held while it is heard
  const AudioClip audio = readAudio(given.audio, {.most = kLongestSong});
  const std::optional<SpeechLabels> labels = labelsFor(given, audio);
  const SpeechLabels* known = labels ? &*labels : nullptr;
  const AudioTags tags = hearTags(audio, known);
  writeFileAtomically(given.output, formatTagsJson(tags));
  for (const std::string& warning : soundWarnings(audio, known, tags)) {
    printNotice(fmt::format("{}: {}", given.audio.string(), warning), given.quiet);
  }
  printNotice(fmt::format("{:.2f} s: {}, {} with vibrato, {}", audio.duration(), counted(tags.notes.size(), "note"),
                          tags.vibrato.size(), counted(tags.consonants.size(), "consonant")),
              given.quiet);
  return kExitDone;
}

void addOptions(CLI::App& command, TagArguments& options) {
  command.add_option("audio", options.audio, "Sound: a voice alone, 15 minutes at most")->required();
  CLI::Option* phones = command.add_option("--phones", options.phones,
                                           "Its phones (TextGrid); without, vowels are found by their loudness");
  command.add_option("--lyrics", options.lyrics, "A file with the words that are sung: its phones are found")
      ->excludes(phones);
  addLexiconOption(command, options.lexicon);
  command.add_option("-o,--out", options.output, "tags.json to write")->required();
  checkOutputs(command, {{"--out"}});
}

}  // namespace

Command tagCommand() {
  return makeCommand("tag", "Pitch, notes, vibrato and sung vowels of a sound",
                     "corpus tag song.wav --phones song.TextGrid --out tags.json", addOptions, runTag);
}

}  // namespace mouthpiece
