#include "programs/synth/line_wish.h"

#include <array>
#include <nlohmann/json.hpp>
#include <string_view>
#include <vector>

#include "base/errors.h"
#include "base/json_fields.h"
#include "base/json_text.h"
#include "expression/expression.h"
#include "synthesis/line_edits.h"

namespace mouthpiece {
namespace {

using nlohmann::json;

constexpr std::array<std::string_view, 4> kUpperFaces{"mouth", "captured", "rules", "best"};  ///< as the enumeration

}  // namespace

std::optional<WishedExpression> expressionIn(const JsonField& wish) {
  const JsonField fields = wish["expression"];
  if (!fields.exists()) return std::nullopt;
  WishedExpression expression;
  expression.upper_face = static_cast<Manner::UpperFace>(fields["upper_face"].choice(kUpperFaces));
  expression.gaze = fields["gaze"].flag();
  expression.head_motion = fields["head_motion"].flag();
  std::vector<std::string_view> moods = moodNames();
  moods.emplace_back("");
  expression.mood = moods[fields["mood"].choice(moods)];
  expression.mood_strength = fields["mood_strength"].number(0, 1);
  return expression;
}

json wishFields(const LineWish& wish) {
  json edits = looseJson(wish.edits);
  if (!edits.is_array()) edits = json::array();
  json fields{{"text", wish.text}, {"recording", wish.recording}, {"voice", wish.voice},
              {"face", wish.face}, {"language", wish.language},   {"edits", std::move(edits)}};
  if (const auto& expression = wish.expression) {
    fields["expression"] = {{"upper_face", kUpperFaces[static_cast<std::size_t>(expression->upper_face)]},
                            {"gaze", expression->gaze},
                            {"head_motion", expression->head_motion},
                            {"mood", expression->mood},
                            {"mood_strength", expression->mood_strength}};
  }
  return fields;
}

void expectEdits(const LineWish& wish) {
  if (!wish.edits.empty()) parseLineEdits(wish.edits, "the edits");
}

void expectWords(const LineWish& wish) {
  if (wish.text.find_first_not_of(" \t\r\n") == std::string::npos && wish.recording.empty())
    throw InputError("there is nothing to say; type a line or drop a recording");
}

std::string titleOf(const LineWish& wish) { return wish.text.empty() ? wish.recording : wish.text; }

}  // namespace mouthpiece
