#include "programs/synth/served_lines.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/child_process.h"
#include "base/errors.h"
#include "base/files.h"
#include "base/json_fields.h"
#include "base/json_text.h"
#include "base/text_encoding.h"
#include "base/unicode.h"
#include "deform/mesh/mesh_files.h"
#include "expression/expression.h"
#include "phonetics/language/language.h"
#include "programs/head_fitting.h"
#include "programs/outputs.h"
#include "speaker/shared_files.h"
#include "speaker/speaker_data.h"
#include "synthesis/line_edits.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr std::size_t kMostLines = 10'000, kMostPerformances = 6, kLongestSlug = 40, kMostNameBytes = 120;
constexpr std::size_t kMostWishBytes = 1 << 24;
/// Lines that were stopped or failed leave numbers without a folder; so many a session's lines may have.
constexpr std::size_t kMostLost = 1000;
/// What the last line took is kept for so long.
constexpr std::chrono::minutes kKept{10};
constexpr std::string_view kDefaultFace = "default";

std::string nameOf(std::string_view text) {
  std::string slug = slugOf(text, kLongestSlug);
  return slug.empty() ? "line" : slug;
}

/// The name of a dropped file, safe in a folder.
std::string fileNameOf(const std::string& given) {
  const fs::path path = fs::path(given).filename();
  std::string ending = nameOf(path.extension().string());
  std::string stem = path.stem().string();
  if (stem.ends_with(".anchors")) {
    stem.resize(stem.size() - std::string_view(".anchors").size());
    ending.insert(0, "anchors.");
  }
  if (given.size() > kMostNameBytes || path.extension().empty())
    throw InputError(fmt::format("found a file called {}; expected a name with an ending", printable(given)));
  return fmt::format("{}.{}", nameOf(stem), ending);
}

/// `name`, or with a number before its ending where the folder has one of that name.
fs::path freeName(const fs::path& folder, const std::string& name) {
  const std::size_t dot = name.find('.');
  for (std::size_t i = 1;; ++i) {
    const fs::path path = folder / (i == 1 ? name : fmt::format("{}-{}{}", name.substr(0, dot), i, name.substr(dot)));
    if (!fs::exists(path)) return path;
  }
}

/// False for what cannot be looked at, too: a link that leads to itself.
bool isThere(const fs::path& file) {
  std::error_code unusable;
  return fs::is_regular_file(file, unusable);
}

/// Whether the mesh that a face was fitted to is there as it was.
bool isOfItsMesh(const fs::path& face) {
  try {
    const SharedFace opened(face);
    return true;
  } catch (const InputError&) {
    return false;
  }
}

std::string dumped(const json& fields) { return jsonText(fields, 1) + "\n"; }

/// A user of the page knows the files that were dropped by their names, not where they are kept.
std::string withoutFolder(std::string text, const fs::path& folder) {
  for (const char* kind : {"recordings/", "heads/", ""}) {
    const std::string path = (folder / kind).string();
    for (std::size_t at = text.find(path); at != std::string::npos; at = text.find(path)) text.erase(at, path.size());
  }
  return text;
}

}  // namespace

ServedLines::ServedLines(const SpeakerOptions& options, fs::path folder)
    : options_(options), folder_(fs::absolute(std::move(folder)).lexically_normal()), corpus_(options.corpus) {
  // The page's lines may ask for another voice, or another language.
  if (!options_.voice.empty()) options_.usual_voice = std::exchange(options_.voice, {});
  faces_.emplace(options.face.empty() ? std::string(kDefaultFace) : options.face.stem().string(), options.face);
  expectWritable(folder_);
  static_cast<void>(speakerFor({}, {}));  // what no line could be made with is told before the first one
  lock_.reset(new FileLock(FileLock::ofFolder(folder_ / "")));  // it cannot be moved
  if (!lock_->isOurs())
    throw InputError(folder_.string(), "", "is in use by another synth serve; expected one at a time");
  readEarlier();
  worker_ = std::jthread([this](std::stop_token stop) { work(std::move(stop)); });
}

