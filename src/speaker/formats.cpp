// The one table of what a performance can be saved as.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>

#include "audio/audio_clip.h"
#include "base/errors.h"
#include "base/files.h"
#include "base/parallel_for.h"
#include "base/text_encoding.h"
#include "deform/mesh/glb_chunks.h"
#include "exports/arkit.h"
#include "exports/curves/curve_files.h"
#include "exports/curves/weight_tracks.h"
#include "exports/format_bytes.h"
#include "exports/scenes/scene_files.h"
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

ArkitCurves arkitOf(const Source& source) {
  ArkitCurves curves;
  curves.frame_rate_hz = source.animation.motion.frame_rate_hz;
  curves.weights = source.arkitOfHead();
  curves.gaze = source.animation.gaze;
  curves.head = source.animation.head;
  return curves;
}

/// By the names that meshes have: "jawOpen".
WeightTracks arkitTracks(const Source& source) {
  WeightTracks tracks{source.animation.motion.frame_rate_hz, {}, source.arkitOfHead()};
  for (const std::string_view name : kArkitNames)
    tracks.names.push_back(lowerCase(name.substr(0, 1)) + std::string(name.substr(1)));
  return tracks;
}

const SpeechLabels& needLabels(const Source& source) {
  if (source.animation.labels.phones.empty())
    throw InputError("nothing is known of what the motion says; expected its labels");
  return source.animation.labels;
}

WeightTracks visemesOf(const Source& source) {
  const MotionClip& motion = source.animation.motion;
  return oculusVisemes(needLabels(source), motion.positions_mm.rows(), motion.frame_rate_hz);
}

/// The mouth by what is said, the lids as they move.
WeightTracks expressionsOf(const Source& source) {
  WeightTracks tracks = vrmMouth(visemesOf(source));
  const RowMajorMatrixF& arkit = source.arkitOfHead();
  const Eigen::Index mouth = tracks.weights.cols();
  tracks.weights.conservativeResize(Eigen::NoChange, mouth + 2);
  tracks.names.insert(tracks.names.end(), {"blinkLeft", "blinkRight"});
  tracks.weights.col(mouth) = arkit.col(arkitIndex("EyeBlinkLeft"));
  tracks.weights.col(mouth + 1) = arkit.col(arkitIndex("EyeBlinkRight"));
  return tracks;
}

std::vector<MouthCue> cuesOf(const Source& source) { return mouthCues(needLabels(source)); }

/// The sound beside a file: with its name, or as a folder has it.
std::string soundBeside(const fs::path& path) {
  const std::string stem = path.stem().string();
  return (stem == "rhubarb" || stem == "mouth" ? "speech" : stem.substr(0, stem.find('.'))) + ".wav";
}

template <std::string (*kWrite)(const WeightTracks&)>
void writeArkitAs(const fs::path& path, const Source& source) {
  writeFileAtomically(path, kWrite(arkitTracks(source)));
}
template <std::string (*kWrite)(const WeightTracks&)>
void writeMetahumanAs(const fs::path& path, const Source& source) {
  writeFileAtomically(path, kWrite(metahumanTracks(arkitTracks(source))));
}
template <std::string (*kWrite)(const WeightTracks&)>
void writeVisemesAs(const fs::path& path, const Source& source) {
  writeFileAtomically(path, kWrite(visemesOf(source)));
}

template <std::string (*kWrite)(const FaceMesh&, const PrincipalShapes&, std::string_view, const SceneTextures&,
                                std::span<const std::string>)>
void writeScene(const fs::path& path, const Source& source) {
  const SharedFace::Data& face = source.needFace();
  const FaceRig& rig = face.rig();
  writeFileAtomically(path, kWrite(rig.mesh(), source.wholeShapes(), rig.name(), sceneTexturesOf(face.meshPath()), {}));
}

/// A lexicon of the words that were guessed, to be mended by hand.
std::string lexiconStub(const Source& source) {
  std::string text =
      "# phones: ARPAbet\n# Words that no dictionary has, as they were said. Mend them and hand this to synth as "
      "lexicon.\n";
  for (const GuessedWord& guess : source.guesses)
    text += fmt::format("# {:.2f} to {:.2f} s\n{} {}\n", guess.span.start, guess.span.end, guess.text,
                        fmt::join(guess.phones, " "));
  return text;
}

