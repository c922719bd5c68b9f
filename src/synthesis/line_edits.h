#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "synthesis/speech_dials.h"
#include "units/selection/selection.h"
#include "vocal/animation_curve.h"
#include "vocal/vocal_style.h"

namespace mouthpiece {

struct SynthesisPlan;

/// A dial over a span: of SpeechDials, or "ma" "ps" "ja" "li" of VOCAL.
struct DialEdit {
  std::string dial;
  TimeSpan span;
  std::vector<StyleSignal::Point> points;  ///< within the span; one alone: that value all along
  Seconds fade = 0.05;                     ///< of the span, at either end: how long it takes to come and to go
};

/// The border between two phones, found again by their names near the time at which it was.
struct BorderEdit {
  std::string before, after;
  Seconds at = 0, to = 0;
};

/// The `number`-th (from 0) place at which a word is said becomes `to`; "" takes it away.
struct WordEdit {
  std::string word;
  std::size_t number = 0;
  std::string to;
};

/// Phones in a row near `start`, to be taken from a take; or, without a take, to be drawn by curves.
struct UnitEdit {
  std::vector<std::string> phones;
  Seconds start = 0;
  std::string take;
  Seconds source_start = 0;
};

/// All that an animator changes in a line (docs/formats/edits.md). It is kept apart from the line, so it survives a new
/// run; what does not apply there is told by the functions below, a sentence each, added to `warnings`.
struct LineEdits {
  CurveEdits curves;
  std::vector<DialEdit> dials;
  std::vector<BorderEdit> borders;
  std::vector<WordEdit> words;
  std::vector<UnitEdit> units;
};

/// edits.json, or curves.json: all curves as they are there. Throws InputError, with `file` in front, for an unknown
/// kind or dial, a span that is none, keys outside it and values out of a dial's range.
LineEdits parseLineEdits(std::string_view json_text, std::string_view file);
LineEdits readLineEdits(const std::filesystem::path& path);

std::string withWords(std::string text, const std::vector<WordEdit>& edits, std::vector<std::string>& warnings);
/// No phone becomes shorter than 10 ms.
SpeechLabels withBorders(SpeechLabels labels, const std::vector<BorderEdit>& edits, std::vector<std::string>& warnings);
SynthesisPlan withUnits(SynthesisPlan plan, const SpeechLabels& labels, const UnitDatabase& database,
                        const std::vector<UnitEdit>& edits, std::vector<std::string>& warnings);
SpeechDials withDials(SpeechDials dials, const std::vector<DialEdit>& edits, Seconds duration,
                      std::vector<std::string>& warnings);
VocalStyle withDials(VocalStyle style, const std::vector<DialEdit>& edits);

}  // namespace mouthpiece
