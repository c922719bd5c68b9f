// evaluateUnseen of evaluation.h.
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <string>

#include "base/errors.h"
#include "corpus_tools/building/settings_fit.h"
#include "corpus_tools/research/evaluation/evaluation.h"

namespace mouthpiece {
namespace {

/// A word, a phone or a pair of them, and where a take says it.
struct Said {
  std::string what;
  TimeSpan span;
};

std::vector<Said> saidIn(const SpeechLabels& labels, Unseen unseen) {
  std::vector<Said> said;
  if (unseen == Unseen::kWords) {
    for (const LabelledWord& word : labels.words) said.push_back({word.text, labels.spanOf(word.phones)});
    return said;
  }
  if (unseen == Unseen::kPhones) {
    for (const LabelledPhone& phone : labels.phones) {
      if (phone.phone != Phone::kSil) said.push_back({std::string(phoneName(phone.phone)), phone.span});
    }
    return said;
  }
  for (std::size_t i = 0; i + 1 < labels.phones.size(); ++i) {
    const LabelledPhone &a = labels.phones[i], &b = labels.phones[i + 1];
    if (a.phone == Phone::kSil || b.phone == Phone::kSil) continue;
    said.push_back({fmt::format("{} {}", phoneName(a.phone), phoneName(b.phone)), {a.span.start, b.span.end}});
  }
  return said;
}

/// What is taken out at once, and the takes that go with it.
struct Round {
  std::set<std::string> unheard;
  std::set<std::size_t> takes;
};

std::vector<Round> roundsOf(const Corpus& corpus, Unseen unseen) {
  constexpr double kMostTakesOfRound = 0.3, kMostTakesOfOne = 0.5;
  std::map<std::string, std::set<std::size_t>> takes_with;
  for (std::size_t take = 0; take < corpus.takes.size(); ++take) {
    for (const Said& said : saidIn(corpus.takes[take].labels, unseen)) takes_with[said.what].insert(take);
  }
  std::vector<Round> rounds;
  const double all = asReal(corpus.takes.size());
  for (const auto& [what, takes] : takes_with) {
    if (asReal(takes.size()) > kMostTakesOfOne * all) continue;
    std::set<std::size_t> together = takes;
    if (!rounds.empty()) together.insert(rounds.back().takes.begin(), rounds.back().takes.end());
    if (rounds.empty() || asReal(together.size()) > kMostTakesOfRound * all) {
      rounds.push_back({{what}, takes});
    } else {
      rounds.back().unheard.insert(what);
      rounds.back().takes = std::move(together);
    }
  }
  return rounds;
}

}  // namespace

Evaluation evaluateUnseen(const Corpus& corpus, Unseen unseen, const EvaluationMethods& methods,
                          const EvaluationOptions& options, const UnseenOptions& limits) {
  std::vector<Round> rounds;
  for (std::vector<Round> all = roundsOf(corpus, unseen); Round & round : all) {
    const auto number = unsignedIndex(&round - all.data());
    if (number % limits.parts == limits.part) rounds.push_back(std::move(round));
  }
  if (rounds.empty() || corpus.takes.size() < 2)
    throw InputError(corpus.name, "", "has nothing that only some of its takes say; expected more takes");
  Evaluation whole{corpus.name, {}, {}};
  const std::size_t count = std::min(limits.most_rounds, rounds.size());
  for (std::size_t i = 0; i < count; ++i) {
    const Round& round = rounds[i * rounds.size() / count];
    Corpus rest = corpus;
    rest.takes.clear();
    rest.viseme_poses.clear();
    std::vector<CorpusTake> held;
    for (std::size_t take = 0; take < corpus.takes.size(); ++take)
      (round.takes.contains(take) ? held : rest.takes).push_back(corpus.takes[take]);
    if (held.size() > limits.most_takes) {
      std::vector<CorpusTake> some;
      for (std::size_t take = 0; take < limits.most_takes; ++take)
        some.push_back(std::move(held[take * held.size() / limits.most_takes]));
      held = std::move(some);
    }
    fitMotion(rest);
    EvaluationOptions of_round = options;
    of_round.stretches = [&](const CorpusTake& take) {
      MeasuredStretches stretches;
      for (const Said& said : saidIn(take.labels, unseen)) {
        if (round.unheard.contains(said.what)) stretches.push_back(said.span);
      }
      return stretches;
    };
    of_round.progress = [&](std::size_t done, std::size_t total) {
      if (options.progress) options.progress(i * total + done, count * total);
    };
    whole += evaluateCorpus(rest, held, methods, of_round);
  }
  return whole;
}

}  // namespace mouthpiece
