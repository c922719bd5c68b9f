#include "corpus_tools/takes/video_takes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>

#include "base/child_process.h"
#include "base/errors.h"
#include "base/files.h"
#include "base/index.h"
#include "base/json_fields.h"
#include "base/parallel_for.h"
#include "corpus_tools/takes/lip_sync.h"
#include "motion/formats/c3d_file.h"
#include "tracking/face_track.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

/// The person is measured in so many clips at most; more tell little new.
constexpr std::size_t kClipsForPerson = 8;
constexpr double kLeastEyeCornersMm = 40, kMostEyeCornersMm = 140;

using NamedClips = std::map<std::string, fs::path>;

NamedClips byName(const std::vector<fs::path>& clips) {
  NamedClips named;
  for (const fs::path& clip : clips) {
    const std::string name = clip.stem().string();
    const auto [other, is_new] = named.emplace(name, clip);
    if (!is_new)
      throw InputError(clip.string(), "", fmt::format("would become the same take as {}", other->second.string()));
  }
  if (named.empty()) throw InputError("", "", "no clip to track");
  return named;
}

bool isDone(const fs::path& clip, const fs::path& take) {
  std::error_code error;
  const auto made = fs::last_write_time(take, error);
  if (error) return false;
  const auto filmed = fs::last_write_time(clip, error);
  return !error && made >= filmed;
}

/// Trackers that wait for work: each has networks of its own.
class TrackerPool {
 public:
  explicit TrackerPool(fs::path models) : models_(std::move(models)) { idle_.push_back(make()); }

  FaceTrack track(const fs::path& clip, const VideoReading& reading) {
    std::unique_ptr<FaceTracker> tracker = take();
    FaceTrack track = trackFace(clip, reading, *tracker);
    const std::lock_guard lock(mutex_);
    idle_.push_back(std::move(tracker));
    return track;
  }

 private:
  [[nodiscard]] std::unique_ptr<FaceTracker> make() const { return std::make_unique<FaceTracker>(models_); }

  std::unique_ptr<FaceTracker> take() {
    {
      const std::lock_guard lock(mutex_);
      if (!idle_.empty()) {
        auto tracker = std::move(idle_.back());
        idle_.pop_back();
        return tracker;
      }
    }
    return make();
  }

  fs::path models_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<FaceTracker>> idle_;
};

class VideoTaker {
 public:
  VideoTaker(NamedClips clips, fs::path folder, const fs::path& models, const VideoTakesOptions& options)
      : clips_(std::move(clips)), folder_(std::move(folder)), options_(options), pool_(models) {}

  VideoTakes run(const std::function<void(std::size_t, std::size_t)>& progress) {
    std::vector<std::string> names;
    for (const auto& [name, clip] : clips_) {
      if (options_.again || !isDone(clip, takeFile(name))) names.push_back(name);
    }
    result_.kept = clips_.size() - names.size();
    expectOurTakes(names);
    std::size_t done = result_.kept;
    const auto advance = [&] {
      const std::lock_guard lock(mutex_);
      progress(++done, clips_.size());
    };
    progress(done, clips_.size());
    const std::size_t first = meetPerson(names, advance);
    parallelFor(names.size() - first, options_.jobs == 0 ? defaultThreadCount() : options_.jobs, [&](std::size_t i) {
      tryClip(names[first + i], [&](const std::string& name) { writeTake(name, read(name)); });
      advance();
    });
    const auto by_name = [](const auto& a, const auto& b) { return a.name < b.name; };
    std::sort(result_.takes.begin(), result_.takes.end(), by_name);
    std::sort(result_.left_out.begin(), result_.left_out.end(), by_name);
    return std::move(result_);
  }

 private:
  [[nodiscard]] fs::path takeFile(const std::string& name) const { return folder_ / (name + ".c3d"); }
  [[nodiscard]] fs::path personFile() const { return folder_ / "person.json"; }

  /// Throws InputError where a take would replace what no earlier run has made: those have left a person.json and the
  /// take's motion, before its sound.
  void expectOurTakes(const std::vector<std::string>& names) const {
    std::error_code error;
    for (const std::string& name : names) {
      const fs::path sound = folder_ / (name + ".wav"), motion = takeFile(name);
      const bool has_sound = fs::exists(sound, error), has_motion = fs::exists(motion, error);
      if ((has_sound || has_motion) && !(has_motion && fs::exists(personFile(), error)))
        throw InputError((has_sound ? sound : motion).string(), "",
                         "is there and was not made by tracking; expected another folder to write to");
    }
  }

  void tryClip(const std::string& name, const std::function<void(const std::string&)>& work) {
    try {
      work(name);
    } catch (const InputError& error) {
      const std::lock_guard lock(mutex_);
      result_.left_out.push_back({name, error.what()});
    }
  }

  FaceTrack read(const std::string& name) {
    const fs::path& clip = clips_.at(name);
    FaceTrack track = pool_.track(clip, {.sound_rate_hz = options_.sound_rate_hz});
    if (track.seenShare() < options_.least_seen)
      throw InputError(clip.string(), "",
                       fmt::format("shows a face in {:.0f} % of its images; expected {:.0f} % or more",
                                   100 * track.seenShare(), 100 * options_.least_seen));
    if (!options_.recorder.samples.empty()) takeRecorder(name, track);
    if (track.sound.samples.empty()) throw InputError(clip.string(), "", "has no sound; a take needs the voice");
    return track;
  }

