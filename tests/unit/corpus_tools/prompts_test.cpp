#include <fmt/format.h>
#include <gtest/gtest.h>

#include <numeric>
#include <set>

#include "base/errors.h"
#include "base/files.h"
#include "corpus_tools/report/prompts.h"
#include "corpus_tools/sample/sample_corpus.h"
#include "support/run_program.h"

namespace mouthpiece {
namespace {

using Sentences = std::vector<std::string>;

TEST(PromptGrammar, SpellsChoicesOptionsGroupsAndRules) {
  EXPECT_EQ(sentencesOfGrammar("# mine\ns = [please] <verb> (it | them) # all\nverb = take | put down\n", "g"),
            (Sentences{"take it", "take them", "put down it", "put down them", "please take it", "please take them",
                       "please put down it", "please put down them"}));
}

TEST(PromptGrammar, ShipsEdgesTimeGrammar) {
  const std::string file = std::string(MOUTHPIECE_SOURCE_DIR) + "/sample_data/prompts/time.grammar";
  const Sentences sentences = sentencesOfGrammar(readFile(file), file);
  EXPECT_EQ(sentences.size(), 5U * 12U * 12U * 4U);  // exactness or none, minutes or none, hours, parts of the day
  EXPECT_EQ(sentences.front(), "the time is now one in the morning");
}

TEST(PromptGrammar, NamesWhatIsWrong) {
  const auto error = [](std::string_view text) -> std::string {
    try {
      sentencesOfGrammar(text, "g.txt");
    } catch (const InputError& input_error) {
      return input_error.what();
    }
    return "no error";
  };
  EXPECT_NE(error("s = <t>\n").find("g.txt:1: found <t>"), std::string::npos);
  EXPECT_NE(error("s = a\nt = <t>\n").find("no error"), std::string::npos);  // never reached
  EXPECT_NE(error("s = a <t>\nt = b | <s>\n").find("holds itself"), std::string::npos);
  EXPECT_NE(error("s = (a | b\n").find("without its ')'"), std::string::npos);
  EXPECT_NE(error("s = a ]\n").find("nothing opened"), std::string::npos);
  EXPECT_NE(error("\n# nothing\n").find("holds no rule"), std::string::npos);
  EXPECT_NE(error("s = <d> <d> <d> <d> <d> <d>\nd = 0|1|2|3|4|5|6|7|8|9\n").find("more than 200000"),
            std::string::npos);
  std::string doubling;
  for (int i = 0; i < 60; ++i) doubling += fmt::format("s{} = <s{}> <s{}>\n", i, i + 1, i + 1);
  EXPECT_NE(error(doubling + "s60 = a\n").find("sentence of over 2000 letters"), std::string::npos);
  std::string words;
  for (int i = 0; i < 2000; ++i) words += fmt::format("word{} ", i);
  EXPECT_NE(error("s = <a> | <b> | <c>\na = " + words + "\nb = " + words + "\nc = " + words + "\n")
                .find("sentence of over 2000 letters"),
            std::string::npos);
  std::string wide = "s = (" + std::string(1900, 'a');
  for (int i = 0; i < 189; ++i) wide += fmt::format(" | {}{}", std::string(1900, 'a'), i);
  EXPECT_NE(error(wide + ") <t>\nt = a|b|c|d|e|f|g|h|i|j|k|l|m|n|o|p|q|r|s|t|u|v|w|x|y|z <u> <u>\n"
                         "u = [1] [2] [3] [4] [5]\n")
                .find("too much text"),
            std::string::npos);
  EXPECT_NE(error("s = " + std::string(5000, '(') + "\n").find("too many brackets"), std::string::npos);
}

TEST(PromptChoice, TakesWhatIsNewFirst) {
  using enum Phone;
  const std::vector<Prompt> prompts = {
      {"ba", {kB, kAA}}, {"ba again", {kB, kAA}}, {"baba", {kB, kAA, kB, kAA}}, {"see", {kS, kIY}}, {"", {}}};
  const ChosenPrompts chosen = choosePrompts(prompts, 10);
  ASSERT_EQ(chosen.sentences.size(), 5U);
  EXPECT_EQ(chosen.possible_pairs, 8U);  // sil-B B-AA AA-sil AA-B, sil-S S-IY IY-sil, sil-sil
  EXPECT_EQ(chosen.pairs.back(), 8U);
  EXPECT_TRUE(std::is_sorted(chosen.pairs.begin(), chosen.pairs.end()));
  EXPECT_EQ(std::set<std::size_t>(chosen.sentences.begin(), chosen.sentences.end()).size(), 5U);
  EXPECT_EQ(chosen.sentences.back(), 1U) << "what is held already comes last";
}

TEST(PromptChoice, CountsAPairAsOftenAsItIsMet) {
  using enum Phone;
  const std::vector<Prompt> prompts = {{"rare", {kZH, kOY, kUH, kNG}}, {"usual", {kDH, kAH}}};
  EXPECT_EQ(choosePrompts(prompts, 2).sentences, (std::vector<std::size_t>{0, 1})) << "more pairs";
  const PairShares shares = pairShares({{"the", {kDH, kAH}}, {"the the", {kDH, kAH, kDH, kAH}}, {"a", {kAH}}});
  const auto share = [&](Phone a, Phone b) {
    return shares[static_cast<std::size_t>(a) * kPhoneCount + static_cast<std::size_t>(b)];
  };
  EXPECT_DOUBLE_EQ(share(kDH, kAH), 3.0 / 10);
  EXPECT_DOUBLE_EQ(share(kAH, kSil), 3.0 / 10);
  const ChosenPrompts chosen = choosePrompts(prompts, 2, &shares);
  EXPECT_EQ(chosen.sentences, (std::vector<std::size_t>{1, 0}));
  ASSERT_EQ(chosen.shares.size(), 2U);
  EXPECT_NEAR(chosen.shares[0], 8.0 / 10, 1e-12);  // all but sil-AH and AH-DH
  EXPECT_EQ(chosen.shares[1], chosen.shares[0]);
}

TEST(PairTable, IsReadAsItIsWritten) {
  using enum Phone;
  const PairShares shares = pairShares({{"the", {kDH, kAH}}, {"a bee", {kAH, kB, kIY}}});
  const std::string table = pairSharesToCsv(shares);
  EXPECT_TRUE(table.starts_with("left,right,share\n")) << table;
  EXPECT_EQ(pairSharesToCsv(parsePairShares(table, "t.csv")), table);
  const auto error = [](std::string_view text) -> std::string {
    try {
      parsePairShares(text, "t.csv");
    } catch (const InputError& input_error) {
      return input_error.what();
    }
    return "no error";
  };
  EXPECT_EQ(error("# said often\nAH,N,0.5\n"), "no error");
  EXPECT_NE(error("AH,N,0.5\nAH,N,0.1\n").find("t.csv:2: 'AH,N,0.1' stands there twice"), std::string::npos);
  for (const char* bad : {"AH,N\n", "AH\n", "AH,Q9,0.1\n", "AH,N,1.5\n", "AH,N,nan\n", "AH,N,-1\n", ",,\n"})
    EXPECT_NE(error(bad).find("expected two phones and a share"), std::string::npos) << bad;
}

/// What the sample corpus promises of its sentences, by the lexicon that reads a typed line.
TEST(RichPrompts, HoldThePhonePairsOfRunningEnglish) {
  const std::string folder = std::string(MOUTHPIECE_SOURCE_DIR) + "/sample_data/prompts/";
  const std::string table = folder + "english_pairs.csv";
  const PairShares shares = parsePairShares(readFile(table), table);
  const auto program = [&](const std::vector<std::string>& sentences) {
    std::string text;
    for (const std::string& sentence : sentences) text += sentence + "\n";
    const test::ScratchFolder scratch;
    writeFileAtomically(scratch.path() / "said.txt", text);
    const std::string curve = (scratch.path() / "curve.csv").string();
    const test::ProgramResult result =
        test::runProgram("corpus", {"prompts", "--text", (scratch.path() / "said.txt").string(), "--running", table,
                                    "--count", std::to_string(sentences.size()), "--curve", curve, "--quiet"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    const std::string lines = test::readAll(curve);
    return std::stod(lines.substr(lines.rfind(',') + 1));
  };
  EXPECT_GE(program(sampleSentences(SamplePrompts::kRich)), 0.99);
  EXPECT_LE(program(sampleSentences(SamplePrompts::kClock)), 0.6) << "the clock's 51 words do not";
  EXPECT_NEAR(std::accumulate(shares.begin(), shares.end(), 0.0), 1.0, 1e-3);
}

TEST(PromptChoice, IsAsGoodAsTheGreedyChoiceByDefinition) {
  // The queue with old judgements against judging every sentence anew each time.
  std::vector<Prompt> prompts;
  for (unsigned i = 0; i < 60; ++i) {
    Prompt prompt{std::to_string(i), {}};
    for (unsigned k = 0; k < 4 + i % 5; ++k)
      prompt.phones.push_back(static_cast<Phone>(1 + (i * 7 + k * k * 13) % (kPhoneCount - 1)));
    prompts.push_back(prompt);
  }
  const ChosenPrompts chosen = choosePrompts(prompts, 20);
  std::set<std::pair<int, int>> held;
  for (std::size_t i = 0; i < chosen.sentences.size(); ++i) {
    const auto pairs_of = [](const Prompt& prompt) {
      std::set<std::pair<int, int>> pairs;
      int before = 0;
      for (const Phone phone : prompt.phones) {
        pairs.insert({before, static_cast<int>(phone)});
        before = static_cast<int>(phone);
      }
      pairs.insert({before, 0});
      return pairs;
    };
    for (const auto& pair : pairs_of(prompts[chosen.sentences[i]])) held.insert(pair);
    EXPECT_EQ(chosen.pairs[i], held.size());
  }
}

}  // namespace
}  // namespace mouthpiece
