// Selection of the rows of a foreign file: repeats and spikes are left out.
#pragma once

#include <string>
#include <vector>

#include "problems/import/source.h"

namespace trueline {

// One entry of `accept:`; a row is left out where any of the columns breaks the rule.
//   {columns: [a, b], range: [low, high]}                       in the file's units
//   {columns: [a, b], median: {window: 7, within: 0.1}}         distance to the running median
// `optional: true` beside a range: a column that the log lacks is not checked.
struct AcceptRule {
  std::vector<SourceColumn> columns;
  std::optional<std::array<double, 2>> range;
  bool optional = false;
  bool is_bound = false;
  int median_window = 0;  // samples, odd
  double median_within = 0.0;

  explicit AcceptRule(const YamlMap& map);
};

// One entry of `expect:`; rows that break it are kept, with one warning:
//   {columns: [a], range: [low, high], else: what follows from other values}
// A column that the log lacks is not checked.
struct ExpectRule {
  std::vector<SourceColumn> columns;
  std::array<double, 2> range;
  std::string otherwise;
  bool is_bound = false;
  std::size_t broken = 0;  // rows

  explicit ExpectRule(const YamlMap& map);
};

// The keys `new_where`, `accept` and `expect` of a stream. One of the columns in `new_where` must
// differ from the row before; this drops the repeated values of a slower sensor.
class RowFilter {
 public:
  RowFilter() = default;
  explicit RowFilter(const YamlMap& map);

  void Bind(const ForeignRow& row);
  // Whether the row is new and in range. Must see every row of the file.
  bool Accepts(const ForeignRow& row);
  // Stores the values of an accepted row for MedianMask(); call it once for each sample that is
  // kept.
  void Remember(const ForeignRow& row);
  // For each remembered row, whether it is within the running medians.
  std::vector<bool> MedianMask() const;

  int out_of_range() const { return out_of_range_; }
  std::vector<std::string> BrokenExpectations() const;

 private:
  bool IsNew(const ForeignRow& row);
  bool InRange(const ForeignRow& row) const;
  void Expect(const ForeignRow& row);

  std::vector<SourceColumn> new_where_;
  std::vector<std::string> previous_;
  std::vector<AcceptRule> rules_;
  std::vector<ExpectRule> expectations_;
  std::vector<std::vector<double>> remembered_;  // by median column
  int out_of_range_ = 0;
};

}  // namespace trueline
