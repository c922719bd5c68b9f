// corpus: performs, builds, inspects and evaluates corpora.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <optional>
#include <string>

#include "base/errors.h"
#include "base/files.h"
#include "corpus_tools/corpus_builder.h"
#include "corpus_tools/corpus_facts.h"
#include "corpus_tools/evaluation.h"
#include "corpus_tools/sample_corpus.h"
#include "corpus_tools/sample_sentences.h"
#include "motion/motion_file.h"
#include "programs/program.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kHoldOutSeed = 1;
constexpr std::uint64_t kMaxLayoutBytes = 16 << 20;

/// What the command line says; each subcommand reads its own part.
struct Options {
  bool quiet = false, json = false, strict = false;
  fs::path input, output, lexicon, layout, takes, truth, sentences;
  std::size_t jobs = 0, count = 55;
  double hold_out = 0;
  SampleOptions sample;
};

/// A progress bar that a library's callback moves.
class CallbackBar {
 public:
  CallbackBar(std::string label, bool quiet) : label_(std::move(label)), quiet_(quiet) {}
  void operator()(std::size_t done, std::size_t total) {
    if (!bar_) bar_.emplace(label_, total, quiet_);
    bar_->setDone(done);
  }

 private:
  std::string label_;
  bool quiet_;
  std::optional<ProgressBar> bar_;
};

MarkerLayout layoutOf(const Options& options) {
  if (options.layout.empty()) return defaultLayout();
  return parseLayout(readFile(options.layout, kMaxLayoutBytes), options.layout.string());
}

BuildOptions buildOptionsOf(const Options& options) {
  BuildOptions build;
  build.layout = layoutOf(options);
  if (!options.lexicon.empty()) build.lexicon = Lexicon::read(options.lexicon);
  build.jobs = options.jobs;
  build.strict = options.strict;
  return build;
}

void noteLeftOut(const std::vector<LeftOutTake>& left_out, bool quiet) {
  for (const LeftOutTake& take : left_out) printNotice(fmt::format("left out {}: {}", take.name, take.reason), quiet);
}

int runSample(const Options& options) {
  SampleOptions sample = options.sample;
  sample.jobs = options.jobs;
  if (!options.truth.empty()) sample.truth_folder = options.truth;
  if (!options.sentences.empty()) sample.sentences = readSentences(options.sentences);
  SampleSummary summary;
  {
    CallbackBar bar("performing", options.quiet);
    summary = writeSampleCorpus(options.output, sample, std::ref(bar));
  }
  if (!summary.notice.empty()) printNotice(summary.notice, options.quiet);
  if (!options.quiet) {
    printText(fmt::format("{} takes, {:.1f} s, {:.2f} % of the samples hidden: {}\n", summary.takes, summary.speech_s,
                          100 * summary.missing_share, options.output.string()));
  }
  return kExitDone;
}

int runBuild(const Options& options) {
  BuildResult result;
  {
    CallbackBar bar("building", options.quiet);
    result = buildCorpus(options.input, buildOptionsOf(options), std::ref(bar));
  }
  result.corpus.name = options.output.stem().string();
  noteLeftOut(result.left_out, options.quiet);
  writeCorpus(options.output, result.corpus);
  if (!options.quiet) {
    printText(fmt::format("{} takes used, {} left out: {}\n", result.takes.size(), result.left_out.size(),
                          options.output.string()));
  }
  return kExitDone;
}

int runInfo(const Options& options) {
  const Corpus corpus = readCorpus(options.input);
  printText(options.json ? corpusFactsJson(corpus) : corpusFactsText(corpus));
  return kExitDone;
}

int runCheck(const Options& options) {
  // The file first, row by row: reading it whole would stop at the first damage.
  const std::vector<std::string> damage = checkCorpus(options.input);
  if (damage.size() == 1) throw InputError(damage.front());
  for (const std::string& row : damage) printText("damage: " + row + "\n");
  if (!damage.empty()) {
    throw InputError(options.input.string(), "", fmt::format("found {} damaged places; expected none", damage.size()));
  }
  const CorpusCheck check = checkCorpus(readCorpus(options.input, CorpusAudio::kLoad));
  for (const std::string& problem : check.problems) printText("problem: " + problem + "\n");
  if (!options.quiet) {
    for (const std::string& remark : check.remarks) printText("remark: " + remark + "\n");
  }
  if (!check.problems.empty()) {
    throw InputError(options.input.string(), "",
                     fmt::format("found {} problems; expected none", check.problems.size()));
  }
  if (!options.quiet) printText(fmt::format("{}: sound\n", options.input.string()));
  return kExitDone;
}

int runConvert(const Options& options) {
  writeMotion(options.output, readMotion(options.input));
  return kExitDone;
}

int runClean(const Options& options) {
  const CleanClip clean = cleanClip(readMotion(options.input), layoutOf(options), options.input.string());
  writeMotion(options.output, clean.motion);
  const TakeReport& report = clean.report;
  printNotice(fmt::format("{} frames: head by jig {}, by skin {}, bridged {}; {} samples filled, {} still missing",
                          report.frames, report.jig_frames, report.skin_frames, report.bridged_frames,
                          report.filled_samples, report.missing_samples),
              options.quiet);
  return kExitDone;
}

int runEvaluate(const Options& options) {
  Corpus corpus = readCorpus(options.input);
  std::vector<CorpusTake> captured;
  if (!options.takes.empty()) {
    CallbackBar bar("reading", options.quiet);
    CleanTakes clean = readTakesInto(corpus, options.takes, buildOptionsOf(options), std::ref(bar));
    noteLeftOut(clean.left_out, options.quiet);
    captured = std::move(clean.takes);
  } else {
    captured = holdOut(corpus, options.hold_out, kHoldOutSeed);
  }
  Evaluation evaluation;
  {
    CallbackBar bar("evaluating", options.quiet);
    evaluation = evaluateCorpus(corpus, captured, std::ref(bar));
  }
  printText(options.json ? evaluationJson(evaluation) : evaluationTable(evaluation));
  return kExitDone;
}

