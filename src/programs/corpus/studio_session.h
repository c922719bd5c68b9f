#pragma once

#include <condition_variable>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "base/unfinished.h"
#include "corpus_tools/report/prompts.h"
#include "corpus_tools/takes/take_files.h"
#include "phonetics/text/lexicon.h"
#include "tracking/marker_refining.h"

namespace mouthpiece {

struct StudioOptions {
  std::filesystem::path
      folder;  ///< holds all that is kept: incoming/, takes/, videos/, own.corpus, line/, head/, person.json
  std::vector<Prompt> prompts;  ///< to be said, the first of them for the lips to be measured in
  Lexicon lexicon;
  const Language* language = &english();  ///< of the prompts and the lines
  std::filesystem::path models;           ///< the tracker's networks
  std::filesystem::path face;             ///< the head that speaks at the end; empty: the default one
  bool keep_video = false;                ///< in videos/
};

/// What is seen in one image of the camera, for the page to draw and to tell.
struct StudioLook {
  bool has_face = false;
  std::vector<Eigen::Vector2d> points;  ///< of the layout's markers and the inner lips, shares of the image's sides
  std::vector<std::string> advice;      ///< plain words; empty: all is well
};

/// One person's recordings: prompts, takes, and what is made of them. Work that takes long is done by one thread, in
/// the order of asking. Whatever is told to be kept is on the disk before the call returns. Thread-safe.
class StudioSession {
 public:
  /// Throws InputError while another program has the folder.
  explicit StudioSession(StudioOptions options);
  StudioSession(const StudioSession&) = delete;
  StudioSession& operator=(const StudioSession&) = delete;
  ~StudioSession();

  /// Rows of red, green, blue, alpha bytes, from the top. Throws InputError for another number of bytes.
  StudioLook look(std::size_t width, std::size_t height, std::string_view rgba);
  /// Keeps the recording of a prompt and has it tracked, aligned and judged. An earlier take of the prompt is replaced
  /// when this one is good. Throws InputError for what is no prompt.
  void keepTake(std::size_t prompt, std::string_view video);
  /// Deletes a take and what was made of it. It waits for what is being made.
  void forgetTake(std::size_t prompt);
  /// Deletes every file that the session has made. It waits for what is being made.
  void forgetAll();
  /// The head that shall speak: the "sample" (or the command line's), or that in the person's "own" shape.
  void wearHead(const std::string& which);
  /// Keeps a head that shall speak, or the anchors of one (`retarget pick`), by its name's ending. It is fitted to the
  /// person before the next line. Throws InputError for another file.
  void keepHead(const std::string& name, std::string_view bytes);
  /// Builds the corpus and has it say the line, with the voice of that name ("" for the program's own, "corpus" for the
  /// person's). Throws InputError without a good take or a text.
  void make(std::string text, std::string voice);

  /// All that the page shows, as JSON.
  [[nodiscard]] std::string state() const;
  /// The page of the line that was made. Throws InputError where there is none.
  [[nodiscard]] std::string linePage() const;

 private:
  enum class TakeState { kNone, kWaiting, kWorking, kGood, kAgain };
  struct TakeEntry {
    TakeState state = TakeState::kNone;
    std::vector<std::string> faults;  ///< why to say it again, plain words
    std::size_t number = 0;           ///< of the recording, so that a later one wins
  };

  void work(const std::stop_token& stop);
  void enqueue(std::function<void()> job);
  void takeUpEarlier();
  void judgeTake(std::size_t prompt, std::size_t number);
  void saveTake(std::size_t prompt, const FaceTrack& track, const SpeechLabels& labels);
  void buildAndSay(const std::string& text, const std::string& voice);
  void enter(const std::string& stage);
  void forget(const std::function<void()>& remove);
  std::filesystem::path faceFor(const std::filesystem::path& corpus);
  [[nodiscard]] std::filesystem::path headMesh() const;

  [[nodiscard]] std::string nameOf(std::size_t prompt) const;
  [[nodiscard]] std::filesystem::path videoOf(std::size_t prompt) const;
  [[nodiscard]] std::filesystem::path takes() const { return options_.folder / "takes"; }
  [[nodiscard]] std::set<std::pair<Phone, Phone>> heldPairs() const;

  StudioOptions options_;
  std::unique_ptr<FileLock> lock_;  ///< of the folder
  std::unique_ptr<FaceTracker> looking_, tracking_;
  std::unique_ptr<TakeLabeller> labeller_;
  std::optional<FilmedPerson> person_;
  std::mutex look_mutex_;
  mutable std::mutex mutex_;
  std::vector<TakeEntry> takes_;
  std::size_t recordings_ = 0;
  std::string stage_, trouble_, said_;  ///< of the making of corpus, face and line
  bool has_line_ = false;
  std::deque<std::function<void()>> jobs_;
  bool is_working_ = false;     ///< on a job
  std::size_t forgetting_ = 0;  ///< how many ask to delete; no job is begun meanwhile
  std::condition_variable_any woken_;
  std::jthread worker_;
};

}  // namespace mouthpiece
