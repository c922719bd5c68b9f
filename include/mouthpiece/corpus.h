#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "mouthpiece/version.h"

namespace mouthpiece {

/// A corpus (docs/formats/corpus.md), opened: captured motion with its labels. Immutable; copies share it, and so may
/// any number of speakers in any number of threads.
class MOUTHPIECE_API SharedCorpus {
 public:
  /// Opens `file`; the sample corpus that Mouthpiece brings when it is empty, its sentences of the paper's grammar
  /// alone when it is "clock". Throws InputError.
  explicit SharedCorpus(const std::filesystem::path& file = {});

  [[nodiscard]] const std::string& name() const;
  [[nodiscard]] std::size_t takeCount() const;
  /// In the order of Motion::marker_names.
  [[nodiscard]] std::vector<std::string> markerNames() const;

  struct Data;
  [[nodiscard]] const Data& data() const { return *data_; }  ///< for the library itself

 private:
  std::shared_ptr<const Data> data_;
};

}  // namespace mouthpiece
