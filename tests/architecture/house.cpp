#include "house.h"

#include <algorithm>
#include <fstream>
#include <functional>
#include <iterator>
#include <optional>
#include <regex>
#include <sstream>

namespace mouthpiece::architecture {
namespace {

namespace fs = std::filesystem;
using Lines = std::vector<std::string>;

constexpr std::string_view kPrograms = "src/programs/";
/// The front door: headers that every room may show, and that programs come in by.
constexpr std::string_view kFrontDoor = "include/";
constexpr std::string_view kBehindTheDoor = "mouthpiece::speaker";

/// Libraries from outside, by how their headers begin; names that the finder may give the target.
struct Outsider {
  std::string_view include;
  std::vector<std::string_view> targets;
};
const std::vector<Outsider> kOutsiders{
    {"Eigen/", {"Eigen3::Eigen"}},
    {"unsupported/Eigen/", {"Eigen3::Eigen"}},
    {"fmt/", {"fmt::fmt"}},
    {"nlohmann/", {"nlohmann_json::nlohmann_json"}},
    {"CLI/", {"CLI11::CLI11"}},
    {"sqlite3.h", {"SQLite::SQLite3"}},
    {"SQLiteCpp/", {"SQLiteCpp", "PkgConfig::SQLITECPP"}},
    {"OpenMesh/Core/", {"OpenMeshCore"}},
    {"OpenMesh/Tools/", {"OpenMeshTools"}},
    {"CGAL/", {"CGAL::CGAL"}},
    {"tiny_gltf.h", {"TinyGLTF::TinyGLTF"}},
    {"draco/", {"Draco::draco"}},
    {"meshoptimizer.h", {"meshoptimizer::meshoptimizer"}},
    {"pugixml.hpp", {"pugixml::pugixml"}},
    {"httplib.h", {"PkgConfig::HTTPLIB"}},
    {"xnnpack.h", {"XNNPACK::xnnpack"}},
    {"openssl/", {"OpenSSL::Crypto"}},
    {"zlib.h", {"ZLIB::ZLIB"}},
    {"libdeflate.h", {"PkgConfig::DEFLATE"}},
    {"xxhash.h", {"PkgConfig::XXHASH", "xxHash::xxhash"}},
    {"boost/", {"Boost::headers", "Boost::boost"}},
    {"unicode/", {"ICU::uc", "ICU::i18n", "PkgConfig::ICU"}},
    {"hwy/", {"hwy::hwy", "PkgConfig::HWY"}},
    {"xsimd/", {"xsimd"}},
    {"FLAC/", {"PkgConfig::FLAC"}},
    {"sndfile.h", {"PkgConfig::SNDFILE", "SndFile::sndfile"}},
    {"samplerate.h", {"PkgConfig::SAMPLERATE", "SampleRate::samplerate"}},
    {"aubio/", {"PkgConfig::AUBIO"}},
    {"pocketsphinx", {"PkgConfig::POCKETSPHINX"}},
    {"sphinxbase/", {"PkgConfig::POCKETSPHINX"}},
    {"ps_lattice", {"PkgConfig::POCKETSPHINX"}},
    {"espeak-ng/", {"PkgConfig::ESPEAK"}},
    {"flite/", {"Flite::flite"}},
    {"dlfcn.h", {"${CMAKE_DL_LIBS}"}},
};
const std::set<std::string_view> kThreads{"thread", "mutex", "shared_mutex", "condition_variable", "future", "atomic"};
const std::regex kSystemHeader(
    R"([a-z_]+|sys/[a-z]+\.h|(cxxabi|unistd|fcntl|netdb|poll|signal|spawn|malloc|immintrin|time|std[a-z]+)\.h)");
const std::regex kHeavy(R"((CGAL/|CLI/|nlohmann/json\.hpp|OpenMesh/|sqlite3\.h|SQLiteCpp/|spdlog/|tiny_gltf\.h).*)");

std::string folderOf(const std::string& path) { return fs::path(path).parent_path().string(); }
bool isUnder(const std::string& path, std::string_view folder) { return path.starts_with(folder); }

/// The words of a CMake file: names, brackets, strings; comments are left out.
std::vector<std::string> wordsOf(std::string_view text) {
  std::vector<std::string> words(1);
  bool in_string = false, in_comment = false;
  for (const char c : text) {
    in_comment = in_comment ? c != '\n' : c == '#' && !in_string;
    if (in_comment) continue;
    if (c == '"') in_string = !in_string;
    if (!in_string && (c == ' ' || c == '\n' || c == '\t' || c == '"')) {
      if (!words.back().empty()) words.emplace_back();
    } else if (!in_string && (c == '(' || c == ')')) {
      if (!words.back().empty()) words.emplace_back();
      words.back() = c;
      words.emplace_back();
    } else if (c != '"') {
      words.back() += c;
    }
  }
  return words;
}

/// A path that a CMakeLists.txt of `folder` names, from the root.
std::string listedPath(const std::string& folder, const std::string& word) {
  for (const std::string_view root : {"${CMAKE_SOURCE_DIR}/", "${PROJECT_SOURCE_DIR}/"}) {
    if (word.starts_with(root)) return word.substr(root.size());
  }
  return (fs::path(folder) / word).lexically_normal().string();
}

/// `#include` lines: names in quotes and in angles.
void readIncludes(const std::string& text, std::vector<std::string>& quoted, std::vector<std::string>& angled) {
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) {
    static const std::regex pattern(R"re(^\s*#\s*include\s*(["<])([^">]+)[">].*)re");
    std::smatch match;
    if (line.find("include") == std::string::npos || !std::regex_match(line, match, pattern)) continue;
    (match[1] == "\"" ? quoted : angled).push_back(match[2]);
  }
}

