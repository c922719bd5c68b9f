#pragma once

#include <filesystem>
#include <map>
#include <mutex>
#include <string>

#include "mouthpiece/speaker.h"

namespace mouthpiece {

/// Who speaks how: a table with a first row of speaker and any of voice, corpus, face, language, rate, lexicon; paths
/// are relative to it. A speaker of the list that it does not name speaks as the options say.
std::map<std::string, SpeakerOptions> readCast(const std::filesystem::path& path, const SpeakerOptions& usual);

/// Corpora and faces, each opened once for all threads.
class SharedCast {
 public:
  SharedCorpus corpus(const std::filesystem::path& file);
  SharedFace face(const std::filesystem::path& file);

 private:
  std::mutex mutex_;
  std::map<std::filesystem::path, SharedCorpus> corpora_;
  std::map<std::filesystem::path, SharedFace> faces_;
};

/// What decides how a line comes out besides its words, as JSON: files by their SHA-256.
std::string settingsJson(const SpeakerOptions& options, SharedCast& cast);

/// SHA-256 of a file of any size; "" for no file.
std::string fileHash(const std::filesystem::path& file);

}  // namespace mouthpiece
