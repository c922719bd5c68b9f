#pragma once

#include <map>
#include <pugixml.hpp>
#include <string_view>
#include <vector>

#include "base/time.h"

namespace mouthpiece {

/// A measure where it is played, and how often it was played before: 0 at first, the verse.
struct PlayedMeasure {
  std::size_t index;
  std::size_t times_before;
};

/// The measures of a MusicXML part as they are played: with repeats, endings, da capo, dal segno, fine and coda; after
/// a jump repeats are not taken again. `score` may tell the jumps in any of its parts. Throws InputError for what never
/// ends.
std::vector<PlayedMeasure> playedMeasures(const pugi::xml_node& score, const pugi::xml_node& part,
                                          std::string_view name);

/// The tempos of a score, which any part may tell, by `sound` or by metronome marks; the first holds from the
/// beginning, and is 100 quarters a minute where there is none. Places are measures and quarters in them.
class ScoreTempos {
 public:
  /// Throws InputError, with `name` in front, for a tempo that is no number.
  ScoreTempos(const pugi::xml_node& score, std::string_view name);

  /// How long it is from quarter `from` to quarter `to` of a measure.
  [[nodiscard]] Seconds between(std::size_t measure, double from, double to) const;

 private:
  std::map<std::pair<std::size_t, double>, double> tempos_;  ///< quarters a minute
};

/// Moves `quarters`, a place in a measure, over one of the measure's elements: notes that sound one after the other,
/// `backup` and `forward`. `divisions` a quarter are kept up to date. Throws InputError, with name and place in front,
/// for lengths that are no numbers or out of range.
void passElement(const pugi::xml_node& element, double& divisions, double& quarters, std::string_view name,
                 std::string_view place);

/// "measure 12", for messages.
std::string placeOfMeasure(const pugi::xml_node& measure);

}  // namespace mouthpiece
