#include "programs/synth_options.h"

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
  std::string endings;
  // Two kinds end in .json: the name tells curves from the report.
  for (const KnownOutput& known : kKnownOutputs) {
    const bool is_other_json = known.kind == OutputKind::kCurves && !path.filename().string().ends_with("curves.json");
    if (path.extension() == known.ending && !is_other_json) return {known.kind, path};
    if (known.kind == OutputKind::kCurves) continue;
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