template <Source::NamedShapes kKind>
void writeNamed(const fs::path& path, const Source& source) {
  writeFileAtomically(path, source.namedGlb(kKind));
}

void writeFilmOf(const fs::path& path, const Source& source) { source.film(path); }

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
  const std::string glb = withoutDraco(source.smallGlb(), face.rig().name());
  const std::string packed = edits ? source.packedLine(*edits) : "";
  const std::string engine = packed.empty() ? "" : readFile(pageEngineFile());
  return viewHtml(page_template,
                  {animation, glb, face.rig().mesh(), face.rig().name(), face.rig().markerNames(),
                   source.faceMotion().markers(), edits ? &*edits : nullptr, engine, packed, source.shownFromGlb()});
}

// What fits a longer ending comes before what fits its end.
constexpr std::array kRows = {
    Row{{".wav", "speech.wav", "the sound", false, true},
        [](const fs::path& path, const Source& source) { writeWav(path, source.animation.audio); }},
    Row{{".c3d", "motion.c3d", "marker motion, head still", false, true},
        [](const fs::path& path, const Source& source) { writeC3d(path, source.motionInPieces()); }},
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
    Row{{"arkit.csv", "arkit.csv", "ARKit's 52 weights as Live Link Face records them", false, false, true},
        [](const fs::path& path, const Source& source) { writeFileAtomically(path, liveLinkCsv(arkitOf(source))); }},
    Row{{"arkit.json", "arkit.json", "the same as JSON", false, false, true}, writeArkitAs<weightsJson>},
    Row{{"a2f.json", "a2f.json", "the same as Audio2Face exports it", false, false, true},
        writeArkitAs<audio2FaceJson>},
    Row{{"metahuman.csv", "metahuman.csv", "the same as curves of MetaHuman's face rig", false, false, true},
        writeMetahumanAs<weightsCsv>},
    Row{{"metahuman.json", "metahuman.json", "the same as JSON", false, false, true}, writeMetahumanAs<weightsJson>},
    Row{{"maya.anim", "maya.anim", "ARKit's weights for a blendShape node of Maya's", false, false, true},
        [](const fs::path& path, const Source& source) {
          writeFileAtomically(path, mayaAnim(arkitTracks(source), "blendShape1"));
        }},
    Row{{".anim", "unity.anim", "the same for a SkinnedMeshRenderer of Unity's", false, false, true},
        [](const fs::path& path, const Source& source) {
          writeFileAtomically(path, unityAnim(arkitTracks(source), path.stem().string()));
        }},
    Row{{".tres", "godot.tres", "the same as an Animation of Godot 4", false, false, true},
        [](const fs::path& path, const Source& source) {
          writeFileAtomically(path, godotAnimation(arkitTracks(source), path.stem().string(), "Face"));
        }},
    Row{{"visemes.csv", "visemes.csv", "Oculus' 15 visemes"}, writeVisemesAs<weightsCsv>},
    Row{{"visemes.json", "visemes.json", "the same as JSON"}, writeVisemesAs<weightsJson>},
    Row{{".vrma", "vrm.vrma", "VRM's expressions of mouth and lids, VRM Animation 1.0"},
        [](const fs::path& path, const Source& source) {
          writeFileAtomically(path, vrmaBytes(expressionsOf(source)));
        }},
    Row{{".tsv", "rhubarb.tsv", "Rhubarb's nine mouths"},
        [](const fs::path& path, const Source& source) { writeFileAtomically(path, rhubarbTsv(cuesOf(source))); }},
    Row{{".xml", "rhubarb.xml", "the same as XML"},
        [](const fs::path& path, const Source& source) {
          writeFileAtomically(path, rhubarbXml(cuesOf(source), soundBeside(path)));
        }},
    Row{{"rhubarb.json", "rhubarb.json", "the same as JSON"},
        [](const fs::path& path, const Source& source) {
          writeFileAtomically(path, rhubarbJson(cuesOf(source), soundBeside(path)));
        }},
    Row{{".dat", "moho.dat", "the same as switch data of Moho and OpenToonz, 24 frames a second"},
        [](const fs::path& path, const Source& source) { writeFileAtomically(path, mohoDat(cuesOf(source), 24)); }},
    Row{{"lexicon.txt", "lexicon.txt", "the words that no dictionary has, as they were said, to be mended"},
        [](const fs::path& path, const Source& source) { writeFileAtomically(path, lexiconStub(source)); }},
    Row{{".srt", "speech.srt", "the words as subtitles"},
        [](const fs::path& path, const Source& source) {
          writeFileAtomically(path, srtText(needLabels(source), source.animation.text));
        }},
    Row{{".vtt", "speech.vtt", "the same as WebVTT"},
        [](const fs::path& path, const Source& source) {
          writeFileAtomically(path, vttText(needLabels(source), source.animation.text));
        }},
    Row{{".trc", "motion.trc", "marker motion as Cortex and OpenSim have it"},
        [](const fs::path& path, const Source& source) { writeTrc(path, source.motionInPieces()); }},
    Row{{".csv", "motion.csv", "marker motion, a row a frame", false, true},
        [](const fs::path& path, const Source& source) { writeMotionCsv(path, source.motionInPieces()); }},
    Row{{"small.glb", "face.small.glb", "the same in a fifth of the room, for programs that know meshopt", true},
        [](const fs::path& path, const Source& source) { writeFileAtomically(path, source.smallGlb()); }},
    Row{{"arkit.glb", "face.arkit.glb", "the same by ARKit's 52 shapes, the same ones in every line", true},
        writeNamed<Source::NamedShapes::kArkit>},
    Row{{"visemes.glb", "face.visemes.glb", "the same by Oculus' visemes", true},
        writeNamed<Source::NamedShapes::kVisemes>},
    Row{{".glb", "face.glb", "the moving face, glTF 2.0", true, true},
        [](const fs::path& path, const Source& source) { writeFileAtomically(path, source.glb()); }},
    Row{{".fbx", "face.fbx", "the same as FBX 7.4, binary", true}, writeScene<fbxBytes>},
    Row{{".usda", "face.usda", "the same as USD, in its parts' colours", true},
        [](const fs::path& path, const Source& source) {
          const FaceRig& rig = source.needFace().rig();
          writeFileAtomically(path, usdaText(rig.mesh(), source.wholeShapes(), rig.name()));
        }},
    Row{{".usdz", "face.usdz", "the same as USD with its pictures", true}, writeScene<usdzBytes>},
    Row{{".mp4", "face.mp4", "a film of it with its sound, for any player", true}, writeFilmOf},
    Row{{".webm", "face.webm", "the same for the web", true}, writeFilmOf},
    Row{{".gif", "face.gif", "the same without sound, small", true}, writeFilmOf},
    Row{{"png.zip", "face.png.zip", "the same as a PNG a picture", true}, writeFilmOf},
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
        [](const fs::path& path, const Source& source) { writePc2(path, source.frames()); }},
    Row{{".mdd", "face.mdd", "the same as MDD", true},
        [](const fs::path& path, const Source& source) { writeMdd(path, source.frames()); }},
    Row{{".json", "report.json", "what it is made of and how long it took", false, true},
        [](const fs::path& path, const Source& source) { writeFileAtomically(path, source.report()); }},
};