/// Code without comments, strings kept; `literals` gets each string with what stands before it in its statement.
struct Literal {
  std::string text, statement;
  std::size_t line;
};
std::string withoutComments(const std::string& text, std::vector<Literal>& literals) {
  std::string code, statement;
  std::size_t line = 1;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const std::string_view rest = std::string_view(text).substr(i);
    if (rest.starts_with("//")) {
      i = std::min(text.find('\n', i), text.size()) - 1;
    } else if (rest.starts_with("/*")) {
      const std::size_t end = std::min(text.find("*/", i + 2), text.size() - 2) + 2;
      line += static_cast<std::size_t>(std::count(text.begin() + static_cast<std::ptrdiff_t>(i),
                                                  text.begin() + static_cast<std::ptrdiff_t>(end), '\n'));
      i = end - 1;
    } else if (rest.starts_with("R\"")) {
      const std::size_t open = text.find('(', i);
      const std::string close = ")" + text.substr(i + 2, open - i - 2) + "\"";
      const std::size_t end = text.find(close, open);
      literals.push_back({text.substr(open + 1, end - open - 1), statement, line});
      line += static_cast<std::size_t>(std::count(literals.back().text.begin(), literals.back().text.end(), '\n'));
      i = end + close.size() - 1;
    } else if (text[i] == '"') {
      std::size_t end = i + 1;
      while (end < text.size() && text[end] != '"') end += text[end] == '\\' ? 2U : 1U;
      literals.push_back({text.substr(i + 1, end - i - 1), statement, line});
      i = end;
    } else if (text[i] == '\'' && i + 2 < text.size() && (text[i + 1] == '\\' || text[i + 2] == '\'')) {
      i = text.find('\'', i + (text[i + 1] == '\\' ? 3 : 2));
    } else {
      line += text[i] == '\n' ? 1U : 0U;
      statement = text[i] == ';' || text[i] == '}' ? "" : statement + text[i];
      code += text[i];
    }
  }
  return code;
}

