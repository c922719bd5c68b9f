#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "base/unfinished.h"
#include "mouthpiece/speaker.h"
#include "programs/synth/line_wish.h"

namespace mouthpiece {

class WordNetwork;

/// The lines of one session: what was asked for, how far it is, and where its files are. One thread makes them, one
/// after the other, with the corpus and the faces open all the while. What the last line took to be heard or said is
/// kept for the next one, for ten minutes. Thread-safe.
///
/// FOLDER/001-the-time-is-now holds a line, .../001-the-time-is-now.2 the same after a change: what is there is never
/// written again. A `line.json` in each tells what was asked for, so that a later session has its lines again.
class ServedLines {
 public:
  /// Throws InputError while another program has the folder.
  ServedLines(const SpeakerOptions& options, std::filesystem::path folder);
  ServedLines(const ServedLines&) = delete;
  ServedLines& operator=(const ServedLines&) = delete;
  ~ServedLines();

  /// Each returns the line's number. Throws InputError for what cannot be asked for.
  std::size_t add(LineWish wish);
  /// The line again, as `wish` has it; its recording stays.
  std::size_t change(std::size_t line, LineWish wish);
  /// Keeps bytes that were dropped on the page under a name of its own, and returns that.
  std::string keepRecording(const std::string& name, std::string_view bytes);
  /// The same of parts of a head. A mesh is fitted, with the anchors of its name if there are some, and is then a face.
  std::string keepHead(const std::string& name, std::string_view bytes);
  /// Ends the work on a line after the stage that it is in; one that waits at once.
  void cancel(std::size_t line);

  /// All that the page shows, as JSON.
  [[nodiscard]] std::string state() const;
  /// A line's file by its usual name. Throws InputError where there is none.
  [[nodiscard]] std::filesystem::path file(std::size_t line, const std::string& name) const;
  /// A page that shows and plays the fragment of the corpus that a unit of the line was taken from.
  [[nodiscard]] std::string sourcePage(std::size_t line, std::size_t unit) const;

 private:
  enum class State { kWaiting, kWorking, kDone, kFailed, kCancelled };
  struct Entry {
    LineWish wish;
    State state = State::kWaiting;
    std::string title, stage, error;
    std::vector<std::string> warnings, notices;
    std::filesystem::path folder;     ///< of the last version that is done; "" before
    std::size_t version = 0;          ///< how often it was made
    double duration = 0, took_s = 0;  ///< s
    bool is_head = false, is_cancelled = false;
    std::optional<Performance> performance;
  };
  class Cancelled {};
  /// Who spoke the last line, for lines that wish for the same.
  struct LastSpeaker {
    std::string wish;  ///< all of it but what is said
    SharedFace face;
    Speaker speaker;
  };

  void work(std::stop_token stop);
  void make(std::size_t line);
  /// The speaker of a line, the last one where it can be; `edits`: what is changed in the line, or "".
  Speaker& speakerFor(const LineWish& wish, const std::filesystem::path& edits);
  void fit(std::size_t line);
  void enter(std::size_t line, std::string_view stage);
  void finish(std::size_t line, State state, const std::string& error);
  void readEarlier();
  std::size_t queue(Entry entry);
  [[nodiscard]] const Entry& entryOf(std::size_t line) const;
  [[nodiscard]] std::filesystem::path freeFolder(const std::string& title, std::size_t line, std::size_t version) const;
  SharedFace faceOf(const std::string& name);

  SpeakerOptions options_;
  std::filesystem::path folder_;
  std::unique_ptr<FileLock> lock_;
  SharedCorpus corpus_;
  std::map<std::string, std::filesystem::path> faces_;  ///< by the name that the page shows
  std::map<std::string, SharedFace> opened_;            ///< of the thread that makes the lines
  std::optional<LastSpeaker> last_;                     ///< of the same thread
  std::shared_ptr<WordNetwork> network_;                ///< held so that its program lives from line to line
  std::vector<Entry> lines_;
  std::deque<std::size_t> waiting_;
  mutable std::mutex mutex_;
  std::condition_variable_any woken_;
  std::jthread worker_;
};

}  // namespace mouthpiece