constexpr auto kFormats = [] {
  std::array<Format, kRows.size()> formats{};
  for (std::size_t i = 0; i < kRows.size(); ++i) formats[i] = kRows[i].format;
  return formats;
}();

std::size_t rowOf(const fs::path& path) {
  const std::string name = lowerCase(path.filename().string());
  for (std::size_t i = 0; i < kFormats.size(); ++i) {
    if (name.ends_with(lowerCase(kFormats[i].ending))) return i;
  }
  std::error_code error;
  if (name.empty() || fs::is_directory(path, error))
    throw InputError(path.string(), "", "names a folder; expected a file, as in folder/talk.glb");
  std::string endings;
  for (const Format& format : kFormats) endings += fmt::format("{}{}", endings.empty() ? "" : " ", format.ending);
  throw InputError(path.string(), "", "found an unknown ending; expected one of " + endings);
}

/// What is made of the vertices alone.
bool makesNoShapes(const Row& row) {
  return row.format.ending == ".pc2" || row.format.ending == ".mdd" || row.write == writeFilmOf ||
         row.format.ending == "arkit.glb" || row.format.ending == "visemes.glb";
}

/// Subtitles of a line that has phones alone, as a recording that was heard by its phones.
bool isEmpty(const fs::path& path, const Source& source) {
  const std::string_view name = formatOf(path).usual_name;
  if (name != "speech.srt" && name != "speech.vtt") return false;
  const SpeechLabels& labels = source.animation.labels;
  return !labels.phones.empty() && std::all_of(labels.words.begin(), labels.words.end(),
                                               [](const LabelledWord& word) { return word.text.empty(); });
}
constexpr std::string_view kNoWords = "the line has phones and no words";

}  // namespace

