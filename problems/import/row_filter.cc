#include "problems/import/row_filter.h"

#include <algorithm>
#include <cmath>

#include "problems/result/statistics.h"

namespace trueline {
namespace {

double MedianAround(const std::vector<double>& values, std::size_t i, int window) {
  const auto half = static_cast<std::size_t>(window / 2);
  const std::size_t first = i > half ? i - half : 0;
  const std::size_t last = std::min(values.size(), i + half + 1);
  return UpperMedian({values.begin() + static_cast<std::ptrdiff_t>(first),
                      values.begin() + static_cast<std::ptrdiff_t>(last)});
}

}  // namespace

AcceptRule::AcceptRule(const YamlMap& map) : columns(ReadColumns(map, "columns", 0)) {
  if (map.Has("range") == map.Has("median")) map.Fail("range", "give either 'range' or 'median'");
  range = map.GetOptional<std::array<double, 2>>("range");
  if (range && !((*range)[0] < (*range)[1])) map.Fail("range", "needs [low, high]");
  if (map.Has("median")) {
    const YamlMap median = map.Child("median");
    median_window = median.Get<int>("window", 7);
    median_within = median.Get<double>("within");
    if (median_window < 3 || median_window % 2 == 0)
      median.Fail("window", "must be odd, at least 3");
    if (!(median_within > 0.0)) median.Fail("within", "must be positive");
    median.Finish();
  }
  map.Finish();
}

RowFilter::RowFilter(const YamlMap& map) {
  if (map.Has("new_where")) new_where_ = ReadColumns(map, "new_where", 0);
  for (const SourceColumn& column : new_where_) {
    if (column.is_constant()) map.Fail("new_where", "a constant never changes; remove it");
  }
  for (const YamlMap& rule : map.Children("accept")) rules_.emplace_back(rule);
}

void RowFilter::Bind(const ForeignRow& row) {
  for (SourceColumn& column : new_where_) column.Bind(row);
  for (AcceptRule& rule : rules_) {
    for (SourceColumn& column : rule.columns) column.Bind(row);
    if (rule.median_window > 0) remembered_.resize(remembered_.size() + rule.columns.size());
  }
}

bool RowFilter::Accepts(const ForeignRow& row) {
  if (!IsNew(row)) return false;
  if (InRange(row)) return true;
  ++out_of_range_;
  return false;
}

// The values of the first row may be of any age, so it counts as repeated.
bool RowFilter::IsNew(const ForeignRow& row) {
  if (new_where_.empty()) return true;
  bool changed = false;
  const bool first = previous_.empty();
  previous_.resize(new_where_.size());
  for (std::size_t i = 0; i < new_where_.size(); ++i) {
    const std::string_view now = row.Text(new_where_[i].index());
    if (previous_[i] == now) continue;
    previous_[i] = now;
    changed = true;
  }
  return changed && !first;
}

bool RowFilter::InRange(const ForeignRow& row) const {
  for (const AcceptRule& rule : rules_) {
    if (!rule.range) continue;
    for (const SourceColumn& column : rule.columns) {
      const double value = column.Value(row);
      if (value < (*rule.range)[0] || value > (*rule.range)[1]) return false;
    }
  }
  return true;
}

void RowFilter::Remember(const ForeignRow& row) {
  std::size_t k = 0;
  for (const AcceptRule& rule : rules_) {
    if (rule.median_window == 0) continue;
    for (const SourceColumn& column : rule.columns) remembered_[k++].push_back(column.Value(row));
  }
}

std::vector<bool> RowFilter::MedianMask() const {
  std::vector<bool> mask(remembered_.empty() ? 0 : remembered_.front().size(), true);
  std::size_t k = 0;
  for (const AcceptRule& rule : rules_) {
    if (rule.median_window == 0) continue;
    for (std::size_t c = 0; c < rule.columns.size(); ++c, ++k) {
      const std::vector<double>& values = remembered_[k];
      for (std::size_t i = 0; i < mask.size(); ++i) {
        const double distance = std::abs(values[i] - MedianAround(values, i, rule.median_window));
        if (!(distance <= rule.median_within)) mask[i] = false;
      }
    }
  }
  return mask;
}

}  // namespace trueline
