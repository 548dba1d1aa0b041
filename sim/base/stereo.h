#pragma once
// What there is two of, one for each camera of a stereo rig.

#include <array>

namespace turbidock {

enum class Side { kLeft, kRight };
inline constexpr std::array kSides = {Side::kLeft, Side::kRight};

template <class T>
struct Stereo {
  T left{}, right{};

  T& operator[](Side side) { return side == Side::kLeft ? left : right; }
  const T& operator[](Side side) const { return side == Side::kLeft ? left : right; }

  // What `function` makes of the left and of the right one.
  template <class Function>
  auto Each(Function&& function) const -> Stereo<decltype(function(left))> {
    return {function(left), function(right)};
  }
  bool operator==(const Stereo&) const = default;
};

}  // namespace turbidock
