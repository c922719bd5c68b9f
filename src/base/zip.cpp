#include "base/zip.h"

#include <optional>

#include "base/byte_reader.h"
#include "base/deflate.h"
#include "base/errors.h"

namespace mouthpiece {
namespace {

constexpr std::size_t kVersion = 20, kFirstDay = 0x21;  // 1980-01-01: the same frames give the same bytes

constexpr std::size_t kDirectoryEnd = 22, kLongestComment = 65'535;

constexpr std::size_t kFurtherField = 4;  ///< of one without what it holds
constexpr std::size_t kPadding = 0x1986;  // the number of USD's own further field

/// What a file's own header and its entry in the directory have in common, up to the length of further fields.
std::string commonFields(std::string_view name, std::string_view bytes) {
  ByteWriter fields;
  fields.writeU16(kVersion);
  fields.writeU16(0);  // flags
  fields.writeU16(0);  // stored
  fields.writeU16(0);  // time
  fields.writeU16(kFirstDay);
  fields.writeU32(crc32Of(bytes));
  fields.writeU32(bytes.size());
  fields.writeU32(bytes.size());
  fields.writeU16(name.size());
  return fields.takeBytes();
}

}  // namespace

void ZipWriter::add(std::string_view name, std::string_view bytes, std::size_t alignment) {
  MOUTHPIECE_EXPECT(size() + bytes.size() < 0xFFFF0000U && count_ < 0xFFFF);
  const std::string fields = commonFields(name, bytes);
  directory_.writeBytes("PK\x01\x02");
  directory_.writeU16(kVersion);
  directory_.writeBytes(fields);
  directory_.writeU16(0);  // no further fields
  directory_.writeU16(0);  // no comment
  directory_.writeU16(0);  // disk
  directory_.writeU16(0);
  directory_.writeU32(0);  // attributes
  directory_.writeU32(archive_.size());
  directory_.writeBytes(name);
  archive_.writeBytes("PK\x03\x04");
  archive_.writeBytes(fields);
  std::size_t padding = (alignment - (archive_.size() + 2 + name.size()) % alignment) % alignment;
  if (padding > 0 && padding < kFurtherField) padding += alignment;
  archive_.writeU16(padding);
  archive_.writeBytes(name);
  if (padding > 0) {
    archive_.writeU16(kPadding);
    archive_.writeU16(padding - kFurtherField);
    archive_.padTo(archive_.size() + padding - kFurtherField);
  }
  archive_.writeBytes(bytes);
  ++count_;
}

std::string ZipWriter::finish() && {
  const std::size_t start = archive_.size();
  archive_.writeBytes(directory_.bytes());
  archive_.writeBytes("PK\x05\x06");
  archive_.writeU32(0);  // disks
  archive_.writeU16(count_);
  archive_.writeU16(count_);
  archive_.writeU32(directory_.size());
  archive_.writeU32(start);
  archive_.writeU16(0);  // no comment
  return archive_.takeBytes();
}

std::string unzipped(std::string_view bytes, std::string_view wanted, std::string_view archive, std::size_t most) {
  ByteReader reader(bytes, archive);
  const std::size_t end = bytes.rfind("PK\x05\x06");
  if (end == std::string_view::npos || bytes.size() - end > kDirectoryEnd + kLongestComment)
    throw InputError(archive, "", "is no ZIP archive");
  reader.seek(end + 10);
  const std::size_t count = reader.readU16();
  reader.skip(4);
  reader.seek(reader.readU32());
  for (std::size_t i = 0; i < count; ++i) {
    if (reader.readBytes(4) != "PK\x01\x02") reader.fail("found no entry of the archive's directory");
    reader.skip(4);
    const bool is_encrypted = (reader.readU16() & 1U) != 0;
    const std::size_t method = reader.readU16();
    reader.skip(4);
    const std::size_t checksum = reader.readU32(), packed_size = reader.readU32(), size = reader.readU32();
    const std::size_t name_size = reader.readU16(), extra_size = reader.readU16(), comment_size = reader.readU16();
    reader.skip(8);
    const std::size_t place = reader.readU32();
    if (reader.readBytes(name_size) != wanted) {
      reader.skip(extra_size + comment_size);
      continue;
    }
    if (is_encrypted) reader.fail("found an encrypted file; expected one without a password");
    if (size > most) reader.fail("found a file that unpacks to " + std::to_string(size) + " bytes, which is too many");
    reader.seek(place);
    reader.skip(26);
    const std::size_t local_name = reader.readU16(), local_extra = reader.readU16();
    reader.skip(local_name + local_extra);
    const std::string_view packed = reader.readBytes(packed_size);
    const std::optional<std::string> whole = method == 8   ? inflated(packed, size, DeflateWrapper::kNone)
                                             : method == 0 ? std::optional(std::string(packed))
                                                           : std::nullopt;
    if (!whole || whole->size() != size || crc32Of(*whole) != checksum)
      reader.fail("found a file in the archive that is damaged, or packed in an unknown way");
    return *whole;
  }
  return {};
}

}  // namespace mouthpiece
