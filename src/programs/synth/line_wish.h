#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "mouthpiece/line.h"

namespace mouthpiece {

class JsonField;

/// What the face does beside speaking (docs/theory/expression.md).
struct WishedExpression {
  Manner::UpperFace upper_face = Manner::UpperFace::kMouth;
  bool gaze = false, head_motion = false;
  std::string mood;          ///< of moodNames(); empty: none
  double mood_strength = 1;  ///< 0 to 1
};
/// The member "expression" of a request or of a line.json, none where it is missing. Throws InputError.
std::optional<WishedExpression> expressionIn(const JsonField& wish);

/// What the user of the page asks for. Empty fields: the program's own options.
struct LineWish {
  std::string text;       ///< to be spoken, or what the recording says; empty for a recording: it is recognised
  std::string recording;  ///< a file of the folder's "recordings"
  std::string voice, face, language;
  std::string edits;  ///< JSON (docs/formats/edits.md), or ""
  std::optional<WishedExpression> expression = std::nullopt;
};

/// What line.json keeps of it.
nlohmann::json wishFields(const LineWish& wish);
/// What a page shows it by.
std::string titleOf(const LineWish& wish);
/// Throws InputError where there is nothing to say.
void expectWords(const LineWish& wish);
/// Throws InputError for edits that no line could be made with.
void expectEdits(const LineWish& wish);

}  // namespace mouthpiece
