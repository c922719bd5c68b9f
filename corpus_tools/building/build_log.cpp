#include "corpus_tools/building/build_log.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "corpus_tools/takes/pose_fit.h"

namespace mouthpiece {
namespace {

using Json = nlohmann::json;

constexpr const char* kJigKey = "head_reference_jig_mm";
constexpr const char* kStableKey = "head_reference_stable_mm";

std::string shapeToJson(const MarkerPositions& shape) {
  Json rows = Json::array();
  for (Eigen::Index i = 0; i < shape.rows(); ++i) rows.push_back({shape(i, 0), shape(i, 1), shape(i, 2)});
  return rows.dump();
}

/// nullopt for what is no list of `rows` points.
std::optional<MarkerPositions> shapeFromJson(const std::string& text, std::size_t rows) {
  const Json json = Json::parse(text, nullptr, false);
  if (!json.is_array() || json.size() != rows) return std::nullopt;
  MarkerPositions shape(static_cast<Eigen::Index>(rows), 3);
  for (std::size_t i = 0; i < rows; ++i) {
    if (!json[i].is_array() || json[i].size() != 3) return std::nullopt;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const Json& value = json[i][axis];  // null: a marker never seen
      const double number = value.is_number() ? value.get<double>() : std::nan("");
      shape(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(axis)) = number;
    }
  }
  return shape;
}

}  // namespace

void logHeadReference(Corpus& corpus, const HeadReference& reference) {
  corpus.build_log[kJigKey] = shapeToJson(reference.jig_mm);
  corpus.build_log[kStableKey] = shapeToJson(reference.stable_mm);
}

HeadReference headReferenceOf(const Corpus& corpus) {
  HeadReference reference{MarkerPositions(0, 3), pickMarkers(corpus.neutral_pose_mm, stableMarkers(corpus.layout))};
  const auto logged = [&](const char* key, std::size_t rows, MarkerPositions& shape) {
    const auto entry = corpus.build_log.find(key);
    if (entry == corpus.build_log.end()) return;
    if (const auto read = shapeFromJson(entry->second, rows)) shape = *read;
  };
  logged(kJigKey, corpus.layout.jig_names.size(), reference.jig_mm);
  logged(kStableKey, stableMarkers(corpus.layout).size(), reference.stable_mm);
  return reference;
}

std::string textOf(const HeadReference& reference) {
  return shapeToJson(reference.jig_mm) + shapeToJson(reference.stable_mm);
}

std::string leftOutToText(const std::vector<LeftOutTake>& left_out) {
  std::vector<std::string> lines;
  for (const LeftOutTake& take : left_out) lines.push_back(fmt::format("{}: {}", take.name, take.reason));
  return fmt::format("{}", fmt::join(lines, "\n"));
}

}  // namespace mouthpiece
