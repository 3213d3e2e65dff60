#include "problems/import/row_filter.h"

#include <fmt/format.h>

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

// False if the row lacks one, which is an error unless that is allowed.
bool BindAll(const ForeignRow& row, bool may_lack, std::vector<SourceColumn>* columns) {
  try {
    for (SourceColumn& column : *columns) column.Bind(row);
    return true;
  } catch (const UnknownColumn&) {
    if (!may_lack) throw;
    return false;
  }
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
  optional = map.Get<bool>("optional", false);
  if (optional && !range) map.Fail("optional", "goes with 'range'");
  map.Finish();
}

ExpectRule::ExpectRule(const YamlMap& map)
    : columns(ReadColumns(map, "columns", 0)),
      range(map.Get<std::array<double, 2>>("range")),
      otherwise(map.Get<std::string>("else")) {
  if (!(range[0] < range[1])) map.Fail("range", "needs [low, high]");
  map.Finish();
}

RowFilter::RowFilter(const YamlMap& map) {
  if (map.Has("new_where")) new_where_ = ReadColumns(map, "new_where", 0);
  for (const SourceColumn& column : new_where_) {
    if (column.is_constant()) map.Fail("new_where", "a constant never changes; remove it");
  }
  for (const YamlMap& rule : map.Children("accept")) rules_.emplace_back(rule);
  for (const YamlMap& rule : map.Children("expect")) expectations_.emplace_back(rule);
}

void RowFilter::Bind(const ForeignRow& row) {
  for (SourceColumn& column : new_where_) column.Bind(row);
  for (AcceptRule& rule : rules_) {
    rule.is_bound = BindAll(row, rule.optional, &rule.columns);
    if (rule.median_window > 0) remembered_.resize(remembered_.size() + rule.columns.size());
  }
  for (ExpectRule& rule : expectations_) rule.is_bound = BindAll(row, true, &rule.columns);
}

bool RowFilter::Accepts(const ForeignRow& row) {
  if (!IsNew(row)) return false;
  if (!InRange(row)) {
    ++out_of_range_;
    return false;
  }
  Expect(row);
  return true;
}

void RowFilter::Expect(const ForeignRow& row) {
  for (ExpectRule& rule : expectations_) {
    if (!rule.is_bound) continue;
    rule.broken += std::any_of(rule.columns.begin(), rule.columns.end(),
                               [&](const SourceColumn& column) {
                                 const double value = column.Value(row);
                                 return value < rule.range[0] || value > rule.range[1];
                               })
                       ? 1
                       : 0;
  }
}

std::vector<std::string> RowFilter::BrokenExpectations() const {
  std::vector<std::string> broken;
  for (const ExpectRule& rule : expectations_) {
    if (rule.broken > 0) broken.push_back(fmt::format("{} rows {}", rule.broken, rule.otherwise));
  }
  return broken;
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
    if (!rule.range || !rule.is_bound) continue;
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
