#include "units/file/corpus.h"

#include <algorithm>

#include "base/errors.h"

namespace mouthpiece {

MotionClip motionOf(const Corpus& corpus, TakeIndex take) {
  return corpus.take_source != nullptr ? corpus.take_source->load(take) : corpus.takes[take.value].motion;
}

const CorpusTake& TakeSource::take(TakeIndex /*take*/) const { throw InternalError("the takes are in memory"); }
std::optional<TakeIndex> TakeSource::takeNamed(std::string_view /*name*/) const {
  throw InternalError("the takes are in memory");
}

std::optional<TakeIndex> takeNamed(const Corpus& corpus, std::string_view name) {
  if (corpus.phone_columns != nullptr) return corpus.take_source->takeNamed(name);
  const auto found =
      std::find_if(corpus.takes.begin(), corpus.takes.end(), [&](const CorpusTake& take) { return take.name == name; });
  if (found == corpus.takes.end()) return std::nullopt;
  return TakeIndex(unsignedIndex(found - corpus.takes.begin()));
}

std::vector<TakeIndex> evenlySpreadTakes(const Corpus& corpus, std::size_t most) {
  const std::size_t count = takeCount(corpus), kept = std::min(count, most);
  std::vector<TakeIndex> takes;
  for (std::size_t i = 0; i < kept; ++i) takes.emplace_back(i * count / kept);
  return takes;
}

PhoneColumns phoneColumnsOf(const Corpus& corpus) {
  PhoneColumns columns;
  for (const CorpusTake& take : corpus.takes) columns.add(take.labels, isAdapted(take));
  return columns;
}

}  // namespace mouthpiece
