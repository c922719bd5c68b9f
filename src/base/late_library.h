#pragma once

#include <atomic>

namespace mouthpiece {

/// A shared library that is loaded when the first of its functions is called, and stays: the start of a program pays
/// for none that its work does not need.
class LateLibrary {
 public:
  /// `file` as the dynamic linker knows it; `package`: what brings it. Both outlive the library.
  constexpr LateLibrary(const char* file, const char* package) : file_(file), package_(package) {}

  /// Throws InputError where the library cannot be loaded, or has no such function.
  [[nodiscard]] void* find(const char* function) const;

 private:
  const char* file_;
  const char* package_;
};

/// A shared library for as long as this lives. What loads it again finds it as if nobody had called it, unless others
/// keep it, too.
class LoadedLibrary {
 public:
  /// Throws InputError where it cannot be loaded.
  LoadedLibrary(const char* file, const char* package);
  ~LoadedLibrary();
  LoadedLibrary(const LoadedLibrary&) = delete;
  LoadedLibrary& operator=(const LoadedLibrary&) = delete;

  /// A function of it, as the header declares it. Throws InputError where it has none of that name.
  template <typename Signature>
  [[nodiscard]] Signature* find(const char* function) const {
    return reinterpret_cast<Signature*>(findAny(function));
  }

 private:
  [[nodiscard]] void* findAny(const char* function) const;

  const char* file_;
  const char* package_;
  void* library_;
};

/// One of a late library's functions, called as the header declares it; throws as LateLibrary::find does. Thread-safe.
template <typename Signature>
class LateFunction;

template <typename Result, typename... Arguments>
class LateFunction<Result(Arguments...)> {
 public:
  constexpr LateFunction(const LateLibrary& library, const char* name) : library_(library), name_(name) {}

  Result operator()(Arguments... arguments) const {
    void* found = found_.load(std::memory_order_acquire);
    if (found == nullptr) found_.store(found = library_.find(name_), std::memory_order_release);
    return reinterpret_cast<Result (*)(Arguments...)>(found)(arguments...);
  }

 private:
  const LateLibrary& library_;
  const char* name_;
  mutable std::atomic<void*> found_ = nullptr;
};

}  // namespace mouthpiece