ServedLines::~ServedLines() {
  worker_.request_stop();
  woken_.notify_all();
}

void ServedLines::readEarlier() {
  std::error_code none;
  std::vector<fs::path> folders;
  for (auto entry = fs::directory_iterator(folder_, none); !none && entry != fs::directory_iterator();
       entry.increment(none)) {
    if (isThere(entry->path() / "line.json")) folders.push_back(entry->path());
    if (entry->path().filename() != "heads") continue;
    std::error_code unusable;
    for (const fs::directory_entry& head : fs::directory_iterator(entry->path(), unusable)) {
      if (head.path().extension() == ".face") faces_.emplace(head.path().stem().string(), head.path());
    }
  }
  std::sort(folders.begin(), folders.end());
  std::map<std::size_t, std::map<std::size_t, Entry>> found;  // by number and version
  std::vector<Entry> others;                                  // whose number another line has, or nobody could give
  for (const fs::path& each : folders) {
    try {
      const fs::path file = each / "line.json";
      const JsonField fields = parseJson(readFile(file, kMostWishBytes), file.string(), "a line");
      Entry entry;
      entry.wish = {fields["text"].text(1 << 20), fs::path(fields["recording"].text()).filename(),
                    fields["voice"].text(),       fields["face"].text(),
                    fields["language"].text(),    "",
                    expressionIn(fields)};
      if (isThere(each / "edits.json")) entry.wish.edits = readFile(each / "edits.json", kMostWishBytes);
      entry.state = State::kDone;
      entry.title = fields["title"].text(1 << 20);
      for (const JsonField& warning : fields["warnings"].list()) entry.warnings.push_back(warning.text());
      if (fields["notices"].exists())  // earlier builds told none
        for (const JsonField& notice : fields["notices"].list()) entry.notices.push_back(notice.text());
      entry.version = static_cast<std::size_t>(fields["version"].whole(1, 1'000'000));
      entry.duration = fields["duration_s"].number(0, 1e6);
      entry.folder = each;
      const auto number = static_cast<std::size_t>(fields["line"].whole(0, kMostLines - 1));
      const std::size_t version = entry.version;
      if (number > folders.size() + kMostLost || found[number].contains(version)) {
        others.push_back(std::move(entry));
      } else {
        found[number].emplace(version, std::move(entry));
      }
    } catch (const InputError&) {
      continue;  // no line of ours
    }
  }
  for (auto& [number, versions] : found) {
    while (lines_.size() < number) {
      lines_.emplace_back();
      lines_.back().state = State::kCancelled;
    }
    lines_.push_back(std::move(versions.rbegin()->second));
  }
  for (Entry& entry : others) lines_.push_back(std::move(entry));
}

std::size_t ServedLines::queue(Entry entry) {
  const std::scoped_lock lock(mutex_);
  if (lines_.size() >= kMostLines) throw InputError(fmt::format("found {} lines; expected no more", kMostLines));
  lines_.push_back(std::move(entry));
  waiting_.push_back(lines_.size() - 1);
  woken_.notify_all();
  return lines_.size() - 1;
}

std::size_t ServedLines::add(LineWish wish) {
  expectEdits(wish);
  expectWords(wish);
  if (!wish.recording.empty() && !isThere(folder_ / "recordings" / fs::path(wish.recording).filename()))
    throw InputError(fmt::format("there is no recording {}", printable(wish.recording)));
  Entry entry;
  entry.title = titleOf(wish);
  entry.wish = std::move(wish);
  return queue(std::move(entry));
}

