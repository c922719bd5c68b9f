#include "base/late_library.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include "base/errors.h"

namespace mouthpiece {

namespace {

/// What the dynamic linker gave, or InputError with its reason.
void* found(void* given, const char* file, const char* package) {
  if (given != nullptr) return given;
  const char* reason = ::dlerror();
  throw InputError(file, "",
                   fmt::format("cannot be used: {}. Get it with: sudo apt-get install {}",
                               printable(reason == nullptr ? "no such function" : reason), package));
}

}  // namespace

void* LateLibrary::find(const char* function) const {
  void* library = found(::dlopen(file_, RTLD_LAZY | RTLD_LOCAL), file_, package_);
  return found(::dlsym(library, function), file_, package_);
}

LoadedLibrary::LoadedLibrary(const char* file, const char* package)
    : file_(file), package_(package), library_(found(::dlopen(file, RTLD_LAZY | RTLD_LOCAL), file, package)) {}

LoadedLibrary::~LoadedLibrary() { ::dlclose(library_); }

void* LoadedLibrary::findAny(const char* function) const { return found(::dlsym(library_, function), file_, package_); }

}  // namespace mouthpiece
