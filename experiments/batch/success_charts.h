#pragma once
// Success over anything that trials differ in, by anything else: every chart ready, with its
// intervals. Who shows them chooses one and computes nothing.

#include <map>
#include <string>
#include <vector>

#include "experiments/batch/result_store.h"
#include "experiments/report/plot.h"
#include "sim/base/result_fields.h"

namespace turbidock::batch {

// Trials by a quantity: by its values, or by bins of a number that has many.
struct Groups {
  std::vector<std::string> names = {};
  std::vector<double> at = {};  // their places on an axis
  std::vector<int> of = {};     // each trial's group; -1 where it has no value
  TURBIDOCK_FIELDS(names, of)
};

// A quantity in which trials differ.
struct TrialAxis {
  std::string key, label;  // the label has the unit
  bool is_number = false;
  Groups across = {}, lines = {};  // along an axis; as curves, which are fewer
  TURBIDOCK_FIELDS(key, label, across, lines)
};

struct SuccessCharts {
  std::vector<TrialAxis> axes = {};
  // Keys of the chart to begin with; over is empty where nothing varies.
  std::string over = {}, by = {};
  // By "OVER|BY". A point's link is "ACROSS,LINE": whose groups its trials are in.
  std::map<std::string, report::Panel> panels = {};
  TURBIDOCK_FIELDS(axes, over, by, panels)
};

SuccessCharts ChartsOf(const StoreHeader& header, const std::vector<StoredTrial>& trials);

}  // namespace turbidock::batch
