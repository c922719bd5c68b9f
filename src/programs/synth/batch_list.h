#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "mouthpiece/line.h"

namespace mouthpiece {

/// One row of a batch list.
struct BatchLine {
  std::string id;  ///< letters, digits, '.', '_' and '-': the name of its output folder
  Line line;
};

/// Shard `index` of `count`, both from 1: the rows whose number modulo `count` is theirs.
struct Shard {
  std::size_t index = 1;
  std::size_t count = 1;
};

/// "2/5". Throws InputError.
Shard parseShard(const std::string& text);

/// Reads a CSV list: `id,text`, or with a header row `id,audio,transcript` or `id,audio,phones` for recordings (paths
/// relative to the list). Fields may be quoted ("" is a quote inside). Throws InputError with the line for a bad or
/// repeated id or a wrong number of fields.
std::vector<BatchLine> readBatchList(const std::filesystem::path& path);

std::vector<BatchLine> linesOfShard(const std::vector<BatchLine>& lines, const Shard& shard);

}  // namespace mouthpiece
