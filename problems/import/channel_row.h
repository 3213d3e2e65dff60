// A record of a recording's channel as a row, with the last records of others.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "problems/import/foreign_csv.h"
#include "problems/import/formats/recording.h"
#include "problems/import/stream_import.h"

namespace trueline {

class ChannelRow : public ForeignRow {
 public:
  // The columns of `channels`; rows are the records of the first one. `recording` must outlive
  // this.
  ChannelRow(const Recording& recording, const std::vector<std::size_t>& channels);

  // Keeps a record of any channel. True if it makes a row.
  bool AddRecord(std::size_t channel, const Record& record);

  int IndexOf(const std::string& column, const std::string& where) const override;
  std::string_view Text(int index) const override { return At(index).Bytes(); }
  double Number(int index) const override { return Noted(index, At(index).Number()); }
  TimeNs Time(int index, int exponent) const override;
  TimeNs Stamp() const override { return time_; }
  bool IsUnstamped() const override { return is_unstamped_; }
  std::size_t Place() const override { return place_; }
  InputError ErrorIn(int index, const std::string& message) const override;
  InputError MissingError(const std::string& stream) const override;

 private:
  const Cell& At(int index) const { return cells_[static_cast<std::size_t>(index)]; }

  const Recording& recording_;
  std::vector<std::size_t> channels_;
  std::vector<std::size_t> starts_;  // of their fields in cells_
  std::vector<TimeNs> times_;        // of the channels' last records
  std::vector<Cell> cells_;
  TimeNs time_ = 0;
  bool is_unstamped_ = false;
  std::size_t place_ = 0;
};

// The records of a recording, given to the streams that come from its channels.

// Reads the channels of the streams. Returns for each channel how many of its messages could not be
// decoded.
std::map<std::size_t, std::size_t> ReadChannels(Recording* recording,
                                                const std::vector<StreamImport*>& streams);

// What is in a recording, for people.

// A channel's fields with their units, elements of a list together: "q[0..3], x [m]".
std::string FieldList(const Channel& channel);

// Format, and for each channel with records: their number, rate (Hz), span (s), fields.
std::string ListChannels(const Recording& recording);

}  // namespace trueline
