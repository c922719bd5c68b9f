#include "programs/corpus/studio_session.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "base/files.h"
#include "base/index.h"
#include "base/json_text.h"
#include "base/text_encoding.h"
#include "base/unicode.h"
#include "corpus_tools/building/corpus_builder.h"
#include "corpus_tools/takes/video_takes.h"
#include "deform/mesh/mesh_files.h"
#include "motion/formats/c3d_file.h"
#include "phonetics/labels/label_files.h"
#include "programs/corpus/studio_advice.h"
#include "programs/head_fitting.h"
#include "speaker/shared_files.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr std::size_t kLongestSlug = 48;
constexpr Seconds kLongestLine = 600;
constexpr const char* kOwnShape = "of-my-shape";  ///< a file that says so
/// Reading a sentence, saying it, looking at what became of it; measured with the tests' takes and rounded up.
constexpr double kMinutesASentence = 0.4;

/// Letters and digits of the sentence, and a few digits that no other sentence has.
std::string takeNameOf(std::string_view text) {
  const std::string slug = slugOf(text, kLongestSlug);
  return fmt::format("{}-{}", slug.empty() ? "sentence" : slug, sha256Hex(text).substr(0, 6));
}

/// A folder that only its owner enters.
void makePrivateFolder(const fs::path& folder) {
  fs::create_directories(folder);
  fs::permissions(folder, fs::perms::owner_all);
}

std::set<std::pair<Phone, Phone>> pairsOf(const Prompt& prompt) {
  std::set<std::pair<Phone, Phone>> pairs;
  Phone last = Phone::kSil;
  for (const Phone phone : prompt.phones) pairs.insert({std::exchange(last, phone), phone});
  pairs.insert({last, Phone::kSil});
  pairs.erase({Phone::kSil, Phone::kSil});
  return pairs;
}

}  // namespace

StudioSession::StudioSession(StudioOptions options)
    : options_(std::move(options)),
      looking_(std::make_unique<FaceTracker>(options_.models)),
      tracking_(std::make_unique<FaceTracker>(options_.models)),
      labeller_(std::make_unique<TakeLabeller>(options_.lexicon, sharedWordNetwork(), *options_.language)),
      takes_(options_.prompts.size()) {
  options_.folder = fs::absolute(options_.folder).lexically_normal();
  for (const char* name : {"", "incoming", "takes", "videos"}) makePrivateFolder(options_.folder / name);
  lock_.reset(new FileLock(FileLock::ofFolder(options_.folder / "")));
  if (!lock_->isOurs())
    throw InputError(options_.folder.string(), "", "is in use by another corpus studio; expected one at a time");
  takeUpEarlier();
  worker_ = std::jthread([this](const std::stop_token& stop) { work(stop); });
}

StudioSession::~StudioSession() {
  worker_.request_stop();
  woken_.notify_all();
}

std::string StudioSession::nameOf(std::size_t prompt) const { return takeNameOf(options_.prompts[prompt].text); }
fs::path StudioSession::videoOf(std::size_t prompt) const {
  return options_.folder / "incoming" / (nameOf(prompt) + ".webm");
}

/// What an earlier session has done; recordings that it did not come to are judged now.
void StudioSession::takeUpEarlier() {
  if (fs::exists(options_.folder / "person.json")) person_ = readPerson(options_.folder / "person.json");
  for (std::size_t prompt = 0; prompt < takes_.size(); ++prompt) {
    if (fs::exists(takes() / (nameOf(prompt) + ".c3d"))) takes_[prompt].state = TakeState::kGood;
    if (!fs::exists(videoOf(prompt))) continue;
    takes_[prompt].state = TakeState::kWaiting;
    takes_[prompt].number = ++recordings_;
    jobs_.push_back([this, prompt, number = recordings_] { judgeTake(prompt, number); });
  }
  has_line_ = fs::exists(options_.folder / "line" / "view.html");
}

void StudioSession::work(const std::stop_token& stop) {
  while (true) {
    std::function<void()> job;
    {
      std::unique_lock lock(mutex_);
      woken_.wait(lock, stop, [this] { return !jobs_.empty() && forgetting_ == 0; });
      if (stop.stop_requested()) return;
      job = std::move(jobs_.front());
      jobs_.pop_front();
      is_working_ = true;
    }
    job();
    {
      const std::lock_guard lock(mutex_);
      is_working_ = false;
    }
    woken_.notify_all();
  }
}

