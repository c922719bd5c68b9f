// What tools/mutate.py writes into a source: places that behave as they did, until the environment's MUTANT has their
// number. Before the program ends it writes into the file MUTANTS_REACHED, a byte a place: 1 where it came by, 2 where
// the types know no such mutant.
#pragma once
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <initializer_list>
#include <type_traits>
#include <utility>

namespace mutants {

inline const int chosen = std::getenv("MUTANT") != nullptr ? std::atoi(std::getenv("MUTANT")) : -1;
inline unsigned char reached[1 << 18] = {};

struct Told {
  ~Told() {
    if (const char* path = std::getenv("MUTANTS_REACHED")) {
      if (std::FILE* file = std::fopen(path, "wb")) {
        std::fwrite(reached, 1, sizeof reached, file);
        std::fclose(file);
      }
    }
  }
};
inline const Told told;

template <int number>
constexpr bool on() {
  if (std::is_constant_evaluated()) return false;
  if (reached[number] == 0) reached[number] = 1;
  return chosen == number;
}

template <int number, class T>
constexpr T value(T original, T mutant) {
  return on<number>() ? mutant : original;
}

/// Not known to the compiler, which takes what begins a constant for one.
template <int number, class T>
T made(T original, T mutant) {
  return on<number>() ? mutant : original;
}

template <int number, class T>
constexpr T min(const T& a, const T& b) {
  return on<number>() ? std::max(a, b) : std::min(a, b);
}
template <int number, class T>
constexpr T max(const T& a, const T& b) {
  return on<number>() ? std::min(a, b) : std::max(a, b);
}
template <int number, class T>
constexpr T min(std::initializer_list<T> all) {
  return on<number>() ? std::max(all) : std::min(all);
}
template <int number, class T>
constexpr T max(std::initializer_list<T> all) {
  return on<number>() ? std::min(all) : std::max(all);
}

/// `a < Place<5>{} < b`: the same operator twice binds as once, so that no parenthesis has to be found.
template <int number>
struct Place {};
template <int number, class L>
struct Left {
  L&& left;
};
template <int number, class R>
struct Right {
  R&& right;
};

template <class T>
concept Evaluated = requires {
  typename std::decay_t<T>::PlainObject;
};

/// One of two results; expressions of Eigen, whose types differ, are evaluated.
template <int number, class Original, class Mutant>
constexpr decltype(auto) choose(Original original, Mutant mutant) {
  using A = decltype(original());
  using B = decltype(mutant());
  if constexpr (std::is_same_v<A, B>) {
    return on<number>() ? mutant() : original();
  } else if constexpr (Evaluated<A> && std::is_constructible_v<typename std::decay_t<A>::PlainObject, B>) {
    using Plain = typename std::decay_t<A>::PlainObject;
    return on<number>() ? Plain(mutant()) : Plain(original());
  } else {
    if (!std::is_constant_evaluated()) reached[number] = 2;
    return original();
  }
}

#define MUTANTS_BINARY(OLD, NEW)                                                                                     \
  template <class L, int number>                                                                                     \
  constexpr Left<number, L> operator OLD(L&& left, Place<number>) {                                                  \
    return {static_cast<L&&>(left)};                                                                                 \
  }                                                                                                                  \
  template <int number, class L, class R>                                                                            \
  constexpr decltype(auto) operator OLD(Left<number, L> at, R&& right) {                                             \
    const auto original = [&]() -> decltype(auto) { return static_cast<L&&>(at.left) OLD static_cast<R&&>(right); }; \
    if constexpr (requires { static_cast<L&&>(at.left) NEW static_cast<R&&>(right); }) {                             \
      return choose<number>(                                                                                         \
          original, [&]() -> decltype(auto) { return static_cast<L&&>(at.left) NEW static_cast<R&&>(right); });      \
    } else {                                                                                                         \
      if (!std::is_constant_evaluated()) reached[number] = 2;                                                        \
      return original();                                                                                             \
    }                                                                                                                \
  }
MUTANTS_BINARY(<, <=)
MUTANTS_BINARY(<=, <)
MUTANTS_BINARY(>, >=)
MUTANTS_BINARY(>=, >)
MUTANTS_BINARY(==, !=)
MUTANTS_BINARY(!=, ==)
MUTANTS_BINARY(+, -)
MUTANTS_BINARY(-, +)
MUTANTS_BINARY(*, /)
MUTANTS_BINARY(/, *)

#define MUTANTS_ASSIGNMENT(OLD, NEW)                                     \
  template <int number, class R>                                         \
  constexpr Right<number, R> operator OLD(Place<number>, R&& right) {    \
    return {static_cast<R&&>(right)};                                    \
  }                                                                      \
  template <class L, int number, class R>                                \
  constexpr L&& operator OLD(L&& left, Right<number, R> from) {          \
    if constexpr (requires { left NEW static_cast<R&&>(from.right); }) { \
      if (on<number>()) {                                                \
        left NEW static_cast<R&&>(from.right);                           \
      } else {                                                           \
        left OLD static_cast<R&&>(from.right);                           \
      }                                                                  \
    } else {                                                             \
      if (!std::is_constant_evaluated()) reached[number] = 2;            \
      left OLD static_cast<R&&>(from.right);                             \
    }                                                                    \
    return static_cast<L&&>(left);                                       \
  }
MUTANTS_ASSIGNMENT(+=, -=)
MUTANTS_ASSIGNMENT(-=, +=)

}  // namespace mutants
