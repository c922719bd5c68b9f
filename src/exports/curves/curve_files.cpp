#include "exports/curves/curve_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "base/text_encoding.h"
#include "base/text_numbers.h"

namespace mouthpiece {
namespace {

using nlohmann::ordered_json;

double timeOf(const WeightTracks& tracks, Eigen::Index frame) { return asReal(frame) / tracks.frame_rate_hz; }

/// "[[0.1,0],...]": a row of the file a frame.
std::string rowsOf(const WeightTracks& tracks) {
  std::string rows = "[";
  for (Eigen::Index t = 0; t < tracks.weights.rows(); ++t) {
    rows += t == 0 ? "\n[" : ",\n[";
    for (Eigen::Index k = 0; k < tracks.weights.cols(); ++k) {
      if (k > 0) rows += ',';
      appendFixed(rows, static_cast<double>(tracks.weights(t, k)), 6);
    }
    rows += ']';
  }
  return rows + "\n]";
}

std::string namesOf(const WeightTracks& tracks) { return ordered_json(tracks.names).dump(); }

/// The frames of column `k` that straight lines between them give the others of, to a thousandth.
std::vector<Eigen::Index> keysOf(const WeightTracks& tracks, Eigen::Index k) {
  constexpr double kStraight = 1e-3;
  const auto values = tracks.weights.col(k).cast<double>().eval();
  std::vector<Eigen::Index> keys;
  double least = 0, most = 0;  // slopes from the last key that pass all frames since it
  const auto slope = [&](Eigen::Index t, double off) {
    return (values(t) + off - values(keys.back())) / asReal(t - keys.back());
  };
  for (Eigen::Index t = 0; t < values.size(); ++t) {
    if (t > 0) {
      least = std::max(least, slope(t, -kStraight));
      most = std::min(most, slope(t, kStraight));
    }
    const bool is_last = t + 1 == values.size();
    if (t > 0 && !is_last && slope(t + 1, 0) >= least && slope(t + 1, 0) <= most) continue;
    keys.push_back(t);
    least = -std::numeric_limits<double>::infinity();
    most = -least;
  }
  return keys;
}

std::string quotedYaml(std::string_view text) { return ordered_json(text).dump(); }

}  // namespace

std::string weightsCsv(const WeightTracks& tracks) {
  std::string csv = "time_s";
  for (const std::string& name : tracks.names) csv += "," + name;
  for (Eigen::Index t = 0; t < tracks.weights.rows(); ++t) {
    csv += '\n';
    appendFixed(csv, timeOf(tracks, t), 6);
    for (Eigen::Index k = 0; k < tracks.weights.cols(); ++k) {
      csv += ',';
      appendFixed(csv, static_cast<double>(tracks.weights(t, k)), 6);
    }
  }
  return csv + "\n";
}

std::string weightsJson(const WeightTracks& tracks) {
  return fmt::format("{{\"fps\": {}, \"names\": {}, \"frames\": {}}}\n", tracks.frame_rate_hz, namesOf(tracks),
                     rowsOf(tracks));
}

std::string audio2FaceJson(const WeightTracks& tracks) {
  return fmt::format(
      "{{\"exportFps\": {}, \"trackPath\": \"\", \"numPoses\": {}, \"numFrames\": {}, \"facsNames\": {}, "
      "\"weightMat\": "
      "{}}}\n",
      tracks.frame_rate_hz, tracks.names.size(), tracks.weights.rows(), namesOf(tracks), rowsOf(tracks));
}

std::string unityAnim(const WeightTracks& tracks, std::string_view name) {
  std::string clip = fmt::format(
      "%YAML 1.1\n%TAG !u! tag:unity3d.com,2011:\n--- !u!74 &7400000\nAnimationClip:\n  m_ObjectHideFlags: 0\n  "
      "m_Name: "
      "{}\n  serializedVersion: 6\n  m_Legacy: 0\n  m_Compressed: 0\n  m_UseHighQualityCurve: 1\n  m_RotationCurves: "
      "[]\n  m_CompressedRotationCurves: []\n  m_EulerCurves: []\n  m_PositionCurves: []\n  m_ScaleCurves: []\n  "
      "m_FloatCurves:\n",
      quotedYaml(name));
  for (std::size_t k = 0; k < tracks.names.size(); ++k) {
    clip += "  - curve:\n      serializedVersion: 2\n      m_Curve:\n";
    const auto column = tracks.weights.col(signedIndex(k));
    const std::vector<Eigen::Index> keys = keysOf(tracks, signedIndex(k));
    const auto slopeBetween = [&](Eigen::Index a, Eigen::Index b) {
      return a == b ? 0.0 : 100 * static_cast<double>(column(b) - column(a)) * tracks.frame_rate_hz / asReal(b - a);
    };
    for (std::size_t i = 0; i < keys.size(); ++i) {
      fmt::format_to(std::back_inserter(clip),
                     "      - serializedVersion: 3\n        time: {:.6f}\n        value: {:.4f}\n        inSlope: "
                     "{:.4f}\n        outSlope: {:.4f}\n        tangentMode: 69\n        weightedMode: 0\n        "
                     "inWeight: 0.33333334\n        outWeight: 0.33333334\n",
                     timeOf(tracks, keys[i]), 100 * column(keys[i]), slopeBetween(keys[i > 0 ? i - 1 : 0], keys[i]),
                     slopeBetween(keys[i], keys[std::min(i + 1, keys.size() - 1)]));
    }
    fmt::format_to(std::back_inserter(clip),
                   "      m_PreInfinity: 2\n      m_PostInfinity: 2\n      m_RotationOrder: 4\n    attribute: "
                   "blendShape.{}\n    path: \n    classID: 137\n    script: {{fileID: 0}}\n",
                   tracks.names[k]);
  }
  const double stop = timeOf(tracks, std::max<Eigen::Index>(0, tracks.weights.rows() - 1));
  clip += fmt::format(
      "  m_PPtrCurves: []\n  m_SampleRate: {}\n  m_WrapMode: 0\n  m_AnimationClipSettings:\n    serializedVersion: 2\n "
      "   "
      "m_StartTime: 0\n    m_StopTime: {:.6f}\n    m_LoopTime: 0\n  m_EditorCurves: []\n  m_EulerEditorCurves: []\n  "
      "m_Events: []\n",
      tracks.frame_rate_hz, stop);
  return clip;
}

std::string godotAnimation(const WeightTracks& tracks, std::string_view name, std::string_view mesh) {
  const double length = timeOf(tracks, std::max<Eigen::Index>(0, tracks.weights.rows() - 1));
  std::string text = fmt::format(
      "[gd_resource type=\"Animation\" format=3]\n\n[resource]\nresource_name = {}\nlength = {:.6f}\nstep = {:.6f}\n",
      quotedYaml(name), length, 1 / tracks.frame_rate_hz);
  for (std::size_t k = 0; k < tracks.names.size(); ++k) {
    fmt::format_to(std::back_inserter(text),
                   "tracks/{0}/type = \"blend_shape\"\ntracks/{0}/imported = false\ntracks/{0}/enabled = "
                   "true\ntracks/{0}/path = NodePath(\"{1}:{2}\")\ntracks/{0}/interp = 1\ntracks/{0}/loop_wrap = "
                   "false\ntracks/{0}/keys = PackedFloat32Array(",
                   k, mesh, tracks.names[k]);
    bool is_first = true;
    for (const Eigen::Index t : keysOf(tracks, signedIndex(k))) {
      fmt::format_to(std::back_inserter(text), "{}{:.6f}, 1, {:.6f}", is_first ? "" : ", ", timeOf(tracks, t),
                     tracks.weights(t, signedIndex(k)));
      is_first = false;
    }
    text += ")\n";
  }
  return text;
}

std::string mayaAnim(const WeightTracks& tracks, std::string_view node) {
  // animImportExport knows frames of no rate but those of film and television; seconds hold at all rates.
  std::string text = fmt::format(
      "animVersion 1.1;\nmayaVersion 2022;\ntimeUnit sec;\nlinearUnit cm;\nangularUnit deg;\nstartTime 0;\nendTime "
      "{:.6f};\n",
      timeOf(tracks, std::max<Eigen::Index>(0, tracks.weights.rows() - 1)));
  for (std::size_t k = 0; k < tracks.names.size(); ++k) {
    fmt::format_to(std::back_inserter(text),
                   "anim {0} {0} {1} 0 0 {2};\nanimData {{\n  input time;\n  output unitless;\n  weighted 0;\n  "
                   "preInfinity constant;\n  postInfinity constant;\n  keys {{\n",
                   tracks.names[k], node, k);
    for (const Eigen::Index t : keysOf(tracks, signedIndex(k)))
      fmt::format_to(std::back_inserter(text), "    {:.6f} {:.6f} linear linear 1 1 0;\n", timeOf(tracks, t),
                     tracks.weights(t, signedIndex(k)));
    text += "  }\n}\n";
  }
  return text;
}

std::string vrmaBytes(const WeightTracks& expressions) {
  const auto frames = static_cast<std::size_t>(expressions.weights.rows());
  std::string binary;
  const auto append = [&](float value) { binary.append(reinterpret_cast<const char*>(&value), sizeof(value)); };
  for (std::size_t t = 0; t < frames; ++t) append(asFloat(timeOf(expressions, signedIndex(t))));
  ordered_json nodes = ordered_json::array({{{"name", "hips"}, {"translation", {0, 1, 0}}}});
  ordered_json preset = ordered_json::object(), channels = ordered_json::array(), samplers = ordered_json::array();
  ordered_json accessors = ordered_json::array();
  ordered_json views = ordered_json::array({{{"buffer", 0}, {"byteOffset", 0}, {"byteLength", 4 * frames}}});
  accessors.push_back({{"bufferView", 0},
                       {"componentType", 5126},
                       {"count", frames},
                       {"type", "SCALAR"},
                       {"min", {0.0F}},
                       {"max", {asFloat(timeOf(expressions, signedIndex(frames) - 1))}}});
  ordered_json roots = {0};
  for (std::size_t k = 0; k < expressions.names.size(); ++k) {
    const std::size_t node = nodes.size();
    nodes.push_back({{"name", expressions.names[k]}});
    roots.push_back(node);
    preset[expressions.names[k]] = {{"node", node}};
    views.push_back({{"buffer", 0}, {"byteOffset", binary.size()}, {"byteLength", 12 * frames}});
    for (std::size_t t = 0; t < frames; ++t) {  // an expression's weight is the x of its node
      append(expressions.weights(signedIndex(t), signedIndex(k)));
      append(0);
      append(0);
    }
    samplers.push_back({{"input", 0}, {"interpolation", "LINEAR"}, {"output", accessors.size()}});
    channels.push_back({{"sampler", k}, {"target", {{"node", node}, {"path", "translation"}}}});
    accessors.push_back({{"bufferView", k + 1}, {"componentType", 5126}, {"count", frames}, {"type", "VEC3"}});
  }
  ordered_json root = {
      {"asset", {{"version", "2.0"}, {"generator", "Mouthpiece"}}},
      {"extensionsUsed", {"VRMC_vrm_animation"}},
      {"extensions",
       {{"VRMC_vrm_animation",
         {{"specVersion", "1.0"},
          {"humanoid", {{"humanBones", {{"hips", {{"node", 0}}}}}}},
          {"expressions", {{"preset", preset}}}}}}},
      {"scene", 0},
      {"scenes", ordered_json::array({{{"nodes", roots}}})},
      {"nodes", nodes},
      {"animations", ordered_json::array({{{"name", "speech"}, {"channels", channels}, {"samplers", samplers}}})},
      {"accessors", accessors},
      {"bufferViews", views},
      {"buffers", ordered_json::array({{{"byteLength", binary.size()}}})}};
  std::string json = root.dump();
  json.resize((json.size() + 3) / 4 * 4, ' ');
  std::string glb;
  const auto word = [&](std::size_t value) {
    for (unsigned shift = 0; shift < 32; shift += 8) glb.push_back(static_cast<char>(value >> shift));
  };
  glb += "glTF";
  word(2);
  word(12 + 8 + json.size() + 8 + binary.size());
  word(json.size());
  glb += "JSON" + json;
  word(binary.size());
  glb += std::string("BIN\0", 4) + binary;
  return glb;
}

std::string rhubarbTsv(const std::vector<MouthCue>& cues) {
  std::string text;
  for (const MouthCue& cue : cues) text += fmt::format("{:.2f}\t{}\n", cue.span.start, cue.shape);
  if (!cues.empty()) text += fmt::format("{:.2f}\tX\n", cues.back().span.end);
  return text;
}

std::string rhubarbXml(const std::vector<MouthCue>& cues, std::string_view sound) {
  std::string text = fmt::format(
      "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<rhubarbResult>\n  <metadata>\n    "
      "<soundFile>{}</soundFile>\n    <duration>{:.2f}</duration>\n  </metadata>\n  <mouthCues>\n",
      xmlEscaped(sound), cues.empty() ? 0.0 : cues.back().span.end);
  for (const MouthCue& cue : cues)
    text += fmt::format("    <mouthCue start=\"{:.2f}\" end=\"{:.2f}\">{}</mouthCue>\n", cue.span.start, cue.span.end,
                        cue.shape);
  return text + "  </mouthCues>\n</rhubarbResult>\n";
}

std::string rhubarbJson(const std::vector<MouthCue>& cues, std::string_view sound) {
  std::string text =
      fmt::format("{{\n  \"metadata\": {{\n    \"soundFile\": {},\n    \"duration\": {:.2f}\n  }},\n  \"mouthCues\": [",
                  quotedYaml(sound), cues.empty() ? 0.0 : cues.back().span.end);
  for (std::size_t i = 0; i < cues.size(); ++i)
    text += fmt::format("{}\n    {{ \"start\": {:.2f}, \"end\": {:.2f}, \"value\": \"{}\" }}", i == 0 ? "" : ",",
                        cues[i].span.start, cues[i].span.end, cues[i].shape);
  return text + "\n  ]\n}\n";
}

std::string mohoDat(const std::vector<MouthCue>& cues, double frame_rate_hz) {
  const auto nameOf = [](char shape) -> std::string_view {
    constexpr std::array<std::string_view, 8> kNames{"MBP", "etc", "E", "AI", "O", "U", "FV", "L"};
    return shape == 'X' ? "rest" : kNames[static_cast<std::size_t>(shape - 'A')];
  };
  const auto frameOf = [&](Seconds time) { return 1 + static_cast<int>(frame_rate_hz * time + 1e-6); };
  std::string text = "MohoSwitch1\n";
  int last = 0;
  for (std::size_t i = 0; i < cues.size();) {
    last = frameOf(cues[i].span.start);
    // Of those that begin in one frame the longest shows.
    std::size_t longest = i;
    for (; i < cues.size() && frameOf(cues[i].span.start) == last; ++i) {
      if (cues[i].span.duration() > cues[longest].span.duration()) longest = i;
    }
    text += fmt::format("{} {}\n", last, nameOf(cues[longest].shape));
  }
  if (!cues.empty()) text += fmt::format("{} rest\n", std::max(frameOf(cues.back().span.end), last + 1));
  return text;
}

}  // namespace mouthpiece