std::span<const Format> formats() { return kFormats; }
const Format& formatOf(const fs::path& path) { return kFormats[rowOf(path)]; }

void save(const Performance& performance, const fs::path& path) { save(performance, std::span(&path, 1)); }

void save(const Performance& performance, std::span<const fs::path> paths) { save(performance, paths, nullptr); }

void save(const Performance& performance, std::span<const fs::path> paths, const FilmProgress& tell) {
  const Source& source = performance.data();
  source.tell_film = tell;
  const auto row_of = [](const fs::path& path) -> const Row& { return kRows[rowOf(path)]; };
  const auto says_nothing = [&](const fs::path& path) {
    return isEmpty(path, source) || row_of(path).format.usual_name == "report.json";
  };
  const auto empty =
      std::find_if(paths.begin(), paths.end(), [&](const fs::path& path) { return isEmpty(path, source); });
  if (empty != paths.end() && std::all_of(paths.begin(), paths.end(), says_nothing))
    throw InputError(
        empty->string(), "",
        fmt::format("would be empty: {}; expected words (a transcript, or another program's times)", kNoWords));
  // Written one after the other are those of one list: a face takes memory, a film all cores.
  std::vector<std::vector<const fs::path*>> small;
  std::vector<const fs::path*> faces, others, reports;
  for (const fs::path& path : paths) {
    const Format& format = row_of(path).format;
    if (format.usual_name == "report.json") {
      reports.push_back(&path);
    } else if (format.in_folder && !format.needs_face) {
      small.push_back({&path});
    } else {
      (format.in_folder ? faces : others).push_back(&path);
    }
  }
  small.insert(small.begin(), faces);
  // What may fail without a disk fails before anything is written; and it is counted as what it is, not as writing.
  if (std::any_of(paths.begin(), paths.end(),
                  [&](const fs::path& path) { return row_of(path).format.needs_face && !makesNoShapes(row_of(path)); }))
    source.shapes();
  FilesTogether together;
  const auto write = [&](std::span<const std::vector<const fs::path*>> lists) {
    double milliseconds = 0;
    timed(milliseconds, [&] {
      parallelFor(lists.size(), [&](std::size_t i) {
        const FilesTogether::Joined joined(together);
        for (const fs::path* path : lists[i]) row_of(*path).write(*path, source);
      });
    });
    source.addWriting(milliseconds);
  };
  write(small);
  write({&others, 1});
  write({&reports, 1});
  together.commit();  // the report last: where it is, all else is
}

std::vector<std::string> notesOn(const Performance& performance, std::span<const fs::path> paths) {
  std::vector<std::string> notes;
  for (const fs::path& path : paths) {
    if (isEmpty(path, performance.data())) notes.push_back(fmt::format("{} is empty: {}", path.string(), kNoWords));
  }
  return notes;
}

std::vector<fs::path> usualFiles(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const Format& format : kFormats) {
    if (format.in_folder) files.push_back(folder / format.usual_name);
  }
  return files;
}

}  // namespace mouthpiece
