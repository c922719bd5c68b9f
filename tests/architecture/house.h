#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace mouthpiece::architecture {

/// Texts by their path from the root: "src/base/files.h".
using Files = std::map<std::string, std::string>;

/// Everything the rules look at: sources and CMakeLists.txt of the checkout, and the tests' sources.
Files filesOf(const std::filesystem::path& root);

/// A target of one folder: a room (mouthpiece_library) or a program (mouthpiece_program).
struct Target {
  std::string name;               ///< mouthpiece::exports_gltf; a program's own name
  std::string folder;             ///< src/exports/gltf
  bool is_program = false;        ///< its links have no PUBLIC and PRIVATE
  std::set<std::string> sources;  ///< paths from the root; "src/voices/*.cpp" stands for all of a folder
  std::set<std::string> headers;  ///< PUBLIC_HEADERS, paths from the root
  std::set<std::string> public_links, private_links;
};

/// What `path`, a CMakeLists.txt with that text, declares. Breaks of our own rules for such a file join `breaches`.
std::vector<Target> parseTargets(const std::string& path, std::string_view text, std::vector<std::string>& breaches);

/// The tree as its targets tell it, and the rules that it must keep (docs/architecture.md). Each rule gives one line
/// for every breach.
class House {
 public:
  explicit House(Files files);

  /// Every source belongs to a target of its folder; every source and header that a target lists is there.
  [[nodiscard]] std::vector<std::string> unlistedFiles() const;
  /// PUBLIC_HEADERS are those headers that other rooms or the tests include.
  [[nodiscard]] std::vector<std::string> headerBreaches() const;
  /// LINKS are the rooms and libraries that the room's files include: PUBLIC when a header does.
  [[nodiscard]] std::vector<std::string> linkBreaches() const;
  /// No room includes, by way of others, itself; no wing includes one that the root's list has after it.
  [[nodiscard]] std::vector<std::string> circles() const;
  /// Only src/programs prints, exits, reads a command line or knows an option's name.
  [[nodiscard]] std::vector<std::string> talkingLibraries() const;
  /// What other rooms include takes no heavy header along.
  [[nodiscard]] std::vector<std::string> heavyHeaders() const;
  /// *_main.cpp of src/programs hold the mains, one each.
  [[nodiscard]] std::vector<std::string> misplacedMains() const;
  /// No two files define a type of one name in one namespace: the linker would take the one's destructor for both.
  [[nodiscard]] std::vector<std::string> typesOfOneName() const;

  [[nodiscard]] std::size_t roomCount() const { return targets_.size(); }
  [[nodiscard]] std::size_t includeCount() const;

 private:
  struct Source {
    std::string target;                  ///< "" for what none lists
    std::vector<std::string> ours;       ///< headers of the tree that it includes, as paths from the root
    std::vector<std::string> outsiders;  ///< <names> of the others
  };
  void readSource(const std::string& path, const std::string& text);
  [[nodiscard]] std::string ownerOf(const std::string& path) const;
  [[nodiscard]] std::string resolved(const std::string& from, const std::string& name) const;
  [[nodiscard]] std::map<std::string, std::set<std::string>> roomsIncludedByRooms() const;
  [[nodiscard]] std::size_t wingNumber(const std::string& path) const;

  Files files_;
  std::vector<std::string> breaches_of_parsing_;
  std::map<std::string, Target> targets_;  ///< by name
  std::map<std::string, Source> sources_;  ///< by path, without the tests
  std::set<std::string> included_by_tests_;
  std::vector<std::string> wings_;
};

}  // namespace mouthpiece::architecture