/// What is being made of the takes would be written after they are deleted: waits until it is done, begins nothing
/// new, and deletes then.
void StudioSession::forget(const std::function<void()>& remove) {
  std::unique_lock lock(mutex_);
  ++forgetting_;
  woken_.wait(lock, [this] { return !is_working_; });
  try {
    remove();
  } catch (...) {
    --forgetting_;
    woken_.notify_all();
    throw;
  }
  --forgetting_;
  woken_.notify_all();
}

void StudioSession::enqueue(std::function<void()> job) {
  {
    const std::lock_guard lock(mutex_);
    jobs_.push_back(std::move(job));
  }
  woken_.notify_all();
}

StudioLook StudioSession::look(std::size_t width, std::size_t height, std::string_view rgba) {
  constexpr std::size_t kMostSide = 4096;
  if (width == 0 || height == 0 || width > kMostSide || height > kMostSide || rgba.size() != 4 * width * height)
    throw InputError("the camera's image", "", "has another size than it says");
  VideoImage image{width, height, {}};
  image.rgb.resize(3 * width * height);
  for (std::size_t i = 0; i < width * height; ++i) {
    for (std::size_t colour = 0; colour < 3; ++colour)
      image.rgb[3 * i + colour] = static_cast<std::uint8_t>(rgba[4 * i + colour]);
  }
  const std::lock_guard lock(look_mutex_);
  return studioLook(image, looking_->track(image));
}

void StudioSession::keepTake(std::size_t prompt, std::string_view video) {
  if (prompt >= takes_.size()) throw InputError("the take", "", "is of no prompt that was given");
  writeFileAtomically(videoOf(prompt), video);
  std::size_t number = 0;
  {
    const std::lock_guard lock(mutex_);
    number = ++recordings_;
    takes_[prompt] = {TakeState::kWaiting, {}, number};
  }
  enqueue([this, prompt, number] { judgeTake(prompt, number); });
}

/// Tracks, aligns, judges; the recording is deleted when the take is good, or kept where that was asked for.
void StudioSession::judgeTake(std::size_t prompt, std::size_t number) {
  {
    const std::lock_guard lock(mutex_);
    if (takes_[prompt].number != number) return;  // said again meanwhile
    takes_[prompt].state = TakeState::kWorking;
  }
  std::vector<std::string> faults;
  try {
    const FaceTrack track = trackFace(videoOf(prompt), {}, *tracking_);
    faults = takeFaults(track);
    if (faults.empty()) {
      const std::string& text = options_.prompts[prompt].text;
      const TakeLabeller::Labels found = labeller_->label(track.sound, text, nameOf(prompt));
      if (const auto fault = wordFault(found)) faults.push_back(*fault);
      if (faults.empty()) saveTake(prompt, track, found.labels);
    }
  } catch (const std::exception& error) {
    faults.push_back(fmt::format("This recording cannot be used ({}). Please say it again.", error.what()));
  }
  const std::lock_guard lock(mutex_);
  if (takes_[prompt].number != number) return;
  std::error_code ignored;
  if (options_.keep_video && faults.empty()) {
    fs::rename(videoOf(prompt), options_.folder / "videos" / videoOf(prompt).filename(), ignored);
  } else {
    fs::remove(videoOf(prompt), ignored);
  }
  const bool has_earlier = fs::exists(takes() / (nameOf(prompt) + ".c3d"));
  if (!faults.empty() && has_earlier) faults.emplace_back("The take before it is kept.");
  takes_[prompt].state = faults.empty() || has_earlier ? TakeState::kGood : TakeState::kAgain;
  takes_[prompt].faults = std::move(faults);
}

void StudioSession::saveTake(std::size_t prompt, const FaceTrack& track, const SpeechLabels& labels) {
  const MarkerLayout& layout = defaultLayout();
  if (!person_) {
    person_ = measurePerson(std::vector{track}, layout, std::nullopt).value_or(FilmedPerson{});
    writePerson(options_.folder / "person.json", *person_);
  }
  const std::string name = nameOf(prompt);
  const MotionClip markers = markersOf(track, layout, person_->eye_corners_mm, name);
  FilesTogether files;
  writeWav(takes() / (name + ".wav"), track.sound);
  writeFileAtomically(takes() / (name + ".txt"), options_.prompts[prompt].text + "\n");
  writeLabels(takes() / (name + ".TextGrid"), labels, {.name = name});
  writeC3d(takes() / (name + ".c3d"), refineMarkers(track, markers, layout, *person_));
  files.commit();
}