/// The target of an outside header: "" for the standard library's and the system's, nullopt for an unknown one.
std::optional<std::vector<std::string_view>> outsideTargets(const std::string& name) {
  if (kThreads.contains(name)) return std::vector<std::string_view>{"Threads::Threads"};
  for (const auto& [include, targets] : kOutsiders) {
    if (name.starts_with(include)) return targets;
  }
  if (std::regex_match(name, kSystemHeader)) return std::vector<std::string_view>{};
  return std::nullopt;
}

void compareLinks(const std::string& room, const std::string& kind, const std::set<std::string>& needed,
                  const std::set<std::string>& listed, Lines& lines) {
  for (const std::string& link : needed) {
    if (!listed.contains(link)) lines.push_back(room + ": LINKS lack " + kind + link);
  }
  for (const std::string& link : listed) {
    if (!needed.contains(link)) lines.push_back(room + ": LINKS name " + kind + link + ", which nothing asks for");
  }
}

}  // namespace

Files filesOf(const fs::path& root) {
  Files files;
  const auto take = [&](const fs::path& path) {
    std::ifstream stream(path);
    files[fs::relative(path, root).generic_string()] = {std::istreambuf_iterator<char>(stream), {}};
  };
  take(root / "CMakeLists.txt");
  for (const char* top : {"include", "src", "deform", "retarget", "corpus_tools", "tests", "examples"}) {
    if (!fs::exists(root / top)) continue;
    for (const auto& entry : fs::recursive_directory_iterator(root / top)) {
      const std::string ending = entry.path().extension().string();
      const bool is_list = entry.path().filename() == "CMakeLists.txt";
      if (ending == ".h" || ending == ".cpp" ||
          (is_list && std::string_view(top) != "tests" && std::string_view(top) != "examples"))
        take(entry.path());
    }
  }
  return files;
}

std::vector<Target> parseTargets(const std::string& path, std::string_view text, Lines& breaches) {
  const std::string folder = folderOf(path);
  std::vector<Target> targets;
  std::map<std::string, std::string> globbed;  // variables that hold every source of the folder
  const Lines words = wordsOf(text);
  for (std::size_t i = 0; i + 2 < words.size(); ++i) {
    const std::string& call = words[i];
    if (words[i + 1] != "(") continue;
    if (call == "file" && words[i + 2] == "GLOB") {
      for (std::size_t k = i + 4; k < words.size() && words[k] != ")"; ++k)
        if (words[k].ends_with("*.cpp")) globbed["${" + words[i + 3] + "}"] = "*.cpp";
    }
    if (call == "target_link_libraries") breaches.push_back(path + ": links by target_link_libraries, not by LINKS");
    const bool is_library = call == "mouthpiece_library", is_program = call == "mouthpiece_program";
    if (!is_library && !is_program && call != "target_sources") continue;
    const std::string name = words[i + 2].starts_with("mouthpiece_") ? "mouthpiece::" + words[i + 2].substr(11)
                             : is_library                            ? "mouthpiece::" + words[i + 2]
                                                                     : words[i + 2];
    if (call != "target_sources") targets.push_back({name, folder, is_program, {}, {}, {}, {}});
    const auto found = std::find_if(targets.begin(), targets.end(), [&](const Target& t) { return t.name == name; });
    if (found == targets.end()) continue;
    std::string list = call == "target_sources" ? "SOURCES" : "", side;
    for (i += 3; i < words.size() && words[i] != ")"; ++i) {
      const std::string& word = words[i];
      if (word == "SOURCES" || word == "APART" || word == "PUBLIC_HEADERS" || word == "LINKS") {
        list = word;
      } else if (word == "PUBLIC" || word == "PRIVATE") {
        side = word;
      } else if (list == "SOURCES") {
        found->sources.insert(listedPath(folder, globbed.contains(word) ? globbed[word] : word));
      } else if (list == "APART") {
        if (!found->sources.contains(listedPath(folder, word)))
          breaches.push_back(path + ": " + word + " is compiled apart and is none of the SOURCES");
      } else if (list == "PUBLIC_HEADERS") {
        found->headers.insert(listedPath(folder, word));
      } else if (list == "LINKS") {
        (side == "PUBLIC" ? found->public_links : found->private_links).insert(word);
        if (side.empty() && is_library) breaches.push_back(path + ": " + word + " is neither PUBLIC nor PRIVATE");
      }
    }
  }
  return targets;
}

