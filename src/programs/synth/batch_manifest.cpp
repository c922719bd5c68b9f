#include "programs/synth/batch_manifest.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>
#include <set>

#include "base/errors.h"
#include "base/file_parts.h"
#include "base/files.h"
#include "base/json_fields.h"
#include "base/json_text.h"
#include "base/page_data.h"
#include "base/text_numbers.h"
#include "mouthpiece/version.h"

namespace mouthpiece {

extern const std::string_view kBatchPage;

namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

constexpr std::uint64_t kMostManifestBytes = std::uint64_t{1} << 30;
constexpr std::string_view kMadeWith = "Mouthpiece ";
constexpr std::string_view kPageTitle = "<title>Lines, worst first</title>";
constexpr std::string_view kCsvBegins = "id,language,speaker,row,status,doubt,";
constexpr std::array<std::string_view, 3> kStatusNames{"made", "failed", "unusable"};

double toTenThousandth(double value) { return std::round(value * 1e4) / 1e4; }

ordered_json fieldsOf(const LineRecord& record) {
  ordered_json fields = {{"key", record.key},
                         {"id", record.id},
                         {"language", record.language},
                         {"speaker", record.speaker},
                         {"row", record.row},
                         {"status", kStatusNames[static_cast<std::size_t>(record.status)]},
                         {"doubt", toTenThousandth(record.quality.doubt)},
                         {"duration_s", toTenThousandth(record.duration_s)},
                         {"method", record.method},
                         {"backoff_share", toTenThousandth(record.quality.backoff_share)},
                         {"closures", record.quality.closures},
                         {"closures_made", record.quality.closures_made},
                         {"jitter_mm", toTenThousandth(record.quality.jitter_mm)},
                         {"warnings", record.warnings},
                         {"notices", record.notices},
                         {"error", record.error},
                         {"files", ordered_json::array()},
                         {"hash", record.hash},
                         {"text", record.text},
                         {"heard", record.heard},
                         {"others", record.others}};
  for (const LineRecord::File& file : record.files)
    fields["files"].push_back({{"name", file.name}, {"bytes", file.bytes}});
  return fields;
}

std::vector<std::string> textsOf(const JsonField& list) {
  std::vector<std::string> texts;
  for (const JsonField& text : list.list()) texts.push_back(text.text(1 << 20));
  return texts;
}

LineRecord recordOf(const JsonField& fields) {
  constexpr std::size_t kLongest = 1 << 20;
  constexpr std::int64_t kMost = std::int64_t{1} << 53;
  LineRecord record;
  record.key = fields["key"].text();
  record.id = fields["id"].text();
  record.language = fields["language"].text();
  record.speaker = fields["speaker"].text();
  record.row = static_cast<std::size_t>(fields["row"].whole(0, kMost));
  record.status = static_cast<LineRecord::Status>(fields["status"].choice(kStatusNames));
  record.quality.doubt = fields["doubt"].number(0, 1);
  record.duration_s = fields["duration_s"].number(0);
  record.method = fields["method"].text();
  record.quality.backoff_share = fields["backoff_share"].number(0, 1);
  record.quality.closures = static_cast<std::size_t>(fields["closures"].whole(0, kMost));
  record.quality.closures_made = static_cast<std::size_t>(fields["closures_made"].whole(0, kMost));
  record.quality.jitter_mm = fields["jitter_mm"].number(0);
  record.warnings = textsOf(fields["warnings"]);
  if (fields["notices"].exists()) record.notices = textsOf(fields["notices"]);
  record.error = fields["error"].text(kLongest);
  for (const JsonField& file : fields["files"].list())
    record.files.push_back({file["name"].text(), static_cast<std::uint64_t>(file["bytes"].whole(0, kMost))});
  record.hash = fields["hash"].text();
  record.text = fields["text"].text(kLongest);
  if (fields["heard"].exists()) record.heard = fields["heard"].text(kLongest);
  record.others = textsOf(fields["others"]);
  return record;
}

std::string csvCell(std::string_view text) {
  const bool is_formula =
      !text.empty() && std::string_view("=+-@\t\r").find(text.front()) != std::string_view::npos && !parseNumber(text);
  std::string cell(is_formula ? "'" : "");
  cell += text;
  if (cell.find_first_of(",\"\r\n;") == std::string::npos) return cell;
  std::string quoted = "\"";
  for (const char c : cell) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + '"';
}

std::string joinedTexts(const std::vector<std::string>& texts, std::string_view between) {
  return fmt::format("{}", fmt::join(texts, between));
}

/// The lines of the page's table: with most doubt first, and before them what was not made.
std::vector<const LineRecord*> worstFirst(const Manifest& manifest) {
  std::vector<const LineRecord*> order;
  for (const LineRecord& line : manifest.lines) order.push_back(&line);
  std::stable_sort(order.begin(), order.end(), [](const LineRecord* a, const LineRecord* b) {
    const bool a_made = a->status == LineRecord::Status::kMade, b_made = b->status == LineRecord::Status::kMade;
    return a_made != b_made ? !a_made : a->quality.doubt > b->quality.doubt;
  });
  return order;
}

void keepWorstPlayers(Manifest& manifest) {
  std::map<std::string_view, std::size_t> place;
  for (const LineRecord* line : worstFirst(manifest)) place.try_emplace(line->key, place.size());
  auto& players = manifest.players;
  std::erase_if(players, [&](const LinePlayer& player) { return !place.contains(player.key); });
  std::stable_sort(players.begin(), players.end(),
                   [&](const LinePlayer& a, const LinePlayer& b) { return place[a.key] < place[b.key]; });
  if (players.size() > kMostPlayers) players.resize(kMostPlayers);
}

std::vector<LinePlayer> playersOf(const JsonField& root) {
  std::vector<LinePlayer> players;
  for (const JsonField& fields : root["players"].list(0, kMostPlayers)) {
    constexpr std::size_t kLongest = std::size_t{1} << 28;
    players.push_back({fields["key"].text(), fields["wav"].text(kLongest), fields["fps"].number(1, 1000),
                       fields["markers"].names(), fields["places"].text(kLongest)});
  }
  return players;
}

/// Whether a file begins as one of a manifest's does; nothing, and what is not there, is nobody's.
bool beginsAsOurs(const fs::path& file) {
  std::error_code error;
  if (fs::file_size(file, error) == 0 || !fs::exists(file, error)) return true;
  if (!fs::is_regular_file(file, error)) return false;
  const std::string begins = FileReader(file, kMostManifestBytes).bytes(0, 4096);
  const std::string ending = file.extension().string();
  if (ending == ".csv") return begins.starts_with(kCsvBegins);
  if (ending == ".html") return begins.find(kPageTitle) != std::string::npos;
  if (file.stem().extension() == ".players") return begins.starts_with("{\"players\":");
  // Another program may have laid the JSON out anew; one that is cut is known by its beginning.
  const nlohmann::json root = looseJson(readFile(file, kMostManifestBytes));
  if (!root.is_object()) return begins.starts_with(fmt::format("{{\n \"made_with\": \"{}", kMadeWith));
  const auto made_with = root.find("made_with");
  return made_with != root.end() && made_with->is_string() && made_with->get<std::string>().starts_with(kMadeWith);
}

std::optional<std::string> readIfThere(const fs::path& path) {
  if (!fs::exists(path)) return std::nullopt;
  return readFile(path, kMostManifestBytes);
}

}  // namespace

