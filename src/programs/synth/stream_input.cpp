#include "programs/synth/stream_ends.h"

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <sstream>

#include "mouthpiece/errors.h"

namespace mouthpiece {
namespace {

bool isBlankByte(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }
bool isLetterByte(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
         (static_cast<unsigned char>(c) & 0x80U) != 0;
}

bool isInsideCharacter(char c) { return (static_cast<unsigned char>(c) & 0xC0U) == 0x80U; }

/// Sentences of scripts without blanks, or with stops of their own, end with these; and pauses.
constexpr std::array<std::string_view, 6> kWideStops{"。", "！", "？", "।", "؟", "։"};
constexpr std::array<std::string_view, 5> kWidePauses{"、", "，", "；", "：", "،"};
constexpr std::array<std::string_view, 3> kPauses{",", ";", ":"};
template <std::size_t kCount>
bool isOneOf(std::string_view character, const std::array<std::string_view, kCount>& all) {
  return std::find(all.begin(), all.end(), character) != all.end();
}

/// The stop of "Dr." and its like ends no sentence.
bool isAbbreviation(const std::string& text, std::size_t stop) {
  constexpr std::array<std::string_view, 12> kAbbreviations{"Mr", "Mrs", "Ms",  "Dr", "St", "Prof",
                                                            "vs", "e.g", "i.e", "No", "Jr", "Sr"};
  std::size_t first = stop;
  while (first > 0 && !isBlankByte(text[first - 1])) --first;
  const std::string_view word = std::string_view(text).substr(first, stop - first);
  return std::find(kAbbreviations.begin(), kAbbreviations.end(), word) != kAbbreviations.end();
}

}  // namespace

InputBytes::InputBytes(std::string file, const std::atomic<bool>& is_stopped)
    : file_(std::move(file)),
      descriptor_(file_ == "stdin" ? STDIN_FILENO : open(file_.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)),
      is_stopped_(is_stopped) {
  if (descriptor_ < 0) throw InputError(file_, "", std::string("cannot be read: ") + std::strerror(errno));
}

InputBytes::~InputBytes() {
  if (descriptor_ != STDIN_FILENO) close(descriptor_);
}

std::string InputBytes::some(std::size_t most) {
  constexpr int kPatienceMs = 100;
  std::string bytes(most, '\0');
  while (!is_stopped_) {
    pollfd waiting{descriptor_, POLLIN, 0};
    const int ready = poll(&waiting, 1, kPatienceMs);
    if (ready == 0 || (ready < 0 && errno == EINTR)) continue;
    const ssize_t count = read(descriptor_, bytes.data(), bytes.size());
    if (count < 0 && (errno == EINTR || errno == EAGAIN)) continue;
    if (count < 0) throw InputError(file_, "", std::string("cannot be read: ") + std::strerror(errno));
    bytes.resize(static_cast<std::size_t>(count));
    offset_ += bytes.size();
    return bytes;
  }
  return {};
}

std::string InputBytes::exactly(std::size_t count) {
  std::string bytes;
  while (bytes.size() < count) {
    const std::string more = some(count - bytes.size());
    if (more.empty()) break;
    bytes += more;
  }
  return bytes;
}

std::optional<std::string> InputLines::next() {
  constexpr std::size_t kLongest = 1 << 16, kAtOnce = 4096;
  while (true) {
    const std::size_t end = read_.find('\n');
    if (end == std::string::npos && read_.size() <= kLongest) {
      const std::string more = input_.some(kAtOnce);
      if (!more.empty()) {
        read_ += more;
        continue;
      }
      if (read_.empty()) return std::nullopt;
    }
    ++line_number_;
    if (std::min(end, read_.size()) > kLongest)
      throw InputError(file_, std::to_string(line_number_), "is over 64 KiB; expected a line of labels");
    std::string line = read_.substr(0, end);
    read_.erase(0, end == std::string::npos ? end : end + 1);
    if (!line.empty() && line.back() == '\r') line.pop_back();
    return line;
  }
}

/// One beyond its last byte; nullopt where more must be read to know.
std::optional<std::size_t> SentenceReader::endOfSentence() const {
  constexpr std::size_t kShortestPhrase = 30, kPhrase = 80, kLongest = 400;
  std::size_t blank = 0, phrase = 0, characters = 0;
  for (std::size_t i = 0, next = 0; i < read_.size(); i = next, ++characters) {
    next = i + 1;
    while (next < std::min(i + 4, read_.size()) && isInsideCharacter(read_[next])) ++next;
    const std::string_view c = std::string_view(read_).substr(i, next - i);
    const bool before_blank = next < read_.size() ? isBlankByte(read_[next]) : is_over_;
    if (c == "\n" || isOneOf(c, kWideStops)) return next;
    if ((c == "!" || c == "?" || (c == "." && !isAbbreviation(read_, i))) && before_blank) return next;
    const bool is_pause = isOneOf(c, kWidePauses) || (isOneOf(c, kPauses) && before_blank);
    if (is_pause && characters >= kShortestPhrase) phrase = next;
    if (characters >= kPhrase && phrase > 0) return phrase;
    if (isBlankByte(c.front())) blank = next;
    if (characters >= kLongest && blank > 0) return blank;
    if (characters >= 4 * kLongest) return i;
  }
  return is_over_ && !read_.empty() ? std::optional(read_.size()) : std::nullopt;
}

std::optional<std::string> SentenceReader::next() {
  constexpr std::size_t kAtOnce = 4096;
  while (true) {
    while (const std::optional<std::size_t> end = endOfSentence()) {
      std::string sentence = read_.substr(0, *end);
      read_.erase(0, *end);
      const auto begin = std::find_if_not(sentence.begin(), sentence.end(), isBlankByte);
      line_number_ = 1 + lines_before_ + static_cast<std::size_t>(std::count(sentence.begin(), begin, '\n'));
      lines_before_ += static_cast<std::size_t>(std::count(sentence.begin(), sentence.end(), '\n'));
      if (std::any_of(sentence.begin(), sentence.end(), isLetterByte)) return sentence;
    }
    if (is_over_) return std::nullopt;
    const std::string more = input_.some(kAtOnce);
    is_over_ = more.empty();
    read_ += more;
  }
}

bool splitLabel(const std::string& line, std::vector<std::string>& fields) {
  fields.clear();
  std::istringstream words(line);
  for (std::string field; words >> field;) fields.push_back(field);
  return !fields.empty() && !fields.front().starts_with('#');
}

}  // namespace mouthpiece
