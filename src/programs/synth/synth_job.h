#pragma once

#include <memory>
#include <string>
#include <vector>

#include "programs/synth/synth_options.h"

namespace mouthpiece {

/// What came of one line, for the user.
struct SynthOutcome {
  Seconds duration = 0;
  std::size_t unit_count = 0;
  std::size_t backoff_count = 0;
  double real_time_factor = 0;  ///< all but speech synthesis, over the line's duration
  std::string report_json;
  std::vector<std::string> notices;
};

/// A corpus, a face and a voice, loaded once and used for any number of lines. Not thread-safe.
class SynthJob {
 public:
  /// Loads just what `outputs` need. Throws InputError.
  SynthJob(const SynthOptions& options, const std::vector<OutputFile>& outputs);
  ~SynthJob();

  /// Speaks (or reads) the line, animates it and writes `outputs`, each atomically. Throws InputError before
  /// anything is written when the line cannot be made.
  SynthOutcome run(const LineSource& source, const std::vector<OutputFile>& outputs);

 private:
  struct Data;
  std::unique_ptr<Data> data_;
};

}  // namespace mouthpiece