int runPrompts(const Options& options) {
  for (const TimeSentence& sentence : chooseTimeSentences(options.count)) printText(sentence.text() + "\n");
  return kExitDone;
}

class CommandLine {
 public:
  CommandLine() {
    app.require_subcommand(1);
    setExample(app, "corpus build takes --out mine.corpus\ncorpus info mine.corpus\ncorpus build --help");
    addSample();
    addBuild();
    addInfo();
    addCheck();
    addConvert();
    addClean();
    addEvaluate();
    addPrompts();
  }

  CLI::App app{"Performs, builds, inspects and evaluates corpora of captured speech", "corpus"};
  std::function<int()> chosen;

 private:
  CLI::App& command(const std::string& name, const std::string& about, std::string_view example,
                    int (*run)(const Options&)) {
    CLI::App* added = app.add_subcommand(name, about);
    setExample(*added, example);
    addQuietFlag(*added, options_.quiet);
    added->callback([this, run] { chosen = [this, run] { return run(options_); }; });
    return *added;
  }

  void addLayout(CLI::App& app_) {
    app_.add_option("--layout", options_.layout, "Marker layout (JSON); default: face66");
  }
  void addLexicon(CLI::App& app_) {
    app_.add_option("--lexicon", options_.lexicon, "Pronunciations of words (WORD PHONES..., one a line)");
  }
  void addJobs(CLI::App& app_) {
    app_.add_option("--jobs", options_.jobs, "Takes at once; default: one per core")->check(CLI::Range(1, 1024));
  }
  void addCorpus(CLI::App& app_) { app_.add_option("corpus", options_.input, "X.corpus")->required(); }

  void addSample() {
    CLI::App& sample = command("sample", "Perform the sample corpus: C3D, WAV, text and labels",
                               "corpus sample takes --truth truth", runSample);
    sample.add_option("folder", options_.output, "Where the takes go")->required();
    sample.add_option("--truth", options_.truth, "Folder for the clean motion, head still");
    sample.add_option("--sentences", options_.sentences,
                      "What to say, one sentence a line; default: 55 of the time grammar");
    sample.add_option("--seed", options_.sample.seed, "Of head motion, noise and gaps")->capture_default_str();
    sample.add_option("--voice", options_.sample.voice, "Who speaks")->capture_default_str();
    addJobs(sample);
  }
  void addBuild() {
    CLI::App& build = command("build", "Takes -> cleaned, labelled, indexed corpus",
                              "corpus build takes --out mine.corpus --lexicon lexicon.txt", runBuild);
    build
        .add_option("folder", options_.input,
                    "NAME.c3d (.trc .csv), NAME.wav (.flac), NAME.txt, NAME.TextGrid (.lab .phn)")
        ->required();
    build.add_option("--out,-o", options_.output, "The corpus to write")->required();
    addLexicon(build);
    addLayout(build);
    addJobs(build);
    build.add_flag("--strict", options_.strict, "Stop at a take that cannot be used");
  }
  void addInfo() {
    CLI::App& info = command("info", "What a corpus holds", "corpus info mine.corpus --json", runInfo);
    addCorpus(info);
    addJsonFlag(info, options_.json);
  }
  void addCheck() {
    addCorpus(command("check", "Read everything in a corpus and name what is suspicious", "corpus check mine.corpus",
                      runCheck));
  }
  void addConvert() {
    CLI::App& convert = command("convert", "Motion from one format to another, by the names' endings (c3d csv trc)",
                                "corpus convert take.c3d take.csv", runConvert);
    convert.add_option("in", options_.input, "Motion to read")->required();
    convert.add_option("out", options_.output, "Motion to write")->required();
  }
  void addClean() {
    CLI::App& clean = command("clean", "One take's motion with the head still and short gaps filled",
                              "corpus clean take.c3d still.csv", runClean);
    clean.add_option("in", options_.input, "Motion to read (c3d csv trc)")->required();
    clean.add_option("out", options_.output, "Motion to write (c3d csv trc)")->required();
    addLayout(clean);
  }
  void addEvaluate() {
    CLI::App& evaluate =
        command("evaluate", "Resynthesise takes that are not in the corpus and compare with the capture",
                "corpus evaluate mine.corpus --hold-out 0.1", runEvaluate);
    addCorpus(evaluate);
    CLI::Option_group& which = *evaluate.add_option_group("takes to compare with", "One of");
    which.add_option("--takes", options_.takes, "Folder of takes that the corpus does not hold");
    which.add_option("--hold-out", options_.hold_out, "Take this share of the takes out of the corpus (in memory)");
    which.require_option(1);
    addLexicon(evaluate);
    addJobs(evaluate);
    addJsonFlag(evaluate, options_.json);
  }
  void addPrompts() {
    CLI::App& prompts = command("prompts", "Sentences of the time grammar to record, chosen for coverage",
                                "corpus prompts --count 55", runPrompts);
    prompts.add_option("--count", options_.count, "How many")->capture_default_str()->check(CLI::Range(1, 2880));
  }

  Options options_;
};

}  // namespace
}  // namespace mouthpiece

int main(int argc, char** argv) {
  mouthpiece::CommandLine line;
  return mouthpiece::runProgram(line.app, argc, argv, [&line] { return line.chosen(); });
}
