// The shipped optics against the published tables, by the program's own search, a second a cell.
// Not asserted is what is missed (assets/measured/recognition.md): both ends at 800 mm, which the
// optics were not calibrated to, and the passive marker's at 1000 mm to a tenth.

#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <set>
#include <string>
#include <vector>

#include "experiments/config/data_files.h"
#include "experiments/studies/recognition/recognition.h"
#include "experiments/studies/recognition/table.h"
#include "experiments/system/output_path.h"

namespace turbidock::recognition {
namespace {

// Every other step of milk, from the last one on: the whole table takes minutes.
TableComparison CompareWithPublished(MarkerKind marker) {
  std::set<double> milks_ml_m3;
  for (const TableRow& row : PublishedTable(marker)) milks_ml_m3.insert(row.cell.milk_ml_m3);
  std::vector<double> chosen_ml_m3;
  for (auto milk = milks_ml_m3.begin(); milk != milks_ml_m3.end(); ++milk)
    if (std::distance(milk, milks_ml_m3.end()) % 2 == 1) chosen_ml_m3.push_back(*milk);
  std::vector<TableRow> table;
  for (const TableRow& row : PublishedTable(marker))
    if (std::ranges::count(chosen_ml_m3, row.cell.milk_ml_m3) > 0) table.push_back(row);

  const std::string file =
      config::AssetPath(fmt::format("plans/recognition_{}.yaml", NameOf(marker)));
  std::string text = system::ReadWhole(file);
  const size_t at = text.find("  600 mm: ");  // which no table has
  text.erase(at, text.find('\n', at) + 1 - at);
  const size_t list = text.find('[', text.find("water.milk_ml_m3:"));
  text.replace(list, text.find(']', list) + 1 - list, fmt::format("{}", chosen_ml_m3));
  const batch::Plan plan(text, file);
  EXPECT_EQ(plan.trials(), std::ssize(table));
  return Compare(Recognize(plan, {.seconds = 1, .jobs = {.workers = 2}}), table).value();
}

void ExpectAreasAndLoss(const TableComparison& c, double least_areas, double accepted_loss,
                        const std::vector<double>& distances_m) {
  EXPECT_GE(c.area_agreement, least_areas);
  ASSERT_EQ(c.loss_by_distance_m.size(), 3u);
  for (const double distance_m : distances_m) {
    const auto ratio = c.loss_by_distance_m.at(distance_m).ratio();
    ASSERT_TRUE(ratio) << distance_m;
    EXPECT_NEAR(*ratio, 1, accepted_loss) << distance_m;
  }
}

// At 400 mm the table ends before the simulated marker is lost.
TEST(ShippedOptics, RecogniseTheActiveMarkerAsPublished) {
  const TableComparison c = CompareWithPublished(MarkerKind::kActive);
  ExpectAreasAndLoss(c, 0.9, 0.16, {0.8, 1.0});
  EXPECT_LE(c.rmse, 0.07);
}

TEST(ShippedOptics, RecogniseThePassiveMarkerAsPublished) {
  const TableComparison c = CompareWithPublished(MarkerKind::kPassive);
  ExpectAreasAndLoss(c, 0.88, 0.15, {0.4, 0.8, 1.0});
  EXPECT_LE(c.rmse, 0.1);
}

}  // namespace
}  // namespace turbidock::recognition
