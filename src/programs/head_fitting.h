#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "base/time.h"

namespace mouthpiece {

/// Runs a program of ours that stands beside this one, in `folder`. Throws InputError when it is missing, takes longer
/// than `limit`, or fails: then with the last line that it has said.
void runBeside(std::string_view name, const std::vector<std::string>& arguments, const std::filesystem::path& folder,
               Seconds limit);

/// Fits a head to the actor of `corpus` as `retarget fit` does, and gives the .face beside it. Its anchors lie beside
/// it, NAME.anchors.json; where they do not, `retarget anchors` finds them. `tell` hears of each stage. Throws
/// InputError for a head on which no face is found, and for one that tears.
std::filesystem::path fitHead(const std::filesystem::path& mesh, const std::filesystem::path& corpus,
                              const std::function<void(std::string_view stage)>& tell);

}  // namespace mouthpiece