std::size_t ServedLines::change(std::size_t line, LineWish wish) {
  expectEdits(wish);
  const std::scoped_lock lock(mutex_);
  Entry& entry = lines_[static_cast<std::size_t>(&entryOf(line) - lines_.data())];
  if (entry.is_head) throw InputError("a head has no words to change");
  if (entry.state == State::kWaiting || entry.state == State::kWorking)
    throw InputError("the line is being made; wait for it, or stop it");
  wish.recording = entry.wish.recording;
  expectWords(wish);
  entry.wish = std::move(wish);
  entry.title = titleOf(entry.wish);
  entry.state = State::kWaiting;
  entry.is_cancelled = false;
  entry.error.clear();
  waiting_.push_back(line);
  woken_.notify_all();
  return line;
}

std::string ServedLines::keepRecording(const std::string& name, std::string_view bytes) {
  if (bytes.empty()) throw InputError(printable(name), "", "is empty; expected a recording");
  const fs::path path = freeName(folder_ / "recordings", fileNameOf(name));
  writeFileAtomically(path, bytes);
  return path.filename().string();
}

std::string ServedLines::keepHead(const std::string& name, std::string_view bytes) {
  const std::string plain = fileNameOf(name);
  const std::string ending = fs::path(plain).extension();
  if (!isHeadMesh(plain) && ending != ".face" && ending != ".json")
    throw InputError(
        fmt::format("found the file {}; expected a head: .glb .vrm .obj .ply .off, its .face, or its "
                    ".anchors.json",
                    printable(name)));
  const fs::path folder = folder_ / "heads", path = folder / plain;
  // A .face names its mesh, and anchors belong to a mesh of their name: these keep theirs, and nothing is lost.
  if (fs::exists(path) && readFile(path) != bytes) fs::rename(path, freeName(folder, plain + ".before"));
  writeFileAtomically(path, bytes);
  if (ending == ".face") {
    const std::scoped_lock lock(mutex_);
    faces_[path.stem().string()] = path;
    opened_.erase(path.stem().string());
  }
  if (isHeadMesh(plain)) {
    const std::scoped_lock lock(mutex_);
    std::erase_if(opened_, [&](const auto& opened) { return isSameFile(opened.second.data().meshPath(), path); });
  }
  const fs::path face = fs::path(path).replace_extension(".face");
  if (isHeadMesh(plain) && fs::exists(face) && !isOfItsMesh(face))
    fs::rename(face, freeName(folder, face.filename().string() + ".before"));
  if (isHeadMesh(plain) && !fs::exists(face)) {
    Entry entry;
    entry.is_head = true;
    entry.title = plain;
    queue(std::move(entry));
  }
  return path.stem().string();
}

void ServedLines::cancel(std::size_t line) {
  const std::scoped_lock lock(mutex_);
  Entry& entry = lines_[static_cast<std::size_t>(&entryOf(line) - lines_.data())];
  entry.is_cancelled = true;
  if (entry.state != State::kWaiting) return;
  entry.state = State::kCancelled;
  std::erase(waiting_, line);
}

std::string ServedLines::state() const {
  const std::scoped_lock lock(mutex_);
  json lines = json::array();
  constexpr std::array<std::string_view, 5> kNames{"waiting", "working", "done", "failed", "stopped"};
  for (std::size_t i = 0; i < lines_.size(); ++i) {
    const Entry& entry = lines_[i];
    if (entry.title.empty()) continue;
    json line = wishFields(entry.wish);
    line.update({{"line", i},
                 {"title", entry.title},
                 {"state", kNames[static_cast<std::size_t>(entry.state)]},
                 {"stage", entry.stage},
                 {"error", entry.error},
                 {"warnings", entry.warnings},
                 {"notices", entry.notices},
                 {"version", entry.version},
                 {"duration_s", entry.duration},
                 {"took_s", entry.took_s},
                 {"folder", entry.folder.string()},
                 {"is_head", entry.is_head}});
    lines.push_back(std::move(line));
  }
  json faces = json::array(), known = json::array();
  for (const auto& [name, path] : faces_) faces.push_back(name);
  for (const Language* language : languages()) known.push_back({{"tag", language->tag}, {"name", language->name}});
  std::vector<std::string> files;
  for (const fs::path& file : usualFiles("")) files.push_back(file.string());
  return dumped({{"folder", folder_.string()},
                 {"lines", std::move(lines)},
                 {"faces", std::move(faces)},
                 {"voices", voiceNames()},
                 {"languages", std::move(known)},
                 {"moods", moodNames()},
                 {"files", files},
                 {"voice", options_.usual_voice},
                 {"corpus", corpus_.name()}});
}

