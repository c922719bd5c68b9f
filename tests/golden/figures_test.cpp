// Figures that the README and the theory pages tell, on real people beside the project (../shared): what costs 3 % of
// one fails here. Bands are round what the very takes of each test gave when they were last set, not round the tables:
// no draw has a table's figures.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <vector>

#include "phonetics/labels/textgrid.h"
#include "support/run_program.h"

namespace mouthpiece::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

const fs::path kShared = fs::path(MOUTHPIECE_SOURCE_DIR) / "../shared";
const fs::path kGrid = kShared / "capture/grid_s1";
const fs::path kSingers = kShared / "singing_vowels";
const fs::path kHeads = kShared / "faces";

class RealCapture : public testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(kGrid / "takes")) GTEST_SKIP() << "no real capture in " << kGrid;
  }
  ScratchFolder scratch_;
};

/// The fields of each row below the header.
std::vector<std::vector<std::string>> rowsOf(const fs::path& csv) {
  std::istringstream table(readAll(csv));
  std::vector<std::vector<std::string>> rows;
  std::string line;
  std::getline(table, line);
  while (std::getline(table, line)) {
    std::istringstream fields(line);
    std::vector<std::string>& row = rows.emplace_back();
    for (std::string field; std::getline(fields, field, ',');) row.push_back(field);
  }
  return rows;
}

/// Edges between words, against those that GRID publishes: every twelfth take, 250 edges. All takes have 14.3 and 51.2
/// ms, 2.6 % over 60 ms (docs/theory/hearing/alignment.md), these 17.0, 51.2 and 2.8 %.
/// 52 ms is what was promised; the others are held to 3 %.
TEST_F(RealCapture, WordsAreHeardWhereTheyWerePublished) {
  constexpr double kMedianMs = 17.0 * 1.03, kMostMs = 52, kShareOverSixty = 0.028 * 1.03;
  std::vector<std::vector<std::string>> rows = rowsOf(kGrid / "alignment_check.csv");
  std::sort(rows.begin(), rows.end());
  std::vector<double> off_ms;
  for (std::size_t i = 3; i < rows.size(); i += 12) {
    const fs::path take = kGrid / "takes" / rows[i][0], found = scratch_.path() / "found.TextGrid";
    std::string words = readAll(take.string() + ".txt");
    words.erase(words.find_last_not_of("\r\n ") + 1);
    const ProgramResult result =
        runProgram("corpus", {"align", take.string() + ".wav", "--transcript", words, "--lexicon",
                              (kGrid / "lexicon.txt").string(), "--out", found.string(), "--quiet"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const SpeechLabels ours = readTextGrid(found), given = readTextGrid(take.string() + ".TextGrid");
    ASSERT_EQ(ours.words.size(), 6U) << rows[i][0];
    ASSERT_EQ(given.words.size(), 6U) << rows[i][0];
    constexpr std::size_t kFirstEdge = 4;  // columns: start1_ms, end1_ms, start2_ms, ...; given less published
    for (std::size_t edge = 1; edge < 11; ++edge) {
      const auto time_of = [&](const SpeechLabels& labels) {
        const TimeSpan span = labels.spanOf(labels.words[edge / 2].phones);
        return 1000 * (edge % 2 == 0 ? span.start : span.end);
      };
      off_ms.push_back(std::abs(time_of(ours) - time_of(given) + std::stod(rows[i][kFirstEdge + edge])));
    }
  }
  ASSERT_EQ(off_ms.size(), 250U);
  std::sort(off_ms.begin(), off_ms.end());
  EXPECT_LE(off_ms[off_ms.size() / 2], kMedianMs);
  EXPECT_LE(off_ms[off_ms.size() * 95 / 100], kMostMs);
  const auto over = std::count_if(off_ms.begin(), off_ms.end(), [](double off) { return off > 60; });
  EXPECT_LE(static_cast<double>(over), kShareOverSixty * 250);
}

/// A measure and what it is in a test's own takes; the worse side is held to 3 %. `least_step` for what is counted: one
/// closure more or less of few is no change for the worse.
struct Held {
  const char* measure;
  double usual;
  bool more_is_better;
  double least_step = 0;
};

void expectHeld(const json& row, const std::vector<Held>& figures) {
  constexpr double kLeast = 0.03;
  for (const Held& held : figures) {
    const double found = row.at(held.measure).get<double>(), step = std::max(kLeast * held.usual, held.least_step);
    if (held.more_is_better) {
      EXPECT_GE(found, held.usual - step) << row.at("method") << ", " << held.measure;
    } else {
      EXPECT_LE(found, held.usual + step) << row.at("method") << ", " << held.measure;
    }
  }
}

json rowNamed(const json& table, const std::string& method) {
  for (const json& row : table.at("rows")) {
    if (row.at("method") == method) return row;
  }
  ADD_FAILURE() << "no row " << method << " in " << table.dump(1);
  return {};
}

/// How far the lips' middles are apart, mm, frame by frame.
struct Opening {
  std::vector<double> times_s, mm;

  [[nodiscard]] double at(double time_s) const {
    const auto next = std::upper_bound(times_s.begin(), times_s.end(), time_s);
    const auto i =
        static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(next - times_s.begin(), 1, std::ssize(times_s) - 1));
    return std::lerp(mm[i - 1], mm[i], (time_s - times_s[i - 1]) / (times_s[i] - times_s[i - 1]));
  }
};

Opening openingOf(const fs::path& csv) {
  std::istringstream header(readAll(csv));
  std::vector<std::string> names;
  std::string line;
  std::getline(header, line);
  std::istringstream fields(line);
  for (std::string field; std::getline(fields, field, ',');) names.push_back(field);
  const auto columnOf = [&](const std::string& name) {
    return static_cast<std::size_t>(std::find(names.begin(), names.end(), name) - names.begin());
  };
  const std::size_t upper = columnOf("LIP_UP_MID.x"), lower = columnOf("LIP_LO_MID.x");
  Opening opening;
  for (const std::vector<std::string>& row : rowsOf(csv)) {
    double squares = 0;
    for (std::size_t axis = 0; axis < 3; ++axis)
      squares += std::pow(std::stod(row.at(upper + axis)) - std::stod(row.at(lower + axis)), 2);
    opening.times_s.push_back(std::stod(row[0]));
    opening.mm.push_back(std::sqrt(squares));
  }
  return opening;
}

double correlation(const std::vector<double>& a, const std::vector<double>& b) {
  const double n = static_cast<double>(a.size());
  double sum_a = 0, sum_b = 0, aa = 0, bb = 0, ab = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    sum_a += a[i];
    sum_b += b[i];
    aa += a[i] * a[i];
    bb += b[i] * b[i];
    ab += a[i] * b[i];
  }
  return (ab - sum_a * sum_b / n) / std::sqrt((aa - sum_a * sum_a / n) * (bb - sum_b * sum_b / n));
}

