#pragma once

#include <filesystem>
#include <string>

#include "deform/binding.h"
#include "retarget/rbf_warp.h"

namespace mouthpiece {

/// What `retarget` was asked for.
struct CommandLine {
  std::filesystem::path mesh, anchors, corpus, out, face, motion, canonical, show;
  WarpOptions warp;
  std::string kernel = "auto";
  BindingOptions binding;
  std::string name;
  bool arkit = false;
  bool quiet = false;
  bool json = false;
};

/// `retarget apply`; the exit code. Throws InputError.
int applyCommand(const CommandLine& line);

}  // namespace mouthpiece
