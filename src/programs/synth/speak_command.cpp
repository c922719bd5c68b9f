// synth itself: one line, typed, recorded or sung.
#include <fmt/format.h>
#include <malloc.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>

#include "base/counted.h"
#include "base/errors.h"
#include "base/text_encoding.h"
#include "phonetics/labels/label_files.h"
#include "programs/outputs.h"
#include "programs/synth/commands.h"
#include "speaker/speaker_data.h"

namespace mouthpiece {
namespace {

constexpr std::size_t kMaxTextFileBytes = 1 << 20;
constexpr double kFarthestOffset = 14'400;  // s, as long as a sound may be

struct SpeakOptions : SharedOptions {
  Line line;
  std::filesystem::path text_file, transcript_file, lyrics;
  std::string transcript, lyrics_text;
  bool strict = false;
  std::filesystem::path out_folder = "out";
  std::vector<std::filesystem::path> out_files;
};

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : " ") + word;
  return text;
}

/// The names in an output folder, and the kinds that only -o writes.
std::string namesOf(bool in_folder) {
  std::vector<std::string> names;
  for (const Format& format : formats()) {
    if (format.in_folder == in_folder) names.emplace_back(format.usual_name);
  }
  return joined(names);
}

void addOptions(CLI::App& app, SpeakOptions& options) {
  auto* text = app.add_option("--text", options.line.text, "The line to speak; -: standard input");
  auto* file = app.add_option("--text-file", options.text_file, "A file with the line to speak; -: standard input");
  auto* audio = app.add_option("--audio", options.line.audio,
                               "A recording to animate instead; what it says is recognised, unless --transcript, "
                               "--phones, --times or --lyrics tell");
  auto* phones = app.add_option("--phones", options.line.phones, "Labels of the recording: TextGrid, .lab or .phn");
  auto* transcript = app.add_option("--transcript", options.transcript,
                                    "What the recording says: its labels are found; -: standard input");
  transcript->needs(audio)->excludes(phones);
  auto* transcript_file = app.add_option("--transcript-file", options.transcript_file,
                                         "A file with what the recording says; -: standard input");
  transcript_file->needs(audio)->excludes(phones)->excludes(transcript);
  auto* times =
      app.add_option("--times", options.line.times,
                     "Words and times of another program: JSON of Whisper, Vosk, Gentle, Azure, Polly, Deepgram, "
                     "Amazon Transcribe, Google, Watson, Speechmatics, Rev, AssemblyAI, ElevenLabs, Piper or Rhubarb, "
                     "Rhubarb's TSV or XML, TextGrid, JSON or CSV of the Montreal Forced Aligner, CTM, SRT, WebVTT");
  times->needs(audio)->excludes(phones)->excludes(transcript)->excludes(transcript_file);
  auto* hint = app.add_option("--hint", options.line.hint, "Words and phrases that are likely in the recording");
  hint->needs(audio)->excludes(phones)->excludes(transcript)->excludes(transcript_file)->excludes(times);
  auto* lyrics = app.add_option("--lyrics", options.lyrics,
                                "The recording is of a song; a file with its words; -: standard input");
  lyrics->needs(audio)->excludes(transcript)->excludes(transcript_file)->excludes(times)->excludes(hint);
  auto* lyrics_text = app.add_option("--lyrics-text", options.lyrics_text, "The same, the words themselves");
  lyrics_text->needs(audio)
      ->excludes(transcript)
      ->excludes(transcript_file)
      ->excludes(times)
      ->excludes(hint)
      ->excludes(lyrics);
  auto* song = app.add_option("--song", options.line.song,
                              "A song to sing: song.json, MusicXML (.mxl, too), MIDI with lyrics, UST, SRT; its sound "
                              "may be given with --audio");
  song->excludes(text, file, phones, transcript, transcript_file, times, hint, lyrics, lyrics_text);
  app.add_option("--song-offset", options.line.song_offset,
                 "When in --audio the song's clock begins, s; it is found by itself else")
      ->needs(song, audio)
      ->check(CLI::Range(-kFarthestOffset, kFarthestOffset));
  text->excludes(file, audio);
  file->excludes(audio);
  phones->needs(audio);
  auto* folder =
      app.add_option("--out", options.out_folder, "Folder for all files: " + namesOf(true))->capture_default_str();
  app.add_option("-o", options.out_files,
                 "A single file, repeatable; its kind follows from the ending (besides those of a folder: " +
                     namesOf(false) + ")")
      ->excludes(folder);
  checkOutputs(app, {{"-o", OutputKind::kFileOrFolder}});  // of a folder needsFace() tells more
  app.add_flag("--page-engine", options.speaker.page_engine,
               "view.html makes its line again by itself after an edit (needs what `make wasm` builds; 6 MB more)");
  app.add_flag("--strict", options.strict, "What makes the line doubtful is an error: nothing is written");
  addSharedOptions(app, options);
  app.callback([&app] {
    if (!app.get_subcommands().empty()) return;
    if (app.count("--text") + app.count("--text-file") + app.count("--audio") + app.count("--song") == 0) {
      throw CLI::ParseError("nothing to say; expected --text, --text-file, --song or --audio",
                            CLI::ExitCodes::RequiredError);
    }
  });
}

