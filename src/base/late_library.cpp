#include "base/late_library.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include "base/errors.h"

namespace mouthpiece {

void* LateLibrary::find(const char* function) const {
  void* library = ::dlopen(file_, RTLD_LAZY | RTLD_LOCAL);
  void* found = library == nullptr ? nullptr : ::dlsym(library, function);
  if (found == nullptr) {
    const char* reason = ::dlerror();
    throw InputError(file_, "",
                     fmt::format("cannot be used: {}. Get it with: sudo apt-get install {}",
                                 printable(reason == nullptr ? "no such function" : reason), package_));
  }
  return found;
}

}  // namespace mouthpiece
