#include "experiments/config/nearest_name.h"

#include <algorithm>
#include <limits>

namespace turbidock::config {
namespace {

// Optimal string alignment: insert, delete, replace, and swap of neighbours count one each.
int EditDistance(const std::string& a, const std::string& b) {
  const size_t columns = b.size() + 1;
  std::vector<int> d((a.size() + 1) * columns);
  const auto at = [&](size_t i, size_t j) -> int& { return d[i * columns + j]; };
  for (size_t i = 0; i <= a.size(); ++i) at(i, 0) = static_cast<int>(i);
  for (size_t j = 0; j <= b.size(); ++j) at(0, j) = static_cast<int>(j);
  for (size_t i = 1; i <= a.size(); ++i)
    for (size_t j = 1; j <= b.size(); ++j) {
      at(i, j) = std::min(
          {at(i - 1, j) + 1, at(i, j - 1) + 1, at(i - 1, j - 1) + (a[i - 1] == b[j - 1] ? 0 : 1)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        at(i, j) = std::min(at(i, j), at(i - 2, j - 2) + 1);
    }
  return d.back();
}

}  // namespace

std::string NearestName(const std::string& word, const std::vector<std::string>& known) {
  std::string best, longer;
  int best_distance = std::numeric_limits<int>::max();
  for (const auto& candidate : known) {
    const int distance = EditDistance(word, candidate);
    const int allowed = std::max(1, static_cast<int>(std::min(word.size(), candidate.size())) / 3);
    if (distance <= allowed && distance < best_distance) {
      best = candidate;
      best_distance = distance;
    }
    const bool is_longer = !word.empty() && candidate.starts_with(word + "_");
    if (is_longer && (longer.empty() || candidate.size() < longer.size())) longer = candidate;
  }
  return best.empty() ? longer : best;
}

std::string DidYouMean(const std::string& word, const std::vector<std::string>& known) {
  const std::string nearest = NearestName(word, known);
  return nearest.empty() ? "" : "; did you mean " + nearest + "?";
}

}  // namespace turbidock::config