/// What is text and yet nothing to say, with the option that takes it; empty for plain text.
std::string_view kindOfNoPlainText(std::string_view text) {
  text.remove_prefix(std::min(text.find_first_not_of(" \t\r\n\xEF\xBB\xBF"), text.size()));
  if ((text.starts_with('{') || text.starts_with('[')) && nlohmann::json::accept(text))
    return "JSON; expected plain text (--song takes a written song)";
  if (text.starts_with("<?xml")) return "XML; expected plain text (--song takes MusicXML)";
  if (text.starts_with("File type = \"oo")) return "a TextGrid; expected plain text (--phones takes labels)";
  if (isLabFile(text)) return "labels; expected plain text (--phones takes labels)";
  return {};
}

std::string textOf(const std::filesystem::path& file) {
  const bool is_input = file == "-";
  std::ifstream stream(is_input ? "/dev/stdin" : file, std::ios::binary);
  std::error_code error;
  if (!is_input && std::filesystem::is_directory(file, error))
    throw InputError(file.string(), "", "is a folder; expected a text file");
  if (!stream.is_open()) throw InputError(file.string(), "", "cannot be read; expected a text file");
  // No more than what is too much: what comes over standard input may never end.
  std::string text(kMaxTextFileBytes + 1, '\0');
  stream.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(stream.gcount()));
  expectText(text, file.string(), "plain text");
  if (text.size() > kMaxTextFileBytes) throw InputError(file.string(), "", "is over 1 MiB; expected one line of text");
  if (text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF")) text = decodeText(text, file.string());  // UTF-16
  if (const std::string_view kind = kindOfNoPlainText(text); !kind.empty())
    throw InputError(file.string(), "", fmt::format("is {}", kind));
  const std::size_t arrow = text.find(" --> ");
  if (arrow != std::string::npos && arrow > 0 && text[arrow - 1] >= '0' && text[arrow - 1] <= '9') {
    const auto line = 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(arrow), '\n');
    throw InputError(file.string(), std::to_string(line),
                     "holds subtitles; expected plain text (--times takes subtitles of a recording)");
  }
  return text;
}

/// The words of an option that takes them, or "-" for standard input.
std::string textOrInput(const std::string& given) { return given == "-" ? textOf(given) : given; }

Line lineOf(const SpeakOptions& options) {
  if (!options.line.song.empty()) {
    Line sung = Line::singing(options.line.song, options.line.audio);
    sung.song_offset = options.line.song_offset;
    return sung;
  }
  if (!options.lyrics.empty()) {
    // Standard input is no file that can be asked for its size.
    Line sung = options.lyrics == "-" ? Line::sungWords(options.line.audio, textOf(options.lyrics))
                                      : Line::sung(options.line.audio, options.lyrics);
    sung.phones = options.line.phones;
    return sung;
  }
  Line line = options.line;
  line.text = textOrInput(line.text);
  if (!options.lyrics_text.empty()) return Line::sungWords(options.line.audio, textOrInput(options.lyrics_text));
  if (!options.transcript.empty()) line.text = textOrInput(options.transcript);
  if (!options.transcript_file.empty()) {
    line.text = textOf(options.transcript_file);
    if (line.text.empty())
      throw InputError(options.transcript_file.string(), "", "is empty; expected what the recording says");
  }
  if (!options.text_file.empty()) line.text = textOf(options.text_file);
  return line;
}

/// What is wrong with a text is told with the name of its file, if it has one.
Performance performed(Speaker speaker, const Line& line, const SpeakOptions& options) {
  constexpr std::string_view kText = "text:";
  const std::filesystem::path& text_file = options.text_file.empty() ? options.transcript_file : options.text_file;
  try {
    return speaker.perform(line);
  } catch (const InputError& error) {
    const std::string_view message = error.what();
    if (text_file.empty() || !message.starts_with(kText)) throw;
    throw InputError(printable(text_file.string(), 400) + ":" + std::string(message.substr(kText.size())));
  }
}

/// Memory that is given back is asked for again: a page that is new costs more than what is done with it. The program
/// ends with its one line.
void keepFreedMemory() {
#if defined(__GLIBC__)
  mallopt(M_MMAP_THRESHOLD, 32 << 20);
  mallopt(M_TRIM_THRESHOLD, 128 << 20);
  mallopt(M_ARENA_MAX, 1);  // by whichever thread
#endif
}

