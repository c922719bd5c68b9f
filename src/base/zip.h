#pragma once

#include <string>
#include <string_view>

#include "base/byte_reader.h"

namespace mouthpiece {

/// Puts files one after another into an archive, as they are: for what is compressed already.
class ZipWriter {
 public:
  /// `name`: without folders, ASCII. Files of under 4 GiB each. `alignment`: its bytes begin at a multiple of it.
  void add(std::string_view name, std::string_view bytes, std::size_t alignment = 1);
  /// The archive so far has so many bytes; zip64 is not written, so all of it must stay under 4 GiB.
  [[nodiscard]] std::size_t size() const { return archive_.size() + directory_.size(); }
  [[nodiscard]] std::string finish() &&;

 private:
  ByteWriter archive_, directory_;
  std::size_t count_ = 0;
};

/// The file `wanted` of an archive, stored or deflated; "" where it is not in it. Throws InputError, with `archive` in
/// front, for what is no archive, is damaged or encrypted, or unpacks to over `most` bytes.
std::string unzipped(std::string_view bytes, std::string_view wanted, std::string_view archive,
                     std::size_t most = std::size_t{64} << 20U);

}  // namespace mouthpiece
