#pragma once
// The steps of the docking procedure.

#include <utility>

#include "sim/base/fields.h"

namespace turbidock {

namespace control {
enum class Stage { kApproach, kVisualServoing, kDocking, kDocked };
}  // namespace control

template <>
struct EnumNames<control::Stage> {
  static constexpr auto kNames = std::to_array<std::pair<control::Stage, const char*>>({
      {control::Stage::kApproach, "approach"},
      {control::Stage::kVisualServoing, "visual_servoing"},
      {control::Stage::kDocking, "docking"},
      {control::Stage::kDocked, "docked"},
  });
};

}  // namespace turbidock