/// Throws InputError for what was meant as -o: a new name with the ending of a file.
void expectFolderName(const std::filesystem::path& folder) {
  const auto endsSo = [&](const Format& format) {
    return std::filesystem::path(format.usual_name).extension() == folder.extension();
  };
  std::error_code error;
  if (std::any_of(formats().begin(), formats().end(), endsSo) && !std::filesystem::exists(folder, error))
    throw InputError(folder.string(), "--out", "names a file; expected a folder (-o takes a file)");
}

/// Throws InputError for an output that is read; the head that the face was fitted to is known when it is open.
void expectNoneRead(const std::vector<std::filesystem::path>& files, const SpeakOptions& options) {
  FilesRead read = filesReadBy(options.speaker);
  read.add(options.line.audio, "--audio");
  read.add(options.line.phones, "--phones");
  read.add(options.line.times, "--times");
  read.add(options.line.song, "--song");
  read.add(options.lyrics, "--lyrics");
  read.add(options.text_file, "--text-file");
  read.add(options.transcript_file, "--transcript-file");
  for (const std::filesystem::path& file : files) read.expectNot(file, options.out_files.empty() ? "--out" : "-o");
}

int runSpeak(const SpeakOptions& options) {
  keepFreedMemory();
  expectFolderName(options.out_folder);
  const std::vector<std::filesystem::path> files =
      options.out_files.empty() ? usualFiles(options.out_folder) : options.out_files;
  expectNoneRead(files, options);
  SpeakerOptions wanted = speakerOf(options);
  if (!options.line.song.empty() && isUsersDefault("--language")) wanted.language.clear();  // it is of spoken lines
  wanted.with_face = needsFace(wanted, files);
  wanted.keep_motion = false;
  const Line line = lineOf(options);
  for (const auto& [option, text] :
       {std::pair("text", options.line.text), {"transcript", options.transcript}, {"lyrics", options.lyrics_text}}) {
    std::error_code no_name;  // longer than any
    if (std::filesystem::is_regular_file(text, no_name))
      printNotice(fmt::format("note: '{}' is the name of a file; --{} takes what is in it", printable(text),
                              option == std::string_view("lyrics") ? "lyrics" : fmt::format("{}-file", option)),
                  options.quiet);
  }
  if (line.audio.empty() && line.song.empty()) {
    if (const std::string note = givingWay(wanted); !note.empty()) printNotice("note: " + note, options.quiet);
  }
  // The speaker goes with its dictionary and its voice: what the files are made of is the performance.
  const Performance performance = performed(Speaker(wanted), line, options);
  if (options.strict && !performance.warnings().empty())
    throw InputError(fmt::format("{} (--strict: {} in all; nothing is written)", performance.warnings().front(),
                                 performance.warnings().size()));
  if (const auto& face = performance.data().face) {
    FilesRead head;
    head.add(face->data().meshPath(), "the face");
    for (const std::filesystem::path& file : files) head.expectNot(file, options.out_files.empty() ? "--out" : "-o");
  }
  {
    std::optional<ProgressBar> progress;
    save(performance, files, [&](std::size_t done, std::size_t all) {
      if (!progress) progress.emplace("synth film", all, options.quiet);
      progress->setDone(done);
    });
  }
  for (const std::string& warning : performance.warnings()) printNotice(warning, options.quiet);
  for (const std::string& notice : performance.notices()) printNotice("note: " + notice, options.quiet);
  for (const std::string& note : notesOn(performance, files)) printNotice("note: " + note, options.quiet);
  if (options.json) {
    printText(performance.report());
  } else if (!options.quiet) {
    const auto backed_off = std::count_if(performance.units().begin(), performance.units().end(),
                                          [](const PerformedUnit& unit) { return unit.is_backoff; });
    printText(fmt::format("{:.2f} s of {} from {}, {} backed off; {:.3f} x real time\n", performance.duration(),
                          line.is_sung ? "song" : "speech", counted(performance.units().size(), "unit"), backed_off,
                          performance.realTimeFactor()));
    for (const std::filesystem::path& file : files) printText("  " + printable(file.string(), 4096) + "\n");
  }
  return kExitDone;
}

}  // namespace

Command speakCommand() {
  return makeCommand<SpeakOptions>(
      "synth", "Makes a face speak with movements learnt and taken from a person's own.",
      "synth --text \"the time is now\"\nsynth --song twinkle.json --out twinkle\n"
      "synth --audio a.wav\nsynth --audio a.wav --hint \"Mouthpiece, viseme\"\n"
      "synth --audio a.wav --times whisper.json\n"
      "synth --audio a.wav --transcript \"the time is now\"\n"
      "synth --audio a.wav --phones a.TextGrid -o talk.glb -o talk.wav\nsynth batch lines.csv --out lines\n"
      "arecord -f S16_LE -r 16000 -t raw | synth --stream --as livelink --real-time",
      addOptions, runSpeak);
}

}  // namespace mouthpiece
