#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

struct sqlite3;
struct sqlite3_stmt;

namespace mouthpiece {

/// An open SQLite file. Every failure becomes an InputError that names the file as the user knows it.
class SqliteDatabase {
 public:
  /// Opens for reading without locks or journals (immutable), so that a file in a read-only folder works; nothing in
  /// its schema is trusted.
  static SqliteDatabase openReadOnly(const std::filesystem::path& path);
  /// Makes an empty database at `path`; messages name `shown_path`.
  static SqliteDatabase create(const std::filesystem::path& path, const std::filesystem::path& shown_path);

  SqliteDatabase(SqliteDatabase&& other) noexcept;
  SqliteDatabase& operator=(SqliteDatabase&&) = delete;
  ~SqliteDatabase();

  void execute(const std::string& sql);
  /// Closes and reports what only then fails.
  void close();
  [[nodiscard]] sqlite3* handle() const { return handle_; }
  [[nodiscard]] const std::string& file() const { return file_; }
  /// InputError with SQLite's own word for the last failure.
  [[noreturn]] void fail(int code) const;

 private:
  SqliteDatabase(sqlite3* handle, std::string file, bool writing);
  sqlite3* handle_ = nullptr;
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
  CheckedQuery(const CheckedQuery&) = delete;
  CheckedQuery& operator=(const CheckedQuery&) = delete;
  ~CheckedQuery();

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

  /// "phones row 17": where we are, for messages.
  [[nodiscard]] std::string place() const;
  [[noreturn]] void fail(const std::string& what) const;

 private:
  void expectType(int column, int type, const char* name) const;
  SqliteDatabase& database_;
  std::string table_;
  sqlite3_stmt* statement_ = nullptr;
  std::size_t row_ = 0;
};

/// Inserts rows with their checksum.
class CheckedInsert {
 public:
  /// `table` has `columns` columns, the last of them `crc`.
  CheckedInsert(SqliteDatabase& database, const std::string& table, int columns);
  CheckedInsert(const CheckedInsert&) = delete;
  CheckedInsert& operator=(const CheckedInsert&) = delete;
  ~CheckedInsert();

  CheckedInsert& integer(std::int64_t value);
  CheckedInsert& real(double value);
  CheckedInsert& text(std::string_view value);
  CheckedInsert& blob(std::string_view value);  ///< must live until insert()
  CheckedInsert& null();
  void insert();

 private:
  SqliteDatabase& database_;
  sqlite3_stmt* statement_ = nullptr;
  int columns_;
  int column_ = 0;
  std::uint32_t crc_ = 0;
};

}  // namespace mouthpiece
