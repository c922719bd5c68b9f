#pragma once

#include <cstddef>
#include <limits>
#include <span>
#include <vector>

namespace mouthpiece {

// Order statistics. No value may be NaN. All are O(n). `if_none` is the answer where there are no values.

/// The middle one of the sorted values, of an even number the later of the two.
double median(std::vector<double> values, double if_none = std::numeric_limits<double>::quiet_NaN());

/// The value that lies `share` (0 to 1) of the way through the sorted values, or else the one before that place.
double quantile(std::vector<double> values, double share, double if_none = std::numeric_limits<double>::quiet_NaN());

/// The same on a straight line between the two values beside that place, as numpy.quantile has it.
double interpolatedQuantile(std::vector<double> values, double share,
                            double if_none = std::numeric_limits<double>::quiet_NaN());

/// The least mean of `count` values in a row; of all where there are fewer. There is at least one.
double leastMean(std::span<const double> values, std::size_t count);

}  // namespace mouthpiece
