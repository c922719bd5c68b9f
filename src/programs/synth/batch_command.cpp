// synth batch: every line of a list, with a manifest of what became of each.
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <set>
#include <span>

#include "audio/audio_clip.h"
#include "base/counted.h"
#include "base/errors.h"
#include "base/files.h"
#include "base/index.h"
#include "base/page_data.h"
#include "base/parallel_for.h"
#include "base/text_encoding.h"
#include "base/text_numbers.h"
#include "programs/synth/batch_input.h"
#include "programs/synth/batch_manifest.h"
#include "programs/synth/commands.h"
#include "speaker/manner.h"
#include "speaker/speaker_data.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostShownBytes = 4096;

struct BatchOptions : SharedOptions {
  fs::path list, cast;
  fs::path out_folder = "out";
  std::string shard = "1/1";
  std::string hint;
  std::vector<std::string> formats, patterns, languages;
  std::size_t jobs = 0;
  bool again = false, check = false;
};

void addOptions(CLI::App& app, BatchOptions& options) {
  app.add_option(
         "list", options.list,
         "The list: CSV with , ; or tab; its first row names the columns: id, text or audio, transcript, phones, "
         "times, song, song offset, speaker, language, or a column a language (de, pt-BR)")
      ->required();
  app.add_option("--out", options.out_folder, "Folder for the files and the manifest")->capture_default_str();
  auto* formats = app.add_option("--format", options.formats,
                                 "Instead of a folder of everything a line, files ID.ENDING: arkit.csv,wav (those that "
                                 "synth -o knows)");
  formats->delimiter(',');
  app.add_option("-o", options.patterns,
                 "The same by their names, repeatable: \"{speaker}/{id}.glb\", with {id}, {language}, {speaker}")
      ->excludes(formats);
  app.add_option("--jobs,-j", options.jobs, "Lines at a time (default: one a processor)")->check(CLI::Range(1, 1024));
  app.add_option("--languages", options.languages, "Of a table with a column a language, only these: de,fr")
      ->delimiter(',');
  app.add_option("--cast", options.cast,
                 "Who speaks how: a table with a first row of speaker and any of voice, corpus, face, language, rate, "
                 "lexicon");
  app.add_option("--hint", options.hint, "Words and phrases that are likely in the recordings without words");
  app.add_option("--shard", options.shard, "I/N: this run makes every N-th line, starting at the I-th")
      ->capture_default_str();
  app.add_flag("--again", options.again, "Make all lines, also those that are there and have not changed");
  app.add_flag("--check", options.check, "Look at the list alone, make nothing");
  addSharedOptions(app, options);
}

/// A line's own language goes before a voice that was asked for for all lines, or for all of a speaker. Throws
/// InputError for one that was asked for with a language that it does not speak.
void letVoiceGiveWay(SpeakerOptions& options) {
  SpeakerOptions settled = options;
  languageFor(settled);
  if (!options.voice.empty()) options.usual_voice = std::exchange(options.voice, {});
}

/// All that a run knows: what is to be made, what is there, and what has been made.
class BatchRun {
 public:
  explicit BatchRun(const BatchOptions& options)
      : options_(options),
        patterns_(filePatterns(options.formats, options.patterns)),
        shard_(parseShard(options.shard)),
        stem_(shard_.count == 1 ? "manifest" : fmt::format("manifest.{}-of-{}", shard_.index, shard_.count)) {
    usual_ = speakerOf(options);
    letVoiceGiveWay(usual_);
    usual_.timing = false;
    const std::vector<fs::path> files(patterns_.begin(), patterns_.end());
    usual_.with_face = needsFace(usual_, files);
    if (!options.cast.empty()) cast_ = readCast(options.cast, usual_);
    for (auto& [speaker, member] : cast_) {
      member.with_face = needsFace(member, files);
      if (!member.voice.empty() && member.language == usual_.language) {  // the row tells a voice alone
        member.usual_voice = std::exchange(member.voice, {});
        continue;
      }
      try {
        letVoiceGiveWay(member);
      } catch (const InputError& error) {
        throw InputError(options.cast.string(), speaker, error.what());
      }
    }
  }

