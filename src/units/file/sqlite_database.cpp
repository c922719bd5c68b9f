#include "units/file/sqlite_database.h"

#include <fmt/format.h>
#include <sqlite3.h>

#include <algorithm>
#include <array>
#include <bit>
#include <climits>
#include <cstring>
#include <utility>

#include "base/errors.h"
#include "base/index.h"

namespace mouthpiece {
namespace {

using EightBytes = std::array<char, 8>;

/// Least significant byte first, on every machine.
EightBytes eightBytes(std::uint64_t value) {
  EightBytes bytes{};
  for (char& byte : bytes) {
    byte = static_cast<char>(value & 0xFFU);
    value >>= 8U;
  }
  return bytes;
}

/// A value's part of its row's checksum: its type and length keep ("ab","c") apart from ("a","bc").
std::uint32_t extendChecksum(std::uint32_t crc, int type, std::string_view bytes) {
  const EightBytes size = eightBytes(bytes.size());
  const auto type_byte = static_cast<char>(type);
  return crc32c(bytes, crc32c({size.data(), size.size()}, crc32c({&type_byte, 1}, crc)));
}

/// The same for a value of eight bytes, in one piece: rows of labels are hundreds of thousands.
std::uint32_t extendByEight(std::uint32_t crc, int type, std::uint64_t value) {
  const EightBytes size = eightBytes(sizeof(value)), bytes = eightBytes(value);
  std::array<char, 1 + size.size() + bytes.size()> all{static_cast<char>(type)};
  std::copy(size.begin(), size.end(), all.begin() + 1);
  std::copy(bytes.begin(), bytes.end(), all.begin() + 1 + size.size());
  return crc32c({all.data(), all.size()}, crc);
}

std::uint32_t extendChecksum(std::uint32_t crc, std::int64_t value) {
  return extendByEight(crc, SQLITE_INTEGER, static_cast<std::uint64_t>(value));
}

std::uint32_t extendChecksum(std::uint32_t crc, double value) {
  return extendByEight(crc, SQLITE_FLOAT, std::bit_cast<std::uint64_t>(value));
}

std::string_view columnBytes(sqlite3_stmt* statement, int column) {
  const void* data = sqlite3_column_blob(statement, column);
  const int size = sqlite3_column_bytes(statement, column);
  return data == nullptr ? std::string_view() : std::string_view(static_cast<const char*>(data), unsignedIndex(size));
}

std::uint32_t columnChecksum(sqlite3_stmt* statement, int column, std::uint32_t crc) {
  const int type = sqlite3_column_type(statement, column);
  switch (type) {
    case SQLITE_INTEGER:
      return extendChecksum(crc, std::int64_t{sqlite3_column_int64(statement, column)});
    case SQLITE_FLOAT:
      return extendChecksum(crc, sqlite3_column_double(statement, column));
    case SQLITE_NULL:
      return extendChecksum(crc, type, {});
    default:
      return extendChecksum(crc, type, columnBytes(statement, column));
  }
}

/// "file:/some%20path?immutable=1": what SQLite reads as a URI must have its special characters escaped.
std::string immutableUri(const std::filesystem::path& path) {
  std::string uri = "file:";
  for (const char c : std::filesystem::absolute(path).string()) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                       std::strchr("/-_.~", c) != nullptr;
    uri += plain ? std::string(1, c) : fmt::format("%{:02X}", static_cast<unsigned char>(c));
  }
  return uri + "?immutable=1";
}

std::unique_ptr<sqlite3_stmt, SqliteCloser> prepare(SqliteDatabase& database, const std::string& sql) {
  sqlite3_stmt* statement = nullptr;
  const int code = sqlite3_prepare_v2(database.handle(), sql.c_str(), -1, &statement, nullptr);
  if (code != SQLITE_OK) database.fail(code);
  return std::unique_ptr<sqlite3_stmt, SqliteCloser>(statement);
}

}  // namespace

void SqliteCloser::operator()(sqlite3* database) const { sqlite3_close(database); }