void StudioSession::forgetTake(std::size_t prompt) {
  if (prompt >= takes_.size()) throw InputError("the take", "", "is of no prompt that was given");
  forget([&] {
    takes_[prompt] = {TakeState::kNone, {}, ++recordings_};
    fs::remove(videoOf(prompt));
    fs::remove(options_.folder / "videos" / videoOf(prompt).filename());
    for (const char* ending : {".c3d", ".wav", ".txt", ".TextGrid"}) fs::remove(takes() / (nameOf(prompt) + ending));
    // A corpus that holds the take, and what it has said, go with it.
    for (const char* made : {"own.corpus", "own.corpus.parts", "line"}) fs::remove_all(options_.folder / made);
    has_line_ = false;
  });
}

void StudioSession::forgetAll() {
  forget([&] {
    jobs_.clear();
    for (const char* made :
         {"incoming", "takes", "videos", "own.corpus", "own.corpus.parts", "line", "head", "person.json"})
      fs::remove_all(options_.folder / made);
    for (TakeEntry& take : takes_) take = {TakeState::kNone, {}, ++recordings_};
    for (const char* name : {"incoming", "takes", "videos"}) makePrivateFolder(options_.folder / name);
    person_.reset();
    stage_.clear();
    trouble_.clear();
    has_line_ = false;
  });
}

/// Throws when what it is made of shall be deleted.
void StudioSession::enter(const std::string& stage) {
  const std::lock_guard lock(mutex_);
  if (forgetting_ > 0) throw InputError("takes were deleted meanwhile");
  stage_ = stage;
}

void StudioSession::make(std::string text, std::string voice) {
  const bool has_take = [&] {
    const std::lock_guard lock(mutex_);
    trouble_.clear();
    return std::any_of(takes_.begin(), takes_.end(), [](const auto& take) { return take.state == TakeState::kGood; });
  }();
  if (!has_take) throw InputError("the corpus", "", "needs a good take first");
  if (text.find_first_not_of(" \t\r\n") == std::string::npos) throw InputError("the line", "", "has no words");
  enter("waiting for the takes");
  enqueue([this, text = std::move(text), voice = std::move(voice)] { buildAndSay(text, voice); });
}

void StudioSession::buildAndSay(const std::string& text, const std::string& voice) {
  try {
    enter("building the corpus");
    BuildOptions build;
    build.lexicon = options_.lexicon;
    build.language = options_.language;
    const fs::path corpus = options_.folder / "own.corpus";
    buildCorpusFile(takes(), corpus, build);
    const fs::path line = options_.folder / "line";
    makePrivateFolder(line);
    std::vector<std::string> arguments{"--quiet",        "--corpus", corpus.string(),
                                       "--text=" + text, "--out",    line.string()};
    if (options_.language != &english()) arguments.push_back(fmt::format("--language={}", options_.language->tag));
    if (!voice.empty()) arguments.push_back("--voice=" + voice);
    const fs::path face = faceFor(corpus);
    if (!face.empty()) arguments.insert(arguments.end(), {"--face", fs::absolute(face).string()});
    enter("speaking the line");
    runBeside("synth", arguments, line, kLongestLine);
    const std::lock_guard lock(mutex_);
    has_line_ = true;
    said_ = text;
    stage_.clear();
  } catch (const std::exception& error) {
    const std::lock_guard lock(mutex_);
    stage_.clear();
    trouble_ = error.what();
  }
}

void StudioSession::wearHead(const std::string& which) {
  if (which != "own" && which != "sample")
    throw InputError(printable(which), "", "is no head; expected own or sample, or a file");
  const fs::path head = options_.folder / "head";
  const std::lock_guard lock(mutex_);
  fs::remove_all(head);
  if (which == "sample") return;
  makePrivateFolder(head);
  writeFileAtomically(head / kOwnShape, "");
}