  int run() {
    list_ = readBatchList(options_.list, options_.languages);
    for (const std::string& notice : list_.notices)
      printNotice(fmt::format("{} {}", printable(options_.list.string(), kMostShownBytes), notice), options_.quiet);
    for (const RowFault& fault : options_.check ? std::span<const RowFault>(list_.faults) : ownFaults())
      printNotice(fmt::format("{}:{}: {}", printable(options_.list.string(), kMostShownBytes), fault.row, fault.what),
                  false);
    lines_ = linesOfShard(list_.lines, shard_);
    for (BatchLine& batch_line : lines_) {
      Line& line = batch_line.line;
      if (!line.audio.empty() && line.text.empty() && line.phones.empty() && line.times.empty() && line.song.empty())
        line.hint = options_.hint;
    }
    if (options_.check) {
      printText(fmt::format("{}, {} that cannot be used\n", counted(list_.lines.size(), "line"),
                            counted(list_.faults.size(), "row")));
      return list_.faults.empty() ? kExitDone : kExitBadInput;
    }
    if (list_.lines.empty()) return kExitBadInput;  // what is wrong with each row has been told
    nameFiles();
    expectOurManifest(options_.out_folder, stem_);
    for (const BatchLine& line : lines_)
      static_cast<void>(wantedFor(line));  // settings that cannot be read end the run
    ManifestJournal journal(options_.out_folder, stem_);
    journal_ = &journal;
    takeStock();
    makeMissing();
    writeAll();
    journal.remove();
    return tell();
  }

 private:
  struct Wanted {
    SpeakerOptions options;
    std::string settings;
  };

  /// Throws InputError where two files would have one name, in whatever case, or one would replace what is read.
  void nameFiles() {
    const std::string option = options_.formats.empty() ? "-o" : "--format";
    const FilesRead read = filesRead();
    std::set<std::string> names, manifest;
    for (const std::string& name : manifestFiles(stem_)) {
      read.expectNot(options_.out_folder / name, "--out");
      manifest.insert(lowerCase(name));
    }
    files_.reserve(lines_.size());
    for (const BatchLine& line : lines_) {
      files_.push_back(filesOfLine(line, patterns_));
      for (const std::string& name : files_.back()) {
        if (!names.insert(lowerCase(name)).second)
          throw InputError(
              option, "",
              fmt::format("gives two lines the file '{}'; expected {{id}} and {{language}} in it", printable(name)));
        if (manifest.contains(lowerCase(name)))
          throw InputError(option, "", fmt::format("gives a line the file '{}', which is the manifest's", name));
        read.expectNot(options_.out_folder / name, option);
      }
    }
  }

  /// Of all shards; what a cast names by its speaker.
  FilesRead filesRead() {
    FilesRead read = filesReadBy(usual_);
    read.add(options_.list, "list");
    read.add(options_.cast, "--cast");
    const auto addFace = [&](const SpeakerOptions& who, const std::string& by) {
      if (who.with_face && !who.face.empty()) read.add(shared_.face(who.face).data().meshPath(), by);
    };
    addFace(usual_, "the face");
    for (const auto& [speaker, member] : cast_) {
      const std::string by = fmt::format("the cast's {}", printable(speaker));
      for (const fs::path& file : {member.corpus, member.face, member.lexicon}) read.add(file, by);
      addFace(member, by);
    }
    for (const BatchLine& line : list_.lines) {
      const Line& wish = line.line;
      for (const fs::path& file : {wish.audio, wish.phones, wish.times, wish.song})
        read.add(file, fmt::format("row {} of the list", line.row));
    }
    return read;
  }

  static bool isWrittenSong(const BatchLine& line) { return !line.line.song.empty(); }

  /// Lines of one key are spoken alike.
  std::string wantedKey(const BatchLine& line) const {
    const std::string who = cast_.contains(line.speaker) ? line.speaker : "";
    return who + "\n" + line.language + (isWrittenSong(line) ? "\nsung" : "");
  }