House::House(Files files) : files_(std::move(files)) {
  for (const auto& [path, text] : files_) {
    if (path == "CMakeLists.txt") {
      static const std::regex list(R"(foreach\(wing([^)]*)\))");
      std::smatch match;
      if (!std::regex_search(text, match, list)) continue;
      std::istringstream words(match[1]);
      for (std::string wing; words >> wing;) wings_.push_back(wing + "/");
    } else if (path.ends_with("CMakeLists.txt")) {
      for (Target& target : parseTargets(path, text, breaches_of_parsing_)) targets_[target.name] = target;
    }
  }
  for (auto& [name, target] : targets_) {  // a folder whose sources CMake finds by themselves
    if (!target.sources.contains(listedPath(target.folder, "${sources}"))) continue;
    for (const auto& [path, text] : files_) {
      if (path.ends_with(".cpp") && folderOf(path) == target.folder) target.sources.insert(path);
    }
  }
  for (const auto& [path, text] : files_) {
    if (!path.ends_with("CMakeLists.txt")) readSource(path, text);
  }
}

std::string House::resolved(const std::string& from, const std::string& name) const {
  for (const std::string& path :
       {"src/" + name, name, "include/" + name, (fs::path(folderOf(from)) / name).lexically_normal().string()}) {
    if (files_.contains(path)) return path;
  }
  return "";
}

void House::readSource(const std::string& path, const std::string& text) {
  std::vector<std::string> quoted, angled;
  readIncludes(text, quoted, angled);
  const bool is_outside = isUnder(path, "tests/") || isUnder(path, "examples/");
  Source source;
  source.target = is_outside ? "" : ownerOf(path);
  for (const auto* names : {&quoted, &angled}) {
    for (const std::string& name : *names) {
      const std::string header = resolved(path, name);
      if (header.empty()) {
        source.outsiders.push_back(name);
      } else {
        source.ours.push_back(header);
      }
    }
  }
  if (is_outside) {
    included_by_tests_.insert(source.ours.begin(), source.ours.end());
  } else {
    sources_[path] = std::move(source);
  }
}

/// The target that lists the file; for a header of the inside: that of its source, or of its folder.
std::string House::ownerOf(const std::string& path) const {
  const std::string source = fs::path(path).replace_extension(".cpp").string();
  if (isUnder(path, kFrontDoor)) return std::string(kFrontDoor);
  const std::string all = folderOf(path) + "/*.cpp";
  std::string of_folder;
  for (const auto& [name, target] : targets_) {
    if (target.headers.contains(path) || target.sources.contains(source) || target.sources.contains(all)) return name;
    if (path.ends_with(".h") && target.folder == folderOf(path) && (of_folder.empty() || !target.is_program))
      of_folder = name;
  }
  return of_folder;
}

std::size_t House::includeCount() const {
  std::size_t count = 0;
  for (const auto& [path, source] : sources_) count += source.ours.size();
  return count;
}

Lines House::unlistedFiles() const {
  Lines lines = breaches_of_parsing_;
  for (const auto& [path, source] : sources_) {
    if (source.target.empty()) lines.push_back(path + ": no target of its folder lists it");
  }
  for (const auto& [name, target] : targets_) {
    for (const auto* listed : {&target.sources, &target.headers}) {
      for (const std::string& path : *listed) {
        if (path.find("${") == std::string::npos && !path.ends_with("*.cpp") && !files_.contains(path))
          lines.push_back(name + ": lists " + path + ", which is not there");
      }
    }
  }
  return lines;
}

