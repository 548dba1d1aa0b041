#include "experiments/studies/compare/comparison_page.h"

#include <fmt/format.h>

#include "experiments/page/report_page.h"
#include "experiments/page/stored_trials.h"
#include "experiments/report/quantity.h"
#include "experiments/report/report_json.h"

namespace turbidock::compare {

page::Page PageOf(const Comparison& comparison, const ComparedFile& a, const ComparedFile& b,
                  const ComparisonPageOptions& options) {
  page::Page page = page::ReportPage(report::Document(ReportOf(comparison), ResultJson(comparison)),
                                     "comparison");
  page.model["sections"].back().erase("commands");  // to this page
  const int64_t bytes = options.series_bytes / 2;
  page::StoredTrials in_a(a.store, a.file, "A", bytes, options.plugins, &page),
      in_b(b.store, b.file, "B", bytes, options.plugins, &page);
  for (const ComparisonGroup& group : comparison.groups)
    for (const TrialPair& pair : group.pairs) {
      if (!pair.lost() && !pair.gained()) continue;
      const std::string note =
          fmt::format("Docked in {} only; in {}: {}.", pair.lost() ? "A" : "B",
                      pair.lost() ? "B" : "A", report::Words(NameOf(pair.failure())));
      page.model["links"][LinkOf(pair)] =
          page::Link{.title = fmt::format("Seed {}", pair.a.seed),
                     .note = note,
                     .trials = {in_a.Of(pair.trial_a), in_b.Of(pair.trial_b)}};
    }
  return page;
}

}  // namespace turbidock::compare
