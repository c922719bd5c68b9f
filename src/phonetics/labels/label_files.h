#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "phonetics/labels/speech_labels.h"
#include "phonetics/language/language.h"

namespace mouthpiece {

struct LabFileOptions {
  int timit_sample_rate_hz = 16000;       ///< TIMIT's .phn counts samples of the sound beside it
  const Language* language = &english();  ///< of the phones
};

/// Reads phones from a label file (docs/formats/labels.md), whichever its content shows:
/// - ESPS/Festival: a header up to a line "#", then "end_s colour label";
/// - HTK: "start end label" in units of 100 ns;
/// - TIMIT .phn: "start end label" in samples;
/// - plain: "start end label" in seconds, with a decimal point (Audacity's label track too).
/// - CTM: "name channel start_s duration_s label".
/// There are no words in such files. `name` stands for the file in messages. Throws InputError naming file and line.
SpeechLabels parseLabFile(std::string_view bytes, std::string_view name, const LabFileOptions& options = {});

/// True for two lines or more of two numbers and a label, each from where the one before ends or behind ESPS' "#": no
/// text that anyone says.
bool isLabFile(std::string_view text);

/// A TextGrid or a label file, told apart by content.
SpeechLabels readLabels(const std::filesystem::path& path, const LabFileOptions& options = {});

/// Label files that can be written (docs/formats/labels.md, textgrid.md).
enum class LabelFormat {
  kTextGrid,       ///< long text, UTF-8
  kShortTextGrid,  ///< short text, UTF-8
  kHtk,            ///< "start end label", 100 ns
  kEsps,           ///< Festival's: header, "end_s 121 label"
  kTimit,          ///< "start end label", samples
  kCtm,            ///< "name 1 start_s duration_s label"
  kSeconds,        ///< "start end label", seconds
};

struct LabelFileOptions {
  int sample_rate_hz = 16000;  ///< for TIMIT
  std::string name = "take";   ///< for CTM: what the labels belong to; blanks become "_"
  bool utf16 = false;          ///< TextGrids: UTF-16, big-endian with its mark, as Praat writes it
};

/// Words and syllables are kept by TextGrids alone; the others hold the phones.
std::string formatLabels(const SpeechLabels& labels, LabelFormat format, const LabelFileOptions& options = {});

/// By the name's ending: .TextGrid, .lab (HTK), .phn (TIMIT), .ctm, .txt (seconds); atomically. Throws InputError for
/// another ending.
void writeLabels(const std::filesystem::path& path, const SpeechLabels& labels, const LabelFileOptions& options = {});
void writeLabels(const std::filesystem::path& path, const SpeechLabels& labels, LabelFormat format,
                 const LabelFileOptions& options);

/// True for a name that writeLabels knows by its ending.
bool isLabelFileName(const std::filesystem::path& path);

}  // namespace mouthpiece