Lines House::headerBreaches() const {
  Lines lines;
  std::set<std::string> included = included_by_tests_;
  for (const auto& [path, source] : sources_) {
    for (const std::string& header : source.ours) {
      const std::string& owner = sources_.at(header).target;
      if (owner == source.target || owner == kFrontDoor) continue;
      included.insert(header);
      if (source.target == kFrontDoor) {
        lines.push_back(path + ": shows " + header + " of the inside");
        continue;
      }
      const auto room = targets_.find(owner);
      if (room == targets_.end() || !room->second.headers.contains(header))
        lines.push_back(path + ": includes " + header + ", which is not among " + owner + "'s PUBLIC_HEADERS");
    }
  }
  for (const auto& [name, target] : targets_) {
    for (const std::string& header : target.headers) {
      if (!included.contains(header))
        lines.push_back(name + ": " + header + " is public, but no other room includes it");
    }
  }
  return lines;
}

Lines House::linkBreaches() const {
  Lines lines;
  std::map<std::string, std::set<std::string>> by_headers, by_sources;
  for (const auto& [path, source] : sources_) {
    auto& needed = (path.ends_with(".h") ? by_headers : by_sources)[source.target];
    for (const std::string& header : source.ours) {
      const std::string& owner = sources_.at(header).target;
      if (owner == kFrontDoor && isUnder(path, kPrograms)) needed.insert(std::string(kBehindTheDoor));
      if (owner != source.target && owner != kFrontDoor) needed.insert(owner);
    }
    const auto own = targets_.find(source.target);
    for (const std::string& name : source.outsiders) {
      const auto targets = outsideTargets(name);
      if (!targets) lines.push_back(path + ": <" + name + "> has no row in the table of outside libraries");
      if (!targets || targets->empty() || own == targets_.end()) continue;
      std::string chosen(targets->front());
      for (const std::string_view each : *targets) {
        const std::string link(each);
        if (own->second.public_links.contains(link) || own->second.private_links.contains(link)) chosen = link;
      }
      needed.insert(chosen);
    }
  }
  for (const auto& [name, target] : targets_) {
    std::set<std::string> open = by_headers[name], inside;
    for (const std::string& link : by_sources[name]) {
      if (!open.contains(link)) inside.insert(link);
    }
    if (target.is_program) {
      inside.merge(open);
      compareLinks(name, "", inside, target.private_links, lines);
    } else {
      compareLinks(name, "PUBLIC ", open, target.public_links, lines);
      compareLinks(name, "PRIVATE ", inside, target.private_links, lines);
    }
  }
  return lines;
}

std::map<std::string, std::set<std::string>> House::roomsIncludedByRooms() const {
  std::map<std::string, std::set<std::string>> graph;
  for (const auto& [path, source] : sources_) {
    for (const std::string& header : source.ours) {
      const std::string& owner = sources_.at(header).target;
      if (owner != source.target && owner != kFrontDoor) graph[source.target].insert(owner);
    }
  }
  return graph;
}

std::size_t House::wingNumber(const std::string& path) const {
  const auto wing = std::find_if(wings_.begin(), wings_.end(), [&](const std::string& w) { return isUnder(path, w); });
  return static_cast<std::size_t>(wing - wings_.begin());
}

Lines House::circles() const {
  Lines lines;
  const auto graph = roomsIncludedByRooms();
  std::map<std::string, int> state;  // 1: on the way, 2: done
  Lines way;
  const std::function<void(const std::string&)> visit = [&](const std::string& room) {
    state[room] = 1;
    way.push_back(room);
    if (const auto next = graph.find(room); next != graph.end()) {
      for (const std::string& other : next->second) {
        if (state[other] == 0) visit(other);
        if (state[other] != 1) continue;
        std::string circle;
        for (auto at = std::find(way.begin(), way.end(), other); at != way.end(); ++at) circle += *at + " -> ";
        lines.push_back(circle + other);
      }
    }
    way.pop_back();
    state[room] = 2;
  };
  for (const auto& [room, others] : graph) {
    if (state[room] == 0) visit(room);
  }
  for (const auto& [path, source] : sources_) {
    for (const std::string& header : source.ours) {
      if (isUnder(path, kFrontDoor) || isUnder(header, kFrontDoor)) continue;
      if (wingNumber(header) > wingNumber(path)) lines.push_back(path + ": includes " + header + " of a later wing");
    }
  }
  return lines;
}