  /// How a line is to be spoken; `voice` tells those alike.
  const Wanted& wantedFor(const BatchLine& line) {
    const auto [found, is_new] = wanted_.try_emplace(wantedKey(line));
    if (is_new) {
      Wanted& wanted = found->second;
      const auto member = cast_.find(line.speaker);
      wanted.options = member == cast_.end() ? usual_ : member->second;
      if (isWrittenSong(line) && wanted.options.language == usual_.language && isUsersDefault("--language"))
        wanted.options.language.clear();  // it is of spoken lines
      if (!line.language.empty()) wanted.options.language = line.language;
      if (const std::string note = line.line.audio.empty() ? givingWay(wanted.options) : ""; !note.empty())
        printNotice("note: " + note, options_.quiet);
      wanted.settings = settingsJson(wanted.options, shared_);
    }
    return found->second;
  }

  std::string hashOf(std::size_t i) {
    const BatchLine& line = lines_[i];
    std::string all = wantedFor(line).settings;
    for (const std::string& part :
         {line.line.text, fileHash(line.line.audio), fileHash(line.line.phones), fileHash(line.line.times)})
      all += '\0' + part;
    if (!line.line.song.empty())  // what other lines have stays what it was
      all += '\0' + fmt::format("song {} {}", fileHash(line.line.song),
                                line.line.song_offset ? fmt::to_string(*line.line.song_offset) : "found");
    if (!line.line.hint.empty()) all += '\0' + ("hint " + line.line.hint);
    for (const std::string& file : files_[i]) all += '\0' + file;
    return sha256Hex(all).substr(0, 16);
  }

  /// Whether the files of these names are there, as the record tells of them.
  bool areThere(const LineRecord& record, const std::vector<std::string>& names) const {
    if (!std::equal(record.files.begin(), record.files.end(), names.begin(), names.end(),
                    [](const LineRecord::File& file, const std::string& name) { return file.name == name; }))
      return false;
    return std::all_of(record.files.begin(), record.files.end(), [&](const LineRecord::File& file) {
      std::error_code error;
      return fs::file_size(options_.out_folder / file.name, error) == file.bytes && !error;
    });
  }

  /// Tells of lines that an earlier run has made and the list has no more: their files stay.
  void tellWhatIsLeft(const Manifest& manifest) const {
    std::set<std::string_view> keys;
    for (const BatchLine& line : list_.lines) keys.insert(line.key);
    const auto left = std::count_if(manifest.lines.begin(), manifest.lines.end(), [&](const LineRecord& line) {
      return line.status == LineRecord::Status::kMade && !keys.contains(line.key);
    });
    const std::string list = options_.list.filename().string();
    const bool is_other = !manifest.list.empty() && manifest.list != list;
    if (!is_other && left == 0) return;
    printNotice(fmt::format("{} was made of {}; {} of its lines {} not in {}; {} files stay",
                            printable((options_.out_folder / (stem_ + ".json")).string(), kMostShownBytes),
                            printable(manifest.list), left, left == 1 ? "is" : "are", printable(list),
                            left == 1 ? "its" : "their"),
                options_.quiet);
  }

  /// What earlier runs have made, of this shard or another, and has not changed.
  void takeStock() {
    std::multimap<std::string, LineRecord> known;
    for (const std::string& stem : manifestStems(options_.out_folder)) {
      try {
        std::optional<Manifest> manifest = readManifest(options_.out_folder, stem);
        if (!manifest) continue;
        if (stem == stem_) tellWhatIsLeft(*manifest);
        for (LineRecord& line : manifest->lines) known.emplace(line.key, std::move(line));
        if (stem == stem_) manifest_.players = std::move(manifest->players);
      } catch (const InputError& error) {
        printNotice(fmt::format("{}; what it tells of is made again", error.what()), options_.quiet);
      }
    }
    records_.resize(lines_.size());
    for (std::size_t i = 0; i < lines_.size(); ++i) records_[i] = recordOfEarlier(i, known);
  }

  /// A line's record of an earlier run; else it is one of those that are missing, or one whose files are none.
  LineRecord recordOfEarlier(std::size_t i, const std::multimap<std::string, LineRecord>& known) {
    LineRecord record;
    static_cast<void>(wantedFor(lines_[i]));  // settings that cannot be read are no line's fault
    try {
      const std::string hash = hashOf(i);
      const auto [first, last] = known.equal_range(lines_[i].key);
      const auto same = std::find_if(first, last, [&](const auto& entry) {
        return entry.second.hash == hash && entry.second.status == LineRecord::Status::kMade &&
               areThere(entry.second, files_[i]);
      });
      const bool is_there = same != last && !options_.again;
      if (is_there) record = same->second;
      record.hash = hash;
      (is_there ? kept_ : missing_).push_back(i);
    } catch (const InputError& error) {
      record.status = LineRecord::Status::kFailed;
      record.error = error.what();
      printNotice(fmt::format("{}: {}", lines_[i].key, record.error), false);
    }
    describe(lines_[i], record);
    return record;
  }

