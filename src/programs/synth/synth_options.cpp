#include "programs/synth/synth_options.h"

#include <array>
#include <string_view>
#include <utility>

#include "base/errors.h"

namespace mouthpiece {
namespace {

struct KnownOutput {
  OutputKind kind;
  std::string_view ending;
  std::string_view usual_name;
};

/// Kinds whose file's whole name tells them from others with the same ending.
constexpr std::array kNamedOutputs = {
    KnownOutput{OutputKind::kCurves, "curves.json", "curves.json"},
    KnownOutput{OutputKind::kCurveKeysCsv, "curves.csv", "curves.csv"},
    KnownOutput{OutputKind::kCurveFramesCsv, "curve_frames.csv", "curve_frames.csv"},
    KnownOutput{OutputKind::kAblation, "ablation.html", "ablation.html"},
};

constexpr std::array kKnownOutputs = {
    KnownOutput{OutputKind::kSound, ".wav", "speech.wav"},
    KnownOutput{OutputKind::kMotionC3d, ".c3d", "motion.c3d"},
    KnownOutput{OutputKind::kMotionCsv, ".csv", "motion.csv"},
    KnownOutput{OutputKind::kFace, ".glb", "face.glb"},
    KnownOutput{OutputKind::kCurves, ".json", "curves.json"},
    KnownOutput{OutputKind::kPhones, ".TextGrid", "phones.TextGrid"},
    KnownOutput{OutputKind::kPage, ".html", "view.html"},
    KnownOutput{OutputKind::kReport, ".json", "report.json"},
};

}  // namespace

OutputFile outputFileFor(const std::filesystem::path& path) {
  for (const KnownOutput& known : kNamedOutputs) {
    if (path.filename().string().ends_with(known.ending)) return {known.kind, path};
  }
  std::string endings;
  for (const KnownOutput& known : kKnownOutputs) {
    if (known.kind == OutputKind::kCurves) continue;
    if (path.extension() == known.ending) return {known.kind, path};
    endings += (endings.empty() ? "" : " ") + std::string(known.ending);
  }
  throw InputError(path.string(), "", "found an unknown ending; expected one of " + endings);
}

std::vector<OutputFile> allOutputFiles(const std::filesystem::path& folder) {
  std::vector<OutputFile> files;
  for (const KnownOutput& known : kKnownOutputs) files.push_back({known.kind, folder / known.usual_name});
  return files;
}

}  // namespace mouthpiece