Lines House::talkingLibraries() const {
  static const std::regex prints(
      R"(std::cout|std::cerr|std::clog|\bprintf\s*\(|\bfprintf\s*\(|\bputs\s*\(|\bperror\s*\(|fmt::print|\b(exit|abort|quick_exit|terminate)\s*\([^)]*\)\s*;|#\s*include\s*<(CLI/|getopt))");
  static const std::regex option(R"((^|[^-\w])--[a-z][a-z-]+)");
  Lines lines;
  for (const auto& [path, source] : sources_) {
    if (isUnder(path, kPrograms)) continue;
    std::vector<Literal> literals;
    std::istringstream code(withoutComments(files_.at(path), literals));
    for (std::string line; std::getline(code, line);) {
      if (std::regex_search(line, prints)) lines.push_back(path + ": prints, exits or reads options: " + line);
    }
    for (const auto& [text, statement, line] : literals) {
      // An argument of a child process is an option of another program.
      if (text.find("--") == std::string::npos || statement.find("runChild(") != std::string::npos) continue;
      if (std::regex_search(text, option))
        lines.push_back(path + ":" + std::to_string(line) + ": names an option: \"" + text.substr(0, 80) + "\"");
    }
  }
  return lines;
}

Lines House::heavyHeaders() const {
  Lines lines;
  for (const auto& [name, target] : targets_) {
    for (const std::string& header : target.headers) {
      std::set<std::string> seen;
      const std::function<void(const std::string&)> visit = [&](const std::string& path) {
        if (!seen.insert(path).second || !sources_.contains(path)) return;
        for (const std::string& outsider : sources_.at(path).outsiders) {
          if (std::regex_match(outsider, kHeavy))
            lines.push_back(header + ": takes <" + outsider + "> along" + (path == header ? "" : " through " + path));
        }
        for (const std::string& next : sources_.at(path).ours) visit(next);
      };
      visit(header);
    }
  }
  return lines;
}

Lines House::misplacedMains() const {
  static const std::regex main_function(R"((^|\n)int main\()");
  Lines lines;
  for (const auto& [path, source] : sources_) {
    const bool is_named_so = path.ends_with("_main.cpp"), holds = std::regex_search(files_.at(path), main_function);
    if (is_named_so && !holds) lines.push_back(path + ": holds no main");
    if (holds && (!is_named_so || !isUnder(path, kPrograms)))
      lines.push_back(path + ": holds a main; expected it in a *_main.cpp of " + std::string(kPrograms));
  }
  return lines;
}

Lines House::typesOfOneName() const {
  static const std::regex space(R"(namespace ([\w:]*) ?\{)"),
      definition(R"((?:struct|class) (\w+)(?: final)?(?: :.*)? ?\{.*)");
  std::map<std::string, std::string> file_of;
  Lines lines;
  for (const auto& [path, source] : sources_) {
    std::istringstream text(files_.at(path));
    std::string line, before, named;
    bool is_anonymous = false;
    for (std::smatch found; std::getline(text, line); before = line) {
      if (line == "}  // namespace") is_anonymous = false;
      if (line == "namespace {") is_anonymous = true;
      if (!is_anonymous && std::regex_match(line, found, space)) named = found[1];
      if (is_anonymous || before.starts_with("template") || !std::regex_match(line, found, definition)) continue;
      const std::string type = named + "::" + found[1].str();
      const auto [known, is_new] = file_of.emplace(type, path);
      if (!is_new && known->second != path)
        lines.push_back(path + ": defines " + type + ", as " + known->second + " does");
    }
  }
  return lines;
}

}  // namespace mouthpiece::architecture