  static void describe(const BatchLine& line, LineRecord& record) {
    record.key = line.key;
    record.id = line.id;
    record.language = line.language;
    record.speaker = line.speaker;
    record.text = line.line.text;
    record.row = line.row;
    record.others = line.others;
  }

  void makeMissing() {
    const std::size_t jobs =
        std::min(options_.jobs > 0 ? options_.jobs : defaultThreadCount(), std::max<std::size_t>(1, missing_.size()));
    ProgressBar progress("synth batch", missing_.size(), options_.quiet);
    std::atomic<std::size_t> next = 0;
    last_written_ = std::chrono::steady_clock::now();
    parallelFor(jobs, jobs, [&](std::size_t) {
      std::map<const Wanted*, Speaker> speakers;
      for (std::size_t at = next++; at < missing_.size(); at = next++) {
        makeOne(missing_[at], speakers);
        progress.advance();
      }
    });
  }

  void makeOne(std::size_t i, std::map<const Wanted*, Speaker>& speakers) {
    LineRecord record = records_[i];
    std::optional<LinePlayer> player;
    try {
      const Wanted& wanted = wanted_.at(wantedKey(lines_[i]));
      auto found = speakers.find(&wanted);
      if (found == speakers.end()) {
        std::optional<SharedFace> face;
        if (wanted.options.with_face) face = shared_.face(wanted.options.face);
        found = speakers.emplace(&wanted, Speaker(shared_.corpus(wanted.options.corpus), face, wanted.options)).first;
      }
      const Performance performance = found->second.perform(lines_[i].line);
      std::vector<fs::path> paths;
      for (const std::string& name : files_[i]) paths.push_back(options_.out_folder / name);
      save(performance, paths);
      fill(performance, i, record);
      const std::vector<std::string> notes = notesOn(performance, paths);
      record.notices.insert(record.notices.end(), notes.begin(), notes.end());
      player = playerOf(record.key, performance);
    } catch (const InputError& error) {
      record.status = LineRecord::Status::kFailed;
      record.error = error.what();
    } catch (const std::bad_alloc&) {
      record.status = LineRecord::Status::kFailed;
      record.error = "not enough memory; fewer --jobs take less";
    }
    note(i, std::move(record), std::move(player));
  }

  void fill(const Performance& performance, std::size_t i, LineRecord& record) const {
    const Performance::Data& data = performance.data();
    record.status = LineRecord::Status::kMade;
    record.duration_s = performance.duration();
    record.method = data.animation.method;
    record.warnings = performance.warnings();
    record.notices = performance.notices();
    const Line& line = lines_[i].line;
    if (line.text.empty() && !line.audio.empty()) record.heard = data.animation.text;
    record.quality =
        judgeLine(data.animation, data.clip(), data.actor ? data.actor->closed_lips_mm : 0.0, data.confidence);
    for (const std::string& name : files_[i]) record.files.push_back({name, fs::file_size(options_.out_folder / name)});
  }

  /// One thread at a time: tells what has become of a line, and writes it down.
  void note(std::size_t i, LineRecord record, std::optional<LinePlayer> player) {
    const std::scoped_lock lock(mutex_);
    journal_->add(record);
    for (const std::string& warning : record.warnings)
      printNotice(fmt::format("{}: {}", record.key, warning), options_.quiet);
    for (const std::string& notice : record.notices)
      printNotice(fmt::format("{}: note: {}", record.key, notice), options_.quiet);
    if (!record.error.empty()) printNotice(fmt::format("{}: {}", record.key, record.error), false);
    std::erase_if(manifest_.players, [&](const LinePlayer& old) { return old.key == record.key; });
    records_[i] = std::move(record);
    if (player) keepIfDoubtful(std::move(*player), records_[i].quality.doubt);
    constexpr std::chrono::seconds kBetweenPages(20);
    if (std::chrono::steady_clock::now() - last_written_ > kBetweenPages) writeAll();
  }

