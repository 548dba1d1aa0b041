#include "experiments/studies/compare/comparison_page.h"

#include <fmt/format.h>

#include "experiments/page/batch_page.h"
#include "experiments/page/report_page.h"
#include "experiments/report/report_json.h"
#include "experiments/report/table.h"

namespace turbidock::compare {

page::Page PageOf(const Comparison& comparison, const ComparedFile& a, const ComparedFile& b,
                  int64_t series_bytes) {
  page::Page page =
      page::ReportPage(report::Document(ReportOf(comparison), comparison), "comparison");
  page.model["sections"].back().erase("commands");  // to this page
  const trial::Plugins& plugins = comparison.options.plugins;
  page::StoredTrials in_a(a.store, a.file, "A", series_bytes / 2, plugins, &page),
      in_b(b.store, b.file, "B", series_bytes / 2, plugins, &page);
  for (const batch::Flip& flip : comparison.flips) {
    const bool is_lost = flip.change == batch::FlipKind::kLost;
    page.model["links"][flip.link] =
        page::Link{.title = fmt::format("Seed {}", flip.seed),
                   .note = fmt::format("Succeeds in {} only; in {}: {}.", is_lost ? "A" : "B",
                                       is_lost ? "B" : "A", report::Words(flip.why)),
                   .trials = {in_a.Of(*flip.trial_a), in_b.Of(*flip.trial_b)}};
  }
  return page;
}

}  // namespace turbidock::compare
