#pragma once

#include <cstddef>
#include <functional>
#include <vector>

namespace mouthpiece {

/// The cheapest way to make one row of phones from another.
struct PhoneEdits {
  double price = 0;
  /// What each phone of both costs: its change for one of the other row, or to be left out.
  std::vector<double> of_first, of_second;
};

/// Of rows of `first` and `second` phones: `change` is the price of one of the first for one of the second, by their
/// places; `left_out` that of leaving out one of either.
PhoneEdits cheapestEdits(std::size_t first, std::size_t second, double left_out,
                         const std::function<double(std::size_t, std::size_t)>& change);

}  // namespace mouthpiece
