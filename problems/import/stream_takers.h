// The streams of a column map, connected to a log that receives their rows.
#pragma once

#include <memory>

#include "problems/import/stream_import.h"

namespace trueline {

struct StreamTaker {
  std::size_t input;  // index of the file that it reads
  std::unique_ptr<RowTaker> taker;
};

// `log` must outlive the result. `fix_sigma` (m), if given, replaces the map's.
std::vector<StreamTaker> MakeTakers(const ImportMap& map, const std::vector<std::string>& files,
                                    const std::optional<double>& fix_sigma, FlightLog* log);

}  // namespace trueline
