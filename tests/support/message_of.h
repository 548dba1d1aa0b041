#pragma once
// Bad input in a test: what it is called.

#include <string>

#include "sim/base/check.h"

namespace turbidock::testing {

// What the ConfigError says that the action throws; "no error" without one.
std::string MessageOf(auto&& action) {
  try {
    action();
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "no error";
}

}  // namespace turbidock::testing
