// Any bytes as a batch's file: refused, or trials and series that can be read, summarised and
// written out.

#include "experiments/farm/batch_report.h"
#include "experiments/farm/export.h"
#include "experiments/farm/result_store.h"
#include "experiments/farm/trial_scheduler.h"
#include "sim/base/check.h"
#include "tests/fuzz/input_file.h"

using namespace turbidock;  // NOLINT(google-build-using-namespace)

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const testing::InputFile file(data, size);
  try {
    const farm::ResultStore store = farm::ResultStore::Read(file.path());
    const farm::TrialScheduler scheduler = farm::SchedulerOf(store);
    const std::vector<farm::StoredTrial> trials = store.Trials();
    TD_CHECK(scheduler.done() <= std::ssize(trials), "no trial is counted that is not there");
    farm::ReportOf(farm::SummaryOf(store, file.path()));
    farm::ExportText(trials);
    for (const int64_t trial : store.TrialsWithSeries()) store.SeriesOf(trial);
  } catch (const ConfigError&) {
  }
  return 0;
}