void StudioSession::keepHead(const std::string& name, std::string_view bytes) {
  const bool is_anchors = name.ends_with(".anchors.json");
  if (!is_anchors && !isHeadMesh(name))
    throw InputError(printable(name), "", "is no head; expected .glb .vrm .obj .ply .off, and its .anchors.json");
  const fs::path head = options_.folder / "head";
  const std::lock_guard lock(mutex_);
  // Another head begins anew; anchors may come before or after the mesh that they belong to.
  const std::string kept = "head" + (is_anchors ? ".anchors.json" : lowerCase(fs::path(name).extension().string()));
  if (!is_anchors && !headMesh().empty()) fs::remove_all(head);
  makePrivateFolder(head);
  for (const char* of_another : {"head.face", kOwnShape}) fs::remove(head / of_another);
  writeFileAtomically(head / kept, bytes);
}

fs::path StudioSession::headMesh() const {
  for (const std::string_view ending : kHeadMeshEndings) {
    const fs::path mesh = options_.folder / "head" / fmt::format("head{}", ending);
    if (fs::exists(mesh)) return mesh;
  }
  return {};
}

/// The head of the person's wish, else the one of the command line. It is fitted to the sample corpus, whose optical
/// actor it is judged by as `retarget fit` judges; any corpus' motion plays on it.
fs::path StudioSession::faceFor(const fs::path& corpus) {
  const fs::path head = options_.folder / "head", face = head / "head.face";
  if (fs::exists(head / kOwnShape)) {
    enter("giving the head your shape");
    runBeside("retarget", {"own", "--corpus", corpus.string(), "--out", (head / "head.obj").string()}, head,
              kLongestLine);
    fs::remove(face);
  }
  const fs::path mesh = headMesh();
  if (mesh.empty()) return options_.face;
  if (fs::exists(face)) return face;
  return fitHead(mesh, findSharedFile("sample.corpus", "make it with `make`"),
                 [this](std::string_view stage) { enter(std::string(stage)); });
}

std::string StudioSession::linePage() const {
  const fs::path page = options_.folder / "line" / "view.html";
  if (!fs::exists(page)) throw InputError("the line", "", "is not there yet");
  return readFile(page);
}

std::set<std::pair<Phone, Phone>> StudioSession::heldPairs() const {
  std::set<std::pair<Phone, Phone>> held;
  for (std::size_t i = 0; i < takes_.size(); ++i) {
    if (takes_[i].state == TakeState::kGood) held.merge(pairsOf(options_.prompts[i]));
  }
  return held;
}

std::string StudioSession::state() const {
  static constexpr std::array<const char*, 5> kWords{"none", "waiting", "working", "good", "again"};
  const std::lock_guard lock(mutex_);
  const auto held = heldPairs();
  std::set<std::pair<Phone, Phone>> possible;
  for (const Prompt& prompt : options_.prompts) possible.merge(pairsOf(prompt));
  json prompts = json::array();
  std::size_t left = 0;
  for (std::size_t i = 0; i < takes_.size(); ++i) {
    const auto own = pairsOf(options_.prompts[i]);
    const auto adds = std::count_if(own.begin(), own.end(), [&](const auto& pair) { return !held.contains(pair); });
    const bool is_open = takes_[i].state == TakeState::kNone || takes_[i].state == TakeState::kAgain;
    left += is_open ? 1 : 0;
    prompts.push_back({{"text", options_.prompts[i].text},
                       {"state", kWords[static_cast<std::size_t>(takes_[i].state)]},
                       {"faults", takes_[i].faults},
                       {"adds", adds}});
  }
  const json state{{"folder", options_.folder.string()},
                   {"keeps_video", options_.keep_video},
                   {"prompts", prompts},
                   {"held_pairs", held.size()},
                   {"possible_pairs", possible.size()},
                   {"minutes_left", std::ceil(kMinutesASentence * asReal(left))},
                   {"head", fs::exists(options_.folder / "head" / kOwnShape) ? "own"
                            : headMesh().empty()                             ? "sample"
                                                                             : "file"},
                   {"stage", stage_},
                   {"trouble", trouble_},
                   {"said", said_},
                   {"has_line", has_line_}};
  return jsonText(state);
}

}  // namespace mouthpiece