/// A voice that is the corpus moves as it does: inside fragments the lips are those of the take whose sound is heard.
/// Seen were 0.9995, and 0.983 with the lips that are predicted.
void expectLipsOfTheTakesHeard(const fs::path& corpus, const ScratchFolder& scratch) {
  constexpr double kClearOfJoins = 0.12, kCorrelation = 0.995;
  const fs::path csv = scratch.path() / "heard.csv", report = scratch.path() / "heard.json";
  const fs::path take_csv = scratch.path() / "take.csv";
  std::vector<double> line_mm, take_mm;
  for (const char* text : {"place red at G nine again", "bin blue with K two now", "set white in F six please"}) {
    const ProgramResult spoken = runProgram("synth", {"--voice", "corpus", "--text", text, "--corpus", corpus.string(),
                                                      "--lexicon", (kGrid / "lexicon.txt").string(), "--fps", "100",
                                                      "-o", csv.string(), "-o", report.string(), "--quiet"});
    ASSERT_EQ(spoken.exit_code, 0) << spoken.err;
    const Opening line = openingOf(csv);
    const json facts = json::parse(readAll(report));
    for (const json& unit : facts.at("units")) {
      if (!unit.contains("sound") || unit.at("last") == unit.at("first")) continue;
      const fs::path take = kGrid / "takes" / unit.at("take").get<std::string>();
      ASSERT_EQ(runProgram("corpus", {"convert", take.string() + ".c3d", take_csv.string()}).exit_code, 0);
      const Opening captured = openingOf(take_csv);
      // Inside a fragment sound and lips run as they were recorded.
      const std::size_t inner = unit.at("last").get<std::size_t>();
      const double source =
          readTextGrid(take.string() + ".TextGrid")
              .phones.at(unit.at("source_first").get<std::size_t>() + inner - unit.at("first").get<std::size_t>())
              .span.start;
      const double later = facts.at("phones").at(inner).at("start_s").get<double>() - source;
      for (std::size_t i = 0; i < captured.times_s.size(); ++i) {
        const double time = captured.times_s[i] + later;
        if (time < unit.at("sound")[0].get<double>() + kClearOfJoins) continue;
        if (time > unit.at("sound")[1].get<double>() - kClearOfJoins) break;
        line_mm.push_back(line.at(time));
        take_mm.push_back(captured.mm[i]);
      }
    }
  }
  ASSERT_GT(line_mm.size(), 40U);
  testing::Test::RecordProperty("heard_lips", std::to_string(correlation(line_mm, take_mm)));
  EXPECT_GE(correlation(line_mm, take_mm), kCorrelation) << line_mm.size() << " frames";
}