  /// Of the lines made by this run the worst are kept; writeManifest() weighs them with those of earlier runs.
  void keepIfDoubtful(LinePlayer player, double doubt) {
    doubts_.emplace(doubt, player.key);
    manifest_.players.push_back(std::move(player));
    if (doubts_.size() <= kMostPlayers) return;
    const std::string best = doubts_.begin()->second;
    doubts_.erase(doubts_.begin());
    std::erase_if(manifest_.players, [&](const LinePlayer& each) { return each.key == best; });
  }

  void writeAll() {
    manifest_.list = options_.list.filename().string();
    manifest_.settings = settingsJson(usual_, shared_);
    manifest_.lines_in_list = list_.lines.size() + list_.faults.size();
    manifest_.other_columns = list_.other_columns;
    manifest_.lines.clear();
    for (const LineRecord& record : records_) {
      // A line that its turn has not come to is no line of the manifest yet.
      if (record.method.empty() && record.error.empty()) continue;
      manifest_.lines.push_back(record);
    }
    for (const RowFault& fault : ownFaults()) {
      LineRecord record;
      record.key = record.id = fmt::format("row {}", fault.row);
      record.row = fault.row;
      record.status = LineRecord::Status::kUnusable;
      record.error = fault.what;
      record.others.resize(list_.other_columns.size());
      manifest_.lines.push_back(std::move(record));
    }
    std::stable_sort(manifest_.lines.begin(), manifest_.lines.end(),
                     [](const LineRecord& a, const LineRecord& b) { return a.row < b.row; });
    writeManifest(options_.out_folder, stem_, manifest_);
    journal_->clear();
    last_written_ = std::chrono::steady_clock::now();
  }

  /// The rows that cannot be used are of the first shard: they are counted once.
  [[nodiscard]] std::span<const RowFault> ownFaults() const {
    return std::span(list_.faults).first(shard_.index == 1 ? list_.faults.size() : 0);
  }

  int tell() const {
    const auto failed =
        static_cast<std::size_t>(std::count_if(records_.begin(), records_.end(), [](const LineRecord& record) {
          return record.status == LineRecord::Status::kFailed;
        }));
    if (!options_.quiet) {
      printText(fmt::format("{} of {} made in {}", records_.size() - failed,
                            counted(records_.size() + ownFaults().size(), "line"),
                            printable(options_.out_folder.string(), kMostShownBytes)));
      if (!kept_.empty()) printText(fmt::format(", {} of them before", kept_.size()));
      printText(fmt::format("; worst first in {}\n",
                            printable((options_.out_folder / (stem_ + ".html")).string(), kMostShownBytes)));
    }
    return failed == 0 && ownFaults().empty() ? kExitDone : kExitBadInput;
  }

  const BatchOptions& options_;
  std::vector<std::string> patterns_;
  Shard shard_;
  std::string stem_;
  SpeakerOptions usual_;
  std::map<std::string, SpeakerOptions> cast_;
  std::map<std::string, Wanted> wanted_;
  SharedCast shared_;
  BatchList list_;
  std::vector<BatchLine> lines_;                 ///< of the shard
  std::vector<std::vector<std::string>> files_;  ///< of each of them
  std::vector<LineRecord> records_;              ///< the same
  std::vector<std::size_t> missing_;             ///< places of those that are to be made
  std::vector<std::size_t> kept_;                ///< of those that an earlier run has made
  Manifest manifest_;
  ManifestJournal* journal_ = nullptr;
  std::mutex mutex_;
  std::set<std::pair<double, std::string>> doubts_;  ///< of the players of this run
  std::chrono::steady_clock::time_point last_written_;
};

int runBatch(const BatchOptions& options) { return BatchRun(options).run(); }

}  // namespace

Command batchCommand() {
  return makeCommand<BatchOptions>(
      "batch", "Makes every line of a list, in parallel; made again is only what has changed",
      "synth batch lines.csv --out lines --format arkit.csv,wav\nsynth batch loc.csv --languages de,fr -o "
      "\"{language}/{id}.glb\"\nsynth batch lines.csv --out lines --shard 3/8",
      addOptions, runBatch);
}

}  // namespace mouthpiece