const ServedLines::Entry& ServedLines::entryOf(std::size_t line) const {
  if (line >= lines_.size() || lines_[line].title.empty()) throw InputError(fmt::format("there is no line {}", line));
  return lines_[line];
}

fs::path ServedLines::file(std::size_t line, const std::string& name) const {
  const std::scoped_lock lock(mutex_);
  const fs::path& folder = entryOf(line).folder;
  const std::vector<fs::path> usual = usualFiles(folder);
  const bool is_ours =
      std::any_of(usual.begin(), usual.end(), [&](const fs::path& path) { return path.filename().string() == name; });
  if (folder.empty() || (!is_ours && name != "edits.json"))
    throw InputError(fmt::format("there is no {}", printable(name)));
  return folder / name;
}

std::string ServedLines::sourcePage(std::size_t line, std::size_t unit) const {
  std::optional<Performance> performance;
  {
    const std::scoped_lock lock(mutex_);
    performance = entryOf(line).performance;
  }
  if (!performance) throw InputError("the line is of an earlier session; make it again to see its sources");
  const PrivateFolder scratch;
  const fs::path page = scratch.path() / "source.html";
  save(sourceOf(*performance, unit), page);
  return readFile(page);
}

void ServedLines::work(std::stop_token stop) {
  while (!stop.stop_requested()) {
    std::size_t line = 0;
    bool is_head = false;
    {
      std::unique_lock lock(mutex_);
      const auto is_asked = [this] { return !waiting_.empty(); };
      if (!woken_.wait_for(lock, stop, kKept, is_asked)) {
        if (stop.stop_requested()) return;
        last_.reset();
        network_.reset();
        if (!woken_.wait(lock, stop, is_asked)) return;
      }
      line = waiting_.front();
      waiting_.pop_front();
      lines_[line].state = State::kWorking;
      is_head = lines_[line].is_head;
    }
    const auto start = std::chrono::steady_clock::now();
    try {
      is_head ? fit(line) : make(line);
      const std::scoped_lock lock(mutex_);
      lines_[line].took_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
      lines_[line].state = State::kDone;
      lines_[line].stage.clear();
    } catch (const Cancelled&) {
      finish(line, State::kCancelled, "");
    } catch (const std::bad_alloc&) {
      finish(line, State::kFailed, "out of memory: the line is too long for this machine");
    } catch (const std::exception& error) {
      finish(line, State::kFailed, withoutFolder(printable(error.what(), 1000), folder_));
    }
  }
}

void ServedLines::finish(std::size_t line, State state, const std::string& error) {
  const std::scoped_lock lock(mutex_);
  lines_[line].state = state;
  lines_[line].error = error;
  lines_[line].stage.clear();
}

void ServedLines::enter(std::size_t line, std::string_view stage) {
  const std::scoped_lock lock(mutex_);
  if (lines_[line].is_cancelled) throw Cancelled();
  lines_[line].stage = stage;
}

SharedFace ServedLines::faceOf(const std::string& name) {
  fs::path path;
  {
    const std::scoped_lock lock(mutex_);
    const auto known = faces_.find(name);
    if (!name.empty() && known == faces_.end()) throw InputError(fmt::format("there is no face {}", printable(name)));
    path = name.empty() ? options_.face : known->second;
    if (const auto opened = opened_.find(name); opened != opened_.end()) return opened->second;
  }
  const SharedFace face(path);
  const std::scoped_lock lock(mutex_);
  opened_.insert_or_assign(name, face);
  return face;
}

