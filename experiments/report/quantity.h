#pragma once
// Quantities as people read them: a name in the program ends in its SI unit, a person's unit may be
// another.

#include <string>

#include "sim/base/result_fields.h"

namespace turbidock::report {

struct Quantity {
  std::string label;  // "final error true y"
  std::string unit;   // "mm"; empty where the name has none
  double factor = 1;  // of what is shown to what is stored
  TURBIDOCK_FIELDS(label, unit, factor)

  std::string Title() const { return unit.empty() ? label : label + ", " + unit; }
  // A value with its unit: "12 mm", but "5°".
  std::string Text(const std::string& value) const {
    return value + (unit.empty() || unit.starts_with("°") ? "" : " ") + unit;
  }
};

// Of a name such as "final_error_true_y_m": lengths in mm, angles in degrees.
Quantity QuantityOf(const std::string& name);

// "false lock" of the program's name "false_lock".
std::string Words(std::string name);

// A sentence about a trial without names of shapes, "hull_box" -> "hull", and keys.
std::string Spoken(const std::string& sentence);

// A number in so many significant digits at most.
std::string Digits(double value, int digits = 4);

// A probability of a test: 0.042, or 3.1e-05.
std::string PValue(double p);

}  // namespace turbidock::report