std::string recordLine(const LineRecord& record) { return jsonText(fieldsOf(record)) + "\n"; }

std::string manifestJson(const Manifest& manifest) {
  ordered_json root = {{"made_with", std::string(kMadeWith) + MOUTHPIECE_VERSION},
                       {"list", manifest.list},
                       {"settings", ordered_json::parse(manifest.settings)},
                       {"lines_in_list", manifest.lines_in_list},
                       {"other_columns", manifest.other_columns},
                       {"lines", ordered_json::array()}};
  std::string text = jsonText(root, 1);
  // A line of the file for a line of the list.
  text.erase(text.rfind("[]"));
  text += "[";
  for (const LineRecord& line : manifest.lines)
    text += (&line == manifest.lines.data() ? "\n  " : ",\n  ") + jsonText(fieldsOf(line));
  return text + "\n ]\n}\n";
}

std::string manifestCsv(const Manifest& manifest) {
  std::string csv = std::string(kCsvBegins) +
                    "duration_s,method,backoff_share,closures,closures_made,jitter_mm,warnings,"
                    "notices,error,files,hash,text,heard";
  for (const std::string& name : manifest.other_columns) csv += "," + csvCell(name);
  csv += "\n";
  for (const LineRecord& line : manifest.lines) {
    std::vector<std::string> names;
    for (const LineRecord::File& file : line.files) names.push_back(file.name);
    csv += fmt::format("{},{},{},{},{},{:.4f},{:.4f},{},{:.4f},{},{},{:.4f},{},{},{},{},{},{},{}", csvCell(line.id),
                       csvCell(line.language), csvCell(line.speaker), line.row,
                       kStatusNames[static_cast<std::size_t>(line.status)], line.quality.doubt, line.duration_s,
                       line.method, line.quality.backoff_share, line.quality.closures, line.quality.closures_made,
                       line.quality.jitter_mm, csvCell(joinedTexts(line.warnings, " | ")),
                       csvCell(joinedTexts(line.notices, " | ")), csvCell(line.error), csvCell(joinedTexts(names, " ")),
                       line.hash, csvCell(line.text), csvCell(line.heard));
    for (const std::string& other : line.others) csv += "," + csvCell(other);
    csv += "\n";
  }
  return csv;
}

