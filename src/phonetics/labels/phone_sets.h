#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "phonetics/language/phone.h"

namespace mouthpiece {

/// How the phones of a label file are written. Symbols overlap (D is DH in X-SAMPA), so a file is read in one set.
enum class PhoneSet {
  kArpabet,  ///< and what phoneFromName knows: CMU, TIMIT, Festival radio, MFA's ARPA
  kXSampa,
  kIpa,  ///< MFA's English sets too
};

/// "ARPAbet", "X-SAMPA", "IPA".
std::string_view phoneSetName(PhoneSet set);

/// The set that knows the most of `names`; ARPAbet when in doubt.
PhoneSet likeliestPhoneSet(std::span<const std::string> names);

/// English phones. In X-SAMPA and IPA, length, stress, syllable, aspiration and tie marks are passed over. nullopt for
/// an unknown symbol.
std::optional<Phone> phoneFromName(std::string_view name, PhoneSet set);

}  // namespace mouthpiece
