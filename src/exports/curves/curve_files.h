#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "exports/curves/weight_tracks.h"

// Shapes over time and what is said when, as bytes, a function a format (docs/formats/).
namespace mouthpiece {

/// A raw control of MetaHuman's face rig and the shape of ARKit's that moves it, by Apple's name in lower camel case.
struct MetahumanControl {
  std::string_view arkit, control;
};

/// A row a control, in ARKit's order; a shape may move several (docs/formats/metahuman.md).
std::span<const MetahumanControl> metahumanControls();

/// The values of MetaHuman's controls, 0 to 1, named as its curves are ("CTRL_expressions_jawOpen"), from ARKit's
/// weights (`arkit`, by Apple's names in lower camel case). A control has its shape's weight; those that bring the lips
/// together have mouthClose as a share of jawOpen, for the rig multiplies the two.
WeightTracks metahumanTracks(const WeightTracks& arkit);

/// A row a frame: `time_s`, then the names.
std::string weightsCsv(const WeightTracks& tracks);
/// {"fps", "names", "frames": [[...], ...]}.
std::string weightsJson(const WeightTracks& tracks);
/// The blend shape weights that NVIDIA's Audio2Face exports: exportFps, facsNames, weightMat.
std::string audio2FaceJson(const WeightTracks& tracks);
/// An AnimationClip of Unity: `blendShape.NAME` of the SkinnedMeshRenderer it is put on, in percent.
std::string unityAnim(const WeightTracks& tracks, std::string_view name);
/// An Animation of Godot 4 with a blend shape track a name, of the node `mesh`.
std::string godotAnimation(const WeightTracks& tracks, std::string_view name, std::string_view mesh);
/// Maya's animation file (animImportExport): the weights of the blendShape node `node`.
std::string mayaAnim(const WeightTracks& tracks, std::string_view node);
/// VRM Animation 1.0, a GLB: an expression of VRM's presets for each name.
std::string vrmaBytes(const WeightTracks& expressions);

/// As Rhubarb Lip Sync writes them; `sound` is the name of the sound file beside them.
std::string rhubarbTsv(const std::vector<MouthCue>& cues);
std::string rhubarbXml(const std::vector<MouthCue>& cues, std::string_view sound);
std::string rhubarbJson(const std::vector<MouthCue>& cues, std::string_view sound);
/// Moho's and OpenToonz' switch data, frames from 1, mouths by Preston Blair's names.
std::string mohoDat(const std::vector<MouthCue>& cues, double frame_rate_hz);

/// The words as subtitles of at most 42 signs and 6 seconds, as `text` writes them (writtenWords()).
std::string srtText(const SpeechLabels& labels, std::string_view text = {});
std::string vttText(const SpeechLabels& labels, std::string_view text = {});

}  // namespace mouthpiece