std::string playersJson(const Manifest& manifest) {
  ordered_json root = {{"players", ordered_json::array()}};
  for (const LinePlayer& player : manifest.players)
    root["players"].push_back({{"key", player.key},
                               {"fps", player.frame_rate_hz},
                               {"markers", player.markers},
                               {"places", player.places},
                               {"wav", player.wav}});
  return jsonText(root) + "\n";
}

std::string manifestPage(const Manifest& manifest) {
  ordered_json data = {{"list", manifest.list},
                       {"settings", ordered_json::parse(manifest.settings)},
                       {"lines_in_list", manifest.lines_in_list},
                       {"other_columns", manifest.other_columns},
                       {"lines", ordered_json::array()},
                       {"players", ordered_json::parse(playersJson(manifest))["players"]}};
  for (const LineRecord* line : worstFirst(manifest)) data["lines"].push_back(fieldsOf(*line));
  constexpr std::string_view kPlace = "<!-- batch:data -->";
  const std::size_t at = kBatchPage.find(kPlace);
  MOUTHPIECE_EXPECT(at != std::string_view::npos);
  std::string page(kBatchPage.substr(0, at));
  page += "<script type=\"application/json\" id=\"batch-data\">" + scriptSafe(jsonText(data)) + "</script>";
  page += kBatchPage.substr(at + kPlace.size());
  return closedPage(page);
}

std::vector<std::string> manifestFiles(const std::string& stem) {
  return {stem + ".json", stem + ".csv", stem + ".html", stem + ".players.json"};
}

void expectOurManifest(const fs::path& folder, const std::string& stem) {
  for (const std::string& name : manifestFiles(stem)) {
    if (!beginsAsOurs(folder / name))
      throw InputError((folder / name).string(), "",
                       "is there and none of ours; expected a folder without it, or with a manifest of synth batch");
    // Where that is, the others are its own, by whatever version they were made.
    if (std::error_code error; name == manifestFiles(stem).front() && fs::exists(folder / name, error)) return;
  }
}

