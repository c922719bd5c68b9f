#include "hearing/alignment/phone_edits.h"

#include <Eigen/Core>
#include <algorithm>

#include "base/index.h"

namespace mouthpiece {

PhoneEdits cheapestEdits(std::span<const Phone> first, std::span<const Phone> second) {
  constexpr double kLeftOut = PhoneEdits::kLeftOut;
  const Eigen::Index rows = std::ssize(first), columns = std::ssize(second);
  const auto change = [&](Eigen::Index i, Eigen::Index j) {
    const Phone one = first[unsignedIndex(i)], other = second[unsignedIndex(j)];
    if (one == other) return 0.0;
    return isVowel(one) == isVowel(other) ? PhoneEdits::kOfItsKind : PhoneEdits::kOther;
  };
  Eigen::ArrayXXd price(rows + 1, columns + 1);
  for (Eigen::Index j = 0; j <= columns; ++j) {
    for (Eigen::Index i = 0; i <= rows; ++i) {
      double& least = price(i, j) = kLeftOut * asReal(i + j);
      if (i == 0 || j == 0) continue;
      least = std::min(
          {price(i - 1, j - 1) + change(i - 1, j - 1), price(i - 1, j) + kLeftOut, price(i, j - 1) + kLeftOut});
    }
  }
  PhoneEdits edits{price(rows, columns), std::vector<double>(first.size(), kLeftOut),
                   std::vector<double>(second.size(), kLeftOut)};
  for (Eigen::Index i = rows, j = columns; i > 0 && j > 0;) {
    constexpr double kSame = 1e-9;
    const double here = price(i, j);
    if (here > price(i - 1, j - 1) + change(i - 1, j - 1) - kSame) {
      --i, --j;
      edits.of_first[unsignedIndex(i)] = edits.of_second[unsignedIndex(j)] = change(i, j);
    } else if (here > price(i - 1, j) + kLeftOut - kSame) {
      --i;
    } else {
      --j;
    }
  }
  return edits;
}

}  // namespace mouthpiece