void SqliteCloser::operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }

SqliteDatabase::SqliteDatabase(const std::string& name, int flags, std::string file, bool writing)
    : file_(std::move(file)), writing_(writing) {
  sqlite3* handle = nullptr;
  const int code = sqlite3_open_v2(name.c_str(), &handle, flags | SQLITE_OPEN_NOMUTEX, nullptr);
  handle_.reset(handle);
  if (code != SQLITE_OK) fail(code);
}

SqliteDatabase SqliteDatabase::openReadOnly(const std::filesystem::path& path) {
  SqliteDatabase database(immutableUri(path), SQLITE_OPEN_READONLY | SQLITE_OPEN_URI, path.string(), false);
  sqlite3_db_config(database.handle(), SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
  sqlite3_db_config(database.handle(), SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
  sqlite3_db_config(database.handle(), SQLITE_DBCONFIG_ENABLE_TRIGGER, 0, nullptr);
  // Not mapped into memory: pages once looked at would stay there, and reading is no slower.
  database.execute("PRAGMA mmap_size=0; PRAGMA cell_size_check=ON");
  return database;
}

SqliteDatabase SqliteDatabase::create(const std::filesystem::path& path, const std::filesystem::path& shown_path) {
  return {path.string(), SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE, shown_path.string(), true};
}

void SqliteDatabase::execute(const std::string& sql) {
  const int code = sqlite3_exec(handle(), sql.c_str(), nullptr, nullptr, nullptr);
  if (code != SQLITE_OK) fail(code);
}

void SqliteDatabase::close() {
  const int code = sqlite3_close(handle());
  if (code != SQLITE_OK) fail(code);
  handle_.release();
}

void SqliteDatabase::fail(int code) const {
  const char* message = handle_ != nullptr ? sqlite3_errmsg(handle()) : sqlite3_errstr(code);
  if (writing_) throw InputError(file_, "", fmt::format("cannot be written: {}", message));
  if (code == SQLITE_NOTADB)
    throw InputError(file_, "", "is no corpus database; expected a file made by `corpus build`");
  if (code == SQLITE_CORRUPT) throw InputError(file_, "", fmt::format("is damaged: {}", message));
  throw InputError(file_, "", fmt::format("cannot be read: {}", message));
}

CheckedQuery::CheckedQuery(SqliteDatabase& database, std::string table)
    : database_(database),
      table_(std::move(table)),
      statement_(prepare(database, fmt::format("SELECT * FROM {} ORDER BY id", table_))) {}

CheckedQuery::CheckedQuery(SqliteDatabase& database, std::string table, ById /*tag*/)
    : database_(database),
      table_(std::move(table)),
      statement_(prepare(database, fmt::format("SELECT * FROM {} WHERE id=?", table_))) {}

CheckedQuery::CheckedQuery(SqliteDatabase& database, std::string table, FromId /*tag*/)
    : database_(database),
      table_(std::move(table)),
      statement_(prepare(database, fmt::format("SELECT * FROM {} WHERE id>=? ORDER BY id", table_))) {}

void CheckedQuery::startAt(std::int64_t id) {
  sqlite3_reset(statement_.get());
  sqlite3_bind_int64(statement_.get(), 1, id);
  row_ = unsignedIndex(id);
}

void CheckedQuery::find(std::int64_t id) {
  sqlite3_reset(statement_.get());
  sqlite3_bind_int64(statement_.get(), 1, id);
  const bool found = nextUnchecked();
  row_ = unsignedIndex(id);
  if (!found) fail("is missing");
  if (!isIntact()) fail("checksum differs: the file is damaged");
}

bool CheckedQuery::nextUnchecked() {
  const int code = sqlite3_step(statement_.get());
  if (code == SQLITE_DONE) return false;
  if (code != SQLITE_ROW) database_.fail(code);
  ++row_;
  return true;
}

bool CheckedQuery::next() {
  if (!nextUnchecked()) return false;
  if (!isIntact()) fail("checksum differs: the file is damaged");
  return true;
}

bool CheckedQuery::isIntact() const {
  const int last = sqlite3_column_count(statement_.get()) - 1;
  std::uint32_t crc = 0;
  for (int column = 0; column < last; ++column) crc = columnChecksum(statement_.get(), column, crc);
  return sqlite3_column_type(statement_.get(), last) == SQLITE_INTEGER &&
         sqlite3_column_int64(statement_.get(), last) == static_cast<sqlite3_int64>(crc);
}

void CheckedQuery::expectType(int column, int type, const char* name) const {
  if (sqlite3_column_type(statement_.get(), column) != type) {
    fail(fmt::format("column {} has another type; expected {}", sqlite3_column_name(statement_.get(), column), name));
  }
}

std::int64_t CheckedQuery::integer(int column) const {
  expectType(column, SQLITE_INTEGER, "an integer");
  return sqlite3_column_int64(statement_.get(), column);
}

double CheckedQuery::real(int column) const {
  expectType(column, SQLITE_FLOAT, "a real number");
  return sqlite3_column_double(statement_.get(), column);
}

std::string_view CheckedQuery::text(int column) const {
  expectType(column, SQLITE_TEXT, "text");
  return columnBytes(statement_.get(), column);
}

std::string_view CheckedQuery::blob(int column) const {
  expectType(column, SQLITE_BLOB, "a blob");
  return columnBytes(statement_.get(), column);
}

bool CheckedQuery::isNull(int column) const { return sqlite3_column_type(statement_.get(), column) == SQLITE_NULL; }

std::string CheckedQuery::place() const { return fmt::format("{} row {}", table_, row_); }

void CheckedQuery::fail(const std::string& what) const { throw InputError(database_.file(), place(), what); }

CheckedInsert::CheckedInsert(SqliteDatabase& database, const std::string& table, int columns)
    : database_(database), columns_(columns) {
  std::string sql = fmt::format("INSERT INTO {} VALUES (?", table);
  for (int i = 1; i < columns; ++i) sql += ",?";
  statement_ = prepare(database, sql + ")");
}

CheckedInsert& CheckedInsert::add(std::int64_t value) {
  sqlite3_bind_int64(statement_.get(), ++column_, value);
  crc_ = extendChecksum(crc_, value);
  return *this;
}

CheckedInsert& CheckedInsert::real(double value) {
  value += 0.0;  // SQLite stores -0 as 0
  sqlite3_bind_double(statement_.get(), ++column_, value);
  crc_ = extendChecksum(crc_, value);
  return *this;
}

CheckedInsert& CheckedInsert::text(std::string_view value) {
  MOUTHPIECE_EXPECT(value.size() < INT_MAX);
  sqlite3_bind_text(statement_.get(), ++column_, value.empty() ? "" : value.data(), static_cast<int>(value.size()),
                    SQLITE_TRANSIENT);
  crc_ = extendChecksum(crc_, SQLITE_TEXT, value);
  return *this;
}

CheckedInsert& CheckedInsert::blob(std::string_view value) {
  sqlite3_bind_blob64(statement_.get(), ++column_, value.empty() ? "" : value.data(), value.size(), SQLITE_STATIC);
  crc_ = extendChecksum(crc_, SQLITE_BLOB, value);
  return *this;
}

CheckedInsert& CheckedInsert::null() {
  sqlite3_bind_null(statement_.get(), ++column_);
  crc_ = extendChecksum(crc_, SQLITE_NULL, {});
  return *this;
}

void CheckedInsert::insert() {
  MOUTHPIECE_EXPECT(column_ == columns_ - 1);
  sqlite3_bind_int64(statement_.get(), columns_, crc_);
  const int code = sqlite3_step(statement_.get());
  if (code != SQLITE_DONE) database_.fail(code);
  sqlite3_reset(statement_.get());
  column_ = 0;
  crc_ = 0;
}

}  // namespace mouthpiece
