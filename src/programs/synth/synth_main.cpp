// synth: a typed or recorded line becomes sound, marker motion, a moving face and a page to watch it on.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/errors.h"
#include "base/files.h"
#include "programs/synth/batch_list.h"
#include "programs/program.h"
#include "programs/synth/synth_job.h"
#include "hearing/alignment/lyrics.h"

namespace mouthpiece {
namespace {

constexpr std::uint64_t kMaxTextFileBytes = 1 << 20;

struct CommandLine {
  LineSource source;
  std::filesystem::path text_file;
  std::string transcript;
  std::filesystem::path lyrics;
  SynthOptions options;
  std::filesystem::path out_folder = "out";
  std::vector<std::filesystem::path> out_files;
  std::filesystem::path batch_list;
  std::string shard = "1/1";
  bool quiet = false;
  bool json = false;
};

/// An option whose value is one of a few names.
template <typename Value>
void addChoice(CLI::App& app, const std::string& option, Value& value, const std::map<std::string, Value>& names,
               const std::string& help) {
  std::string known;
  for (const auto& [name, unused] : names) known += (known.empty() ? "" : "|") + name;
  app.add_option_function<std::string>(
         option,
         [&value, names, option, known](const std::string& name) {
           const auto found = names.find(name);
           if (found == names.end())
             throw CLI::ValidationError(option, fmt::format("found '{}'; expected {}", name, known));
           value = found->second;
         },
         help)
      ->type_name(known);
}

void addCurveOptions(CLI::App& app, CommandLine& line) {
  addChoice(app, "--backoff", line.options.backoff,
            {{"vocal", BackoffKind::kVocal}, {"viseme", BackoffKind::kViseme}, {"none", BackoffKind::kNone}},
            "A phone pair the corpus lacks: vocal takes the nearest pair by viseme class, moved to where the corpus "
            "predicts the lips, and draws VOCAL's curves where there is none or with --select greedy; viseme takes "
            "the nearest pair as it is; none refuses (default: vocal)");
  addChoice(app, "--style", line.options.synthesis.curves.alone,
            {{"speech", std::optional(CurveStyle::kSpeech)}, {"sing", std::optional(CurveStyle::kSing)}},
            "Make all of the motion from curves, as spoken or as sung (default: captured units)");
  app.add_option("--ma", line.options.ma, "Melodic accent, 0 to 1, auto, or a file of time_s,value");
  app.add_option("--ps", line.options.ps, "Pitch sensitivity, 0 to 1, auto, or a file of time_s,value");
  app.add_option("--ja", line.options.ja, "Jaw, 0 to 2 (1 as the actor), or a file of time_s,value");
  app.add_option("--li", line.options.li, "Lips, 0 to 2 (1 as the actor), or a file of time_s,value");
  app.add_option("--edits", line.options.edits, "An animator's changes to the curves (edits.json)");
}

void addSharedOptions(CLI::App& app, CommandLine& line) {
  SynthesisOptions& synthesis = line.options.synthesis;
  synthesis.selection.method = SelectionMethod::kViterbi;
  app.add_option("--corpus", line.options.corpus, "Corpus to take the movements from (default: the sample corpus)");
  app.add_option("--face", line.options.face, "Face to move, made by `retarget fit` (default: the sample face)");
  app.add_option("--voice", line.options.voice,
                 "festival:cmu_us_slt_arctic_hts festival:kal_diphone flite:slt|rms|awb|kal16 espeak:en-us corpus")
      ->capture_default_str();
  app.add_option("--rate", line.options.rate,
                 "With --voice corpus: speaking rate, 1 as fast as Festival would speak (default: as it was recorded)")
      ->check(CLI::Range(0.4, 2.5));
  app.add_option("--lexicon", line.options.lexicon, "Pronunciations that go before the voice's own");
  app.add_option("--fps", synthesis.frame_rate_hz, "Frames a second, 24 to 240")->capture_default_str();
  addChoice(app, "--select", synthesis.selection.method,
            {{"greedy", SelectionMethod::kGreedy}, {"viterbi", SelectionMethod::kViterbi}},
            "greedy: the longest fragment each time; viterbi: the cheapest path of all (default: viterbi)");
  addChoice(app, "--units", synthesis.selection.units, {{"any", UnitScales::kAny}, {"paper", UnitScales::kPaper}},
            "any: every fragment; paper: sentences, words, syllables and diphones (default: any)");
  addChoice(app, "--blend", synthesis.blend,
            {{"smooth", BlendKind::kSmooth},
             {"linear", BlendKind::kLinear},
             {"cosine", BlendKind::kCosine},
             {"exponential", BlendKind::kExponential}},
            "How neighbours fade into each other (default: smooth)");
  app.add_option("--overlap-ms", synthesis.overlap_ms, "Blend between two fragments; viterbi takes up to twice that")
      ->capture_default_str();
  addCurveOptions(app, line);
  addQuietFlag(app, line.quiet);
  addJsonFlag(app, line.json);
}

void addLineOptions(CLI::App& app, CommandLine& line) {
  auto* text = app.add_option("--text", line.source.text, "The line to speak");
  auto* file = app.add_option("--text-file", line.text_file, "A file with the line to speak");
  auto* audio = app.add_option("--audio", line.source.audio,
                               "A recording to animate instead; needs --phones, --transcript or --lyrics");
  auto* phones = app.add_option("--phones", line.source.phones, "Labels of the recording: TextGrid, .lab or .phn");
  auto* transcript = app.add_option("--transcript", line.transcript, "What the recording says: its labels are found");
  transcript->needs(audio)->excludes(phones);
  auto* lyrics = app.add_option("--lyrics", line.lyrics, "The recording is of a song; a file with its words");
  lyrics->needs(audio)->excludes(transcript);
  auto* song = app.add_option("--song", line.source.song, "A song to sing: song.json or MusicXML");
  song->excludes(text, file, audio);
  text->excludes(file, audio);
  file->excludes(audio);
  phones->needs(audio);
  auto* folder = app.add_option("--out", line.out_folder,
                                "Folder for all files: speech.wav motion.c3d motion.csv face.glb curves.json "
                                "phones.TextGrid view.html report.json")
                     ->capture_default_str();
  app.add_option("-o", line.out_files,
                 "A single file, repeatable; its kind follows from the ending (of curves: "
                 "curves.json, curves.csv with the same keys, curve_frames.csv; ablation.html: what each part of VOCAL "
                 "does to them)")
      ->excludes(folder);
}

/// The typed line itself, wherever it came from.
LineSource sourceOf(const CommandLine& line) {
  LineSource source = line.source;
  source.is_sung = !line.lyrics.empty() || !line.source.song.empty();
  if (!line.lyrics.empty()) source.text = readLyrics(line.lyrics);
  if (!line.transcript.empty()) source.text = line.transcript;
  if (!line.text_file.empty()) source.text = readFile(line.text_file, kMaxTextFileBytes);
  return source;
}

std::vector<OutputFile> outputsOf(const CommandLine& line) {
  if (line.out_files.empty()) return allOutputFiles(line.out_folder);
  std::vector<OutputFile> outputs;
  for (const auto& path : line.out_files) outputs.push_back(outputFileFor(path));
  return outputs;
}

void printOutcome(const SynthOutcome& outcome, const std::vector<OutputFile>& outputs, const CommandLine& line) {
  for (const std::string& notice : outcome.notices) printNotice(notice, line.quiet);
  if (line.json) {
    printText(outcome.report_json);
  } else if (!line.quiet) {
    printText(fmt::format("{:.2f} s of speech from {} unit{}, {} backed off; {:.3f} x real time\n", outcome.duration,
                          outcome.unit_count, outcome.unit_count == 1 ? "" : "s", outcome.backoff_count,
                          outcome.real_time_factor));
    for (const OutputFile& output : outputs) printText("  " + output.path.string() + "\n");
  }
}

int speakOneLine(const CommandLine& line) {
  const std::vector<OutputFile> outputs = outputsOf(line);
  const LineSource source = sourceOf(line);
  SynthJob job(line.options, outputs);
  printOutcome(job.run(source, outputs), outputs, line);
  return kExitDone;
}

/// A line that cannot be spoken is named and left out; the others are made all the same.
int speakBatch(const CommandLine& line) {
  const std::vector<BatchLine> lines = linesOfShard(readBatchList(line.batch_list), parseShard(line.shard));
  SynthJob job(line.options, allOutputFiles(line.out_folder));
  ProgressBar progress("synth batch", lines.size(), line.quiet);
  std::size_t failed = 0;
  for (const BatchLine& each : lines) {
    try {
      job.run(each.source, allOutputFiles(line.out_folder / each.id));
    } catch (const InputError& error) {
      ++failed;
      printNotice(fmt::format("{}: {}", each.id, error.what()), false);
    }
    progress.advance();
  }
  if (!line.quiet)
    printText(
        fmt::format("{} of {} lines made in {}\n", lines.size() - failed, lines.size(), line.out_folder.string()));
  return failed == 0 ? kExitDone : kExitBadInput;
}

int runSynth(int argc, char** argv) {
  CLI::App app("Makes a face speak with movements a person really made.");
  CommandLine line;
  setExample(app,
             "synth --text \"the time is now\"\nsynth --song twinkle.json --out twinkle\nsynth --audio a.wav "
             "--transcript \"the time is now\"\nsynth --audio "
             "a.wav --phones a.TextGrid -o talk.glb -o talk.wav\nsynth "
             "batch lines.csv --out lines");
  addLineOptions(app, line);
  addSharedOptions(app, line);
  CLI::App* batch = app.add_subcommand(
      "batch",
      "Makes every line of a CSV list (id,text, id,audio,transcript or id,audio,phones) in a folder of its own");
  setExample(*batch, "synth batch lines.csv --out lines --shard 1/4");
  batch->add_option("list", line.batch_list, "The list")->required();
  batch->add_option("--out", line.out_folder, "Folder for the folders")->capture_default_str();
  batch->add_option("--shard", line.shard, "I/N: this run makes every N-th line, starting at the I-th")
      ->capture_default_str();
  addSharedOptions(*batch, line);

  return runProgram(app, argc, argv, [&]() -> int {
    if (batch->parsed()) return speakBatch(line);
    if (app.count("--text") + app.count("--text-file") + app.count("--audio") + app.count("--song") == 0) {
      printNotice(
          "nothing to say; expected --text, --text-file, --song or --audio with --phones, --transcript or --lyrics "
          "(see "
          "--help)",
          false);
      return kExitWrongUsage;
    }
    if (app.count("--audio") > 0 && app.count("--phones") + app.count("--transcript") + app.count("--lyrics") == 0) {
      printNotice("--audio needs --phones, --transcript or --lyrics (see --help)", false);
      return kExitWrongUsage;
    }
    return speakOneLine(line);
  });
}

}  // namespace
}  // namespace mouthpiece

int main(int argc, char** argv) { return mouthpiece::runSynth(argc, argv); }
