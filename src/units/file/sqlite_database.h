#pragma once

#include <concepts>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

struct sqlite3;
struct sqlite3_stmt;

namespace mouthpiece {

/// CRC-32C (Castagnoli, reflected, RFC 3720) of `bytes`, continuing from `crc` (0 to begin). Finds every single
/// flipped bit and every burst of up to 32 bits; "123456789" gives 0xE3069283. Uses the processor's instruction where
/// it has one, else a table: a corpus is checked each time it is read.
std::uint32_t crc32c(std::string_view bytes, std::uint32_t crc = 0);

/// The same by a table alone, the other route of the unit test.
std::uint32_t crc32cByTable(std::string_view bytes, std::uint32_t crc = 0);

struct SqliteCloser {
  void operator()(sqlite3* database) const;
  void operator()(sqlite3_stmt* statement) const;
};

/// An open SQLite file. Every failure becomes an InputError that names the file as the user knows it.
class SqliteDatabase {
 public:
  /// Opens for reading without locks or journals (immutable), so that a file in a read-only folder works; nothing in
  /// its schema is trusted.
  static SqliteDatabase openReadOnly(const std::filesystem::path& path);
  /// Makes an empty database at `path`; messages name `shown_path`.
  static SqliteDatabase create(const std::filesystem::path& path, const std::filesystem::path& shown_path);

  void execute(const std::string& sql);
  /// Closes and reports what only then fails.
  void close();
  [[nodiscard]] sqlite3* handle() const { return handle_.get(); }
  [[nodiscard]] const std::string& file() const { return file_; }
  /// InputError with SQLite's own word for the last failure.
  [[noreturn]] void fail(int code) const;

 private:
  SqliteDatabase(const std::string& name, int flags, std::string file, bool writing);
  std::unique_ptr<sqlite3, SqliteCloser> handle_;
  std::string file_;
  bool writing_ = false;
};

/// The rows of a table in the order of `id`, all columns; the last one is `crc`, the checksum of those before it
/// (docs/formats/corpus.md).
class CheckedQuery {
 public:
  CheckedQuery(SqliteDatabase& database, std::string table);
  /// For find() only.
  struct ById {};
  CheckedQuery(SqliteDatabase& database, std::string table, ById tag);

  /// For startAt().
  struct FromId {};
  CheckedQuery(SqliteDatabase& database, std::string table, FromId tag);
  /// The row of that id is next.
  void startAt(std::int64_t id);

  /// False after the last row. Throws InputError when the row's checksum differs.
  bool next();
  /// As next(), but tells a wrong checksum through isIntact().
  bool nextUnchecked();
  [[nodiscard]] bool isIntact() const;
  /// The row of that id, of a query made with ById. Throws InputError when there is none or its checksum differs.
  void find(std::int64_t id);

  /// Throw InputError when the column holds another type.
  [[nodiscard]] std::int64_t integer(int column) const;
  [[nodiscard]] double real(int column) const;
  [[nodiscard]] std::string_view text(int column) const;  ///< valid until the next row
  [[nodiscard]] std::string_view blob(int column) const;  ///< valid until the next row
  [[nodiscard]] bool isNull(int column) const;

  [[nodiscard]] const std::string& table() const { return table_; }
  /// "phones row 17": where we are, for messages.
  [[nodiscard]] std::string place() const;
  [[noreturn]] void fail(const std::string& what) const;

 private:
  void expectType(int column, int type, const char* name) const;
  SqliteDatabase& database_;
  std::string table_;
  std::unique_ptr<sqlite3_stmt, SqliteCloser> statement_;
  std::size_t row_ = 0;
};

/// Inserts rows with their checksum.
class CheckedInsert {
 public:
  /// `table` has `columns` columns, the last of them `crc`.
  CheckedInsert(SqliteDatabase& database, const std::string& table, int columns);

  CheckedInsert& integer(std::integral auto value) { return add(static_cast<std::int64_t>(value)); }
  CheckedInsert& real(double value);
  CheckedInsert& text(std::string_view value);
  CheckedInsert& blob(std::string_view value);  ///< must live until insert()
  CheckedInsert& null();
  CheckedInsert& integerOrNull(const std::optional<std::size_t>& value) { return value ? integer(*value) : null(); }
  void insert();

 private:
  CheckedInsert& add(std::int64_t value);
  SqliteDatabase& database_;
  std::unique_ptr<sqlite3_stmt, SqliteCloser> statement_;
  int columns_;
  int column_ = 0;
  std::uint32_t crc_ = 0;
};

}  // namespace mouthpiece