/// Every sixth take by the others. What is set on these takes' kind was set without a look at this draw.
TEST_F(RealCapture, HeldOutTakesComeNearTheirCapture) {
  fs::create_directories(scratch_.path() / "build");
  fs::create_directories(scratch_.path() / "test");
  std::vector<fs::path> takes;
  for (const auto& entry : fs::directory_iterator(kGrid / "takes")) {
    if (entry.path().extension() == ".c3d") takes.push_back(entry.path());
  }
  std::sort(takes.begin(), takes.end());
  ASSERT_GE(takes.size(), 290U);
  for (std::size_t i = 0; i < takes.size(); ++i) {
    const fs::path folder = scratch_.path() / (i % 6 == 3 ? "test" : "build");
    for (const char* ending : {".c3d", ".wav", ".txt", ".TextGrid"}) {
      fs::path from = takes[i];
      from.replace_extension(ending);
      fs::create_symlink(fs::absolute(from), folder / from.filename());
    }
  }
  const fs::path corpus = scratch_.path() / "s1.corpus";
  const ProgramResult built =
      runProgram("corpus", {"build", (scratch_.path() / "build").string(), "--out", corpus.string(), "--lexicon",
                            (kGrid / "lexicon.txt").string(), "--quiet"});
  ASSERT_EQ(built.exit_code, 0) << built.err;
  EXPECT_EQ(runProgram("corpus", {"check", corpus.string()}).exit_code, 0);
  const ProgramResult judged =
      runProgram("corpus", {"evaluate", corpus.string(), "--takes", (scratch_.path() / "test").string(), "--rows",
                            "guided,prediction,greedy,vocal", "--json"});
  ASSERT_EQ(judged.exit_code, 0) << judged.err;
  const json table = json::parse(judged.out);
  RecordProperty("evaluation", table.dump());
  constexpr double kOneContact = 1.0 / 19, kOneJoin = 1.0 / 195;
  const json guided = rowNamed(table, "guided (default)");
  expectHeld(guided, {{"lip_rms_mm", 1.283, false},
                      {"lve_mm2", 3.708, false},
                      {"opening_correlation", 0.9258, true},
                      {"width_correlation", 0.7506, true},
                      {"protrusion_correlation", 0.8745, true},
                      {"closure_recall", 0.981, true},
                      {"contact_recall", 1, true, kOneContact},
                      {"false_closure_share", 0.0767, false},
                      {"vowels_shut_share", 0.1206, false},
                      {"joins_over_corpus_p95", 0.0154, false, kOneJoin},
                      {"velocities_over_corpus_p95", 0.0821, false, kOneJoin}});
  // Neither flat nor shaking: both sides.
  for (const Held& held : {Held{"variance_ratio", 0.8371, true}, Held{"jerk_ratio", 0.8685, true}}) {
    expectHeld(guided, {held});
    EXPECT_LE(guided.at(held.measure).get<double>(), held.usual * 1.03) << held.measure;
  }
  expectHeld(rowNamed(table, "guided, with the sound"), {{"lip_rms_mm", 1.255, false},
                                                         {"opening_correlation", 0.932, true},
                                                         {"width_correlation", 0.7545, true},
                                                         {"closure_recall", 1, true}});
  expectHeld(
      rowNamed(table, "prediction alone"),
      {{"lip_rms_mm", 1.256, false}, {"opening_correlation", 0.9294, true}, {"width_correlation", 0.7645, true}});
  expectHeld(rowNamed(table, "greedy, any units"),
             {{"lip_rms_mm", 1.640, false}, {"opening_correlation", 0.8744, true}, {"closure_recall", 0.9245, true}});
  expectHeld(rowNamed(table, "vocal curves"), {{"lip_rms_mm", 1.939, false},
                                               {"opening_correlation", 0.7865, true},
                                               {"closure_recall", 1, true},
                                               {"false_closure_share", 0.1329, false}});

  const fs::path csv = scratch_.path() / "place.csv";
  const ProgramResult typed = runProgram("synth", {"--text", "place red at G nine again", "--corpus", corpus.string(),
                                                   "--lexicon", (kGrid / "lexicon.txt").string(), "-o", csv.string()});
  EXPECT_EQ(typed.exit_code, 0) << typed.err;
  expectLipsOfTheTakesHeard(corpus, scratch_);
}

