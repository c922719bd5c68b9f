#include "hearing/alignment/phone_edits.h"

#include <Eigen/Core>
#include <algorithm>

#include "base/index.h"

namespace mouthpiece {

PhoneEdits cheapestEdits(std::size_t first, std::size_t second, double left_out,
                         const std::function<double(std::size_t, std::size_t)>& change) {
  const Eigen::Index rows = signedIndex(first), columns = signedIndex(second);
  Eigen::ArrayXXd changes(rows, columns), price(rows + 1, columns + 1);
  for (Eigen::Index j = 0; j <= columns; ++j) {
    for (Eigen::Index i = 0; i <= rows; ++i) {
      double& least = price(i, j) = left_out * asReal(i + j);
      if (i == 0 || j == 0) continue;
      const double changed = changes(i - 1, j - 1) = change(unsignedIndex(i - 1), unsignedIndex(j - 1));
      least = std::min({price(i - 1, j - 1) + changed, price(i - 1, j) + left_out, price(i, j - 1) + left_out});
    }
  }
  PhoneEdits edits{price(rows, columns), std::vector<double>(first, left_out), std::vector<double>(second, left_out)};
  for (Eigen::Index i = rows, j = columns; i > 0 && j > 0;) {
    constexpr double kSame = 1e-9;
    const double here = price(i, j);
    if (here > price(i - 1, j - 1) + changes(i - 1, j - 1) - kSame) {
      --i, --j;
      edits.of_first[unsignedIndex(i)] = edits.of_second[unsignedIndex(j)] = changes(i, j);
    } else if (here > price(i - 1, j) + left_out - kSame) {
      --i;
    } else {
      --j;
    }
  }
  return edits;
}

}  // namespace mouthpiece
