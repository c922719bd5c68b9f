// load_trial lines COUNT CORPUS [FACE]: many lines in one process, through the front door, and with a FACE saved as
// moving heads; fails when memory or descriptors grow. load_trial phones: the index over 100,000 and 1,000,000 phones,
// and a text of 10,000 phones chosen from each.
#include <fmt/format.h>
#include <unistd.h>

#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <random>
#include <string_view>

#include "mouthpiece/save.h"
#include "mouthpiece/speaker.h"
#include "support/phone_index.h"

namespace mouthpiece {
namespace {

constexpr double kMostGrowth = 1.05;  ///< of memory, after the first lines
constexpr std::size_t kFirstLines = 100;

/// Processor time of this process: the machine may be busy.
double secondsSince(std::clock_t start) {
  return static_cast<double>(std::clock() - start) / static_cast<double>(CLOCKS_PER_SEC);
}

/// What this process holds, MiB.
double residentMiB() {
  std::ifstream statm("/proc/self/statm");
  double all = 0, resident = 0;
  statm >> all >> resident;
  return resident * static_cast<double>(::sysconf(_SC_PAGESIZE)) / (1 << 20);
}

std::size_t openDescriptors() {
  const std::filesystem::directory_iterator entries("/proc/self/fd");
  return static_cast<std::size_t>(std::distance(begin(entries), end(entries)));
}

/// Lines of one to four clauses of the sample grammar, no two after one another alike.
std::string lineOf(std::size_t number) {
  constexpr std::string_view kWhen[] = {"exactly", "almost", "just after", "a little past"};
  constexpr std::string_view kHour[] = {"one", "two", "five", "six", "nine", "ten", "eleven"};
  std::string line = "the time is now";
  for (std::size_t clause = 0; clause <= number % 4; ++clause)
    line += fmt::format(" {} {}", kWhen[(number + clause) % 4], kHour[(number / 4 + clause) % 7]);
  return line;
}

int speakLines(std::size_t count, const std::filesystem::path& corpus, const std::filesystem::path& face) {
  SpeakerOptions options;
  options.corpus = corpus;
  options.face = face;
  options.with_face = !face.empty();
  options.voice = "flite:slt";
  Speaker speaker(options);
  const std::filesystem::path head =
      std::filesystem::temp_directory_path() / fmt::format("mouthpiece_load.{}.glb", ::getpid());
  double first = 0, most = 0;
  std::size_t descriptors = 0, frames = 0;
  const auto start = std::clock();
  for (std::size_t i = 0; i < count; ++i) {
    const Performance line = speaker.perform(lineOf(i));
    frames += line.frameCount();
    if (!face.empty()) save(line, head);
    if (i < kFirstLines) {
      first = std::max(first, residentMiB());
      descriptors = openDescriptors();
    }
    most = std::max(most, residentMiB());
  }
  std::filesystem::remove(head);
  const std::size_t left = openDescriptors();
  fmt::print(
      "{} lines, {} frames in {:.1f} s of processor time; {:.1f} MiB in the first {}, {:.1f} MiB at most; {} "
      "descriptors, then {}\n",
      count, frames, secondsSince(start), first, kFirstLines, most, descriptors, left);
  return most > kMostGrowth * first || left > descriptors ? 1 : 0;
}

/// Takes of some 30 phones from 2,000 words, so that long runs repeat as they do in speech.
std::vector<std::vector<Phone>> takesOf(std::size_t phones, std::uint64_t seed) {
  std::mt19937_64 random(1);
  std::vector<std::vector<Phone>> words(2000);
  for (auto& word : words) {
    for (std::size_t i = 0, length = 1 + random() % 6; i < length; ++i)
      word.push_back(static_cast<Phone>(1 + random() % (kPhoneCount - 1)));
  }
  random.seed(seed);
  std::vector<std::vector<Phone>> takes;
  for (std::size_t so_far = 0; so_far < phones; so_far += takes.back().size()) {
    auto& take = takes.emplace_back(1, Phone::kSil);
    while (take.size() < 30) {
      const auto& word = words[random() % words.size()];
      take.insert(take.end(), word.begin(), word.end());
    }
  }
  return takes;
}

int choosePhones() {
  std::vector<Phone> text;
  for (const auto& take : takesOf(10'000, 7)) text.insert(text.end(), take.begin(), take.end());
  for (const std::size_t phones : {100'000U, 1'000'000U}) {
    const auto takes = takesOf(phones, 3);
    auto start = std::clock();
    const PhoneSpanIndex index = samples::phoneIndexOf(takes);
    const double indexed_s = secondsSince(start);
    std::size_t units = 0;
    start = std::clock();
    for (std::size_t at = 0; at + 1 < text.size(); ++units)
      at += std::max<std::size_t>(2, index.longestMatch(std::span(text).subspan(at)).length) - 1;
    fmt::print("{} phones: indexed in {:.3f} s; a text of {} phones in {} units, {:.2f} ms\n", index.phoneCount(),
               indexed_s, text.size(), units, 1000 * secondsSince(start));
  }
  return 0;
}

}  // namespace
}  // namespace mouthpiece

int main(int argc, char** argv) {
  using namespace mouthpiece;
  const std::string_view what = argc > 1 ? argv[1] : "";
  if (what == "lines" && (argc == 4 || argc == 5))
    return speakLines(std::strtoul(argv[2], nullptr, 10), argv[3], argc == 5 ? argv[4] : "");
  if (what == "phones" && argc == 2) return choosePhones();
  fmt::print(stderr, "usage: load_trial lines COUNT CORPUS [FACE] | load_trial phones\n");
  return 2;
}