/// Vowels of real singers, frame by frame, every eighth file. The shipped network has learnt from these singers, so
/// that this holds what it does and says nothing of strangers (docs/theory/hearing/vowel_training.md).
TEST(RealSingers, VowelsAreHeardAsTheyWereMarked) {
  if (!fs::exists(kSingers / "labels.csv")) GTEST_SKIP() << "no singers in " << kSingers;
  constexpr double kRight = 0.9536, kMerged = 0.9604, kWorst = 0.97;
  struct Marked {
    Seconds start, end;
    char vowel;
  };
  std::map<std::string, std::vector<Marked>> marks;
  for (const std::vector<std::string>& row : rowsOf(kSingers / "labels.csv")) {
    const bool is_vowel = row[3].size() == 1 && std::string("AEIOU").find(row[3]) != std::string::npos;
    if (is_vowel) marks[row[0]].push_back({std::stod(row[1]), std::stod(row[2]), row[3][0]});
  }
  const auto merged = [](char vowel) { return vowel == 'I' ? 'E' : vowel == 'U' ? 'O' : vowel; };
  const ScratchFolder scratch;
  const fs::path out = scratch.path() / "tags.json";
  double frames = 0, right = 0, alike = 0;
  std::size_t number = 0;
  for (const auto& [file, marked] : marks) {
    if (number++ % 8 != 0) continue;
    const ProgramResult result =
        runProgram("corpus", {"tag", (kSingers / "audio" / file).string(), "--out", out.string(), "--quiet"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const json tags = json::parse(readAll(out));
    for (const json& frame : tags.at("vowels")) {
      const double time = frame.at("time_s");
      for (const Marked& mark : marked) {
        if (time < mark.start || time >= mark.end) continue;
        char heard = 'A';
        for (const char vowel : std::string("EIOU")) {
          if (frame.at(std::string(1, vowel)).get<double>() > frame.at(std::string(1, heard)).get<double>())
            heard = vowel;
        }
        frames += 1;
        right += heard == mark.vowel ? 1 : 0;
        alike += merged(heard) == merged(mark.vowel) ? 1 : 0;
      }
    }
  }
  ASSERT_GT(frames, 4000);
  RecordProperty("right", std::to_string(right / frames));
  RecordProperty("merged", std::to_string(alike / frames));
  EXPECT_GE(right / frames, kWorst * kRight);
  EXPECT_GE(alike / frames, kWorst * kMerged);
}

/// Of the closures that the paper's corpus holds, those that touch on each shared head by its ten clicks.
struct ClosingHead {
  const char* name;
  int touching;
};
/// CTest names the test by it.
void PrintTo(const ClosingHead& head, std::ostream* out) { *out << head.name; }

class RealHeads : public testing::TestWithParam<ClosingHead> {};

TEST_P(RealHeads, CloseTheirLipsAsOftenAsTheyDid) {
  const std::string name = GetParam().name;
  fs::path mesh = kHeads / (name + ".obj");
  if (!fs::exists(mesh)) mesh = kHeads / "more" / (name + ".obj");
  const fs::path clock = fs::path(MOUTHPIECE_BUILD_SHARE_DIR) / "clock.corpus";
  if (!fs::exists(mesh)) GTEST_SKIP() << "no head " << name << " in " << kHeads;
  if (!fs::exists(clock)) GTEST_SKIP() << "no " << clock << ": run `make data`";
  const ScratchFolder scratch;
  const fs::path anchors = fs::path(MOUTHPIECE_SOURCE_DIR) / "tests/data/anchors" / (name + ".anchors.json");
  const std::string face = (scratch.path() / "head.face").string();
  // A fit with a fault exits with 1 and is written all the same.
  runProgram("retarget", {"fit", "--mesh", mesh.string(), "--anchors", anchors.string(), "--corpus", clock.string(),
                          "--out", face, "--even-if-faulty", "--quiet"});
  const ProgramResult checked = runProgram("retarget", {"check", face, "--corpus", clock.string(), "--json"});
  ASSERT_FALSE(checked.out.empty()) << checked.err;
  const json closures = json::parse(checked.out).at("captured_closures");
  RecordProperty("closures", closures.dump());
  EXPECT_EQ(closures.at("closures").get<int>(), 91) << "the clock says so many B P M";
  EXPECT_GE(closures.at("touching").get<double>(), 0.97 * GetParam().touching) << closures;
}

/// Every third for everybody, all of them each night, as in tests/heads.
std::vector<ClosingHead> headsThatClose() {
  const std::vector<ClosingHead> all{{"ict_head", 91},
                                     {"ict_id11", 91},
                                     {"ict_id12", 91},
                                     {"ict_id13", 91},
                                     {"ict_id14", 91},
                                     {"makehuman_male", 91},
                                     {"mh_african_female_young", 91},
                                     {"mh_asian_male_old", 90}};
  if (std::getenv("MOUTHPIECE_ALL_HEADS") != nullptr) return all;
  return {all[0], all[3], all[6]};
}
INSTANTIATE_TEST_SUITE_P(Shared, RealHeads, testing::ValuesIn(headsThatClose()),
                         [](const auto& head) { return std::string(head.param.name); });

}  // namespace
}  // namespace mouthpiece::test
