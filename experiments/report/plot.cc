#include "experiments/report/plot.h"

namespace turbidock::report {

std::vector<double> Evenly(double from, double to, int steps) {
  std::vector<double> values;
  for (int i = 0; i <= steps; ++i) values.push_back(from + (to - from) * i / steps);
  return values;
}

}  // namespace turbidock::report
