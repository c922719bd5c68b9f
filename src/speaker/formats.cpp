// The one table of what a performance can be saved as.
#include <algorithm>
#include <array>

#include "audio/audio_clip.h"
#include "base/errors.h"
#include "base/files.h"
#include "exports/arkit.h"
#include "exports/format_bytes.h"
#include "motion/formats/c3d_file.h"
#include "motion/formats/motion_csv.h"
#include "motion/resample.h"
#include "mouthpiece/save.h"
#include "phonetics/labels/textgrid.h"
#include "speaker/shared_files.h"
#include "speaker/speaker_data.h"
#include "synthesis/curve_ablation.h"
#include "vocal/animation_curve.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;
using Source = Performance::Data;

/// A row of the table: the kind of file, and how `source` gets into one at a path.
struct Row {
  Format format;
  void (*write)(const fs::path& path, const Source& source);
};

/// Fitted to the markers; a head's own shapes do not count here (`retarget apply` asks for them).
ArkitCurves arkitOf(const Source& source) {
  ArkitCurves curves;
  curves.frame_rate_hz = source.animation.motion.frame_rate_hz;
  curves.weights = source.arkit();
  return curves;
}

std::string ablationOf(const Source& source) {
  if (!source.corpus) throw InputError("the performance was made of no corpus; expected one for the curves' ablation");
  const MotionClip& motion = source.animation.motion;
  return ablationPage(
      source.animation.text, source.animation.labels,
      ablateCurves(source.animation.labels, source.tags, source.style, source.corpus->data().curve_model.poses(),
                   frameTimes(0, motion.frameCount(), motion.frame_rate_hz)),
      motion.frame_rate_hz);
}

std::string pageOf(const Source& source) {
  const std::string page_template =
      readFile(findSharedFile("viewer.html", "make it with `make build` in the checkout"));
  const SharedFace::Data& face = source.needFace();
  const UtteranceAnimation animation = source.timedAnimation();
  const std::optional<ViewEdits> edits = source.viewEdits();
  return viewHtml(page_template, {animation, source.glb(), face.rig.mesh(), face.rig.name(), face.rig.markerNames(),
                                  source.faceMotion().markers(), edits ? &*edits : nullptr});
}

// What fits a longer ending comes before what fits its end.
constexpr std::array kRows = {
    Row{{".wav", "speech.wav", "the sound", false, true},
        [](const fs::path& path, const Source& source) { writeWav(path, source.animation.audio); }},
    Row{{".c3d", "motion.c3d", "marker motion, head still", false, true},
        [](const fs::path& path, const Source& source) { writeC3d(path, source.animation.motion); }},
    Row{{"curves.csv", "curves.csv", "the curves' keys"},
        [](const fs::path& path, const Source& source) {
          writeFileAtomically(path, curveKeysToCsv(source.animation.curves));
        }},
    Row{{"curve_frames.csv", "curve_frames.csv", "the curves, a value a frame"},
        [](const fs::path& path, const Source& source) {
          const MotionClip& motion = source.animation.motion;
          writeFileAtomically(path,
                              curveFramesToCsv(source.animation.curves, motion.frame_rate_hz, motion.frameCount()));
        }},
    Row{{"arkit.csv", "arkit.csv", "ARKit's 52 weights as Live Link Face records them"},
        [](const fs::path& path, const Source& source) { writeFileAtomically(path, liveLinkCsv(arkitOf(source))); }},
    Row{{".csv", "motion.csv", "marker motion, a row a frame", false, true},
        [](const fs::path& path, const Source& source) { writeMotionCsv(path, source.animation.motion); }},
    Row{{".glb", "face.glb", "the moving face, glTF 2.0", true, true},
        [](const fs::path& path, const Source& source) { writeFileAtomically(path, source.glb()); }},
    Row{{"curves.json", "curves.json", "VOCAL's curves, to look at and to edit", false, true},
        [](const fs::path& path, const Source& source) {
          writeFileAtomically(path, curvesToJson(source.animation.curves));
        }},
    Row{{".TextGrid", "phones.TextGrid", "words and phones with their times", false, true},
        [](const fs::path& path, const Source& source) {
          writeTextGrid(path, source.animation.labels, source.confidence);
        }},
    Row{{"ablation.html", "ablation.html", "what each part of VOCAL does to the curves"},
        [](const fs::path& path, const Source& source) { writeFileAtomically(path, ablationOf(source)); }},
    Row{{".html", "view.html", "a page that shows it, one file", true, true},
        [](const fs::path& path, const Source& source) { writeFileAtomically(path, pageOf(source)); }},
    Row{{".pc2", "face.pc2", "every vertex of every frame, a point cache", true},
        [](const fs::path& path, const Source& source) { writeFileAtomically(path, pc2Bytes(source.allVertices())); }},
    Row{{".mdd", "face.mdd", "the same as MDD", true},
        [](const fs::path& path, const Source& source) { writeFileAtomically(path, mddBytes(source.allVertices())); }},
    Row{{".json", "report.json", "what it is made of and how long it took", false, true},
        [](const fs::path& path, const Source& source) {
          writeFileAtomically(path, reportJson(source.timedAnimation()));
        }},
};

constexpr auto kFormats = [] {
  std::array<Format, kRows.size()> formats{};
  for (std::size_t i = 0; i < kRows.size(); ++i) formats[i] = kRows[i].format;
  return formats;
}();

std::size_t rowOf(const fs::path& path) {
  const std::string name = path.filename().string();
  for (std::size_t i = 0; i < kFormats.size(); ++i) {
    if (name.ends_with(kFormats[i].ending)) return i;
  }
  std::string endings;
  for (const Format& format : kFormats) endings += (endings.empty() ? "" : " ") + std::string(format.ending);
  throw InputError(path.string(), "", "found an unknown ending; expected one of " + endings);
}

}  // namespace

std::span<const Format> formats() { return kFormats; }
const Format& formatOf(const fs::path& path) { return kFormats[rowOf(path)]; }

void save(const Performance& performance, const fs::path& path) {
  const Row& row = kRows[rowOf(path)];
  // What the page and the GLB are made of is counted as what it is, not as writing.
  if (row.format.needs_face && row.format.ending != ".pc2" && row.format.ending != ".mdd") performance.data().glb();
  double milliseconds = 0;
  timed(milliseconds, [&] { row.write(path, performance.data()); });
  performance.data().addWriting(milliseconds);
}

void save(const Performance& performance, std::span<const fs::path> paths) {
  // What may fail without a disk fails before anything is written.
  if (std::any_of(paths.begin(), paths.end(), [](const fs::path& path) { return formatOf(path).needs_face; }))
    performance.data().glb();
  FilesTogether together;
  const auto is_report = [](const fs::path& path) { return formatOf(path).usual_name == "report.json"; };
  for (const bool reports : {false, true}) {
    for (const fs::path& path : paths) {
      if (is_report(path) == reports) save(performance, path);
    }
  }
  together.commit();  // the report last: where it is, all else is
}

std::vector<fs::path> usualFiles(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const Format& format : kFormats) {
    if (format.in_folder) files.push_back(folder / format.usual_name);
  }
  return files;
}

}  // namespace mouthpiece