void writeManifest(const fs::path& folder, const std::string& stem, Manifest& manifest) {
  keepWorstPlayers(manifest);
  writeFileAtomically(folder / (stem + ".players.json"), playersJson(manifest));
  writeFileAtomically(folder / (stem + ".html"), manifestPage(manifest));
  writeFileAtomically(folder / (stem + ".csv"), manifestCsv(manifest));
  writeFileAtomically(folder / (stem + ".json"), manifestJson(manifest));  // last: where it is, all is
}

std::optional<Manifest> readManifest(const fs::path& folder, const std::string& stem) {
  const fs::path json = folder / (stem + ".json"), journal = folder / (stem + ".journal");
  std::optional<Manifest> manifest;
  if (const auto text = readIfThere(json)) {
    const JsonField root = parseJson(*text, json.string(), "a manifest of synth batch");
    manifest.emplace();
    manifest->list = root["list"].text();
    if (!root["settings"].isObject()) root["settings"].refuse("an object");
    manifest->settings = jsonText(ordered_json::parse(*text).at("settings"));
    manifest->lines_in_list = static_cast<std::size_t>(root["lines_in_list"].whole(0, std::int64_t{1} << 40));
    manifest->other_columns = textsOf(root["other_columns"]);
    for (const JsonField& line : root["lines"].list()) manifest->lines.push_back(recordOf(line));
  }
  if (const auto players = readIfThere(folder / (stem + ".players.json")); players && manifest)
    manifest->players = playersOf(parseJson(*players, (folder / (stem + ".players.json")).string(), "players"));
  if (const auto text = readIfThere(journal)) {
    if (!manifest) manifest.emplace().settings = "{}";
    std::map<std::string, std::size_t> place;
    for (std::size_t i = 0; i < manifest->lines.size(); ++i) place[manifest->lines[i].key] = i;
    LineReader lines(*text);
    std::string_view line;
    while (lines.next(line)) {
      // The last line of a killed process may be torn; what it told of is made again.
      if (line.empty() || line.back() != '}') continue;
      LineRecord record = recordOf(parseJson(line, journal.string(), "a record"));
      const auto [found, is_new] = place.try_emplace(record.key, manifest->lines.size());
      if (is_new) {
        manifest->lines.push_back(std::move(record));
      } else {
        manifest->lines[found->second] = std::move(record);
      }
    }
  }
  return manifest;
}

std::vector<std::string> manifestStems(const fs::path& folder) {
  std::set<std::string> stems;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with("manifest") || name.ends_with(".players.json")) continue;
    for (const std::string_view ending : {".json", ".journal"}) {
      if (name.ends_with(ending)) stems.insert(name.substr(0, name.size() - ending.size()));
    }
  }
  return {stems.begin(), stems.end()};
}

ManifestJournal::ManifestJournal(const fs::path& folder, const std::string& stem)
    : path_(folder / (stem + ".journal")),
      descriptor_(
          (fs::create_directories(folder), ::open(path_.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666))),
      lock_(descriptor_) {
  if (descriptor_ < 0) throw InputError(path_.string(), "", fmt::format("cannot be written: {}", std::strerror(errno)));
  if (!lock_.isOurs())
    throw InputError(path_.string(), "", "is being written by another synth batch; expected one at a time");
}

void ManifestJournal::add(const LineRecord& record) {
  // The line end before it ends what a killed process has torn.
  const std::string line = "\n" + recordLine(record);
  std::size_t written = 0;
  while (written < line.size()) {
    const ssize_t count = ::write(descriptor_, line.data() + written, line.size() - written);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) throw InputError(path_.string(), "", fmt::format("cannot be written: {}", std::strerror(errno)));
    written += static_cast<std::size_t>(count);
  }
}

void ManifestJournal::clear() {
  if (::ftruncate(descriptor_, 0) != 0)
    throw InputError(path_.string(), "", fmt::format("cannot be emptied: {}", std::strerror(errno)));
}

void ManifestJournal::remove() {
  std::error_code ignored;
  fs::remove(path_, ignored);
}

}  // namespace mouthpiece
