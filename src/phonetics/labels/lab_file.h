#pragma once

#include <filesystem>
#include <string_view>

#include "phonetics/labels/speech_labels.h"

namespace mouthpiece {

struct LabFileOptions {
  int timit_sample_rate_hz = 16000;  ///< TIMIT's .phn counts samples of the sound beside it
};

/// Reads phones from a label file (docs/formats/labels.md), whichever its content shows:
/// - ESPS/Festival: a header up to a line "#", then "end_s colour label";
/// - HTK: "start end label" in units of 100 ns;
/// - TIMIT .phn: "start end label" in samples;
/// - plain: "start end label" in seconds, with a decimal point (Audacity's label track too).
/// - CTM: "name channel start_s duration_s label".
/// There are no words in such files. Throws InputError naming file and line.
SpeechLabels readLabFile(const std::filesystem::path& path, const LabFileOptions& options = {});
/// The same from memory; `name` stands for the file in messages.
SpeechLabels parseLabFile(std::string_view bytes, std::string_view name, const LabFileOptions& options = {});

/// A TextGrid or a label file, told apart by content.
SpeechLabels readLabels(const std::filesystem::path& path, const LabFileOptions& options = {});

}  // namespace mouthpiece
