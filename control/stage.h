#pragma once
// The steps of the docking procedure.

#include "sim/base/fields.h"

namespace turbidock::control {

enum class Stage { kApproach, kVisualServoing, kDocking, kDocked, kUndocking, kSearch };
constexpr auto Names(Stage) {
  using enum Stage;
  return EnumList<Stage>({{kApproach, "approach"},
                          {kVisualServoing, "visual_servoing"},
                          {kDocking, "docking"},
                          {kDocked, "docked"},
                          {kUndocking, "undocking"},
                          {kSearch, "search"}});
}

// Whether the marker is still to be found.
constexpr bool IsBeforeFound(Stage stage) {
  return stage == Stage::kApproach || stage == Stage::kSearch;
}

}  // namespace turbidock::control