  /// Puts the recorder's sound in the place of the clip's own.
  void takeRecorder(const std::string& name, FaceTrack& track) {
    const std::string file = clips_.at(name).string();
    SoundPlace place;
    if (track.sound.samples.empty()) {
      const MotionClip markers = markersOf(track, options_.layout, 90, file);  // any size will do
      place = placeOfSound(markers, options_.recorder, LipGauge(markers.marker_names));
    } else {
      place = placeOfSameSound(track.sound, options_.recorder);
    }
    if (!place.is_sure)
      throw InputError(
          file, "",
          fmt::format("perhaps the other sound begins {:.3f} s {} it (alike by {:.2f}, elsewhere by "
                      "{:.2f}); that is not sure",
                      std::abs(place.late), place.late < 0 ? "before" : "after", place.likeness, place.likeness_apart));
    const Seconds duration = asReal(track.frames.size()) / track.frame_rate_hz;
    track.sound = resampleAudio(soundBeside(duration, options_.recorder, place.late, place.drift.value_or(0)),
                                options_.sound_rate_hz);
    const std::lock_guard lock(mutex_);
    recorder_places_[name] = place;
  }

  /// Finds out about the person: in person.json, or in the first clips, which are then written, too. Gives how many.
  std::size_t meetPerson(const std::vector<std::string>& names, const std::function<void()>& advance) {
    if (fs::exists(personFile())) {
      takeUpPerson();
      return 0;
    }
    const std::size_t count = std::min(names.size(), kClipsForPerson);
    std::vector<std::optional<FaceTrack>> tracks(count);
    parallelFor(count, options_.jobs == 0 ? defaultThreadCount() : options_.jobs,
                [&](std::size_t i) { tryClip(names[i], [&](const std::string& name) { tracks[i] = read(name); }); });
    std::vector<FaceTrack> found;
    for (const auto& track : tracks) {
      if (track) found.push_back(*track);
    }
    if (!found.empty()) {
      result_.person = measurePerson(found, options_.layout, options_.eye_corners_mm).value_or(FilmedPerson{});
      writePerson(personFile(), result_.person);
    }
    for (std::size_t i = 0; i < count; ++i) {
      if (tracks[i]) tryClip(names[i], [&](const std::string& name) { writeTake(name, *tracks[i]); });
      advance();
    }
    return count;
  }

  void takeUpPerson() {
    result_.person = readPerson(personFile());
    const double size_mm = result_.person.eye_corners_mm;
    if (options_.eye_corners_mm && std::abs(*options_.eye_corners_mm - size_mm) > 1e-6)
      throw InputError(personFile().string(), "",
                       fmt::format("has another size, {:.1f} mm; take another folder", size_mm));
  }

  void writeTake(const std::string& name, const FaceTrack& track) {
    const fs::path& clip = clips_.at(name);
    MotionClip motion = markersOf(track, options_.layout, result_.person.eye_corners_mm, clip.string());
    if (!options_.plain_markers) motion = refineMarkers(track, motion, options_.layout, result_.person);
    FilesTogether files;
    writeC3d(takeFile(name), motion);  // first: a sound alone is none of ours
    writeWav(folder_ / (name + ".wav"), track.sound);
    for (const char* ending : {".txt", ".TextGrid"}) {
      const fs::path beside = fs::path(clip).replace_extension(ending);
      if (fs::exists(beside) && !fs::exists(folder_ / (name + ending)))
        writeFileAtomically(folder_ / (name + ending), readFile(beside, 64 << 20));
    }
    files.commit();
    const std::lock_guard lock(mutex_);
    const auto place = recorder_places_.find(name);
    result_.takes.push_back({name, track.frame_rate_hz, track.seenShare(), track.frames.size(), track.had_even_steps,
                             place == recorder_places_.end() ? std::nullopt : std::optional(place->second)});
  }

  NamedClips clips_;
  fs::path folder_;
  const VideoTakesOptions& options_;
  TrackerPool pool_;
  std::mutex mutex_;
  std::map<std::string, SoundPlace> recorder_places_;
  VideoTakes result_;
};

}  // namespace

FilmedPerson readPerson(const fs::path& file) {
  const JsonField json = parseJson(readFile(file, 1 << 20), file.string(), "what is known of a filmed person");
  return {.eye_corners_mm = json["eye_corners_mm"].number(kLeastEyeCornersMm, kMostEyeCornersMm),
          .noise_mm = json["noise_mm"].number(0, 10),
          .inner_closed_mm = json["inner_closed_mm"].number(0, 20),
          .closed_lips_mm = json["closed_lips_mm"].number(0, 60)};
}

void writePerson(const fs::path& file, const FilmedPerson& person) {
  const nlohmann::json json{
      {"eye_corners_mm", std::clamp(person.eye_corners_mm, kLeastEyeCornersMm, kMostEyeCornersMm)},
      {"noise_mm", person.noise_mm},
      {"inner_closed_mm", person.inner_closed_mm},
      {"closed_lips_mm", person.closed_lips_mm}};
  writeFileAtomically(file, json.dump(2) + "\n");
}

VideoTakes trackVideos(const std::vector<fs::path>& clips, const fs::path& folder, const fs::path& models,
                       const VideoTakesOptions& options,
                       const std::function<void(std::size_t done, std::size_t total)>& progress) {
  if (!findProgram("ffmpeg"))
    throw InputError("ffmpeg", "",
                     "is not here, and videos are read with it; get it with: sudo apt-get install ffmpeg");
  return VideoTaker(byName(clips), folder, models, options).run(progress);
}

}  // namespace mouthpiece
