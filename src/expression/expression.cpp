#include "expression/expression.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "base/errors.h"
#include "base/index.h"
#include "base/text_encoding.h"
#include "expression/beats.h"
#include "expression/captured_upper_face.h"
#include "expression/ruled_face.h"
#include "units/file/corpus.h"

namespace mouthpiece {
namespace {

/// How much farther, or less far, than on the head that the shapes were learnt from the lids of this face travel until
/// they meet.
double blinkScale(std::string_view side, const ArkitMarkerMoves& learnt, const MarkerPositions& blink,
                  const MarkerLayout& layout, const MarkerPositions& neutral_mm) {
  const auto row = [&](const std::string& marker) -> std::optional<Eigen::Index> {
    const auto found = std::find_if(layout.markers.begin(), layout.markers.end(),
                                    [&](const LayoutMarker& own) { return own.name == marker; });
    if (found == layout.markers.end()) return std::nullopt;
    return found - layout.markers.begin();
  };
  const auto drop = [&](const std::string& marker) {
    const auto found = std::find(learnt.markers.begin(), learnt.markers.end(), marker);
    return found == learnt.markers.end() ? 0.0 : -blink(found - learnt.markers.begin(), 1);
  };
  const std::string upper = fmt::format("LID_UP_{}", side), lower = fmt::format("LID_LO_{}", side);
  const auto upper_row = row(upper), lower_row = row(lower);
  const double closes = drop(upper) - drop(lower);
  if (!upper_row || !lower_row || !(closes > 1)) return 1;
  return std::clamp((neutral_mm(*upper_row, 1) - neutral_mm(*lower_row, 1)) / closes, 0.5, 2.0);
}

}  // namespace

PositionMatrix shapeDisplacements(const Eigen::Ref<const PositionMatrix>& weights, const MarkerLayout& layout,
                                  const MarkerPositions& neutral_mm) {
  MOUTHPIECE_EXPECT(weights.cols() == std::ssize(kArkitNames));
  const ArkitMarkerMoves& learnt = arkitMarkerMoves();
  PositionMatrix moves = PositionMatrix::Zero(weights.cols(), signedIndex(3 * layout.markers.size()));
  for (std::size_t k = 0; k < kArkitNames.size(); ++k) {
    if (weights.col(signedIndex(k)).isZero(0)) continue;
    double scale = 1;
    if (kArkitNames[k].starts_with("EyeBlink"))
      scale = blinkScale(kArkitNames[k].ends_with("Left") ? "L" : "R", learnt, learnt.moves_mm[k], layout, neutral_mm);
    for (std::size_t m = 0; m < layout.markers.size(); ++m) {
      const auto found = std::find(learnt.markers.begin(), learnt.markers.end(), layout.markers[m].name);
      if (found == learnt.markers.end()) continue;
      moves.block<1, 3>(signedIndex(k), signedIndex(3 * m)) =
          scale * learnt.moves_mm[k].row(found - learnt.markers.begin());
    }
  }
  return weights * moves;
}

namespace {

/// Whether a sign is no blank, punctuation or picture. Without ICU, which a page's engine has not.
bool isOfWord(char32_t c) {
  if (c < 0x80) return (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z');
  constexpr std::array<std::pair<char32_t, char32_t>, 11> kOther{{{0x80, 0xBF},
                                                                  {0x55A, 0x55F},
                                                                  {0x600, 0x61F},
                                                                  {0x2000, 0x2BFF},
                                                                  {0x3000, 0x303F},
                                                                  {0xFE00, 0xFE6F},
                                                                  {0xFF00, 0xFF0F},
                                                                  {0xFF1A, 0xFF20},
                                                                  {0xFF3B, 0xFF40},
                                                                  {0xFF5B, 0xFF65},
                                                                  {0x1F000, 0x1FAFF}}};
  return std::none_of(kOther.begin(), kOther.end(),
                      [&](const auto& range) { return c >= range.first && c <= range.second; });
}

}  // namespace

bool isQuestion(std::string_view text) {
  constexpr std::u32string_view kQuestionMarks = U"?\u037E\u061F\u203D\u2047\u2048\u2049\uFF1F";
  bool asks = false;
  for (std::size_t offset = 0; offset < text.size();) {
    const auto c = decodeUtf8(text, offset);
    if (!c) return false;
    if (kQuestionMarks.find(*c) != std::u32string_view::npos) {
      asks = true;
    } else if (isOfWord(*c)) {
      asks = false;
    }
  }
  return asks;
}

LineExpression expressionOf(const SpeechLabels& labels, bool asks, std::span<const Seconds> times,
                            const UnitDatabase& database, const ExpressionOptions& options) {
  const Corpus& corpus = database.corpus();
  const std::vector<Beat> beats = beatsOf(labels);
  LineExpression made;
  // Each has dice of its own, so that asking for one more leaves the others as they were.
  Dice upper_dice(options.seed), head_dice(options.seed + 1), gaze_dice(options.seed + 2);
  if (options.head) made.head = ruledHead(beats, times, head_dice);
  if (options.gaze) made.gaze = ruledGaze(beats, times, made.head, gaze_dice);
  if (options.upper_face == UpperFaceSource::kMouth) return made;

  if (options.upper_face != UpperFaceSource::kRules) {
    if (auto captured = capturedUpperFace(beats, times, database, upper_dice)) {
      made.upper_face = "captured";
      made.upper_mm = std::move(captured->positions_mm);
      made.stretches = captured->stretches;
      return made;
    }
    if (options.upper_face == UpperFaceSource::kCaptured)
      throw InputError(
          fmt::format("the corpus {} has captured no lids that blink; expected them for a captured upper "
                      "face (rules make one without)",
                      corpus.name));
  }
  made.upper_face = "rules";
  const PositionMatrix weights = ruledUpperFace(beats, asks, times, upper_dice, made.blinks);
  made.upper_mm = shapeDisplacements(weights, corpus.layout, corpus.neutral_pose_mm);
  if (made.upper_mm.isZero(0) && !made.blinks.empty())
    made.warnings.push_back(
        fmt::format("no marker of lids or brows in the corpus {}: the upper face stays as it is", corpus.name));
  const std::vector<bool> upper = upperFaceColumns(corpus.layout);
  for (std::size_t i = 0; i < upper.size(); ++i) {
    auto column = made.upper_mm.col(signedIndex(i));
    if (upper[i]) {
      column.array() += corpus.neutral_pose_mm.data()[i];
    } else {
      column.setZero();
    }
  }
  return made;
}

}  // namespace mouthpiece
