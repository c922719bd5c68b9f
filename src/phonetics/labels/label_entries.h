#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "phonetics/labels/labels_builder.h"

namespace mouthpiece {

/// HTK's label files count 100 ns.
inline constexpr double kHtkUnitsPerSecond = 1e7;

/// What the Montreal Forced Aligner writes for the phones of a word that its dictionary lacks.
inline constexpr std::string_view kUnspelledWord = "spn";

/// A labelled stretch of time as it stands in a file.
struct LabelEntry {
  std::string text;
  TimeSpan span;
  std::string place;  ///< for messages: the line, as "41"
};

/// What one speaker says, twice.
struct LabelTiers {
  std::vector<LabelEntry> words, phones;
};

/// Later than this is no speech but a damaged number.
inline constexpr Seconds kLatestLabel = 24 * 3600.0;

/// Entries as phones. TIMIT's closures join the stop that follows, its glottal stop ("q") the phone before.
/// Throws InputError for what is no time, backward, empty or overlapping (rounding of 0.1 ms is forgiven), and names
/// an unknown phone.
std::vector<PhoneSegment> phonesFromEntries(std::string_view file, const std::vector<LabelEntry>& entries,
                                            const Language& language);

/// The entries that are no silence, as words. The same errors.
std::vector<WordSegment> wordsFromEntries(std::string_view file, const std::vector<LabelEntry>& entries);

}  // namespace mouthpiece
