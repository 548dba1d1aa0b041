// What a planted fault is made of. Faults are compiled into the program side by side, each with a
// number; the environment variable MUTATION chooses the one that is in force, none when it is not
// set. MUTATION_REACHED names a file, a byte a fault, in which a run marks the faults that it came
// by.
#pragma once
#pragma GCC system_header

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <type_traits>

namespace mutation {

struct State {
  int chosen = -1;
  char* reached = nullptr;
  long size = 0;

  State() {
    if (const char* number = std::getenv("MUTATION")) chosen = std::atoi(number);
    const char* file = std::getenv("MUTATION_REACHED");
    const int opened = file ? open(file, O_RDWR) : -1;
    struct stat status;
    if (opened < 0 || fstat(opened, &status) != 0) return;
    size = status.st_size;
    // Shared: processes that a test starts, or kills, leave their marks as well.
    void* map = mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_SHARED, opened, 0);
    close(opened);
    if (map != MAP_FAILED) reached = static_cast<char*>(map);
  }
};

inline bool On(int fault) {
  static const State state;
  if (state.reached && fault < state.size) state.reached[fault] = 1;
  return state.chosen == fault;
}

template <class A, class B>
auto Add(int fault, A a, B b) {
  return On(fault) ? a - b : a + b;
}
template <class A, class B>
auto Subtract(int fault, A a, B b) {
  return On(fault) ? a + b : a - b;
}
template <class A, class B>
auto Multiply(int fault, A a, B b) {
  return On(fault) ? a / b : a * b;
}
template <class A, class B>
auto Divide(int fault, A a, B b) {
  return On(fault) ? a * b : a / b;
}
template <class A, class B>
bool Less(int fault, A a, B b) {
  return On(fault) ? a <= b : a < b;
}
template <class A, class B>
bool LessOrEqual(int fault, A a, B b) {
  return On(fault) ? a < b : a <= b;
}
template <class A, class B>
bool Greater(int fault, A a, B b) {
  return On(fault) ? a >= b : a > b;
}
template <class A, class B>
bool GreaterOrEqual(int fault, A a, B b) {
  return On(fault) ? a > b : a >= b;
}
template <class T>
const T& min(int fault, const T& a, const T& b) {
  return (b < a) != On(fault) ? b : a;
}
template <class T>
const T& max(int fault, const T& a, const T& b) {
  return (a < b) != On(fault) ? b : a;
}
inline double Sign(int fault) { return On(fault) ? -1 : 1; }
template <class T>
T Value(int fault, T value) {
  if constexpr (std::is_floating_point_v<T>) return On(fault) ? static_cast<T>(1.1) * value : value;
  return On(fault) ? value + 1 : value;
}
inline int Index(int fault, int index) { return !On(fault) ? index : index == 0 ? 1 : index - 1; }
template <class V>
decltype(auto) x(int fault, V&& v) {
  return On(fault) ? v.y() : v.x();
}
template <class V>
decltype(auto) y(int fault, V&& v) {
  return On(fault) ? v.x() : v.y();
}
template <class V>
decltype(auto) z(int fault, V&& v) {
  return On(fault) ? v.y() : v.z();
}

}  // namespace mutation
