// The rules of the house (docs/architecture.md), held against the tree.
#include <gtest/gtest.h>

#include "house.h"

namespace mouthpiece::architecture {
namespace {

const House& house() {
  static const House tree(filesOf(MOUTHPIECE_SOURCE_DIR));
  return tree;
}

void expectNone(const std::vector<std::string>& breaches) {
  for (const std::string& breach : breaches) ADD_FAILURE() << breach;
}

TEST(Architecture, TheTreeIsSeen) {
  EXPECT_GT(house().roomCount(), 30U);
  EXPECT_GT(house().includeCount(), 500U);
}

TEST(Architecture, EverySourceIsListed) { expectNone(house().unlistedFiles()); }
TEST(Architecture, PublicHeadersAreThoseThatOthersInclude) { expectNone(house().headerBreaches()); }
TEST(Architecture, LinksAreWhatFilesInclude) { expectNone(house().linkBreaches()); }
TEST(Architecture, RoomsIncludeOneWay) { expectNone(house().circles()); }
TEST(Architecture, OnlyProgramsTalk) { expectNone(house().talkingLibraries()); }
TEST(Architecture, HeavyHeadersStayInside) { expectNone(house().heavyHeaders()); }
TEST(Architecture, MainsAreInTheirPlace) { expectNone(house().misplacedMains()); }
TEST(Architecture, TypesHaveNamesOfTheirOwn) { expectNone(house().typesOfOneName()); }

}  // namespace
}  // namespace mouthpiece::architecture
