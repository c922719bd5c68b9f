#pragma once

#include <functional>
#include <string>

#include "base/errors.h"

namespace mouthpiece {

/// What an InputError says that `action` throws.
inline std::string errorOf(const std::function<void()>& action) {
  try {
    action();
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

}  // namespace mouthpiece
