#pragma once

#include <map>
#include <string>
#include <string_view>

#include "motion/marker_layout.h"

namespace mouthpiece {

/// What a capture system calls the markers of a layout: label in its files -> name in the layout, for those markers of
/// the layout's JSON that have a "label". `layout` was read from the same text. Throws InputError for a label that two
/// markers have, or that is another marker's name.
std::map<std::string, std::string> markerLabels(std::string_view json_text, std::string_view file,
                                                const MarkerLayout& layout);

}  // namespace mouthpiece
