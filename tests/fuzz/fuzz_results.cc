// Any bytes as a batch's file: refused, or trials and series that can be read, summarised and
// written out.

#include "experiments/batch/batch_report.h"
#include "experiments/batch/result_store.h"
#include "sim/base/check.h"
#include "tests/fuzz/input_file.h"

using namespace turbidock;  // NOLINT(google-build-using-namespace)

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const testing::InputFile file(data, size);
  try {
    const batch::ResultStore store = batch::ResultStore::Read(file.path());
    const batch::TrialScheduler scheduler = batch::SchedulerOf(store);
    const std::vector<batch::StoredTrial> trials = store.Trials();
    TD_CHECK(scheduler.done() <= std::ssize(trials), "no trial is counted that is not there");
    batch::ReportOf(batch::SummaryOf(store, file.path()));
    store.Csv(/*timing=*/true);
    for (const int64_t trial : store.TrialsWithSeries()) store.SeriesOf(trial);
  } catch (const ConfigError&) {
  }
  return 0;
}