fs::path ServedLines::freeFolder(const std::string& title, std::size_t line, std::size_t version) const {
  const std::string name = fmt::format("{:03}-{}", line + 1, nameOf(title));
  for (;; ++version) {
    fs::path folder = folder_ / (version > 1 ? fmt::format("{}.{}", name, version) : name);
    if (!fs::exists(folder)) return folder;
  }
}

Speaker& ServedLines::speakerFor(const LineWish& wish, const fs::path& edits) {
  LineWish unsaid = wish;
  unsaid.text.clear();
  unsaid.recording.clear();
  const std::string key = dumped(wishFields(unsaid));
  const SharedFace face = faceOf(wish.face);
  if (!network_) network_ = sharedWordNetwork();
  if (last_ && last_->wish == key && &last_->face.data() == &face.data()) return last_->speaker;
  SpeakerOptions options = options_;
  // The page always names a voice; the usual one gives way to a language.
  if (!wish.voice.empty() && wish.voice != options_.usual_voice) options.voice = wish.voice;
  if (!wish.language.empty()) options.language = wish.language;
  if (const auto& expression = wish.expression) {
    Manner& manner = options.manner;
    manner.upper_face = expression->upper_face;
    manner.gaze = expression->gaze;
    manner.head_motion = expression->head_motion;
    manner.mood = expression->mood.empty() ? "" : fmt::format("{}:{}", expression->mood, expression->mood_strength);
  }
  if (!edits.empty()) options.manner.edits = edits;
  last_.reset();
  return last_.emplace(LastSpeaker{key, face, Speaker(corpus_, face, options)}).speaker;
}

void ServedLines::make(std::size_t line) {
  LineWish wish;
  std::size_t version = 0;
  {
    const std::scoped_lock lock(mutex_);
    wish = lines_[line].wish;
    version = lines_[line].version + 1;
  }
  enter(line, wish.recording.empty() ? "speaking the line" : "listening to the recording");
  const fs::path folder = freeFolder(titleOf(wish), line, version);
  const fs::path edits = folder / "edits.json";
  if (!wish.edits.empty()) writeFileAtomically(edits, wish.edits);
  Line said = Line::typed(wish.text);
  if (!wish.recording.empty()) said.audio = folder_ / "recordings" / wish.recording;
  Performance performance = speakerFor(wish, wish.edits.empty() ? fs::path() : edits).perform(said);
  enter(line, "moving the face");
  performance.data().shapes();
  enter(line, "writing the files");
  save(performance, usualFiles(folder));
  json told = wishFields(wish);
  told.update({{"line", line},
               {"version", version},
               {"title", performance.text()},
               {"warnings", performance.warnings()},
               {"notices", performance.notices()},
               {"duration_s", performance.duration()}});
  told.erase("edits");
  writeFileAtomically(folder / "line.json", dumped(told));

  const std::scoped_lock lock(mutex_);
  Entry& entry = lines_[line];
  entry.folder = folder;
  entry.version = version;
  entry.warnings = performance.warnings();
  entry.notices = performance.notices();
  entry.duration = performance.duration();
  if (!performance.text().empty()) entry.title = performance.text();
  entry.performance = std::move(performance);
  std::size_t kept = 0;  // motion and sound of the last few lines: their sources can be asked for
  for (std::size_t i = lines_.size(); i-- > 0;) {
    if (lines_[i].performance && i != line && ++kept >= kMostPerformances) lines_[i].performance.reset();
  }
}

void ServedLines::fit(std::size_t line) {
  const std::string name = [&] {
    const std::scoped_lock lock(mutex_);
    return lines_[line].title;
  }();
  const fs::path mesh = folder_ / "heads" / name;
  const fs::path corpus = fs::absolute(corpusFile(options_.corpus == "clock" ? "" : options_.corpus));
  const fs::path face = fitHead(mesh, corpus, [&](std::string_view stage) { enter(line, stage); });
  const std::scoped_lock lock(mutex_);
  faces_[face.stem().string()] = face;
  opened_.erase(face.stem().string());
  lines_[line].folder = mesh.parent_path();
}

}  // namespace mouthpiece
